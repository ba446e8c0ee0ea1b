import assert from 'node:assert/strict';
import test from 'node:test';
import { create, type MessageInitShape } from '@bufbuild/protobuf';
import { Reason } from '../src/proto/relmap/v1/reason_pb';
import { GetStatusReplySchema, RobotSchema } from '../src/proto/relmap/v1/status_pb';
import { fleetText, troublesOf, worstFirst } from '../src/views/fleet/trouble';
import { needsAttention } from '../src/views/health/attention';
import { grown, merged, most, nearest, niceTop, pathOf, rowsOf, valuesOf, type Sample } from '../src/views/health/samples';

const robot = (init: MessageInitShape<typeof RobotSchema> = {}) => create(RobotSchema, { robot: 'cart', session: 3, ...init });
const none = new Set<number>();
const words = (init: MessageInitShape<typeof RobotSchema>, frozen = none) => troublesOf(robot(init), frozen).map(({ word }) => word);

test('what is wrong with a robot, the worst first', () => {
  assert.deepEqual(words({}), []);
  assert.deepEqual(words({ silent: true, blocked: Reason.DISK_FULL }), ['blocked', 'silent']);
  assert.deepEqual(words({ sameName: ['other'] }), ['same name']);
  assert.deepEqual(words({ session: 0, refused: [{ reason: Reason.BAD_NAME, count: 1n }] }), ['not begun']);
  assert.deepEqual(words({ droppedMessages: 3n }), ['messages dropped']);
  const conflict = troublesOf(robot({ notTaken: [{ reason: Reason.SEQUENCE_CONFLICT, count: 1n }] }), none);
  assert.equal(conflict[0]!.reason, 'SEQUENCE_CONFLICT');
});

test('a frozen session counts only while it is frozen; refused keyframes alone are no trouble', () => {
  const refused = { refused: [{ reason: Reason.SESSION_FROZEN, count: 4n }] };
  assert.deepEqual(words(refused, new Set([3])), ['not accepted']);
  assert.deepEqual(words(refused), []);
  assert.deepEqual(words({ refused: [{ reason: Reason.SESSION_DELETED, count: 4n }] }), ['not accepted']);
  assert.deepEqual(words({ refused: [{ reason: Reason.CORRUPT, count: 4n }] }), []);
});

test('robots in trouble come first, others keep their places', () => {
  const rows = worstFirst(
    [robot({ robot: 'b' }), robot({ robot: 'silent', silent: true }), robot({ robot: 'a' }), robot({ robot: 'z', blocked: Reason.READ_ONLY })],
    none,
  );
  assert.deepEqual(rows.map((row) => row.robot.robot), ['z', 'silent', 'a', 'b']);
  assert.equal(fleetText(rows), '3 robots heard of in the last minute; 1 needs attention; 1 has fallen silent.');
  assert.equal(fleetText(worstFirst([robot()], none)), '1 robot heard of in the last minute.');
});

const status = (init: MessageInitShape<typeof GetStatusReplySchema>) => create(GetStatusReplySchema, init);

test('nothing needs attention in a daemon that is well', () => {
  assert.deepEqual(needsAttention(status({ components: [{ name: 'worker' }], memoryShares: [{ name: 'cache', used: 10n, allowance: 10n }] }), []), []);
});

test('what needs attention, each once, the urgent first', () => {
  const facts = needsAttention(
    status({
      storageReason: Reason.DISK_FULL,
      storageMessage: '200 MiB are left\u202e',
      components: [{ name: 'storage', reason: Reason.DISK_FULL, message: 'the same' }, { name: 'worker', reason: Reason.STALLED, message: 'for 6 s' }],
      clockSteps: 1n,
      lastClockStepS: -3,
      accessReason: Reason.BAD_CONFIG,
      accessMessage: 'line 4',
      certificateReason: Reason.BAD_CONFIG,
      certificateMessage: 'expires',
      placesLeftOut: 3n,
      lookupLagS: 5,
      lookupLag: 9n,
      memoryShares: [{ name: 'queues', used: 96n, allowance: 100n }, { name: 'cache', used: 100n, allowance: 100n }],
      doubtfulCameras: [{ session: 6, robot: 'cart', name: 'x', against: [1, 2], contradicted: 4n, message: 'f 412' }],
    }),
    worstFirst([robot({ silent: true }), robot({ blocked: Reason.DISK_FULL })], none),
  );
  assert.deepEqual(
    facts.map(({ where }) => where),
    ['storage', 'worker', 'access list', 'certificate', 'robot cart', 'session 6', 'places', 'lookups', 'memory', 'clock', 'robot cart'],
  );
  assert.equal(facts[0]!.what, '200 MiB are left\\u202e');
  assert.equal(facts.at(-1)!.urgent, false);
});

const sample = (t: number, more: Partial<Sample> = {}): Sample => ({ t, reachable: true, ...more });

test('samples of an hour are kept, each once', () => {
  const old = [sample(1000), sample(6000)];
  assert.deepEqual(merged(old, [sample(6000), sample(11_000)]).map(({ t }) => t), [1000, 6000, 11_000]);
  assert.deepEqual(merged(old, [sample(3_602_000)]).map(({ t }) => t), [6000, 3_602_000]);
  assert.deepEqual(merged([], []), []);
});

test('what is not known is a gap, and counts begin anew with the daemon', () => {
  const samples = [sample(0, { refused: 5 }), sample(1, { refused: 7 }), { t: 2, reachable: false, refused: 9 }, sample(3, { refused: 1 }), sample(4, {}), sample(5, { refused: NaN })];
  assert.deepEqual(valuesOf(samples, 'refused'), [5, 7, null, 1, null, null]);
  assert.deepEqual(grown(valuesOf(samples, 'refused')), [0, 2, null, 3, null, null]);
});

test('lines break where nothing is known', () => {
  const times = [0, 50, 100, 150];
  assert.equal(pathOf(times, [0, 10, null, 5], { from: 0, to: 100 }, 10, 100, 100), 'M0.0 100.0L50.0 0.0M150.0 50.0');
  assert.equal(pathOf([0, 90_000], [1, 1], { from: 0, to: 90_000 }, 1, 10, 10).match(/M/g)!.length, 2);
  assert.equal(pathOf([], [], { from: 0, to: 0 }, 1, 10, 10), '');
});

test('axes end with a short number, and tables have a row a minute', () => {
  assert.deepEqual([0, NaN, 0.7, 1, 11, 23.4, 99, 61_000].map(niceTop), [1, 1, 0.8, 1, 15, 25, 100, 80_000]);
  assert.equal(most([[1, null], [3, 2]]), 3);
  assert.equal(nearest([0, 10, 20], 14), 1);
  assert.equal(nearest([], 3), -1);
  assert.deepEqual(rowsOf([0, 5_000, 59_000, 61_000, 65_000], 60_000), [4, 2]);
});
