import assert from 'node:assert/strict';
import test from 'node:test';
import { create } from '@bufbuild/protobuf';
import { EdgeKind } from '../src/proto/relmap/v1/graph_pb';
import { FindRouteReplySchema, RouteStepSchema, RouteSummarySchema, type RouteStep } from '../src/proto/relmap/v1/map_pb';
import { notable, planOf, profileOf, sdOf, sharedWords, spaced, stretchesOf, ticksOf, warningsOf, wayWords, withReply } from '../src/views/place/route';

const step = (index: number, more: Record<string, unknown> = {}): RouteStep => {
  const upper = Array<number>(21).fill(0);
  upper[0] = index * 0.01;
  return create(RouteStepSchema, {
    frame: { session: 1, index },
    distanceM: index * 2,
    kind: EdgeKind.ODOMETRY,
    edge: { frame: { session: 1, index: index + 1 }, ordinal: 0 },
    startFromThis: { translation: { x: index, y: 0, z: 2 * index } },
    covariance: { upper },
    ...more,
  });
};
const steps = Array.from({ length: 101 }, (_, index) => step(index));

test('messages become routes, whatever comes first', () => {
  const summary = create(RouteSummarySchema, { distanceM: 10 });
  let routes = withReply([], create(FindRouteReplySchema, { steps: [step(1)] }));
  assert.deepEqual(routes, []);
  routes = withReply([], create(FindRouteReplySchema, { summary, steps: [step(0), step(1)] }));
  routes = withReply(routes, create(FindRouteReplySchema, { steps: [step(2)] }));
  routes = withReply(routes, create(FindRouteReplySchema, { route: 1, summary, steps: [step(0)] }));
  assert.deepEqual(routes.map((route) => route.steps.length), [3, 1]);
});

test('the profile keeps the most uncertain of each part', () => {
  const profile = profileOf(steps, 10);
  assert.equal(profile.sd.length, 10);
  assert.ok(Math.abs(profile.most - 1) < 1e-9);
  assert.equal(profile.length, 200);
  assert.equal(profile.step.at(-1), 100);
  assert.equal(sdOf(create(RouteStepSchema, {})), -1);
  assert.equal(profileOf([], 10).sd.length, 0);
});

test('axes have round values', () => {
  assert.deepEqual(ticksOf(0.37), [0, 0.1, 0.2, 0.3, 0.4]);
  assert.deepEqual(ticksOf(200), [0, 50, 100, 150, 200]);
  assert.deepEqual(ticksOf(0), [0, 1]);
});

test('the plan is seen from above, and keeps both ends', () => {
  const plan = planOf(steps, 10);
  assert.deepEqual([plan[0]!.step, plan.at(-1)!.step], [0, 100]);
  assert.equal(plan.at(-1)!.y, -200);
});

test('thumbnails are spaced evenly by distance', () => {
  assert.deepEqual(spaced(steps, 5), [0, 25, 50, 75, 100]);
  assert.deepEqual(spaced(steps.slice(0, 3), 5), [0, 1, 2]);
  const standing = Array.from({ length: 50 }, (_, index) => step(index, { distanceM: index < 40 ? 0 : index }));
  assert.equal(spaced(standing, 5).at(-1), 49);
});

test('what is notable: ends, labels, closures, changes of session', () => {
  const some = [step(0), step(1), step(2, { labels: ['kitchen'] }), step(3), step(4, { kind: EdgeKind.LOOP }), step(5), step(6), step(7)];
  assert.deepEqual(notable(some), [0, 2, 4, 5, 7]);
  assert.equal(wayWords(step(1, { kind: EdgeKind.LOOP, longLoop: true, unmeasured: true })), 'across a closure longer than 5 m: assumed to be passable, a guess');
});

test('stretches are joined', () => {
  const some = [step(0), step(1, { carried: true }), step(2, { carried: true }), step(3), step(4, { carried: true })];
  assert.deepEqual(stretchesOf(some, (each) => each.carried), [{ from: 2, to: 6 }]);
});

test('what must be known is warned of', () => {
  assert.deepEqual(warningsOf(create(RouteSummarySchema, {})), []);
  const warnings = warningsOf(create(RouteSummarySchema, {
    longLoops: 1, unmeasuredSteps: 2, unmeasuredM: 3,
    carried: [{ first: { session: 1, index: 2 }, last: { session: 1, index: 4 } }],
    unmeasured: [{ first: { session: 1, index: 7 }, last: { session: 1, index: 9 } }],
  }));
  assert.match(warnings[0]!, /carried .* 1:2 to 1:4/);
  assert.match(warnings[1]!, /2 steps, 3.0 m of the way, are a guess/);
  assert.match(warnings[2]!, /1 closure longer/);
  assert.equal(sharedWords(create(RouteSummarySchema, { shared: 0.42 }), 1), '42 % shared with those before');
});
