import assert from 'node:assert/strict';
import test from 'node:test';
import { align, apply, layoutPair, nearest, pathsOf, residualClass, type Match } from '../src/lib/matches';

const frame = { width: 400, height: 300, scale: 0.5 };
const view = { width: 800, height: 600, scale: 1 };
const match = (u: number, v: number, frameU: number, frameV: number, inlier = true, residual?: number): Match => ({
  u, v, frameU, frameV, inlier, ...(residual === undefined ? {} : { residual }),
});

test('points lie on their pictures, whatever the sizes and scales', () => {
  const layout = layoutPair(frame, view, [match(400, 300, 400, 300)], false, 'place');
  assert.equal(layout.view.enlarged, 0.5);
  assert.equal(layout.width, 400 + 8 + 400);
  assert.deepEqual(layout.matches[0]!.frame, { x: 200, y: 150 });
  assert.deepEqual(layout.matches[0]!.view, { x: 408 + 200, y: 150 });
  const stacked = layoutPair(frame, view, [match(400, 300, 400, 300)], true, 'place');
  assert.equal(stacked.height, 300 + 8 + 300);
  assert.deepEqual(stacked.matches[0]!.view, { x: 200, y: 308 + 150 });
});

test('points outside a picture are left out', () => {
  const layout = layoutPair(frame, view, [match(900, 10, 10, 10), match(10, 10, 10, 10)], false, 'place');
  assert.deepEqual(layout.matches.map((each) => each.index), [1]);
});

test('residuals have classes, and one that is not known has its own', () => {
  assert.deepEqual([0.2, 1.5, 3, 9].map((residual) => residualClass(match(0, 0, 0, 0, true, residual))), [0, 1, 2, 3]);
  assert.equal(residualClass(match(0, 0, 0, 0)), 4);
});

test('what does not agree is drawn below, with crosses', () => {
  const layout = layoutPair(frame, view, [match(1, 1, 1, 1, true, 1), match(9, 9, 9, 9, false, 1)], false, 'residual');
  const paths = pathsOf(layout.matches, 3);
  assert.deepEqual(paths.map((each) => each.inlier), [false, true]);
  assert.ok(!paths[0]!.marks.includes('a'));
  assert.ok(paths[1]!.marks.includes('a'));
});

test('the nearest match is found at either end', () => {
  const layout = layoutPair(frame, view, [match(100, 100, 100, 100), match(700, 500, 700, 500)], false, 'place');
  assert.equal(nearest(layout.matches, { x: 52, y: 51 }, 5)!.index, 0);
  assert.equal(nearest(layout.matches, { x: 408 + 351, y: 250 }, 5)!.index, 1);
  assert.equal(nearest(layout.matches, { x: 200, y: 10 }, 5), null);
});

test('matched points come together, in spite of some that are wrong', () => {
  const truth = { a: 0.4, b: 0.1, e: 30, f: -20, aligned: true };
  const matches: Match[] = [];
  for (let i = 0; i < 40; ++i) {
    const from = { x: (i * 97) % 800, y: (i * 61) % 600 };
    const to = apply(truth, from);
    matches.push(match(from.x, from.y, (to.x + (i % 10 ? 0 : 60)) / frame.scale, to.y / frame.scale));
  }
  const found = align(frame, view, matches);
  assert.ok(found.aligned);
  const at = apply(found, { x: 400, y: 300 });
  const should = apply(truth, { x: 400, y: 300 });
  assert.ok(Math.hypot(at.x - should.x, at.y - should.y) < 1);
});

test('without enough points the view is only scaled', () => {
  assert.deepEqual(align(frame, view, [match(1, 1, 2, 2)]), { a: 0.5, b: 0, e: 0, f: 0, aligned: false });
  const same = Array.from({ length: 9 }, () => match(5, 5, 7, 7));
  assert.equal(align(frame, view, same).aligned, false);
});
