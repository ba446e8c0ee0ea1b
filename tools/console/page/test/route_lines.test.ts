import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { FramePlace } from '../src/map/layout';
import type { Route } from '../src/views/place/route';
import { framesOf, parseRoute, runsOf } from '../src/views/map/route_lines';

const route = (steps: number) =>
  ({ steps: Array.from({ length: steps }, (_, index) => ({ frame: { session: 1, index } })) }) as unknown as Route;

test('a route in the address has two frames', () => {
  assert.deepEqual(parseRoute('6:10,6:120'), ['6:10', '6:120']);
  for (const text of [null, '', '6:10', '6:10,', '6:10,stairs', '6:1,6:2,6:3', '6:1,6:4294967296']) assert.equal(parseRoute(text), null);
});

test('a route is drawn through all its frames, a long one through as many as are asked for at once', () => {
  assert.deepEqual(framesOf([route(3)]), [['1:0', '1:1', '1:2']]);
  assert.deepEqual(framesOf([]), []);
  for (const steps of [9_999, 10_000, 10_001, 123_457]) {
    const drawn = framesOf([route(steps), route(steps), route(7)]);
    assert.ok(drawn.flat().length <= 10_000);
    assert.ok(drawn[0]!.length > 1500);
    for (const [i, length] of [steps, steps, 7].entries()) assert.deepEqual([drawn[i]![0], drawn[i]!.at(-1)], ['1:0', `1:${length - 1}`]);
    assert.equal(drawn[2]!.length, 7);
  }
});

test('no line is drawn across what the layout does not have, nor from one part to another', () => {
  const place = (frame: string): FramePlace | null => {
    const index = Number(frame.split(':')[1]);
    return index === 2 ? null : { frame, part: index < 5 ? 0 : 1, x: index, y: 0, heading: 0 };
  };
  const runs = runsOf(['1:0', '1:1', '1:2', '1:3', '1:4', '1:5', '1:6'], place);
  assert.deepEqual(runs.map((run) => run.map(({ x }) => x)), [[0, 1], [3, 4], [5, 6]]);
  assert.deepEqual(runsOf([], place), []);
});
