// Which tiles show a picture, and what is drawn as long as they have not come.
import { corners, type Box, type Camera, type Size } from './camera';
import type { World } from './layout';

export interface TileId {
  z: number;
  x: number;
  y: number;
}
export const tilePixels = 512; // a tile's width in the picture, times 0.7 to 1.4
export const deeper = 6; // levels beyond that at which all points are drawn

// Levels are below 32 and columns below 2^21.
export function keyOf({ z, x, y }: TileId): number {
  return (z * 2 ** 21 + x) * 2 ** 21 + y;
}

export function zoomFor(mpp: number, world: World, zooms: number): number {
  const zoom = Math.round(Math.log2(world.size / (tilePixels * mpp)));
  return Math.max(0, Math.min(zooms + deeper, 20, zoom));
}

export function tileBox(world: World, { z, x, y }: TileId): Box {
  const size = world.size / 2 ** z;
  return [world.x + x * size, world.y + y * size, world.x + (x + 1) * size, world.y + (y + 1) * size];
}

// The tiles of level z that the picture shows, nearest to its middle first.
export function tilesInView(camera: Camera, size: Size, world: World, z: number): TileId[] {
  const width = world.size / 2 ** z;
  const last = 2 ** z - 1;
  const points = corners(camera, size);
  const xs = points.map(([x]) => (x - world.x) / width);
  const ys = points.map(([, y]) => (y - world.y) / width);
  const clamp = (value: number) => Math.max(0, Math.min(last, Math.floor(value)));
  const [left, right, bottom, top] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  if (right < 0 || top < 0 || left > last + 1 || bottom > last + 1) return [];
  const middleX = (camera.x - world.x) / width - 0.5;
  const middleY = (camera.y - world.y) / width - 0.5;
  const found: { tile: TileId; away: number }[] = [];
  for (let x = clamp(left); x <= clamp(right); x++)
    for (let y = clamp(bottom); y <= clamp(top); y++)
      if (touches(camera, size, (x + 0.5) * width + world.x, (y + 0.5) * width + world.y, width))
        found.push({ tile: { z, x, y }, away: (x - middleX) ** 2 + (y - middleY) ** 2 });
  return found.sort((one, other) => one.away - other.away).map(({ tile }) => tile);
}

// Whether a square around this point, along the layout's axes, touches the picture, which may be turned.
function touches(camera: Camera, size: Size, x: number, y: number, width: number): boolean {
  const cos = Math.cos(camera.turn);
  const sin = Math.sin(camera.turn);
  const dx = x - camera.x;
  const dy = y - camera.y;
  const reach = (width / 2) * (Math.abs(cos) + Math.abs(sin));
  return (
    Math.abs(dx * cos - dy * sin) <= (size.width / 2) * camera.mpp + reach &&
    Math.abs(dx * sin + dy * cos) <= (size.height / 2) * camera.mpp + reach
  );
}

export function ancestor({ z, x, y }: TileId, levels: number): TileId {
  return { z: z - levels, x: Math.floor(x / 2 ** levels), y: Math.floor(y / 2 ** levels) };
}

export interface Drawn {
  tile: TileId;
  only: TileId | null; // only what lies in this tile, for which it stands in
}

// What to draw for the tiles of a picture: each itself, or its four children if they are there (the picture went
// farther), or of its nearest ancestor what lies in it (the picture went nearer).
export function cover(wanted: readonly TileId[], has: (tile: TileId) => boolean): Drawn[] {
  const drawn: Drawn[] = [];
  for (const tile of wanted) {
    if (has(tile)) {
      drawn.push({ tile, only: null });
      continue;
    }
    const { z, x, y } = tile;
    const children = [0, 1, 2, 3].map((i) => ({ z: z + 1, x: 2 * x + (i & 1), y: 2 * y + (i >> 1) }));
    if (children.every(has)) {
      for (const child of children) drawn.push({ tile: child, only: null });
      continue;
    }
    for (let levels = 1; levels <= z; levels++) {
      const parent = ancestor(tile, levels);
      if (!has(parent)) continue;
      drawn.push({ tile: parent, only: tile });
      break;
    }
  }
  return drawn;
}

// The level at which the picture has at most so many vertices, as far as they are known: dense places are drawn
// coarser. `known`: vertices of a tile, undefined where it never came.
export function affordable(
  zoom: number,
  tiles: (z: number) => TileId[],
  known: (tile: TileId) => number | undefined,
  most: number,
): { zoom: number; tiles: TileId[] } {
  for (let z = zoom; ; z--) {
    const list = tiles(z);
    const sum = list.reduce((total, tile) => total + (known(tile) ?? 0), 0);
    if (sum <= most || z === 0 || z <= zoom - 4) return { zoom: z, tiles: list };
  }
}
