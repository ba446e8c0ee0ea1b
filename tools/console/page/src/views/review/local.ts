// The small layout around a closure (GET /map/local, tools/console/README.md), fitted into a drawing.

export interface Layer {
  frames: string[];
  x: number[];
  y: number[];
  runs: number[]; // first positions of consecutive frames
}
export interface Local {
  edge: string;
  root: string;
  cut: boolean;
  sigmas: number | null;
  with: Layer;
  without: Layer;
  closures: { edge: string; a: number; b: number; in_force: boolean; suspicion: number }[];
}

export interface Box {
  x: number;
  y: number;
  width: number;
  height: number;
}

// The box around both layers, so that they can be compared, with y down, and some room around it.
export function boxOf(local: Local): Box {
  let [left, right, top, bottom] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const layer of [local.with, local.without])
    layer.x.forEach((x, index) => {
      const y = -layer.y[index]!;
      left = Math.min(left, x);
      right = Math.max(right, x);
      top = Math.min(top, y);
      bottom = Math.max(bottom, y);
    });
  if (!Number.isFinite(left)) return { x: 0, y: 0, width: 1, height: 1 };
  const size = Math.max(right - left, bottom - top, 1);
  const room = size * 0.08;
  // At least two thirds as high as wide, and the reverse, so that a straight drive is not a line in a slit.
  const width = Math.max(right - left, size * 0.66) + 2 * room;
  const height = Math.max(bottom - top, size * 0.66) + 2 * room;
  return { x: (left + right - width) / 2, y: (top + bottom - height) / 2, width, height };
}

export function pathOf(layer: Layer): string {
  const starts = new Set(layer.runs);
  return layer.x.map((x, index) => `${index === 0 || starts.has(index) ? 'M' : 'L'}${round(x)} ${round(-layer.y[index]!)}`).join('');
}

// Where the ends of the closure with this name are in a layer; null: it is not there.
export function endsOf(local: Local, layer: Layer, name: string) {
  const closure = local.closures.find((each) => each.edge === name);
  if (!closure) return null;
  const at = (index: number) => ({ x: layer.x[index] ?? 0, y: -(layer.y[index] ?? 0) });
  return { a: at(closure.a), b: at(closure.b) };
}

export function otherClosures(local: Local, layer: Layer, name: string): string {
  return local.closures
    .filter((each) => each.edge !== name && each.in_force)
    .map((each) => `M${round(layer.x[each.a]!)} ${round(-layer.y[each.a]!)}L${round(layer.x[each.b]!)} ${round(-layer.y[each.b]!)}`)
    .join('');
}

// How far the ends are apart in a layer, in metres.
export function apart(local: Local, layer: Layer, name: string): number {
  const ends = endsOf(local, layer, name);
  return ends ? Math.hypot(ends.a.x - ends.b.x, ends.a.y - ends.b.y) : NaN;
}

// A round length of about a quarter of the box, for a scale.
export function scaleOf(box: Box): number {
  const most = box.width / 3;
  const power = 10 ** Math.floor(Math.log10(most));
  return [5, 2, 1].map((each) => each * power).find((each) => each <= most)!;
}

function round(value: number): number {
  return Math.round(value * 1000) / 1000;
}
