import assert from 'node:assert/strict';
import { webcrypto } from 'node:crypto';
import test from 'node:test';
import { create } from '@bufbuild/protobuf';
import { afterEvents } from '../src/lib/session_list';
import { SessionSchema, SessionState, type Session } from '../src/proto/relmap/v1/graph_pb';
import { MapEventSchema, type MapEvent } from '../src/proto/relmap/v1/watch_pb';

// What a browser has (and node 18 does not).
Object.defineProperty(globalThis, 'crypto', { value: webcrypto, configurable: true });
Object.assign(globalThis, { location: { origin: 'http://localhost' } });
const { EditKeys, newKey } = await import('../src/lib/edit_keys');
const { allPages, seldom } = await import('../src/lib/pages');
const { CallError, Code } = await import('../src/lib/grpc_web');
const { ErrorSchema, Reason } = await import('../src/proto/relmap/v1/reason_pb');

const session = (number: number, frames = 10): Session =>
  create(SessionSchema, { number, name: `s${number}`, frames, last: frames - 1, firstTimeUs: 1n, lastTimeUs: 100n, state: SessionState.OPEN });
const event = (value: MapEvent['event']): MapEvent => create(MapEventSchema, { event: value as never });
const added = (...frames: [number, number][]) =>
  event({ case: 'framesAdded', value: { frames: frames.map(([number, index]) => ({ frame: { session: number, index }, timeUs: 200n })) } } as never);

test('sessions grow with their frames; frames that the list has already count once', () => {
  const after = afterEvents([session(1), session(2)], [added([1, 9], [1, 10], [1, 12], [2, 3])]);
  assert.equal(after.again, false);
  assert.deepEqual(after.list.map(({ frames, last }) => [frames, last]), [[12, 12], [10, 9]]);
  assert.equal(after.list[0]!.lastTimeUs, 200n);
  assert.equal(after.list[1]!.lastTimeUs, 100n);
});

test('sessions change their state, go, and are read anew if something is not known', () => {
  const frozen = event({ case: 'sessionChanged', value: { number: 2, name: 'new', robot: 'r', state: SessionState.FROZEN } } as never);
  const gone = event({ case: 'sessionDeleted', value: { session: 1 } } as never);
  const after = afterEvents([session(1), session(2)], [frozen, gone]);
  assert.deepEqual(after.list.map(({ number, name, state }) => [number, name, state]), [[2, 'new', SessionState.FROZEN]]);
  assert.equal(after.list[0]!.frames, 10); // the event does not have them
  assert.equal(afterEvents([session(1)], [added([3, 0])]).again, true);
  assert.equal(afterEvents([], [frozen]).again, true);
  assert.equal(afterEvents([session(1)], [event({ case: 'framesRemoved', value: { session: 1, first: 3 } } as never)]).again, true);
  const same = [session(1)];
  assert.equal(afterEvents(same, [event({ case: 'caughtUp', value: {} } as never)]).list, same);
});

test('an edit that is tried again at once keeps its key, others get new ones', () => {
  const keys = new EditKeys();
  const first = keys.of('freeze 1');
  assert.match(first, /^[0-9a-f]{32}$/);
  assert.equal(keys.of('freeze 1'), first);
  keys.done();
  assert.notEqual(keys.of('freeze 1'), first);
  const again = keys.of('freeze 1');
  assert.notEqual(keys.of('thaw 1'), again);
  assert.notEqual(keys.of('freeze 1'), again); // what it did may have been taken back
  assert.equal(new Set(Array.from({ length: 1000 }, newKey)).size, 1000);
});

const expired = () =>
  new CallError(10, 'gone', create(ErrorSchema, { reason: Reason.VIEW_EXPIRED, message: 'gone' }));

test('all pages of a list are read, anew if their version is gone', async () => {
  let seen: number[] = [];
  let fail = 1;
  await allPages(
    async (token) => {
      if (token === '2' && fail-- > 0) throw expired();
      return { value: Number(token || 0), nextPageToken: token === '3' ? '' : String(Number(token || 0) + 1) };
    },
    (reply) => seen.push(reply.value),
    () => (seen = []),
  );
  assert.deepEqual(seen, [0, 1, 2, 3]);
  let tries = 0;
  await assert.rejects(allPages(async () => (++tries, Promise.reject(expired())), () => {}, () => {}));
  assert.equal(tries, 3);
  tries = 0;
  await assert.rejects(allPages(async () => (++tries, Promise.reject(new CallError(Code.internal, 'no'))), () => {}, () => {}));
  assert.equal(tries, 1);
});

test('work that is asked for again and again is done seldom, and not after the end', async () => {
  let done = 0;
  const work = seldom(() => ++done, 1);
  for (let i = 0; i < 100; ++i) work.ask();
  await new Promise((resolve) => setTimeout(resolve, 400));
  assert.equal(done, 1);
  work.ask();
  work.end();
  await new Promise((resolve) => setTimeout(resolve, 300));
  assert.equal(done, 1);
});
