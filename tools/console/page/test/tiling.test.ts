import assert from 'node:assert/strict';
import { test } from 'node:test';
import { affordable, ancestor, cover, keyOf, tileBox, tilesInView, zoomFor, type TileId } from '../src/map/tiling';

const world = { x: -100, y: -100, size: 4096 };
const size = { width: 1024, height: 512 };
const has = (...tiles: TileId[]) => {
  const keys = new Set(tiles.map(keyOf));
  return (tile: TileId) => keys.has(keyOf(tile));
};

test('a tile is drawn about 512 pixels wide, between the first and the last level', () => {
  assert.equal(zoomFor(8, world, 9), 0);
  assert.equal(zoomFor(1, world, 9), 3);
  assert.equal(zoomFor(1000, world, 9), 0);
  assert.equal(zoomFor(1e-9, world, 9), 15);
  for (let mpp = 0.01; mpp < 8; mpp *= 1.3) {
    const pixels = world.size / 2 ** zoomFor(mpp, world, 9) / mpp;
    assert.ok(pixels > 360 && pixels < 730, `${pixels}`);
  }
});
test('the tiles in view cover it, the nearest to the middle first', () => {
  const camera = { x: 1000, y: 1000, mpp: 1, turn: 0 };
  const tiles = tilesInView(camera, size, world, 3);
  assert.ok(tiles.length <= 6);
  const [first] = tiles;
  const box = tileBox(world, first!);
  assert.ok(box[0] <= 1000 && box[2] >= 1000 && box[1] <= 1000 && box[3] >= 1000);
  // Turned, the corners of the bounding box are not in view.
  const turned = tilesInView({ ...camera, turn: Math.PI / 4 }, { width: 2000, height: 100 }, world, 5);
  assert.ok(turned.length < 60);
});
test('beside the world there is nothing', () => {
  assert.deepEqual(tilesInView({ x: 1e6, y: 0, mpp: 1, turn: 0 }, size, world, 4), []);
});
test('keys differ', () => {
  const keys = new Set<number>();
  for (let z = 0; z < 6; z++) for (let x = 0; x < 2 ** z; x++) for (let y = 0; y < 2 ** z; y++) keys.add(keyOf({ z, x, y }));
  assert.equal(keys.size, 1365);
  assert.deepEqual(ancestor({ z: 5, x: 21, y: 9 }, 2), { z: 3, x: 5, y: 2 });
});
test('until a tile has come its parent stands in, or its children', () => {
  const wanted = [{ z: 3, x: 2, y: 5 }, { z: 3, x: 3, y: 5 }];
  assert.deepEqual(cover(wanted, has(...wanted)).map(({ only }) => only), [null, null]);
  const parent = { z: 1, x: 0, y: 1 };
  assert.deepEqual(cover(wanted, has(parent)), wanted.map((only) => ({ tile: parent, only })));
  const children = [0, 1, 2, 3].map((i) => ({ z: 4, x: 4 + (i & 1), y: 10 + (i >> 1) }));
  assert.equal(cover(wanted, has(...children)).length, 4);
  assert.equal(cover(wanted, has(...children.slice(1))).length, 0);
});
test('dense places are drawn coarser', () => {
  const tiles = (z: number): TileId[] => Array.from({ length: 4 }, (_, x) => ({ z, x, y: 0 }));
  const dense = affordable(6, tiles, ({ z }) => (z === 6 ? 90_000 : z === 5 ? 60_000 : 10_000), 200_000);
  assert.equal(dense.zoom, 4);
  assert.equal(affordable(6, tiles, () => undefined, 200_000).zoom, 6);
  assert.equal(affordable(0, tiles, () => 1e6, 200_000).zoom, 0);
});
