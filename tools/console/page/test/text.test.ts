import assert from 'node:assert/strict';
import test from 'node:test';
import { href, parseAddress } from '../src/lib/address_text';
import { ago, bytes, count, counted, line, metres, plain, seconds, time } from '../src/lib/format';
import { edgeText, frameText, parseEdge, parseFrame } from '../src/lib/ids';

test('frames and closures are read as they are written', () => {
  assert.deepEqual(parseFrame('6:120'), { session: 6, index: 120 });
  assert.equal(frameText(parseFrame('6:120')!), '6:120');
  assert.deepEqual(parseEdge('6:120/1'), { session: 6, index: 120, ordinal: 1 });
  assert.equal(edgeText(parseEdge('6:120/1')!), '6:120/1');
  assert.equal(frameText(undefined), '');
  assert.equal(edgeText(undefined), '');
});

test('what is no frame or closure is null', () => {
  for (const text of [null, '', '6', '6:', ':1', '6:1 ', ' 6:1', '-6:1', '6:1/1', '6:1.5', '99999999999:1', '4294967296:1', '６:1', '6:1\n', '__proto__'])
    assert.equal(parseFrame(text), null, String(text));
  for (const text of [null, '', '6:1', '6:1/', '6:1/4294967296', '6:1/-1', '6:1/1/1', '6:1/1x']) assert.equal(parseEdge(text), null, String(text));
  assert.deepEqual(parseFrame('4294967295:0'), { session: 4294967295, index: 0 });
});

test('an address is read as it is written, and stays readable', () => {
  const text = href('review', { session: '6', edge: '6:9291/1', words: 'a&b=c #%+é' });
  assert.ok(text.startsWith('#/review?session=6&edge=6:9291/1&'), text);
  const { view, parameters } = parseAddress(text);
  assert.equal(view, 'review');
  assert.equal(parameters.get('edge'), '6:9291/1');
  assert.equal(parameters.get('words'), 'a&b=c #%+é');
  assert.equal(href('map'), '#/map');
});

test('whatever is no address shows the map', () => {
  for (const hash of ['', '#', '#/', '#review', '#/../x', '#/Review', '#key=abc', '#/<script>'])
    assert.equal(parseAddress(hash).view, 'map', hash);
  assert.equal(parseAddress('#/nothing?x=%E0%A4%A').view, 'nothing'); // a damaged escape does not throw
  assert.equal(parseAddress('#/map?root=6:1%0A').parameters.get('root'), '6:1\n');
});

test('hostile text is shown as codes and cut, never within a character', () => {
  assert.equal(line(' the other\n hall \n'), 'the other hall');
  assert.equal(plain('cart'), 'cart');
  assert.equal(plain('a\u0000b\nc\td\u007f'), 'a\\u0000b\\u000ac\\u0009d\\u007f');
  assert.equal(plain('evil\u202egnp.exe'), 'evil\\u202egnp.exe');
  assert.equal(plain('\u2066x\u2069\u200e\u061c\ufeff'), '\\u2066x\\u2069\\u200e\\u061c\\ufeff');
  assert.equal(plain('a\u200bb\u00adc\u2063'), 'a\\u200bb\\u00adc\\u2063'); // what cannot be seen
  assert.equal(plain('\u{e0041}x'), '\\ue0041x'); // tags, neither
  assert.equal(plain('lone \ud800 half'), 'lone \\ud800 half');
  assert.equal(plain('日本語 Ärger 🦊'), '日本語 Ärger 🦊');
  assert.equal(plain('x'.repeat(300)), 'x'.repeat(200) + '…');
  assert.equal(plain('abc🦊def', 4), 'abc…');
  assert.equal(plain('abc🦊def', 5), 'abc🦊…');
  assert.equal(plain('<b>&amp;</b>'), '<b>&amp;</b>'); // text stays text; Svelte escapes it
});

test('numbers as people read them', () => {
  assert.equal(count(1234567n), '1,234,567');
  assert.equal(counted(1, 'closure'), '1 closure');
  assert.equal(counted(0n, 'closure'), '0 closures');
  assert.equal(counted(2, 'has', 'have'), '2 have');
  assert.equal(bytes(0), '0 B');
  assert.equal(bytes(1500n), '1.5 kB');
  assert.equal(bytes(5e12), '5.0 TB');
  assert.equal(metres(0.05), '5.0 cm');
  assert.equal(metres(-0.5), '-50 cm');
  assert.equal(metres(12.34), '12 m');
  assert.equal(metres(Infinity), 'unknown');
  assert.equal(seconds(0.0012), '1.2 ms');
  assert.equal(seconds(90), '90 s');
  assert.equal(seconds(3600), '60 min');
});

test('times that have no date are empty, and never throw', () => {
  assert.equal(time(1_764_540_245_000_000n), '2025-11-30 22:04:05');
  for (const us of [0n, 0, 9223372036854775807n, -9223372036854775808n, NaN]) assert.equal(time(us), '', String(us));
  assert.equal(ago(0n), '');
  assert.equal(ago(1_000_000n, 181_000), '3 min ago');
});
