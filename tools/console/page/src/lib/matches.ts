// Two pictures and the points that both show, laid out for drawing: beside each other with lines, or one over the other.

// A picture as it is drawn: its size, and how many of its pixels are one pixel of the measurements.
export interface Shot {
  width: number;
  height: number;
  scale: number;
}

// As Correspondence of evidence.proto, without its wrapping.
export interface Match {
  u: number; // in the view
  v: number;
  frameU: number; // in the frame of the map
  frameV: number;
  inlier: boolean;
  residual?: number; // pixels in the view
}

export interface Point {
  x: number;
  y: number;
}

// A match in the coordinates of the drawing.
export interface Drawn {
  frame: Point;
  view: Point;
  inlier: boolean;
  class: number; // of its colour
  index: number; // of its match
}

export interface Layout {
  width: number;
  height: number;
  // Where the pictures are: the frame's at the left or on top, then the view's. `enlarged`: drawn pixels per pixel.
  frame: Point & { enlarged: number };
  view: Point & { enlarged: number };
  matches: Drawn[];
}

const kGap = 8; // between the pictures, in pixels of the frame's picture

// Both pictures get the same height (the same width, if stacked).
export function layoutPair(frame: Shot, view: Shot, matches: Match[], stacked: boolean, colour: Colour): Layout {
  const enlarged = stacked ? frame.width / view.width : frame.height / view.height;
  const at = stacked ? { x: 0, y: frame.height + kGap } : { x: frame.width + kGap, y: 0 };
  const width = stacked ? frame.width : at.x + view.width * enlarged;
  const height = stacked ? at.y + view.height * enlarged : frame.height;
  const drawn: Drawn[] = [];
  matches.forEach((match, index) => {
    const f = { x: match.frameU * frame.scale, y: match.frameV * frame.scale };
    const v = { x: match.u * view.scale, y: match.v * view.scale };
    if (!inside(f, frame) || !inside(v, view)) return;
    drawn.push({
      frame: f,
      view: { x: at.x + v.x * enlarged, y: at.y + v.y * enlarged },
      inlier: match.inlier,
      class: colour === 'residual' ? residualClass(match) : placeClass(f, frame),
      index,
    });
  });
  return { width, height, frame: { x: 0, y: 0, enlarged: 1 }, view: { ...at, enlarged }, matches: drawn };
}

function inside(point: Point, shot: Shot): boolean {
  return point.x >= 0 && point.y >= 0 && point.x <= shot.width && point.y <= shot.height;
}

// ---- Colours

// By where the point is in the frame's picture, from left to right: lines of neighbours that join the same thing keep
// the order of their colours. Or by the residual.
export type Colour = 'place' | 'residual';
export const kPlaceClasses = 8;
export const kResidualLimits = [1, 2, 4]; // pixels; classes 0 to 3, and 4 where it is not known

export function residualClass(match: Match): number {
  if (match.residual === undefined) return kResidualLimits.length + 1;
  const at = kResidualLimits.findIndex((limit) => match.residual! <= limit);
  return at < 0 ? kResidualLimits.length : at;
}

function placeClass(point: Point, shot: Shot): number {
  return Math.min(kPlaceClasses - 1, Math.floor((point.x / shot.width) * kPlaceClasses));
}

// ---- Paths: all matches of one colour are one element, since a thousand of them would take longer to make than to see.

export interface Paths {
  class: number;
  inlier: boolean;
  lines: string;
  marks: string; // rings for inliers, crosses for others
}

export function pathsOf(matches: Drawn[], markSize: number): Paths[] {
  const found = new Map<string, Paths>();
  for (const match of matches) {
    const key = `${match.inlier}${match.class}`;
    let paths = found.get(key);
    if (!paths) found.set(key, (paths = { class: match.class, inlier: match.inlier, lines: '', marks: '' }));
    const { frame: f, view: v } = match;
    paths.lines += `M${r(f.x)} ${r(f.y)}L${r(v.x)} ${r(v.y)}`;
    const mark = match.inlier ? ring : cross;
    paths.marks += mark(f, markSize) + mark(v, markSize);
  }
  // Those that do not agree lie below.
  return [...found.values()].sort((x, y) => Number(x.inlier) - Number(y.inlier) || x.class - y.class);
}

function r(value: number): string {
  return String(Math.round(value * 10) / 10);
}
function ring(at: Point, size: number): string {
  return `M${r(at.x - size)} ${r(at.y)}a${size} ${size} 0 1 0 ${2 * size} 0a${size} ${size} 0 1 0 ${-2 * size} 0`;
}
function cross(at: Point, size: number): string {
  const [x, y] = [at.x - size, at.y - size];
  return `M${r(x)} ${r(y)}l${2 * size} ${2 * size}m0 ${-2 * size}l${-2 * size} ${2 * size}`;
}

// The match with an end nearest to a point of the drawing, if it is within reach.
export function nearest(matches: Drawn[], point: Point, reach: number): Drawn | null {
  let best: Drawn | null = null;
  let least = reach * reach;
  for (const match of matches)
    for (const end of [match.frame, match.view]) {
      const square = (end.x - point.x) ** 2 + (end.y - point.y) ** 2;
      if (square <= least) {
        least = square;
        best = match;
      }
    }
  return best;
}

// ---- One over the other

// Maps pixels of the view's picture to pixels of the frame's: x' = a x - b y + e, y' = b x + a y + f.
export interface Similarity {
  a: number;
  b: number;
  e: number;
  f: number;
  aligned: boolean; // by matched points; false: only scaled to the same width
}

// The similarity that brings matched points roughly together (least squares over the inliers, then over the better half
// of them: what is near moves otherwise than what is far). Where the points do not tell it, the view is only scaled.
export function align(frame: Shot, view: Shot, matches: Match[]): Similarity {
  const plain = { a: frame.width / view.width, b: 0, e: 0, f: 0, aligned: false };
  let pairs = matches
    .filter((match) => match.inlier)
    .map((match) => ({
      from: { x: match.u * view.scale, y: match.v * view.scale },
      to: { x: match.frameU * frame.scale, y: match.frameV * frame.scale },
    }));
  let fitted: Similarity | null = null;
  for (let round = 0; round < 3; ++round) {
    if (pairs.length < 4) break;
    const next = fit(pairs);
    if (!next) break;
    fitted = next;
    const off = (pair: (typeof pairs)[0]) => {
      const at = apply(next, pair.from);
      return (at.x - pair.to.x) ** 2 + (at.y - pair.to.y) ** 2;
    };
    pairs = [...pairs].sort((x, y) => off(x) - off(y)).slice(0, Math.ceil(pairs.length * 0.75));
  }
  if (!fitted) return plain;
  const size = Math.hypot(fitted.a, fitted.b) / plain.a;
  return size > 1 / 4 && size < 4 ? fitted : plain;
}

export function apply(by: Similarity, point: Point): Point {
  return { x: by.a * point.x - by.b * point.y + by.e, y: by.b * point.x + by.a * point.y + by.f };
}

function fit(pairs: { from: Point; to: Point }[]): Similarity | null {
  const n = pairs.length;
  let fx = 0, fy = 0, tx = 0, ty = 0;
  for (const { from, to } of pairs) {
    fx += from.x / n;
    fy += from.y / n;
    tx += to.x / n;
    ty += to.y / n;
  }
  let dot = 0, turn = 0, square = 0;
  for (const { from, to } of pairs) {
    const [x, y, X, Y] = [from.x - fx, from.y - fy, to.x - tx, to.y - ty];
    dot += x * X + y * Y;
    turn += x * Y - y * X;
    square += x * x + y * y;
  }
  if (square < 1) return null;
  const [a, b] = [dot / square, turn / square];
  return { a, b, e: tx - a * fx + b * fy, f: ty - b * fx - a * fy, aligned: true };
}

// Why no points are joined although there are two pictures, or "".
export function pointsText(matches: Match[], drawn: number): string {
  if (matches.length === 0) return 'No points are known that both pictures show.';
  if (drawn === 0) return 'None of the matched points lies within the pictures that are kept.';
  return '';
}
