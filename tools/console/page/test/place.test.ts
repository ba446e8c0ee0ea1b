import assert from 'node:assert/strict';
import test from 'node:test';
import { RouteBy } from '../src/proto/relmap/v1/map_pb';
import { endProblem, endRequest, endText, mapParameters, parseEnd, readHow, routeRequest, writeHow } from '../src/views/place/ends';
import { hasExif, planPhoto, typeOf } from '../src/views/place/photo';
import { percent } from '../src/views/place/match_words';

test('ends are read as people write them', () => {
  assert.deepEqual(parseEnd('6:120'), { kind: 'frame', text: '6:120' });
  assert.deepEqual(parseEnd('kitchen'), { kind: 'label', text: 'kitchen' });
  assert.deepEqual(parseEnd('label:6:120'), { kind: 'label', text: '6:120' });
  assert.deepEqual(parseEnd('robot:cart'), { kind: 'robot', text: 'cart' });
  for (const text of ['6:120', 'kitchen', 'label:6:120', 'robot:cart', 'label:robot:x', 'label:label:y'])
    assert.equal(endText(parseEnd(text)), text);
  assert.equal(endText({ kind: 'picture', text: 'photo.jpg' }), null);
  assert.equal(endProblem(parseEnd('kitchen'), false), '');
  assert.match(endProblem({ kind: 'frame', text: 'x' }, false), /6:120/);
  assert.match(endProblem({ kind: 'picture', text: '' }, false), /Choose/);
  assert.deepEqual(endRequest(parseEnd('6:120'), null), { end: { case: 'frame', value: { session: 6, index: 120 } } });
});

test('what to avoid is in the address, whatever the labels are', () => {
  const how = { by: 'time' as const, alternatives: 5, avoidFrames: ['6:1'], avoidLabels: ['a, b', '100%', '7:7', 'long-loops', 'stairs'], noLongLoops: true };
  const written = writeHow(how);
  assert.deepEqual(readHow((name) => written[name] ?? null), how);
  assert.deepEqual(writeHow(readHow(() => null)), { by: null, alternatives: null, avoid: null });
  assert.equal(readHow((name) => (name === 'alternatives' ? '99' : null)).alternatives, 5);
  const request = routeRequest({}, {}, how);
  assert.equal(request.by, RouteBy.TIME);
  assert.deepEqual(request.filter!.avoidFrames, [{ session: 6, index: 1 }]);
  const parameters = mapParameters({ session: 1, index: 2 }, { session: 1, index: 9 }, how, 1);
  assert.deepEqual([parameters.route, parameters.by, parameters.way], ['1:2,1:9', 'time', '2']);
  assert.deepEqual(readHow((name) => parameters[name] ?? null), how);
});

test('photographs are reduced only where it is needed', () => {
  const photo = { type: 'image/jpeg', bytes: 1e6, width: 1200, height: 900, turned: false };
  assert.deepEqual(planPhoto(photo, false), { send: 'as it is' });
  assert.deepEqual(planPhoto({ ...photo, width: 4000, height: 3000 }, false), { send: 'redrawn', width: 1600, height: 1200, type: 'image/jpeg' });
  assert.deepEqual(planPhoto({ ...photo, turned: true }, false), { send: 'redrawn', width: 1200, height: 900, type: 'image/jpeg' });
  assert.equal(planPhoto({ ...photo, type: '' }, false).send, 'redrawn');
  assert.equal(planPhoto({ ...photo, width: 4000, height: 3000 }, true).send, 'as it is');
  assert.equal(planPhoto({ ...photo, bytes: 20e6 }, true).send, 'redrawn');
  assert.equal(planPhoto({ ...photo, type: 'image/png', width: 4000, height: 3000 }, true).send, 'redrawn');
  assert.equal(planPhoto({ ...photo, width: 12000, height: 9000 }, true).send, 'nothing');
  assert.equal(planPhoto({ ...photo, width: 0 }, false).send, 'nothing');
});

test('files are known by their bytes', () => {
  assert.equal(typeOf(Uint8Array.of(0xff, 0xd8, 0xff, 0xe0)), 'image/jpeg');
  assert.equal(typeOf(Uint8Array.of(0x89, 0x50, 0x4e, 0x47)), 'image/png');
  assert.equal(typeOf(Uint8Array.of(1)), '');
  assert.equal(hasExif(new TextEncoder().encode('....Exif....')), true);
  assert.equal(hasExif(Uint8Array.of(1, 2)), false);
});

test('probabilities that are nearly certain are not called certain', () => {
  assert.deepEqual([0, 0.001, 0.5, 0.999, 1].map(percent), ['0 %', 'under 1 %', '50 %', 'over 99 %', '100 %']);
});
