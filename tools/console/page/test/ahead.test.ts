import assert from 'node:assert/strict';
import test from 'node:test';
import { Ahead } from '../src/lib/ahead';

// Loads that the test finishes itself.
function bench(most = 4) {
  const open = new Map<string, { resolve: (value: string) => void; reject: (error: unknown) => void; signal: AbortSignal }>();
  const dropped: string[] = [];
  const told: string[] = [];
  const ahead = new Ahead<string>(
    (name, signal) => new Promise((resolve, reject) => open.set(name, { resolve, reject, signal })),
    (value) => dropped.push(value),
    (name) => told.push(name),
    most,
  );
  const finish = async (name: string, value = name) => {
    open.get(name)!.resolve(value);
    open.delete(name);
    await new Promise((resolve) => setImmediate(resolve));
  };
  return { ahead, open, dropped, told, finish };
}

test('what is shown is loaded first, then what comes next, one at a time', async () => {
  const { ahead, open, finish } = bench();
  ahead.want(['a', 'b', 'c']);
  assert.deepEqual([...open.keys()], ['a']);
  await finish('a');
  assert.equal(ahead.value('a'), 'a');
  assert.deepEqual([...open.keys()], ['b']);
  await finish('b');
  await finish('c');
  assert.deepEqual(ahead.names().sort(), ['a', 'b', 'c']);
});

test('what is not wanted any more is cancelled, and the new one does not wait for it', () => {
  const { ahead, open } = bench();
  ahead.want(['a', 'b']);
  ahead.want(['x']);
  assert.ok(open.get('a')!.signal.aborted);
  assert.ok(open.has('x'));
});

test('no more values are held than allowed, and dropped ones are freed', async () => {
  const { ahead, dropped, finish } = bench(3);
  for (const name of ['a', 'b', 'c', 'd', 'e']) {
    ahead.want([name]);
    await finish(name);
  }
  assert.deepEqual(ahead.names(), ['c', 'd', 'e']);
  assert.deepEqual(dropped, ['a', 'b']);
  ahead.clear();
  assert.deepEqual(dropped, ['a', 'b', 'c', 'd', 'e']);
});

test('a refreshed value is shown until the new one is there', async () => {
  const { ahead, dropped, finish } = bench();
  ahead.want(['a']);
  await finish('a', 'old');
  ahead.refresh(['a']);
  assert.equal(ahead.value('a'), 'old');
  await finish('a', 'new');
  assert.equal(ahead.value('a'), 'new');
  assert.deepEqual(dropped, ['old']);
});

test('a failure is told and not tried again by itself', async () => {
  const { ahead, open, told } = bench();
  ahead.want(['a', 'b']);
  open.get('a')!.reject(new Error('no'));
  await new Promise((resolve) => setImmediate(resolve));
  assert.match(String(ahead.failure('a')), /no/);
  assert.deepEqual(told, ['a']);
  assert.ok(open.has('b'));
  ahead.refresh(['a']);
  assert.equal(ahead.failure('a'), undefined);
});

test('a value that comes after its load was cancelled is freed', async () => {
  const { ahead, dropped, finish } = bench();
  ahead.want(['a']);
  ahead.want(['b']);
  await finish('a');
  assert.equal(ahead.value('a'), undefined);
  assert.deepEqual(dropped, ['a']);
});
