import assert from 'node:assert/strict';
import test from 'node:test';
import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { ProgressSchema, VerifySummarySchema } from '../src/proto/relmap/v1/admin_pb';
import { ClosureMatrixCellSchema } from '../src/proto/relmap/v1/evidence_pb';
import { LabelledFramesSchema, SessionSchema, SessionState } from '../src/proto/relmap/v1/graph_pb';
import { isShown, request as auditRequest, timeUs, wrongWith as wrongWithQuery } from '../src/views/audit/query';
import { begun, outcomeText, progressText, remainingText, share } from '../src/views/jobs/job';
import { parseSessions } from '../src/views/jobs/session_numbers';
import { joined, request, wrongWith } from '../src/views/labels/find';
import { clampPage, filtered, orderOf, pageCount, pageOf, stateOf } from '../src/views/sessions/filters';
import { closuresText, goingWith, wordToType } from '../src/views/sessions/going';
import { heat, Matrix, measureOf, windowStart } from '../src/views/sessions/matrix';

const session = (init: MessageInitShape<typeof SessionSchema>) => create(SessionSchema, init);
const sessions = [
  session({ number: 1, name: 'Morning', robot: 'cart', frames: 5, lastTimeUs: 30n }),
  session({ number: 2, name: 'evening', robot: 'cart', frames: 50, lastTimeUs: 10n, state: SessionState.FROZEN }),
  session({ number: 12, name: 'noon', robot: 'boat', frames: 7, lastTimeUs: 20n }),
];
const numbers = (words: string, state: SessionState | null = null, order = 'newest') =>
  filtered(sessions, { words, state, order: orderOf(order) }).map(({ number }) => number);

test('sessions are found by all words, in any order of the list', () => {
  assert.deepEqual(numbers(''), [1, 12, 2]);
  assert.deepEqual(numbers('CART ning'), [1, 2]);
  assert.deepEqual(numbers('2'), [12, 2]);
  assert.deepEqual(numbers('', SessionState.FROZEN), [2]);
  assert.deepEqual(numbers('', null, 'frames'), [2, 12, 1]);
  assert.deepEqual(numbers('nothing'), []);
});

test('what an address says of the list is checked', () => {
  assert.equal(orderOf('constructor'), 'newest');
  assert.equal(stateOf(''), null);
  assert.equal(stateOf(null), null);
  assert.equal(stateOf('9'), null);
  assert.equal(stateOf('0'), SessionState.OPEN);
  assert.deepEqual(['1', '3', '99', '-4', 'x', null].map((text) => clampPage(text, 120)), [0, 2, 2, 0, 0, 0]);
  assert.equal(clampPage('2', 0), 0);
  assert.deepEqual([pageOf(-1), pageOf(49), pageOf(50), pageCount(0), pageCount(51)], [0, 0, 1, 1, 2]);
});

const cell = (sessionA: number, sessionB: number, accepted: number, suspicion = 0) =>
  create(ClosureMatrixCellSchema, {
    sessionA, sessionB, accepted, candidate: 1, suspicion,
    ...(accepted ? { mostSuspicious: { frame: { session: sessionB, index: 1 }, ordinal: 1 } } : {}),
  });

test('the matrix has each pair in both orders', () => {
  const matrix = new Matrix([cell(1, 1, 3), cell(1, 12, 40, 0.9), cell(2, 12, 0)]);
  assert.deepEqual(matrix.sessions, [1, 2, 12]);
  assert.equal(matrix.cell(12, 1), matrix.cell(1, 12));
  assert.equal(matrix.cell(1, 2), undefined);
  assert.equal(matrix.most('accepted'), 40);
  assert.equal(matrix.most('suspicion'), 90);
  assert.deepEqual(matrix.suspicious(5).map(({ sessionB }) => sessionB), [12, 1]); // 2 and 12 have nothing in force
  assert.equal(measureOf('toString'), 'accepted');
});

test('windows of the matrix begin at multiples, within the list', () => {
  assert.deepEqual([null, '0', '17', '999', '-3', 'x'].map((text) => windowStart(text, 40)), [0, 0, 16, 32, 0, 0]);
  assert.equal(windowStart('16', 0), 0);
  assert.deepEqual([heat(0, 9), heat(1, 1000), heat(1000, 1000), heat(5, 0)], [0, 1, 4, 0]);
});

test('what goes with a session is counted, and its name has to be typed', () => {
  const going = goingWith(1, [cell(1, 1, 3), cell(1, 12, 40), cell(2, 12, 7)], [
    create(LabelledFramesSchema, { label: 'door', frames: [{ session: 1, index: 4 }, { session: 2, index: 1 }] }),
    create(LabelledFramesSchema, { label: 'dock', frames: [{ session: 12, index: 4 }] }),
  ]);
  assert.deepEqual(going, { closures: 45, inForceWithOthers: 40, others: 1, labels: ['door'] });
  assert.equal(closuresText(going), '45 loop closures, of which 40 join it to 1 other session');
  assert.equal(closuresText(goingWith(3, [], [])), 'no loop closure');
  assert.equal(wordToType(sessions[0]!, 'Morning'), 'Morning');
  assert.equal(wordToType(sessions[0]!, '  '), 'session 1');
});

const progress = (init: MessageInitShape<typeof ProgressSchema>) => create(ProgressSchema, init);

test('the progress of a job, in words', () => {
  assert.equal(share(null), null);
  assert.equal(share(progress({ done: 5n })), null);
  assert.equal(share(progress({ done: 5n, total: 4n })), 1);
  assert.equal(progressText(progress({ step: 'checking', done: 1200n, total: 4000n, unit: 'frames' })), 'checking: 1,200 of 4,000 frames');
  assert.equal(progressText(progress({ done: 1_500_000n, unit: 'bytes' })), '1.5 MB');
  const job = { ...begun('backup', 'x', 0), progress: progress({ done: 1n, total: 4n }) };
  assert.equal(remainingText(job, 10_000), 'about 30 s to go');
  assert.equal(remainingText(job, 1_000), '');
});

test('what a job came to, in words', () => {
  const job = begun('compact', 'x', 0);
  assert.equal(
    outcomeText({ ...job, progress: progress({ outcome: { case: 'compact', value: { bytesBefore: 9_000_000n, bytesAfter: 4_000_000n } } as never }) }),
    'The map has 4.0 MB now, 5.0 MB less than before.',
  );
  const summary = create(VerifySummarySchema, { sessions: 1n, frames: 65n, edges: 90n, landmarks: 4n });
  assert.match(outcomeText({ ...job, summary }), /^The map is sound: 1 session, 65 frames/);
  assert.match(outcomeText({ ...job, summary: { ...summary, findings: 2n } }), /^2 findings/);
});

test('lists of sessions to verify', () => {
  assert.deepEqual(parseSessions(' 5, 3 3;7 '), [3, 5, 7]);
  assert.deepEqual(parseSessions(''), []);
  for (const text of ['0', 'x', '1-3', '-1', '4294967296', '1.5']) assert.equal(parseSessions(text), null, text);
});

test('labels: what is asked for, what may be added, pages together', () => {
  assert.deepEqual(request(' a b ', 'words'), { words: 'a b' });
  assert.deepEqual(request('a ', 'prefix'), { prefix: 'a ' });
  assert.equal(wrongWith('door'), '');
  assert.match(wrongWith('   '), /white space/);
  assert.match(wrongWith('é'.repeat(33)), /this one has 66/);
  const labelled = (label: string, index: number) => create(LabelledFramesSchema, { label, frames: [{ session: 1, index }] });
  const all = joined([[labelled('a', 1), labelled('b', 2)], [labelled('b', 3), labelled('c', 4)]]);
  assert.deepEqual(all.map(({ label, frames }) => [label, frames.length]), [['a', 1], ['b', 2], ['c', 1]]);
});

test('the audit log is asked for times in UTC', () => {
  assert.equal(timeUs('2026-11-30T21:04'), BigInt(Date.UTC(2026, 10, 30, 21, 4)) * 1000n);
  for (const text of ['', 'x', '2026-13-40T99:99', '2026-11-30']) assert.equal(timeUs(text), 0n, text);
  const query = { who: ' anna ', method: '', failed: true, from: '2026-11-30T21:04', until: '2026-11-30T21:03', reads: false };
  assert.notEqual(wrongWithQuery(query), '');
  assert.equal(wrongWithQuery({ ...query, until: '' }), '');
  assert.deepEqual(auditRequest({ ...query, from: '', until: '' }), { who: 'anna', method: '', failed: true, fromUs: 0n, untilUs: 0n });
});

test('what only reads is left out of the audit log, unless it failed or is asked for', () => {
  const query = { who: '', method: '', failed: false, from: '', until: '', reads: false };
  assert.equal(isShown(query, { method: 'Admin.ListAudit', outcome: 0 }), false);
  assert.equal(isShown(query, { method: 'Admin.ListAudit', outcome: 22 }), true);
  assert.equal(isShown(query, { method: 'Admin.Verify', outcome: 0 }), true);
  assert.equal(isShown({ ...query, reads: true }, { method: 'Admin.GetStats', outcome: 0 }), true);
  assert.equal(isShown({ ...query, method: 'Admin.GetStats' }, { method: 'Admin.GetStats', outcome: 0 }), true);
});
