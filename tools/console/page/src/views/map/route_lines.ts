// A route on the map: its ends as the address has them, and what is drawn of it.
import { frameText, parseFrame } from '../../lib/ids';
import type { FramePlace } from '../../map/layout';
import type { RouteMark } from '../../map/overlay';
import type { Route } from '../place/route';

// "6:10,6:120"; null: it names no two frames.
export function parseRoute(text: string | null): [from: string, to: string] | null {
  const ends = (text ?? '').split(',');
  return ends.length === 2 && ends.every((end) => parseFrame(end)) ? [ends[0]!, ends[1]!] : null;
}

// The frames through which each route is drawn: all, or of long routes some at even distances and the last, so that all
// together are no more than the console is asked for at once.
export function framesOf(routes: readonly Route[], most = 10_000): string[][] {
  return routes.map(({ steps }) => {
    const each = Math.max(1, Math.ceil(steps.length / Math.max(1, Math.floor(most / routes.length) - 1)));
    return steps.filter((_, at) => at % each === 0 || at === steps.length - 1).map(({ frame }) => frameText(frame));
  });
}

// The runs of places that are joined by lines: a frame that the layout does not have, and the way from one of its parts
// to another, leave a gap.
export function runsOf(frames: readonly string[], place: (frame: string) => FramePlace | null): FramePlace[][] {
  const runs: FramePlace[][] = [];
  let before: FramePlace | null = null;
  for (const frame of frames) {
    const at = place(frame);
    if (at) {
      if (before?.part === at.part) runs.at(-1)!.push(at);
      else runs.push([at]);
    }
    before = at;
  }
  return runs;
}

// The chosen one is drawn last, over the others.
export function routeMarks(routes: readonly (readonly string[])[], chosen: number, place: (frame: string) => FramePlace | null): RouteMark[] {
  const marks = routes.flatMap((frames, at) => {
    const runs = runsOf(frames, place);
    const origin = runs[0]?.[0];
    if (!origin) return [];
    const path = new Path2D();
    for (const run of runs) run.forEach(({ x, y }, i) => (i ? path.lineTo(x - origin.x, y - origin.y) : path.moveTo(x - origin.x, y - origin.y)));
    return [{ x: origin.x, y: origin.y, path, chosen: at === chosen, points: runs.reduce((sum, { length }) => sum + length, 0) }];
  });
  return marks.sort((one, other) => Number(one.chosen) - Number(other.chosen));
}
