import assert from 'node:assert/strict';
import test from 'node:test';
import { create, toBinary } from '@bufbuild/protobuf';
import { CallError, Code, makeClient } from '../src/lib/grpc_web';
import { Admin, ProgressSchema } from '../src/proto/relmap/v1/admin_pb';
import { ListSessionsReplySchema, Map as MapService } from '../src/proto/relmap/v1/map_pb';
import { ErrorSchema, Reason } from '../src/proto/relmap/v1/reason_pb';

Object.assign(globalThis, { location: { origin: 'http://localhost' } });
const { isAborted, problemOf } = await import('../src/lib/rpc');

const frame = (flags: number, bytes: Uint8Array) => {
  const all = new Uint8Array(5 + bytes.length);
  all[0] = flags;
  new DataView(all.buffer).setUint32(1, bytes.length);
  all.set(bytes, 5);
  return all;
};
const trailers = (text: string) => frame(0x80, new TextEncoder().encode(text));
const reply = frame(0, toBinary(ListSessionsReplySchema, create(ListSessionsReplySchema, { nextPageToken: 'next' })));
const step = (done: bigint) => frame(0, toBinary(ProgressSchema, create(ProgressSchema, { done })));
const ok = trailers('grpc-status: 0\r\n');

let seen: { url: string; init: RequestInit } | null = null;
// Answers the next call with these bytes, a piece at a time.
function answer(pieces: Uint8Array[], init: ResponseInit = {}, end = true) {
  globalThis.fetch = (async (url: string, request: RequestInit) => {
    seen = { url, init: request };
    const body = new ReadableStream({
      start(controller) {
        for (const piece of pieces) controller.enqueue(piece);
        if (end) controller.close();
        request.signal?.addEventListener('abort', () => {
          try {
            controller.error(new DOMException('aborted', 'AbortError'));
          } catch {
            // It has ended.
          }
        });
      },
    });
    return new Response(body, init);
  }) as never;
}
const bytewise = (...parts: Uint8Array[]) => parts.flatMap((part) => [...part]).map((byte) => Uint8Array.of(byte));

const map = makeClient(MapService, 'http://daemon', 1000);
const admin = makeClient(Admin, 'http://daemon', 1000);
const failure = async (call: Promise<unknown>): Promise<CallError> => {
  try {
    await call;
  } catch (error) {
    assert.ok(error instanceof CallError, String(error));
    return error;
  }
  assert.fail('it succeeded');
};

test('a unary call is sent and read, in whatever pieces it comes', async () => {
  answer(bytewise(reply, ok));
  assert.equal((await map.listSessions({ pageSize: 3 })).nextPageToken, 'next');
  assert.equal(seen!.url, 'http://daemon/relmap.v1.Map/ListSessions');
  assert.equal((seen!.init.headers as Record<string, string>)['grpc-timeout'], '1000m');
  assert.deepEqual([...(seen!.init.body as Uint8Array)], [0, 0, 0, 0, 2, 8, 3]);
});

test('a stream is read to its end', async () => {
  answer([step(1n), new Uint8Array([...step(2n), ...ok])]);
  const done: bigint[] = [];
  for await (const progress of admin.compact({}, { timeoutMs: 0 })) done.push(progress.done);
  assert.deepEqual(done, [1n, 2n]);
  assert.equal('grpc-timeout' in (seen!.init.headers as object), false);
});

test('the daemon’s reason is in the details, without padding', async () => {
  const detail = create(ErrorSchema, { reason: Reason.DISK_FULL, message: 'no room', requestId: 'abc' });
  const base64 = Buffer.from(toBinary(ErrorSchema, detail)).toString('base64').replace(/=+$/, '');
  answer([trailers(`grpc-status: 8\r\ngrpc-message: DISK_FULL%3A no\r\ngrpc-status-details-bin: ${base64}\r\n`)]);
  const error = await failure(map.listSessions({}));
  assert.equal(error.code, 8);
  assert.deepEqual(problemOf(error), { reason: 'DISK_FULL', message: 'no room', requestId: 'abc' });
  // In the headers, if there is no message at all.
  answer([], { headers: { 'grpc-status': '8', 'grpc-status-details-bin': base64 } });
  assert.equal(problemOf(await failure(map.listSessions({}))).reason, 'DISK_FULL');
});

test('what is no answer of the daemon has a reason, too', async () => {
  answer([], { status: 403, headers: {} });
  assert.equal(problemOf(await failure(map.listSessions({}))).reason, 'NOT_ALLOWED');
  globalThis.fetch = (async () => new Response('{"reason": "UNREACHABLE", "message": "no daemon"}', { status: 502 })) as never;
  assert.deepEqual(problemOf(await failure(map.listSessions({}))), { reason: 'UNREACHABLE', message: 'no daemon' });
  globalThis.fetch = (async () => Promise.reject(new TypeError('failed to fetch'))) as never;
  assert.equal(problemOf(await failure(map.listSessions({}))).reason, 'UNREACHABLE');
  answer([reply]); // no trailers
  assert.match(problemOf(await failure(map.listSessions({}))).message, /broke/);
  answer([ok]); // no message
  assert.equal((await failure(map.listSessions({}))).code, Code.internal);
  answer([frame(0, Uint8Array.of(0xff, 0xff)), ok]); // no protobuf
  assert.equal((await failure(map.listSessions({}))).code, Code.internal);
  answer([trailers('grpc-status: 5\r\ngrpc-message: %E0%A4%A\r\ngrpc-status-details-bin: !!!\r\n')]);
  assert.equal((await failure(map.listSessions({}))).message, '%E0%A4%A');
});

test('a call is cancelled by whoever made it, and ends in time', async () => {
  const abort = new AbortController();
  answer([step(1n)], {}, false);
  const stream = admin.compact({}, { signal: abort.signal })[Symbol.asyncIterator]();
  await stream.next();
  abort.abort();
  const error = await failure(stream.next());
  assert.ok(isAborted(error));
  answer([], {}, false);
  assert.equal((await failure(map.listSessions({}, { timeoutMs: 30 }))).code, Code.deadline);
  answer([step(1n), step(2n)], {}, false);
  for await (const progress of admin.compact({})) {
    assert.equal(progress.done, 1n);
    break;
  }
  assert.ok(seen!.init.signal!.aborted); // leaving a stream ends the call
});
