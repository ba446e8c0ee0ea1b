import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  around, between, cameraText, fit, fromRelative, headingUp, pan, parseCamera, relativeTo, toScreen, toWorld, zoomAt,
  type Camera,
} from '../src/map/camera';

const size = { width: 800, height: 600 };
const camera: Camera = { x: 100, y: -50, mpp: 0.25, turn: 0.7 };
function near(one: readonly number[], other: readonly number[], within = 1e-6) {
  one.forEach((value, i) => assert.ok(Math.abs(value - other[i]!) < within, `${one} is not ${other}`));
}

test('the middle of the picture is the camera; up is y', () => {
  near(toScreen({ ...camera, turn: 0 }, size, 100, -50), [400, 300]);
  near(toScreen({ ...camera, turn: 0 }, size, 110, -40), [440, 260]);
});
test('screen and world are each other’s inverse', () => {
  for (const [px, py] of [[0, 0], [123, 456], [799, 1]] as const) near(toScreen(camera, size, ...toWorld(camera, size, px, py)), [px, py]);
});
test('what was under the pointer stays under it', () => {
  const before = toWorld(camera, size, 200, 100);
  near(toWorld(pan(camera, 30, -70), size, 230, 30), before);
  near(toWorld(zoomAt(camera, size, 200, 100, 3), size, 200, 100), before);
  assert.ok(zoomAt(camera, size, 0, 0, 1e9).mpp > 0);
});
test('all of a box fits, also when the picture is turned', () => {
  const box = [-10, 5, 90, 25] as [number, number, number, number];
  for (const turn of [0, 0.5, 2]) {
    const fitted = fit(box, size, 20, turn);
    for (const [x, y] of [[-10, 5], [90, 5], [90, 25], [-10, 25]] as const) {
      const [px, py] = toScreen(fitted, size, x, y);
      assert.ok(px >= 19.9 && px <= 780.1 && py >= 19.9 && py <= 580.1);
    }
  }
  assert.ok(fit([3, 3, 3, 3], size).mpp > 0);
  assert.deepEqual(around([{ x: 1, y: 5 }, { x: -2, y: 7 }]), [-2, 5, 1, 7]);
});
test('the heading of the root is up', () => {
  for (const heading of [0, 1, -2.5]) {
    const turned = { x: 0, y: 0, mpp: 1, turn: headingUp(heading) };
    const [px, py] = toScreen(turned, size, Math.cos(heading), Math.sin(heading));
    near([px, py], [400, 299]);
  }
});
test('a view from a frame is the same view after the frame has moved', () => {
  const place = { x: 10, y: 20, heading: 0.4 };
  near(Object.values(fromRelative(place, relativeTo(place, camera))), Object.values(camera));
  const moved = { x: -7, y: 3, heading: 1.9 };
  const after = fromRelative(moved, relativeTo(place, camera));
  near(toScreen(after, size, moved.x, moved.y), toScreen(camera, size, place.x, place.y));
  const there = relativeTo(place, { ...camera, x: 10, y: 20, turn: headingUp(0.4) });
  near([there.x, there.y, there.turn], [0, 0, 0]);
});
test('a flight begins and ends where it should, and turns the shorter way', () => {
  const to = { x: 0, y: 0, mpp: 25, turn: -3 };
  near(Object.values(between(camera, to, 0)), Object.values(camera));
  near(Object.values(between({ ...camera, turn: 3 }, to, 1)).slice(0, 3), [0, 0, 25]);
  assert.ok(Math.abs(between({ ...camera, turn: 3 }, to, 0.5).turn) > 3);
});
test('the address holds the picture', () => {
  const read = parseCamera(cameraText(camera))!;
  near([read.x, read.y, read.mpp, read.turn], [100, -50, 0.25, 0.7], 0.01);
  assert.equal(cameraText({ x: 1.23456789, y: 2, mpp: 1, turn: 0 }), '1.2,2,1');
  for (const bad of [null, '', '1,2', '1,2,x', '1,2,0', '1,2,-1', '1,2,3,4,5', '1,2,1e9', 'NaN,0,1']) assert.equal(parseCamera(bad), null);
});
