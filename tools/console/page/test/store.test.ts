import assert from 'node:assert/strict';
import { test } from 'node:test';
import { TileStore } from '../src/map/store';
import { keyOf, type TileId } from '../src/map/tiling';

interface Ask {
  tile: TileId;
  signal: AbortSignal;
  give: (value: { bytes: number } | null) => void;
  fail: (error: unknown) => void;
}
function made(limit = 1000) {
  const asked: Ask[] = [];
  const dropped: { bytes: number }[] = [];
  let changes = 0;
  const store = new TileStore<{ bytes: number }>(
    (tile, signal) => new Promise((give, fail) => asked.push({ tile, signal, give, fail })),
    (value) => dropped.push(value),
    () => changes++,
    () => limit,
  );
  return { store, asked, dropped, changes: () => changes };
}
const row = (from: number, count: number): TileId[] => Array.from({ length: count }, (_, i) => ({ z: 9, x: from + i, y: 0 }));
const soon = () => new Promise((resolve) => setTimeout(resolve, 0));

test('a few tiles are fetched at a time, the most wanted first', async () => {
  const { store, asked, changes } = made();
  store.want(row(0, 10));
  assert.deepEqual(asked.map(({ tile }) => tile.x), [0, 1, 2, 3]);
  asked[0]!.give({ bytes: 10 });
  asked[1]!.give(null);
  await soon();
  assert.deepEqual(asked.map(({ tile }) => tile.x), [0, 1, 2, 3, 4, 5]);
  assert.equal(changes(), 2);
  assert.equal(store.use(row(0, 1)[0]!)!.bytes, 10);
  assert.equal(store.use({ z: 9, x: 1, y: 0 }), null);
  assert.equal(store.use({ z: 9, x: 2, y: 0 }), undefined);
  assert.equal(store.missing, 8);
});
test('what is no longer wanted is given up', async () => {
  const { store, asked } = made();
  store.want(row(0, 4));
  store.want(row(3, 4));
  assert.deepEqual(asked.map(({ signal }) => signal.aborted), [true, true, true, false, false, false, false]);
  asked[0]!.fail(new DOMException('gone', 'AbortError'));
  await soon();
  assert.equal(store.trouble, null);
});
test('a value that comes for nobody is dropped', async () => {
  const { store, asked, dropped } = made();
  store.want(row(0, 1));
  store.want([]);
  asked[0]!.give({ bytes: 7 });
  await soon();
  assert.equal(dropped.length, 1);
  assert.equal(store.bytes, 0);
});
test('too much: what was not used for longest goes, never what is wanted', async () => {
  const { store, asked, dropped } = made(100);
  for (let i = 0; i < 5; i++) {
    store.want(row(i, 1));
    asked[i]!.give({ bytes: 30 });
    await soon();
  }
  assert.ok(store.bytes <= 100);
  assert.ok(dropped.length >= 1);
  assert.ok(store.has(row(4, 1)[0]!));
  assert.ok(!store.has(row(0, 1)[0]!));
  store.want(row(10, 4));
  for (const ask of asked.slice(5)) ask.give({ bytes: 90 });
  await soon();
  assert.ok(row(10, 4).every(store.has));
});
test('a failure is told, and the picture counts as settled', async () => {
  const { store, asked } = made();
  store.want(row(0, 1));
  asked[0]!.fail(new Error('broken'));
  await soon();
  assert.ok(store.settled);
  assert.equal(store.missing, 1);
  store.end();
});
test('at the end everything is dropped', async () => {
  const { store, asked, dropped } = made();
  store.want(row(0, 2));
  asked[0]!.give({ bytes: 5 });
  await soon();
  store.end();
  assert.equal(dropped.length, 1);
  assert.ok(asked[1]!.signal.aborted);
  assert.equal(keyOf({ z: 0, x: 0, y: 0 }), 0);
});
