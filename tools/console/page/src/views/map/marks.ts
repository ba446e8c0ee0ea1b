// What lies over the lines, put together from what is known.
import { count } from '../../lib/format';
import type { FramePlace, Part, Torn } from '../../map/layout';
import type { Caption, LabelMark, LooseClosure, Marks, RouteMark, Trail } from '../../map/overlay';
import type { Pose, Trails } from '../../map/trails';
import type { Edge } from '../../proto/relmap/v1/graph_pb';
import type { RobotRow } from '../fleet/trouble';
import type { Loose } from './events';
import type { AllLayers } from './shown';

export interface Known {
  place: (frame: string) => FramePlace | null;
  layers: AllLayers;
  past: boolean; // what is shown is of an earlier time
  rows: RobotRow[];
  followed: string;
  head: (session: number) => Pose | null;
  trails: Trails;
  labelled: ReadonlyMap<string, string[]>;
  torn: Torn[];
  parts: Part[];
  loose: Iterable<Loose>;
  frame: string;
  edge: Edge | null;
  root: string;
  routes: RouteMark[];
  ends: [from: string, to: string] | null; // of the route
  crosshair: boolean;
}

const trailMs = 60_000;
const namedParts = 30;

export function makeMarks(known: Known): Marks {
  const { place, layers } = known;
  const nowadays = layers.robots && !known.past;
  const robots = nowadays
    ? known.rows.flatMap(({ robot, troubles }) => {
        const head = robot.session ? known.head(robot.session) : null;
        if (!head) return [];
        const name = robot.robot || robot.name || `session ${robot.session}`;
        return [{ ...head, name, session: robot.session, wrong: troubles.length > 0, followed: robot.robot === known.followed && !!robot.robot }];
      })
    : [];
  const labels = layers.labels
    ? [...known.labelled].flatMap(([frame, texts]) => {
        const at = place(frame);
        return at ? [{ x: at.x, y: at.y, text: texts.join(', ') }] : [];
      })
    : [];
  const torn = layers.torn
    ? known.torn.flatMap(({ edge, a, b, sigmas }) => {
        const [from, to] = [place(a), place(b)];
        return from && to ? [{ ax: from.x, ay: from.y, bx: to.x, by: to.y, edge, text: `${sigmas.toFixed(1)} σ` }] : [];
      })
    : [];
  const frame = known.frame ? place(known.frame) : null;
  const root = known.root ? place(known.root) : null;
  return {
    robots,
    labels,
    torn,
    captions: captions(known.parts),
    trails: nowadays ? trails(known.trails) : [],
    closures: loose(known),
    frame,
    closure: closure(known),
    root: root ? { ...root, text: `drawn from ${known.root}` } : null,
    routes: known.routes,
    ends: ends(known),
    crosshair: known.crosshair,
  };
}

function closure({ edge, place }: Known): Marks['closure'] {
  if (!edge?.a || !edge.b) return null;
  const a = place(`${edge.a.session}:${edge.a.index}`);
  const b = place(`${edge.b.session}:${edge.b.index}`);
  return a && b ? { ax: a.x, ay: a.y, bx: b.x, by: b.y } : null;
}

function ends({ ends, routes, place }: Known): LabelMark[] {
  if (!routes.length || !ends) return [];
  return ends.flatMap((frame, i) => {
    const at = place(frame);
    return at ? [{ x: at.x, y: at.y, text: i ? 'goal' : 'start' }] : [];
  });
}

const stateNames = ['', 'candidate', 'accepted', 'quarantined', 'removed'] as const;

function loose({ loose, place, layers }: Known): LooseClosure[] {
  return [...loose].flatMap(({ a, b, state }) => {
    const name = stateNames[state];
    const [from, to] = [place(a), place(b)];
    return name && layers[name] && from && to ? [{ ax: from.x, ay: from.y, bx: to.x, by: to.y, state: name }] : [];
  });
}

// Pieces that nothing connects stand side by side, at places without a meaning.
function captions(parts: Part[]): Caption[] {
  if (parts.length < 2) return [];
  return parts.slice(0, namedParts).map(({ box, frames }, i) => ({
    x: (box[0] + box[2]) / 2,
    y: box[3],
    text: `part ${i + 1} · ${count(frames)} frames`,
  }));
}

// Frames that the layout does not have, and those of the last minute.
function trails(all: Trails): Trail[] {
  const made: Trail[] = [];
  for (const [session, points] of all.all) {
    const newest = points.at(-1)?.timeMs ?? 0;
    let path: Path2D | null = null;
    let origin = { x: 0, y: 0 };
    let before: Pose | null = null;
    for (const { place, laidOut, timeMs } of points) {
      if (place && (!laidOut || timeMs > newest - trailMs)) {
        if (!path) {
          path = new Path2D();
          origin = place;
          made.push({ x: place.x, y: place.y, path, session });
          if (before) {
            path.moveTo(before.x - origin.x, before.y - origin.y);
            path.lineTo(0, 0);
          } else path.moveTo(0, 0);
        } else if (before) path.lineTo(place.x - origin.x, place.y - origin.y);
        else path.moveTo(place.x - origin.x, place.y - origin.y);
      }
      before = place;
    }
  }
  return made;
}
