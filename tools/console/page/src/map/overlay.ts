// What lies over the lines: trails, robots, labels, captions, what is selected, the bar of the scale. It is drawn on a
// second canvas, which has text.
import { toScreen, type Camera, type Size } from './camera';
import { metres, plain } from '../lib/format';
import { css, sessionColour, type Palette, type Rgb } from './palette';
import { clipped, Placement, scaleBar } from './placement';

interface At {
  x: number; // metres
  y: number;
}
export interface RobotMark extends At {
  heading: number;
  name: string;
  session: number;
  wrong: boolean;
  followed: boolean;
}
export interface LabelMark extends At {
  text: string;
}
export interface Caption extends At {
  text: string;
}
export interface Trail extends At {
  path: Path2D; // metres from x, y
  session: number;
}
export interface RouteMark extends At {
  path: Path2D;
  chosen: boolean;
  points: number;
}
export interface Line {
  ax: number;
  ay: number;
  bx: number;
  by: number;
}
export interface LooseClosure extends Line {
  state: 'candidate' | 'accepted' | 'quarantined' | 'removed';
}
export interface Marks {
  robots: RobotMark[];
  labels: LabelMark[];
  captions: Caption[];
  trails: Trail[];
  routes: RouteMark[]; // the chosen one last
  ends: LabelMark[]; // of the route
  closures: LooseClosure[]; // newer than the tiles
  torn: (Line & { edge: string | null; text: string })[];
  frame: At | null; // selected
  closure: Line | null; // selected
  root: (At & { heading: number; text: string }) | null;
  crosshair: boolean;
}
export const noMarks: Marks = {
  robots: [], labels: [], captions: [], trails: [], routes: [], ends: [], closures: [], torn: [],
  frame: null, closure: null, root: null, crosshair: false,
};

const font = "13px system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif";
const line = 17; // pixels
type Stroke = [colour: Rgb, width: number, dashes?: number[]];

export class Overlay {
  private context: CanvasRenderingContext2D;
  private widths = new Map<string, number>();

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.context = canvas.getContext('2d')!;
  }

  // `drawn`: the torn closures that the lines beneath have.
  draw(camera: Camera, size: Size, pixel: number, marks: Marks, palette: Palette, drawn: (edge: string) => boolean) {
    const { canvas, context } = this;
    const width = Math.max(1, Math.round(size.width * pixel));
    const height = Math.max(1, Math.round(size.height * pixel));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    context.setTransform(pixel, 0, 0, pixel, 0, 0);
    context.clearRect(0, 0, size.width, size.height);
    context.font = font;
    context.textBaseline = 'top';
    context.lineJoin = context.lineCap = 'round';

    for (const route of marks.routes)
      this.path(camera, size, pixel, route, route.chosen ? [[palette.text, 8], [palette.route, 4.5]] : [[palette.ground, 6], [palette.text, 2.5, [9, 6]]]);
    for (const trail of marks.trails)
      this.path(camera, size, pixel, trail, [[palette.ground, 7], [sessionColour(palette, trail.session), 4]]);
    for (const closure of marks.closures) this.closure(camera, size, closure, css(palette[closure.state]), 2, true);
    if (marks.closure) {
      this.closure(camera, size, marks.closure, css(palette.selected, 0.22), 16, false);
      const { ax, ay, bx, by } = marks.closure;
      for (const [x, y] of [toScreen(camera, size, ax, ay), toScreen(camera, size, bx, by)])
        this.ring(x, y, 8, palette.selected, palette.ground);
    }
    if (marks.frame) this.ring(...toScreen(camera, size, marks.frame.x, marks.frame.y), 9, palette.selected, palette.ground);

    const placement = new Placement(size.width, size.height);
    this.scale(camera, size, palette, placement);
    const near = (x: number, y: number, margin: number) =>
      x > -margin && y > -margin && x < size.width + margin && y < size.height + margin;
    // Marks first, then their texts: no text covers a mark.
    const robots = marks.robots
      .map((robot) => ({ robot, at: toScreen(camera, size, robot.x, robot.y) }))
      .filter(({ at }) => near(...at, 40));
    for (const { at: [x, y] } of robots) placement.take({ left: x - 9, top: y - 9, right: x + 9, bottom: y + 9 });
    if (marks.root) this.root(camera, size, marks.root, palette, placement);
    for (const { robot, at } of robots) this.robot(camera, robot, at, palette);
    for (const { robot, at } of robots) this.text(plain(robot.name, 30), at, 13, palette.text, palette, placement, true);
    for (const torn of marks.torn) {
      const ends = [toScreen(camera, size, torn.ax, torn.ay), toScreen(camera, size, torn.bx, torn.by)] as const;
      const seen = clipped(...ends[0], ...ends[1], size.width, size.height);
      if (!seen) continue;
      // Tiles have only closures of which they have an end.
      if (!torn.edge || !drawn(torn.edge)) this.closure(camera, size, torn, css(palette.torn), 2.5, true);
      this.text(torn.text, [(seen[0] + seen[2]) / 2, (seen[1] + seen[3]) / 2], 9, palette.torn, palette, placement, true);
    }
    for (const caption of marks.captions) {
      const at = toScreen(camera, size, caption.x, caption.y);
      if (near(...at, 200)) this.text(caption.text, at, 6, palette.text, palette, placement, true);
    }
    for (const { x, y, text } of marks.ends) {
      const at = toScreen(camera, size, x, y);
      this.ring(...at, 6, palette.text, palette.route);
      this.text(text, at, 9, palette.text, palette, placement, true);
    }
    for (const label of marks.labels) {
      const at = toScreen(camera, size, label.x, label.y);
      if (near(...at, 10)) this.label(label.text, at, palette, placement);
    }
    if (marks.crosshair) {
      context.strokeStyle = css(palette.text);
      context.lineWidth = 1.5;
      context.beginPath();
      const [x, y] = [size.width / 2, size.height / 2];
      for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]] as const) {
        context.moveTo(x + 5 * dx, y + 5 * dy);
        context.lineTo(x + 14 * dx, y + 14 * dy);
      }
      context.stroke();
    }
  }

  // A path is made once and drawn from wherever it is looked at. Strokes are in pixels: colour, width, dashes.
  private path(camera: Camera, size: Size, pixel: number, { x, y, path }: At & { path: Path2D }, strokes: Stroke[]) {
    const { context } = this;
    const cos = Math.cos(camera.turn) / camera.mpp;
    const sin = Math.sin(camera.turn) / camera.mpp;
    const [px, py] = toScreen(camera, size, x, y);
    context.setTransform(cos * pixel, -sin * pixel, -sin * pixel, -cos * pixel, px * pixel, py * pixel);
    for (const [colour, width, dashes = []] of strokes) {
      context.strokeStyle = css(colour);
      context.lineWidth = width * camera.mpp;
      context.setLineDash(dashes.map((length) => length * camera.mpp));
      context.stroke(path);
    }
    context.setLineDash([]);
    context.setTransform(pixel, 0, 0, pixel, 0, 0);
  }

  private closure(camera: Camera, size: Size, { ax, ay, bx, by }: Line, colour: string, width: number, dashed: boolean) {
    const { context } = this;
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dashed ? [8, 3] : []);
    context.beginPath();
    context.moveTo(...toScreen(camera, size, ax, ay));
    context.lineTo(...toScreen(camera, size, bx, by));
    context.stroke();
    context.setLineDash([]);
  }

  private ring(x: number, y: number, radius: number, colour: Palette['text'], ground: Palette['text']) {
    const { context } = this;
    for (const [stroke, width] of [[ground, 5], [colour, 2.5]] as const) {
      context.strokeStyle = css(stroke);
      context.lineWidth = width;
      context.beginPath();
      context.arc(x, y, radius, 0, 2 * Math.PI);
      context.stroke();
    }
  }

  private robot(camera: Camera, robot: RobotMark, [x, y]: [number, number], palette: Palette) {
    const { context } = this;
    context.save();
    context.translate(x, y);
    context.rotate(-(robot.heading + camera.turn));
    context.beginPath();
    context.moveTo(12, 0);
    context.lineTo(-8, 8);
    context.lineTo(-4, 0);
    context.lineTo(-8, -8);
    context.closePath();
    context.lineWidth = 4;
    context.strokeStyle = css(palette.ground);
    context.stroke();
    context.fillStyle = css(sessionColour(palette, robot.session));
    context.fill();
    context.lineWidth = 1.2;
    context.strokeStyle = css(palette.text);
    context.stroke();
    context.restore();
    if (robot.wrong) this.ring(x, y, 16, palette.torn, palette.ground);
    if (robot.followed) this.ring(x, y, 20, palette.text, palette.ground);
  }

  private root(camera: Camera, size: Size, root: NonNullable<Marks['root']>, palette: Palette, placement: Placement) {
    const { context } = this;
    const [x, y] = toScreen(camera, size, root.x, root.y);
    const up = root.heading + camera.turn;
    context.strokeStyle = css(palette.text);
    context.lineWidth = 2;
    context.beginPath();
    context.arc(x, y, 5, 0, 2 * Math.PI);
    context.moveTo(x + 5 * Math.cos(up), y - 5 * Math.sin(up));
    context.lineTo(x + 22 * Math.cos(up), y - 22 * Math.sin(up));
    for (const side of [-0.5, 0.5]) {
      context.moveTo(x + 22 * Math.cos(up), y - 22 * Math.sin(up));
      context.lineTo(x + 22 * Math.cos(up) - 8 * Math.cos(up + side), y - 22 * Math.sin(up) + 8 * Math.sin(up + side));
    }
    context.stroke();
    this.text(root.text, [x, y], 10, palette.text, palette, placement, true);
  }

  private label(text: string, [x, y]: [number, number], palette: Palette, placement: Placement) {
    const { context } = this;
    context.fillStyle = css(palette.text);
    context.beginPath();
    context.arc(x, y, 3, 0, 2 * Math.PI);
    context.fill();
    this.text(plain(text, 30), [x, y], 7, palette.text, palette, placement, false);
  }

  private text(
    text: string, [x, y]: [number, number], away: number, colour: Palette['text'], palette: Palette, placement: Placement,
    strong: boolean,
  ) {
    const { context } = this;
    const place = placement.place({ x, y, width: this.width(text) + 4, height: line, away });
    if (!place) return;
    context.lineWidth = strong ? 5 : 3.5;
    context.strokeStyle = css(palette.ground, 0.9);
    context.strokeText(text, place.left + 2, place.top + 2);
    context.fillStyle = css(colour);
    context.fillText(text, place.left + 2, place.top + 2);
  }
  private width(text: string): number {
    let width = this.widths.get(text);
    if (width === undefined) {
      if (this.widths.size > 5000) this.widths.clear();
      this.widths.set(text, (width = this.context.measureText(text).width));
    }
    return width;
  }

  private scale(camera: Camera, size: Size, palette: Palette, placement: Placement) {
    const { context } = this;
    const bar = scaleBar(camera.mpp, 140);
    const x = size.width - 64 - bar.pixels;
    const y = size.height - 14;
    context.strokeStyle = css(palette.text);
    context.lineWidth = 1.5;
    context.beginPath();
    context.moveTo(x, y - 5);
    context.lineTo(x, y);
    context.lineTo(x + bar.pixels, y);
    context.lineTo(x + bar.pixels, y - 5);
    context.stroke();
    const text = metres(bar.metres);
    context.fillStyle = css(palette.text);
    context.fillText(text, x + (bar.pixels - this.width(text)) / 2, y - 21);
    placement.take({ left: x - 4, top: y - 24, right: x + bar.pixels + 4, bottom: size.height });
  }
}
