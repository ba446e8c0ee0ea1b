// The state of the layout, as the console tells it (tools/console/README.md).
import type { Box } from './camera';

export interface Part {
  root: string;
  frames: number;
  box: Box;
  sessions: number[];
}
export interface Torn {
  edge: string | null; // null: a stretch of motion, and no closure
  a: string;
  b: string;
  sigmas: number;
  metres: number;
}
export interface World {
  x: number;
  y: number;
  size: number; // metres
}
export interface Layout {
  version: number; // when it was made, ms since 1970; 0: there is none
  map_version: string;
  map_uuid: string;
  coarse: boolean;
  points: number;
  frames: number;
  converged: boolean;
  world: World;
  zooms: number;
  time: { first_ms: number; last_ms: number };
  parts: Part[];
  torn: Torn[]; // the worst
  torn_in_all: number;
  progress: { step: string; done: number; total: number } | null;
  behind: number;
  empty: { reason: string; message: string } | null;
  error: { reason: string; message: string } | null; // why it is not kept up
}
export interface FramePlace {
  frame: string;
  part: number;
  x: number;
  y: number;
  heading: number;
}

// Of a torn closure or stretch of motion, for lists.
export function tornName({ edge, a, b }: Torn): string {
  return edge ?? `${a} – ${b}`;
}

// Whether there is something to draw.
export function drawable(layout: Layout | null): layout is Layout {
  return !!layout && layout.version > 0 && !layout.empty && !!layout.world && layout.world.size > 0 && layout.parts.length > 0;
}

// A box around all parts.
export function whole(layout: Layout): Box {
  const box: Box = [Infinity, Infinity, -Infinity, -Infinity];
  for (const part of layout.parts) {
    box[0] = Math.min(box[0], part.box[0]);
    box[1] = Math.min(box[1], part.box[1]);
    box[2] = Math.max(box[2], part.box[2]);
    box[3] = Math.max(box[3], part.box[3]);
  }
  return box;
}
