import assert from 'node:assert/strict';
import { test } from 'node:test';
import { inView } from '../src/map/in_view';
import { ageShare, palette, scaleColour, sdShare, sessionColour, sessionTable, type Rgb } from '../src/map/palette';
import { pickClosure, pickFrame, type PickRules } from '../src/map/pick';
import { clipped, Placement, scaleBar } from '../src/map/placement';
import { decodeTile } from '../src/map/tile';
import { layersText, parseColour, parseLayers, parseSessions, parseTime, timeText } from '../src/views/map/shown';
import { tileBytes } from './tile_bytes';

// Relative luminance, as WCAG has it.
function luminance(colour: Rgb): number {
  const [r, g, b] = colour.map((value) => (value / 255 <= 0.03928 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r! + 0.7152 * g! + 0.0722 * b!;
}
function contrast(one: Rgb, other: Rgb): number {
  const [high, low] = [luminance(one), luminance(other)].sort((a, b) => b - a);
  return (high! + 0.05) / (low! + 0.05);
}

test('texts do not cover each other', () => {
  const placement = new Placement(400, 300);
  const boxes: { left: number; top: number }[] = [];
  for (let i = 0; i < 60; i++) {
    const placed = placement.place({ x: 200 + (i % 7) * 9, y: 150 + (i % 5) * 7, width: 60, height: 17, away: 7 });
    if (placed) boxes.push(placed);
  }
  assert.ok(boxes.length >= 4);
  for (const one of boxes)
    for (const other of boxes)
      assert.ok(one === other || Math.abs(one.left - other.left) >= 60 || Math.abs(one.top - other.top) >= 17);
  for (const { left, top } of boxes) assert.ok(left >= 0 && top >= 0 && left + 60 <= 400 && top + 17 <= 300);
});
test('the first text gets the first place', () => {
  const placement = new Placement(400, 300);
  assert.deepEqual(placement.place({ x: 100, y: 100, width: 50, height: 16, away: 7 }), { left: 107, top: 92 });
  placement.take({ left: 300, top: 0, right: 400, bottom: 300 });
  assert.equal(placement.place({ x: 290, y: 100, width: 50, height: 16, away: 7 })!.left, 233);
  assert.equal(placement.place({ x: -50, y: 0, width: 5, height: 5, away: 1 }), null);
});
test('the bar of the scale is round and not too long', () => {
  for (let mpp = 1e-3; mpp < 1e4; mpp *= 1.7) {
    const { metres, pixels } = scaleBar(mpp, 140);
    assert.ok(pixels <= 140.001 && pixels > 50);
    assert.match(metres.toExponential(3), /^[125]\.000e/);
  }
});
test('segments are clipped to the picture', () => {
  assert.deepEqual(clipped(-10, 5, 20, 5, 10, 10), [0, 5, 10, 5]);
  assert.equal(clipped(-10, -5, 20, -5, 10, 10), null);
  assert.deepEqual(clipped(1, 1, 2, 2, 10, 10), [1, 1, 2, 2]);
});

test('the scale rises steadily in lightness, and stands out from the ground', () => {
  for (const dark of [false, true]) {
    const colours = palette(dark);
    let before = -1;
    for (let share = 0; share <= 1; share += 0.05) {
      const now = luminance(scaleColour(colours, share));
      assert.ok(now > before, `${dark} ${share}`);
      before = now;
      assert.ok(contrast(scaleColour(colours, share), colours.ground) > 2.3);
    }
    for (const session of [1, 2, 3, 9, 10, 11, 4095]) assert.ok(contrast(sessionColour(colours, session), colours.ground) >= 3);
    for (const colour of [colours.torn, colours.suspicious, colours.candidate, colours.quarantined, colours.guess])
      assert.ok(contrast(colour, colours.ground) >= 3);
  }
  assert.deepEqual(scaleColour(palette(true), -1), palette(true).scale[0]);
  assert.deepEqual(scaleColour(palette(true), 2), palette(true).scale.at(-1));
});
test('values lie on the scale where its legend says', () => {
  assert.equal(ageShare(0, 1e6), 1);
  assert.ok(Math.abs(ageShare(1e6, 1e6)) < 1e-9);
  assert.ok(ageShare(60, 1e6) - ageShare(3600, 1e6) > 0.2);
  assert.equal(sdShare(0.01), 0);
  assert.ok(Math.abs(sdShare(1) - 0.5) < 1e-9);
  assert.equal(sdShare(0), 0);
});
test('sessions that are not chosen are faint', () => {
  const table = sessionTable(palette(false), new Set([3]));
  assert.equal(table[3 * 4 + 3], 255);
  assert.equal(table[4 * 4 + 3], 50);
  assert.equal(sessionTable(palette(false), new Set())[4 * 4 + 3], 255);
});

const tile = decodeTile(tileBytes({
  runs: [[6, 0], [9, 3]],
  x: [0, 100, 200, 0, 100],
  y: [0, 0, 0, 50, 50],
  index: [10, 11, 12, 0, 1],
  time: [100, 200, 300, 0, 50],
  flags: [8, 0, 4, 8, 8],
  closures: [
    { a: [0, 100], b: [200, 100], id: [9, 1, 1], suspicion: 0.8, sigmas: 7, flags: 3 },
    { a: [0, 5000], b: [200, 5000], id: [9, 1, 2], state: 4 },
  ],
}));
const rules: PickRules = { until: Infinity, session: () => true, closure: () => true };

test('the nearest frame of the nearest line is meant', () => {
  const at = (x: number, y: number, changes: Partial<PickRules> = {}) => {
    const picked = pickFrame(tile, x, y, 10, { ...rules, ...changes });
    return picked && `${picked.session}:${picked.index}`;
  };
  assert.equal(at(40, 3), '6:10');
  assert.equal(at(60, 3), '6:11');
  assert.equal(at(190, 3), '6:11'); // the vertex beyond is cut, and no frame
  assert.equal(at(60, 47), '9:1');
  assert.equal(at(60, 25), null);
  assert.equal(at(60, 3, { until: 150 }), null);
  assert.equal(at(60, 47, { session: (session) => session === 6 }), null);
});
test('a closure is meant along its whole length', () => {
  assert.equal(pickClosure(tile, 100, 105, 10, rules)?.ordinal, 1);
  assert.equal(pickClosure(tile, 100, 130, 10, rules), null);
  assert.equal(pickClosure(tile, 100, 105, 10, { ...rules, closure: () => false }), null);
});
test('what is in view is counted', () => {
  const box = [-1, -1, 150, 120] as [number, number, number, number];
  const inside = (x: number, y: number) => x >= box[0] && y >= box[1] && x <= box[2] && y <= box[3];
  const view = inView([tile, tile], inside, box, Infinity);
  assert.equal(view.points, 8);
  assert.deepEqual(new Set(view.sessions), new Set([6, 9]));
  assert.deepEqual(view.states, [0, 0, 1, 0, 0]);
  assert.equal(view.suspicious, 1);
  assert.deepEqual(view.torn, ['9:1/1']);
  assert.equal(inView([tile], inside, box, 120).points, 3);
});

test('the address says what is shown, and nothing for what is usual', () => {
  const usual = parseLayers(null);
  assert.ok(usual.torn && usual.accepted && !usual.removed);
  assert.equal(layersText(usual), null);
  assert.deepEqual(parseLayers(layersText({ ...usual, removed: true })), { ...usual, removed: true });
  assert.equal(Object.values(parseLayers(layersText(parseLayers('none')))).some(Boolean), false);
  assert.equal(parseColour('nonsense'), 'session');
  assert.deepEqual([...parseSessions('3,x,5,-1,2.5')], [3, 5]);
  assert.equal(parseTime(timeText(1_700_000_000)), 1_700_000_000);
  assert.equal(parseTime('yesterday'), Infinity);
  assert.equal(timeText(Infinity), null);
});
