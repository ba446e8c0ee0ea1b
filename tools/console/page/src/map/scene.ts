// The tiles of one version of the layout on the graphics card.
import { getBytes, problemOf } from '../lib/rpc';
import { Batch } from './batch';
import type { Layout } from './layout';
import type { Renderer } from './renderer';
import { TileStore } from './store';
import { decodeTile, TileError, type Tile } from './tile';
import type { TileId } from './tiling';

const heldAtMost = 110e6; // bytes, of tiles and their copies on the graphics card

export class Scene {
  readonly store: TileStore<Batch>;
  easedFrom: number | null = null; // since when positions are eased, ms
  expired = false; // the console no longer has this version
  readonly counts = new Map<string, number>(); // vertices of tiles that came
  private withOld: boolean;

  constructor(
    readonly layout: Layout,
    readonly root: string | null, // with standard deviations relative to this frame
    readonly from: number | null, // with the places in this older version
    private readonly renderer: Renderer,
    private readonly override: (tile: Tile) => void,
    changed: () => void,
  ) {
    this.withOld = from !== null;
    this.store = new TileStore(
      (tile, signal) => this.load(tile, signal),
      (batch) => renderer.remove(batch),
      changed,
      () => heldAtMost,
    );
  }

  get since(): number {
    return Math.floor(this.layout.time.first_ms / 1000);
  }

  // From now on tiles are fetched without old places: they are drawn where they are.
  noMoreOld() {
    this.withOld = false;
  }

  count(tile: TileId): number | undefined {
    return this.counts.get(name(tile));
  }

  private async load(id: TileId, signal: AbortSignal): Promise<Batch | null> {
    const bytes = await this.fetch(id, signal);
    if (signal.aborted) return null;
    if (!bytes) {
      this.counts.set(name(id), 0);
      return null;
    }
    let tile: Tile;
    try {
      tile = decodeTile(bytes);
    } catch (error) {
      if (!(error instanceof TileError)) throw error;
      throw new TileError(`Tile ${name(id)}: ${error.message}`);
    }
    this.override(tile);
    const batch = new Batch(tile, this.since);
    this.renderer.add(batch);
    this.counts.set(name(id), tile.count);
    return batch;
  }

  private async fetch(id: TileId, signal: AbortSignal): Promise<ArrayBuffer | null> {
    const query = new URLSearchParams();
    if (this.withOld) query.set('from', String(this.from));
    if (this.root) query.set('root', this.root);
    const path = `/map/tiles/${this.layout.version}/${name(id)}`;
    try {
      return await getBytes(query.size ? `${path}?${query}` : path, signal);
    } catch (error) {
      if (signal.aborted || problemOf(error).reason !== 'VIEW_EXPIRED') throw error;
      if (!this.withOld) {
        this.expired = true;
        throw error;
      }
      // The older version may be what is gone.
      this.withOld = false;
      return this.fetch(id, signal);
    }
  }

  end() {
    this.store.end();
  }
}

function name({ z, x, y }: TileId): string {
  return `${z}/${x}/${y}`;
}
