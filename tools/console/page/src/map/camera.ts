// From where the map is looked at, and between metres of the layout's plane (x to the right, y up) and pixels of the
// picture (from its upper left corner, y down).
export interface Camera {
  x: number; // metres, what lies in the middle of the picture
  y: number;
  mpp: number; // metres per CSS pixel
  turn: number; // radians by which the picture is turned, counter-clockwise
}
export interface Size {
  width: number; // CSS pixels
  height: number;
}
export type Box = [left: number, bottom: number, right: number, top: number]; // metres

export const nearest = 0.001; // metres per pixel
export const farthest = 10_000;

export function toScreen(camera: Camera, size: Size, x: number, y: number): [number, number] {
  const dx = (x - camera.x) / camera.mpp;
  const dy = (y - camera.y) / camera.mpp;
  const cos = Math.cos(camera.turn);
  const sin = Math.sin(camera.turn);
  return [size.width / 2 + dx * cos - dy * sin, size.height / 2 - dx * sin - dy * cos];
}

export function toWorld(camera: Camera, size: Size, px: number, py: number): [number, number] {
  const dx = (px - size.width / 2) * camera.mpp;
  const dy = (size.height / 2 - py) * camera.mpp;
  const cos = Math.cos(camera.turn);
  const sin = Math.sin(camera.turn);
  return [camera.x + dx * cos + dy * sin, camera.y - dx * sin + dy * cos];
}

// The picture is pulled by so many pixels: what was under the pointer stays under it.
export function pan(camera: Camera, dx: number, dy: number): Camera {
  const [x, y] = toWorld(camera, { width: 0, height: 0 }, -dx, -dy);
  return { ...camera, x, y };
}

// What lies at this pixel stays there. A factor above 1 goes nearer.
export function zoomAt(camera: Camera, size: Size, px: number, py: number, factor: number): Camera {
  const mpp = Math.min(farthest, Math.max(nearest, camera.mpp / factor));
  const [x, y] = toWorld(camera, size, px, py);
  const next = { ...camera, mpp };
  const [nextX, nextY] = toWorld(next, size, px, py);
  return { ...next, x: next.x + x - nextX, y: next.y + y - nextY };
}

// All of the box is in the picture, with a margin of so many pixels.
export function fit(box: Box, size: Size, margin = 40, turn = 0, least = nearest): Camera {
  const width = Math.max(0, box[2] - box[0]);
  const height = Math.max(0, box[3] - box[1]);
  const cos = Math.abs(Math.cos(turn));
  const sin = Math.abs(Math.sin(turn));
  const across = Math.max(1, size.width - 2 * margin);
  const up = Math.max(1, size.height - 2 * margin);
  const mpp = Math.max((width * cos + height * sin) / across, (width * sin + height * cos) / up, least);
  return { x: (box[0] + box[2]) / 2, y: (box[1] + box[3]) / 2, mpp: Math.min(farthest, mpp), turn };
}

export function around(points: readonly { x: number; y: number }[]): Box {
  const box: Box = [Infinity, Infinity, -Infinity, -Infinity];
  for (const { x, y } of points) {
    box[0] = Math.min(box[0], x);
    box[1] = Math.min(box[1], y);
    box[2] = Math.max(box[2], x);
    box[3] = Math.max(box[3], y);
  }
  return box;
}

// The corners of the picture in metres, counter-clockwise from the lower left one.
export function corners(camera: Camera, size: Size): [number, number][] {
  return [
    toWorld(camera, size, 0, size.height),
    toWorld(camera, size, size.width, size.height),
    toWorld(camera, size, size.width, 0),
    toWorld(camera, size, 0, 0),
  ];
}

// The turn that shows this direction (radians, 0 along x, counter-clockwise) upwards.
export function headingUp(heading: number): number {
  return wrapped(Math.PI / 2 - heading);
}

export function wrapped(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

// From one camera to another, share 0..1: the scale goes by factors, and the turn the shorter way.
export function between(from: Camera, to: Camera, share: number): Camera {
  const mpp = from.mpp * (to.mpp / from.mpp) ** share;
  // The middle moves in step with the scale, so that the flight is even to the eye.
  const even = Math.abs(to.mpp - from.mpp) < 1e-6 * from.mpp ? share : (mpp - from.mpp) / (to.mpp - from.mpp);
  return {
    x: from.x + (to.x - from.x) * even,
    y: from.y + (to.y - from.y) * even,
    mpp,
    turn: from.turn + wrapped(to.turn - from.turn) * share,
  };
}

// A picture relative to a frame, whose heading is up: the camera's place in the frame's plane coordinates. So an
// address that names a frame shows the same after the layout has changed.
export interface Place {
  x: number;
  y: number;
  heading: number;
}
export function relativeTo(place: Place, camera: Camera): Camera {
  const turn = headingUp(place.heading);
  const [x, y] = toScreen({ x: place.x, y: place.y, mpp: 1, turn }, { width: 0, height: 0 }, camera.x, camera.y);
  return { x, y: -y, mpp: camera.mpp, turn: wrapped(camera.turn - turn) };
}
export function fromRelative(place: Place, camera: Camera): Camera {
  const turn = headingUp(place.heading);
  const [x, y] = toWorld({ x: place.x, y: place.y, mpp: 1, turn }, { width: 0, height: 0 }, camera.x, -camera.y);
  return { x, y, mpp: camera.mpp, turn: wrapped(camera.turn + turn) };
}

// "12.5,-3,0.25" or with the turn in degrees as a fourth number, for the address.
export function cameraText(camera: Camera): string {
  const digits = Math.max(0, Math.min(4, Math.ceil(1 - Math.log10(camera.mpp))));
  const numbers = [camera.x.toFixed(digits), camera.y.toFixed(digits), camera.mpp.toPrecision(3)].map(Number);
  const degrees = Math.round((camera.turn * 180) / Math.PI);
  return (degrees ? [...numbers, degrees] : numbers).join(',');
}
export function parseCamera(text: string | null): Camera | null {
  const numbers = text?.split(',').map(Number) ?? [];
  const [x, y, mpp, degrees = 0] = numbers;
  if (numbers.length < 3 || numbers.length > 4 || !numbers.every(Number.isFinite)) return null;
  if (mpp! < nearest || mpp! > farthest) return null;
  return { x: x!, y: y!, mpp: mpp!, turn: wrapped((degrees * Math.PI) / 180) };
}
