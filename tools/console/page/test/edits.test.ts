import assert from 'node:assert/strict';
import test from 'node:test';
import { create } from '@bufbuild/protobuf';
import { EdgeState } from '../src/proto/relmap/v1/graph_pb';
import { EditEffectSchema } from '../src/proto/relmap/v1/map_pb';
import { Reason } from '../src/proto/relmap/v1/reason_pb';
import {
  conflictOf, isOld, lastToUndo, onlyItself, possible, readList, requestOf, undoOf, withDone, withStepUndone, type Done,
} from '../src/views/review/edits';

const done = (id: string): Done => ({
  id, name: '2:5/1', ends: '1:1 – 2:5', what: 'remove', note: '', when: 0, sequence: '70',
  state: EdgeState.REMOVED, changed: 1, undo: ['restore'], undone: false, byUndo: false,
});

test('each edit is undone as the table of the operations guide says', () => {
  assert.deepEqual(undoOf('remove', '2:5/1', undefined), ['restore']);
  assert.deepEqual(undoOf('removeAlone', '2:5/1', undefined), ['restore']);
  assert.deepEqual(undoOf('accept', '2:5/1', undefined), ['withdraw']);
  assert.deepEqual(undoOf('withdraw', '2:5/1', undefined), ['accept']);
  assert.deepEqual(undoOf('proposeAccepted', '2:5/1', undefined), ['withdraw', 'removeAlone']);
  const closures = [{ id: { frame: { session: 2, index: 5 }, ordinal: 1 }, reasonBefore: Reason.REMOVED_ALONE }];
  assert.deepEqual(undoOf('restore', '2:5/1', create(EditEffectSchema, { closures })), ['removeAlone']);
  assert.deepEqual(undoOf('restore', '2:6/1', create(EditEffectSchema, { closures })), ['remove']);
});

test('only what the state allows is offered', () => {
  assert.deepEqual(possible(EdgeState.REMOVED, Reason.REMOVED_ALONE),
    { remove: false, removeAlone: false, restore: true, accept: true, withdraw: false });
  assert.deepEqual(possible(EdgeState.ACCEPTED, Reason.ACCEPTED_BY_OPERATOR),
    { remove: true, removeAlone: true, restore: false, accept: false, withdraw: true });
  assert.equal(possible(EdgeState.ACCEPTED, Reason.CONSISTENT).accept, true);
  assert.deepEqual(requestOf('accept'), { state: EdgeState.ACCEPTED, decided: true, alone: false });
});

test('the history takes back the newest edit that stands', () => {
  let list = withDone(withDone([], done('1')), done('2'));
  assert.equal(lastToUndo(list)!.id, '2');
  list = withDone(withStepUndone(list, '2', '71'), { ...done('3'), byUndo: true });
  assert.equal(lastToUndo(list)!.id, '1');
  assert.equal(lastToUndo(withStepUndone(list, '1', '72')), null);
  assert.deepEqual(readList(JSON.stringify(list)), list);
  assert.deepEqual(readList('{"x":'), []);
  assert.deepEqual(readList('[null, {"name": 3}]'), []);
});

test('an edit that takes two steps to undo stays, with the step that is left, until both are done', () => {
  const proposed: Done = { ...done('1'), what: 'proposeAccepted', undo: ['withdraw', 'removeAlone'] };
  const half = withStepUndone([proposed], '1', '80');
  assert.deepEqual(half, [{ ...proposed, undo: ['removeAlone'], sequence: '80' }]);
  assert.equal(lastToUndo(half)!.id, '1');
  assert.equal(lastToUndo(withStepUndone(half, '1', '81')), null);
});

test('a step that changes more than the closure itself is told from one that does not', () => {
  const change = (index: number) => ({ id: { frame: { session: 2, index }, ordinal: 1 } });
  const effect = (...indices: number[]) => create(EditEffectSchema, { closures: indices.map(change) });
  assert.equal(onlyItself('2:5/1', effect(5), []), true);
  assert.equal(onlyItself('2:5/1', effect(5, 6), []), false);
  assert.equal(onlyItself('2:5/1', effect(5), [change(6).id]), false);
  const stretch = { first: { session: 2, index: 1 }, last: { session: 2, index: 4 } };
  assert.equal(onlyItself('2:5/1', create(EditEffectSchema, { carried: [stretch] }), []), false);
});

test('what this tab did itself is no news', () => {
  const list = [done('1')]; // of 2:5/1, in record 70
  assert.equal(isOld(list, { name: '2:5/1', sequence: '69' }), true);
  assert.equal(isOld(list, { name: '2:9/1', sequence: '70' }), true); // went with it
  assert.equal(isOld(list, { name: '2:9/1', sequence: '69' }), false);
  assert.equal(isOld(list, { name: '2:5/1', sequence: '71' }), false);
});

test('somebody else’s later edit is told before undoing', () => {
  const words = { state: (state: EdgeState) => EdgeState[state]!, author: (author: string) => author };
  const event = (sequence: bigint, author: string) => ({ journalSequence: sequence, author, state: EdgeState.ACCEPTED });
  assert.equal(conflictOf(done('1'), [event(70n, 'anna')], words), '');
  assert.equal(conflictOf(done('1'), [event(70n, 'anna'), event(75n, 'bob')], words),
    'Since then bob has changed this closure: it is now ACCEPTED.');
});
