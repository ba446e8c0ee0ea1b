// Routes as they come, message by message, and what is drawn of them.
import type { FindRouteReply, RouteStep, RouteSummary } from '../../proto/relmap/v1/map_pb';
import { EdgeKind } from '../../proto/relmap/v1/graph_pb';
import { counted, metres, seconds } from '../../lib/format';
import { frameText } from '../../lib/ids';

export interface Route {
  summary: RouteSummary;
  steps: RouteStep[];
}

// The routes after one more message. Steps are appended to what is there.
export function withReply(routes: Route[], reply: FindRouteReply): Route[] {
  const at = reply.route;
  const known = routes[at];
  if (!known && !reply.summary) return routes; // without its summary nothing is known of it
  const next = [...routes];
  next[at] = known ? { ...known, steps: known.steps.concat(reply.steps) } : { summary: reply.summary!, steps: reply.steps };
  return next;
}

// ---- In words

// What whoever follows the route must know, the gravest first.
export function warningsOf(summary: RouteSummary): string[] {
  const stretch = (each: { first?: { session: number; index: number } | undefined; last?: { session: number; index: number } | undefined }) =>
    `${frameText(each.first)} to ${frameText(each.last)}`;
  const warnings: string[] = [];
  if (summary.carried.length)
    warnings.push(
      `The robot that drove there was carried (by a lift, a train) along ${summary.carried.map(stretch).join(', ')}. ` +
        'Whoever follows needs to be carried, too.',
    );
  if (summary.unmeasuredSteps)
    warnings.push(
      `${counted(summary.unmeasuredSteps, 'step')}, ${metres(summary.unmeasuredM)} of the way, ${summary.unmeasuredSteps === 1 ? 'is' : 'are'} ` +
        `a guess: nothing measured how the robot moved there (${summary.unmeasured.slice(0, 3).map(stretch).join(', ')}${summary.unmeasured.length > 3 ? ', …' : ''}).`,
    );
  if (summary.longLoops)
    warnings.push(
      `${counted(summary.longLoops, 'closure')} longer than 5 m ${summary.longLoops === 1 ? 'is' : 'are'} on the way: nobody drove ` +
        'there, and it is only assumed to be passable. You can avoid these below.',
    );
  if (summary.noWayByEdges)
    warnings.push('No way leads there by edges alone. This one uses closures that only bind landmarks.');
  return warnings;
}

export function summaryWords(summary: RouteSummary): string {
  return `${metres(summary.distanceM)}, ${seconds(summary.timeS)} of driving, ${counted(summary.steps, 'step')}`;
}

export function sharedWords(summary: RouteSummary, index: number): string {
  if (index === 0) return 'the best';
  return summary.shared < 0.005 ? 'quite another way' : `${Math.round(summary.shared * 100)} % shared with those before`;
}

// ---- The profile of uncertainty

export interface Profile {
  distance: number[]; // metres from the start
  sd: number[]; // metres: of the position relative to the start
  step: number[]; // indices of steps
  most: number; // of the sd
  length: number;
}

// At most `points` of them: of each part the most uncertain.
export function profileOf(steps: RouteStep[], points = 500): Profile {
  const profile: Profile = { distance: [], sd: [], step: [], most: 0, length: steps.at(-1)?.distanceM ?? 0 };
  const each = Math.max(1, Math.ceil(steps.length / points));
  for (let first = 0; first < steps.length; first += each) {
    let best = -1;
    let most = -1;
    for (let at = first; at < Math.min(first + each, steps.length); ++at) {
      const sd = sdOf(steps[at]!);
      if (sd > most) [best, most] = [at, sd];
    }
    if (best < 0) continue;
    profile.distance.push(steps[best]!.distanceM);
    profile.sd.push(most);
    profile.step.push(best);
    profile.most = Math.max(profile.most, most);
  }
  return profile;
}

// Standard deviation of where the step is, seen from the start, in metres: of the length of the error. -1: not known.
export function sdOf(step: RouteStep): number {
  const upper = step.covariance?.upper;
  if (upper?.length !== 21) return step.startFromThis ? 0 : -1;
  return Math.sqrt(Math.max(0, upper[0]! + upper[6]! + upper[11]!));
}

// Round values for an axis from 0 to at least `most`.
export function ticksOf(most: number, about = 4): number[] {
  if (!(most > 0)) return [0, 1];
  const rough = most / about;
  const power = 10 ** Math.floor(Math.log10(rough));
  const each = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough)!;
  const ticks = [];
  for (let at = 0; at <= Math.ceil(most / each - 1e-9); ++at) ticks.push(Number((at * each).toPrecision(12)));
  return ticks;
}

// Stretches of the way with a property of their steps, in metres.
export function stretchesOf(steps: RouteStep[], has: (step: RouteStep) => boolean): { from: number; to: number }[] {
  const found: { from: number; to: number }[] = [];
  steps.forEach((step, at) => {
    const next = steps[at + 1];
    if (!next || !has(step)) return;
    const last = found.at(-1);
    if (last && last.to === step.distanceM) last.to = next.distanceM;
    else found.push({ from: step.distanceM, to: next.distanceM });
  });
  return found;
}

// ---- The plan: seen from above, in the start's coordinates (x right, z forward), y of the drawing down.

export interface PlanPoint {
  x: number;
  y: number;
  step: number;
}

export function planOf(steps: RouteStep[], points = 2000): PlanPoint[] {
  const each = Math.max(1, Math.ceil(steps.length / points));
  const plan: PlanPoint[] = [];
  steps.forEach((step, at) => {
    const where = step.startFromThis?.translation;
    if (where && (at % each === 0 || at === steps.length - 1)) plan.push({ x: where.x, y: -where.z, step: at });
  });
  return plan;
}

// ---- Steps to show

// So many steps, evenly spaced along the way, the first and the last among them.
export function spaced(steps: RouteStep[], most: number): number[] {
  if (steps.length <= most) return steps.map((_, at) => at);
  const length = steps.at(-1)!.distanceM;
  if (!(length > 0)) return Array.from({ length: most }, (_, at) => Math.round((at * (steps.length - 1)) / (most - 1)));
  const chosen: number[] = [];
  let at = 0;
  for (let i = 0; i < most; ++i) {
    const target = (i * length) / (most - 1);
    while (at < steps.length - 1 && Math.abs(steps[at + 1]!.distanceM - target) <= Math.abs(steps[at]!.distanceM - target)) ++at;
    if (chosen.at(-1) !== at) chosen.push(at);
  }
  return chosen;
}

// Steps at which something changes: ends, labels, another session, closures, what is a guess or carried.
export function notable(steps: RouteStep[]): number[] {
  const found: number[] = [];
  steps.forEach((step, at) => {
    const before = steps[at - 1];
    const turn = before && (before.carried !== step.carried || before.unmeasured !== step.unmeasured);
    const loop = step.kind === EdgeKind.LOOP || before?.kind === EdgeKind.LOOP;
    const session = before && before.frame?.session !== step.frame?.session;
    if (at === 0 || at === steps.length - 1 || step.labels.length || turn || loop || session) found.push(at);
  });
  return found;
}

// How one gets from a step to the next.
export function wayWords(step: RouteStep): string {
  const how =
    step.kind === EdgeKind.LOOP
      ? step.longLoop ? 'across a closure longer than 5 m: assumed to be passable' : 'across a closure'
      : step.kind === EdgeKind.PRIOR ? 'across a gap' : step.edge ? 'as the robot drove' : '';
  return [how, step.carried ? 'carried' : '', step.unmeasured ? 'a guess' : ''].filter(Boolean).join(', ');
}
