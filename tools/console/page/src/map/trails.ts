// Where robots have driven since the layout was made: their newest frames, joined to the last frame whose place the
// layout knows by the motion that the daemon told with them.
import type { FramePlace } from './layout';

export interface Step {
  // p_previous = T p_this; null: nothing joins it to the frame before.
  forward: number; // metres along the previous camera's view
  right: number;
  turn: number; // radians, counter-clockwise seen from above
}
export interface Fresh {
  session: number;
  index: number;
  timeMs: number;
  step: Step | null;
  guess: boolean;
}
export interface Pose {
  x: number;
  y: number;
  heading: number;
}
export interface Point extends Fresh {
  place: Pose | null;
  laidOut: boolean; // the place is the layout's
}

// A camera looks along z, has x on its right and y below it. Seen from above only the turn about y remains.
export function stepOf(
  translation: { x: number; z: number },
  rotation: { w: number; x: number; y: number; z: number },
): Step {
  const { w, x, y, z } = rotation;
  // The image of the view's direction (0, 0, 1).
  const right = 2 * (x * z + w * y);
  const forward = 1 - 2 * (x * x + y * y);
  return { forward: translation.z, right: translation.x, turn: -Math.atan2(right, forward) };
}

export function after(pose: Pose, step: Step): Pose {
  const cos = Math.cos(pose.heading);
  const sin = Math.sin(pose.heading);
  return {
    x: pose.x + step.forward * cos + step.right * sin,
    y: pose.y + step.forward * sin - step.right * cos,
    heading: pose.heading + step.turn,
  };
}

const most = 4000; // points of a session
const keepMs = 60_000; // points that the layout has stay so long, as the trail of the last minute

export class Trails {
  private sessions = new Map<number, { base: { index: number; place: Pose } | null; points: Point[] }>();

  add(frames: readonly Fresh[]) {
    for (const frame of frames) {
      let trail = this.sessions.get(frame.session);
      if (!trail) this.sessions.set(frame.session, (trail = { base: null, points: [] }));
      const last = trail.points.at(-1);
      // Told twice, or from before.
      if (last && frame.index <= last.index) continue;
      trail.points.push({ ...frame, place: null, laidOut: false });
      if (trail.points.length > most) trail.points.splice(0, trail.points.length - most);
      this.chain(trail);
    }
  }

  remove(session: number, first = 0) {
    const trail = this.sessions.get(session);
    if (!trail) return;
    trail.points = trail.points.filter((point) => point.index < first);
    if (!trail.points.length) this.sessions.delete(session);
  }
  clear() {
    this.sessions.clear();
  }

  // The frames whose places in the layout are needed: those of the trails, and the one before each.
  asked(): string[] {
    const frames: string[] = [];
    for (const [session, { points }] of this.sessions) {
      if (points.length && points[0]!.index > 0) frames.push(`${session}:${points[0]!.index - 1}`);
      for (const point of points) frames.push(`${session}:${point.index}`);
    }
    return frames.slice(0, 10_000);
  }

  // The places of frames in the layout that is drawn now.
  lay(places: readonly (FramePlace | null)[], nowMs: number) {
    const known = new Map(places.filter((place) => place !== null).map((place) => [place.frame, place]));
    for (const [session, trail] of this.sessions) {
      const before = trail.points[0] ? known.get(`${session}:${trail.points[0].index - 1}`) : undefined;
      trail.base = before ? { index: trail.points[0]!.index - 1, place: before } : null;
      for (const point of trail.points) {
        const place = known.get(`${session}:${point.index}`);
        point.laidOut = !!place;
        point.place = place ?? null;
      }
      // What is old and has its place in the layout is drawn with it.
      let gone = 0;
      while (gone < trail.points.length - 1 && trail.points[gone]!.laidOut && trail.points[gone]!.timeMs < nowMs - keepMs)
        gone++;
      if (gone) trail.points.splice(0, gone);
      this.chain(trail);
    }
  }

  private chain(trail: { base: { index: number; place: Pose } | null; points: Point[] }) {
    let place: Pose | null = trail.base?.place ?? null;
    for (const point of trail.points) {
      if (!point.laidOut) point.place = place && point.step ? after(place, point.step) : null;
      place = point.place;
    }
  }

  points(session: number): readonly Point[] {
    return this.sessions.get(session)?.points ?? [];
  }
  // The newest frame with a place.
  head(session: number): (Point & { place: Pose }) | null {
    const points = this.points(session);
    for (let i = points.length - 1; i >= 0; i--) if (points[i]!.place) return points[i] as Point & { place: Pose };
    return null;
  }
  get all(): Iterable<[number, readonly Point[]]> {
    return [...this.sessions].map(([session, { points }]) => [session, points] as [number, readonly Point[]]);
  }
  // Frames that the layout does not have yet.
  get fresh(): number {
    let count = 0;
    for (const { points } of this.sessions.values()) for (const point of points) if (!point.laidOut) count++;
    return count;
  }
}
