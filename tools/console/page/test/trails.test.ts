import assert from 'node:assert/strict';
import { test } from 'node:test';
import { after, stepOf, Trails, type Fresh } from '../src/map/trails';

const quarter = Math.SQRT1_2;
const place = (frame: string, x: number, y: number, heading = 0) => ({ frame, part: 0, x, y, heading });
const fresh = (index: number, timeMs = index * 1000): Fresh => ({
  session: 3, index, timeMs, step: { forward: 1, right: 0, turn: 0 }, guess: false,
});

test('a camera that turns right turns clockwise on the map', () => {
  // About y, which points down: right.
  const step = stepOf({ x: 2, z: 5 }, { w: quarter, x: 0, y: quarter, z: 0 });
  assert.ok(Math.abs(step.turn + Math.PI / 2) < 1e-9);
  const there = after({ x: 10, y: 20, heading: Math.PI / 2 }, step);
  assert.ok(Math.abs(there.x - 12) < 1e-9 && Math.abs(there.y - 25) < 1e-9 && Math.abs(there.heading) < 1e-9);
  assert.ok(Math.abs(stepOf({ x: 0, z: 1 }, { w: 1, x: 0, y: 0, z: 0 }).turn) < 1e-9);
});
test('new frames continue from the last one that is laid out', () => {
  const trails = new Trails();
  trails.add([fresh(10), fresh(11)]);
  assert.equal(trails.head(3), null);
  assert.deepEqual(trails.asked(), ['3:9', '3:10', '3:11']);
  trails.lay([place('3:9', 5, 5), null, null], 11_000);
  assert.equal(trails.head(3)!.place.x, 7);
  trails.add([fresh(12)]);
  assert.equal(trails.head(3)!.place.x, 8);
  assert.equal(trails.fresh, 3);
});
test('a new layout takes over what it has', () => {
  const trails = new Trails();
  trails.add([fresh(10), fresh(11), fresh(12)]);
  trails.lay([place('3:9', 0, 0), place('3:10', 100, 0), place('3:11', 101, 0), null], 12_000);
  assert.equal(trails.head(3)!.place.x, 102);
  assert.equal(trails.fresh, 1);
  // Old points that the layout has are drawn with it.
  trails.lay([null, place('3:10', 100, 0), place('3:11', 101, 0), place('3:12', 103, 0)], 200_000);
  assert.deepEqual(trails.points(3).map(({ index }) => index), [12]);
  trails.add([fresh(13)]);
  assert.equal(trails.head(3)!.place.x, 104);
});
test('what nothing joins has no place, and what is told twice counts once', () => {
  const trails = new Trails();
  trails.add([fresh(10), { ...fresh(11), step: null }, fresh(12)]);
  trails.lay([place('3:9', 0, 0), null, null, null], 0);
  assert.equal(trails.head(3)!.index, 10);
  trails.add([fresh(12), fresh(11)]);
  assert.equal(trails.points(3).length, 3);
  trails.remove(3, 11);
  assert.equal(trails.points(3).length, 1);
  trails.remove(3);
  assert.equal(trails.asked().length, 0);
});
