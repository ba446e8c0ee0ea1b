// The tiles of one version of the layout: those wanted are fetched, the most wanted first and a few at a time; what is
// no longer wanted is not fetched to its end; what was not drawn for longest goes first when there is too much.
import { keyOf, type TileId } from './tiling';

export interface Held {
  bytes: number;
}
interface Entry<T> {
  value: T | null; // null: there is nothing
  used: number;
}
interface Trouble {
  error: unknown;
  tries: number;
  again: number; // when it is tried again, ms
}

const atOnce = 4; // of six connections that a browser makes to a host; two are for what waits
const tries = 4;

export class TileStore<T extends Held> {
  bytes = 0;
  fetched = 0; // bytes that came, in all
  private entries = new Map<number, Entry<T>>();
  private loading = new Map<number, AbortController>();
  private troubles = new Map<number, Trouble>();
  private wanted: TileId[] = [];
  private clock = 0;
  private timer: ReturnType<typeof setTimeout> | null = null;
  private ended = false;

  constructor(
    private readonly load: (tile: TileId, signal: AbortSignal) => Promise<T | null>,
    private readonly drop: (value: T) => void,
    private readonly changed: () => void,
    private readonly limit: () => number, // bytes
    private readonly now: () => number = () => performance.now(),
  ) {}

  // The tiles that a picture needs, in their order of importance.
  want(tiles: TileId[]) {
    this.wanted = tiles;
    const keys = new Set(tiles.map(keyOf));
    for (const [key, abort] of this.loading)
      if (!keys.has(key)) {
        this.loading.delete(key);
        abort.abort();
      }
    this.next();
  }

  has = (tile: TileId): boolean => this.entries.has(keyOf(tile));

  // What is to be drawn. undefined: it has not come; null: there is nothing.
  use(tile: TileId): T | null | undefined {
    const entry = this.entries.get(keyOf(tile));
    if (!entry) return undefined;
    entry.used = ++this.clock;
    return entry.value;
  }

  // Whether all that was wanted has come, or could not be had.
  get settled(): boolean {
    return this.wanted.every((tile) => this.has(tile) || this.troubles.has(keyOf(tile)));
  }
  get missing(): number {
    return this.wanted.filter((tile) => !this.has(tile)).length;
  }
  // Why a wanted tile could not be had.
  get trouble(): unknown {
    for (const tile of this.wanted) {
      const trouble = this.troubles.get(keyOf(tile));
      if (trouble && trouble.tries > 1) return trouble.error;
    }
    return null;
  }

  *values(): Iterable<T> {
    for (const { value } of this.entries.values()) if (value) yield value;
  }

  end() {
    this.ended = true;
    if (this.timer) clearTimeout(this.timer);
    for (const abort of this.loading.values()) abort.abort();
    this.loading.clear();
    for (const { value } of this.entries.values()) if (value) this.drop(value);
    this.entries.clear();
    this.bytes = 0;
  }

  private next() {
    if (this.ended) return;
    let soonest = Infinity;
    for (const tile of this.wanted) {
      if (this.loading.size >= atOnce) return;
      const key = keyOf(tile);
      if (this.entries.has(key) || this.loading.has(key)) continue;
      const trouble = this.troubles.get(key);
      if (trouble && trouble.tries >= tries) continue;
      if (trouble && trouble.again > this.now()) {
        soonest = Math.min(soonest, trouble.again);
        continue;
      }
      void this.fetch(tile, key);
    }
    if (soonest < Infinity && !this.timer)
      this.timer = setTimeout(() => {
        this.timer = null;
        this.next();
      }, soonest - this.now());
  }

  private async fetch(tile: TileId, key: number) {
    const abort = new AbortController();
    this.loading.set(key, abort);
    try {
      const value = await this.load(tile, abort.signal);
      if (this.ended || abort.signal.aborted) {
        if (value) this.drop(value);
        return;
      }
      this.entries.set(key, { value, used: ++this.clock });
      this.troubles.delete(key);
      this.bytes += value?.bytes ?? 0;
      this.fetched += value?.bytes ?? 0;
      this.evict();
      this.changed();
    } catch (error) {
      if (this.ended || abort.signal.aborted) return;
      const count = (this.troubles.get(key)?.tries ?? 0) + 1;
      this.troubles.set(key, { error, tries: count, again: this.now() + 500 * 2 ** count });
      this.changed();
    } finally {
      if (this.loading.get(key) === abort) this.loading.delete(key);
      this.next();
    }
  }

  // What the picture needs stays, whatever it takes.
  private evict() {
    if (this.bytes <= this.limit()) return;
    const needed = new Set(this.wanted.map(keyOf));
    const oldest = [...this.entries].filter(([key]) => !needed.has(key)).sort(([, a], [, b]) => a.used - b.used);
    for (const [key, { value }] of oldest) {
      if (this.bytes <= this.limit() * 0.8) break;
      this.entries.delete(key);
      if (!value) continue;
      this.bytes -= value.bytes;
      this.drop(value);
    }
  }
}
