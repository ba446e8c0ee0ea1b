import assert from 'node:assert/strict';
import test from 'node:test';
import { create } from '@bufbuild/protobuf';
import { EdgeKind, EdgeSchema, EdgeState, type Edge } from '../src/proto/relmap/v1/graph_pb';
import { EdgeOrder } from '../src/proto/relmap/v1/map_pb';
import { MapEventSchema } from '../src/proto/relmap/v1/watch_pb';
import {
  around, emptyQueue, filterProblem, nearEnd, readFilters, requestOf, step, withEvents, withPage, writeFilters,
} from '../src/views/review/queue';

const edge = (index: number, state = EdgeState.ACCEPTED, suspicion = 0.5): Edge =>
  create(EdgeSchema, {
    id: { frame: { session: 2, index }, ordinal: 1 },
    a: { session: 1, index: 1 },
    b: { session: 2, index },
    kind: EdgeKind.LOOP,
    state,
    suspicion: { value: suspicion },
  });
const changed = (what: Edge, author = 'bob') =>
  create(MapEventSchema, { event: { case: 'edgeChanged', value: what }, author, note: 'why' });
const filters = readFilters(() => null);
const queue = withPage(emptyQueue, [edge(1), edge(2), edge(3), edge(4)], 'token');

test('the address holds the filters, and those in force are listed by default', () => {
  assert.deepEqual(filters.states, [EdgeState.ACCEPTED]);
  const all = { ...filters, states: [1, 2, 3, 4], session: '6', other: '9', min: '0.5', from: '2026-11-30T21:04', near: '6:1', within: '20' };
  const written = writeFilters(all);
  assert.deepEqual({ ...readFilters((name) => written[name] ?? null), states: [] }, { ...all, states: [] });
  assert.equal(written.states, 'all');
  assert.equal(writeFilters(filters).states, null);
});

test('the request asks for loops, in the order and the region', () => {
  const request = requestOf({ ...filters, near: '6:1', within: '20', from: '1970-01-01T00:01' }, 50, 't');
  assert.deepEqual(request.kinds, [EdgeKind.LOOP]);
  assert.equal(request.order, EdgeOrder.SUSPICION);
  assert.equal(request.fromUs, 60_000_000n);
  assert.deepEqual({ ...request.region!.root }, { session: 6, index: 1 });
  assert.equal(request.region!.maxMetres, 20);
});

test('what is wrong with filters is said', () => {
  assert.equal(filterProblem(filters), '');
  assert.match(filterProblem({ ...filters, other: '2' }), /before the other/);
  assert.match(filterProblem({ ...filters, near: '6' }), /6:120/);
  assert.match(filterProblem({ ...filters, min: '2' }), /0 to 1/);
  assert.match(filterProblem({ ...filters, from: '2026-01-02', until: '2026-01-01' }), /before its end/);
});

test('pages are joined without doubles', () => {
  const more = withPage(queue, [edge(4), edge(5)], '');
  assert.deepEqual(more.rows.map((row) => row.name), ['2:1/1', '2:2/1', '2:3/1', '2:4/1', '2:5/1']);
  assert.equal(more.next, '');
});

test('an event changes the row where it stands, and says who did it', () => {
  const { queue: after, notices } = withEvents(queue, [changed(edge(2, EdgeState.REMOVED))], filters);
  assert.equal(after.rows[1]!.state, EdgeState.REMOVED);
  assert.equal(after.rows[1]!.changedBy, 'bob');
  assert.equal(after.rows[1]!.suspicion, 0.5);
  assert.equal(queue.rows[1]!.state, EdgeState.ACCEPTED);
  assert.deepEqual(notices.map((each) => [each.name, each.author, each.note]), [['2:2/1', 'bob', 'why']]);
});

test('a closure that is not listed is counted if it may fit', () => {
  const events = [changed(edge(9)), changed(edge(9)), changed(edge(10, EdgeState.CANDIDATE))];
  assert.deepEqual([...withEvents(queue, events, filters).queue.fresh], ['2:9/1']);
  assert.equal(withEvents(queue, events, { ...filters, session: '7' }).queue, queue);
});

test('a closure that went with its session is marked', () => {
  const event = create(MapEventSchema, {
    event: { case: 'edgeRemoved', value: { edge: { frame: { session: 2, index: 3 }, ordinal: 1 } } },
    author: 'eve',
  });
  assert.equal(withEvents(queue, [event], filters).queue.rows[2]!.gone, true);
});

test('going through the list, and what is loaded ahead', () => {
  assert.equal(step(queue, null, 1), '2:1/1');
  assert.equal(step(queue, '2:2/1', 1), '2:3/1');
  assert.equal(step(queue, '2:1/1', -1), null);
  assert.equal(step(queue, '2:4/1', 1), null);
  assert.deepEqual(around(queue, '2:2/1'), ['2:2/1', '2:3/1', '2:4/1', '2:1/1']);
  assert.deepEqual(around(queue, '7:7/7'), ['7:7/7']);
  assert.equal(nearEnd(queue, '2:1/1'), true);
  assert.equal(nearEnd({ ...queue, next: '' }, '2:1/1'), false);
});
