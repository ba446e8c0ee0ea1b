// Where texts stand beside what they name, so that none covers another: in the order of their importance, each at the
// first of four places where there is room, or nowhere.
export interface Text {
  x: number; // pixels, of what is named
  y: number;
  width: number; // of the text
  height: number;
  away: number; // from what is named
}
export interface Placed {
  left: number;
  top: number;
}
interface Taken {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

const cell = 64; // pixels

export class Placement {
  private cells = new Map<number, Taken[]>();
  constructor(
    private readonly width: number,
    private readonly height: number,
  ) {}

  // Takes the place, if there is one.
  place(text: Text): Placed | null {
    if (text.x < -text.away || text.y < -text.away || text.x > this.width + text.away || text.y > this.height + text.away)
      return null;
    const { x, y, width, height, away } = text;
    const options: [number, number][] = [
      [x + away, y - height / 2],
      [x - away - width, y - height / 2],
      [x - width / 2, y - away - height],
      [x - width / 2, y + away],
    ];
    for (const [left, top] of options) {
      const box = { left, top, right: left + width, bottom: top + height };
      if (box.left < 0 || box.top < 0 || box.right > this.width || box.bottom > this.height || this.hits(box)) continue;
      this.take(box);
      return { left, top };
    }
    return null;
  }

  // What texts must not cover.
  take(box: Taken) {
    for (const key of this.keys(box)) {
      const list = this.cells.get(key);
      if (list) list.push(box);
      else this.cells.set(key, [box]);
    }
  }

  private hits(box: Taken): boolean {
    for (const key of this.keys(box))
      for (const taken of this.cells.get(key) ?? [])
        if (box.left < taken.right && taken.left < box.right && box.top < taken.bottom && taken.top < box.bottom)
          return true;
    return false;
  }

  private *keys(box: Taken): Iterable<number> {
    for (let x = Math.floor(box.left / cell); x <= Math.floor(box.right / cell); x++)
      for (let y = Math.floor(box.top / cell); y <= Math.floor(box.bottom / cell); y++) yield x * 100_000 + y;
  }
}

// A round length for the bar of the scale, at most so many pixels long.
export function scaleBar(mpp: number, most: number): { metres: number; pixels: number } {
  const longest = mpp * most;
  const power = 10 ** Math.floor(Math.log10(longest));
  const metres = [5, 2, 1].map((step) => step * power).find((length) => length <= longest) ?? power;
  return { metres, pixels: metres / mpp };
}

// The part of a segment that lies within the picture; null: none does.
export function clipped(
  ax: number, ay: number, bx: number, by: number, width: number, height: number,
): [number, number, number, number] | null {
  let from = 0;
  let to = 1;
  const dx = bx - ax;
  const dy = by - ay;
  for (const [way, room] of [[-dx, ax], [dx, width - ax], [-dy, ay], [dy, height - ay]] as const) {
    if (way === 0 && room < 0) return null;
    if (way < 0) from = Math.max(from, room / way);
    if (way > 0) to = Math.min(to, room / way);
  }
  return from > to ? null : [ax + from * dx, ay + from * dy, ax + to * dx, ay + to * dy];
}
