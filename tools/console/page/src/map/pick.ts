// What lies under the pointer: the nearest frame of a line, or the nearest closure. It goes through all of a tile:
// comparing 20,000 segments takes less than a millisecond, and an index would have to be built first.
import { closureTorn, vertexCut, type Tile } from './tile';

export interface PickedFrame {
  kind: 'frame';
  session: number;
  index: number;
  time: number; // seconds UTC, 0: not known
  sd: number | null;
  x: number; // metres in the layout's plane
  y: number;
  away: number; // metres from the pointer
}
export interface PickedClosure {
  kind: 'closure';
  tile: Tile;
  at: number; // in the tile's closures
  session: number;
  index: number;
  ordinal: number;
  away: number;
}
export type Picked = PickedFrame | PickedClosure;

export interface PickRules {
  until: number; // seconds; nothing that is younger
  session: (session: number) => boolean;
  closure: (tile: Tile, at: number) => boolean;
}

// The distance of a point from a segment, squared, and where along it (0..1) the nearest point is.
export function segment(px: number, py: number, ax: number, ay: number, bx: number, by: number): [number, number] {
  const dx = bx - ax;
  const dy = by - ay;
  const length = dx * dx + dy * dy;
  const along = length > 0 ? Math.max(0, Math.min(1, ((px - ax) * dx + (py - ay) * dy) / length)) : 0;
  return [(px - ax - along * dx) ** 2 + (py - ay - along * dy) ** 2, along];
}

export function pickFrame(tile: Tile, x: number, y: number, reach: number, rules: PickRules): PickedFrame | null {
  const px = (x - tile.originX) / tile.unit;
  const py = (y - tile.originY) / tile.unit;
  let best = (reach / tile.unit) ** 2;
  let found = -1;
  let foundRun = 0;
  const { first, session } = tile.runs;
  for (let run = 0; run < first.length; run++) {
    if (!rules.session(session[run]!)) continue;
    const begin = first[run]!;
    const end = first[run + 1] ?? tile.count;
    for (let i = begin; i < end; i++) {
      if (tile.time[i]! > rules.until) continue;
      const before = i > begin ? i - 1 : i;
      const [away, along] = segment(px, py, tile.x[before]!, tile.y[before]!, tile.x[i]!, tile.y[i]!);
      if (away >= best) continue;
      const near = along < 0.5 ? before : i;
      const frame = tile.flags[near]! & vertexCut ? (near === i ? before : i) : near;
      if (tile.flags[frame]! & vertexCut) continue;
      best = away;
      found = frame;
      foundRun = run;
    }
  }
  if (found < 0) return null;
  return {
    kind: 'frame',
    session: session[foundRun]!,
    index: tile.index[found]!,
    time: tile.time[found]!,
    sd: tile.sd ? tile.sd[found]! : null,
    x: tile.originX + tile.x[found]! * tile.unit,
    y: tile.originY + tile.y[found]! * tile.unit,
    away: Math.sqrt(best) * tile.unit,
  };
}

// Torn closures are found from a little farther off: they are what one looks for.
export function pickClosure(tile: Tile, x: number, y: number, reach: number, rules: PickRules): PickedClosure | null {
  const px = x - tile.originX;
  const py = y - tile.originY;
  const { closures } = tile;
  let best = reach * reach;
  let found = -1;
  for (let i = 0; i < closures.count; i++) {
    if (closures.time[i]! > rules.until || !rules.closure(tile, i)) continue;
    let [away] = segment(px, py, closures.ax[i]!, closures.ay[i]!, closures.bx[i]!, closures.by[i]!);
    if (closures.flags[i]! & closureTorn) away /= 2;
    if (away >= best) continue;
    best = away;
    found = i;
  }
  if (found < 0) return null;
  return {
    kind: 'closure',
    tile,
    at: found,
    session: closures.session[found]!,
    index: closures.index[found]!,
    ordinal: closures.ordinal[found]!,
    away: Math.sqrt(best),
  };
}
