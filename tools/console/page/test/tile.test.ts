import assert from 'node:assert/strict';
import { test } from 'node:test';
import { decodeTile, sessionsOf, TileError } from '../src/map/tile';
import { tileBytes, type MadeTile } from './tile_bytes';

const made: MadeTile = {
  runs: [[6, 0], [9, 3]],
  x: [0, 10, 65535, 7, 8],
  y: [1, 2, 3, 4, 5],
  index: [100, 101, 102, 0, 1],
  time: [0, 1_700_000_000, 1_700_000_001, 5, 6],
  flags: [8, 1, 2, 4, 8],
  old: [[0, 0], [1, 1], [2, 2], [3, 3], [4, 4]],
  sd: [0.1, Infinity, 0.3, 0, 1],
  closures: [{ a: [1, 2], b: [3, 4], id: [6, 102, 1], suspicion: 0.7, sigmas: 9.1, flags: 3 }],
  unit: 0.5,
  origin: [1000, -2000],
};

test('a tile is read as it was written', () => {
  const tile = decodeTile(tileBytes(made));
  assert.deepEqual([...tile.x], made.x);
  assert.deepEqual([...tile.y], made.y);
  assert.deepEqual([...tile.index], made.index);
  assert.deepEqual([...tile.flags], made.flags);
  assert.deepEqual([...sessionsOf(tile)], [6, 6, 6, 9, 9]);
  assert.deepEqual([...tile.old![1]], [0, 1, 2, 3, 4]);
  assert.equal(tile.sd![1], Infinity);
  assert.deepEqual([tile.originX, tile.originY, tile.unit], [1000, -2000, 0.5]);
  const { closures } = tile;
  assert.deepEqual([closures.ax[0], closures.ay[0], closures.bx[0], closures.by[0]], [1, 2, 3, 4]);
  assert.deepEqual([closures.session[0], closures.index[0], closures.ordinal[0]], [6, 102, 1]);
  assert.deepEqual([closures.state[0], closures.flags[0]], [2, 3]);
  assert.ok(Math.abs(closures.sigmas[0]! - 9.1) < 1e-5);
});

test('a tile without anything is one', () => {
  assert.equal(decodeTile(tileBytes({})).count, 0);
});

test('a tile that ends early, anywhere, is refused', () => {
  const bytes = tileBytes(made);
  for (let size = 0; size < bytes.byteLength; size++) assert.throws(() => decodeTile(bytes.slice(0, size)), TileError, `${size} bytes`);
});

test('a tile that is too long is refused', () => {
  const long = new Uint8Array(tileBytes(made).byteLength + 4);
  long.set(new Uint8Array(tileBytes(made)));
  assert.throws(() => decodeTile(long.buffer), TileError);
});

test('what makes no sense is refused', () => {
  const refused = (changes: Partial<MadeTile>) => assert.throws(() => decodeTile(tileBytes({ ...made, ...changes })), TileError);
  refused({ unit: 0 });
  refused({ unit: NaN });
  refused({ origin: [Infinity, 0] });
  refused({ runs: [[6, 1]] }); // vertices of no run
  refused({ runs: [] });
  refused({ runs: [[6, 0], [9, 5]] });
  refused({ runs: [[6, 0], [9, 3], [9, 3]] });
  refused({ sd: [0, -1, 0, 0, 0] });
  refused({ sd: [0, NaN, 0, 0, 0] });
  refused({ closures: [{ a: [NaN, 0], b: [0, 0], id: [1, 1, 1] }] });
});

// Whatever stands in a byte, the outcome is a tile or a TileError, and a tile's arrays lie within its bytes.
test('a damaged byte never does more than that', () => {
  const whole = new Uint8Array(tileBytes(made));
  let refused = 0;
  for (let at = 0; at < whole.length; at++)
    for (const value of [0, 1, 127, 255]) {
      const bytes = whole.slice();
      bytes[at] = value;
      try {
        const tile = decodeTile(bytes.buffer);
        assert.equal(tile.x.length, tile.count);
        assert.equal(sessionsOf(tile).length, tile.count);
      } catch (error) {
        assert.ok(error instanceof TileError, String(error));
        refused++;
      }
    }
  assert.ok(refused > 50);
});

test('counts that would need more memory than there is are refused at once', () => {
  const bytes = tileBytes(made);
  for (const at of [4, 8, 12]) {
    const huge = bytes.slice(0);
    new DataView(huge).setUint32(at, 0xffffffff, true);
    assert.throws(() => decodeTile(huge), TileError);
  }
});
