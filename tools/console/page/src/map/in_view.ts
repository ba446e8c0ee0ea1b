// What the picture shows, counted: for the list beside it, which says in words what others see.
import type { Box } from './camera';
import { closureTorn, vertexCut, type Tile } from './tile';

export interface InView {
  points: number; // drawn, of the frames in view
  sessions: number[]; // of these, the most points first
  states: [number, number, number, number, number]; // closures by EdgeState, with an end in view
  suspicious: number; // of those in force
  torn: string[]; // "6:9291/1", the worst first
}

export function inView(tiles: readonly Tile[], inside: (x: number, y: number) => boolean, box: Box, until: number): InView {
  const points = new Map<number, number>();
  const seen = new Set<string>();
  const states: InView['states'] = [0, 0, 0, 0, 0];
  const torn: { edge: string; sigmas: number }[] = [];
  let all = 0;
  let suspicious = 0;
  for (const tile of tiles) {
    // Compared in the tile's units, as most vertices are within the box or none is.
    const left = (box[0] - tile.originX) / tile.unit;
    const right = (box[2] - tile.originX) / tile.unit;
    const bottom = (box[1] - tile.originY) / tile.unit;
    const top = (box[3] - tile.originY) / tile.unit;
    const { session, first } = tile.runs;
    for (let run = 0; run < first.length; run++) {
      let count = 0;
      const end = first[run + 1] ?? tile.count;
      for (let i = first[run]!; i < end; i++) {
        const x = tile.x[i]!;
        const y = tile.y[i]!;
        if (x < left || x > right || y < bottom || y > top || tile.time[i]! > until || tile.flags[i]! & vertexCut) continue;
        if (inside(tile.originX + x * tile.unit, tile.originY + y * tile.unit)) count++;
      }
      if (!count) continue;
      all += count;
      points.set(session[run]!, (points.get(session[run]!) ?? 0) + count);
    }
    const { closures } = tile;
    for (let i = 0; i < closures.count; i++) {
      if (closures.time[i]! > until) continue;
      const a = inside(tile.originX + closures.ax[i]!, tile.originY + closures.ay[i]!);
      if (!a && !inside(tile.originX + closures.bx[i]!, tile.originY + closures.by[i]!)) continue;
      const edge = `${closures.session[i]}:${closures.index[i]}/${closures.ordinal[i]}`;
      if (seen.has(edge)) continue;
      seen.add(edge);
      const state = Math.min(4, closures.state[i]!);
      states[state]!++;
      if (state !== 2) continue;
      if (closures.suspicion[i]! >= 0.5) suspicious++;
      if (closures.flags[i]! & closureTorn) torn.push({ edge, sigmas: closures.sigmas[i]! });
    }
  }
  return {
    points: all,
    sessions: [...points].sort(([, a], [, b]) => b - a).map(([session]) => session),
    states,
    suspicious,
    torn: torn.sort((a, b) => b.sigmas - a.sigmas).map(({ edge }) => edge),
  };
}
