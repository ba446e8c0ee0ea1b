// What needs attention, the most urgent first: what `relmap status` lists, and queues that are long for too long.
import { bytes, count, counted, plain, seconds } from '../../lib/format';
import { reasonText } from '../../lib/reasons';
import { Reason } from '../../proto/relmap/v1/reason_pb';
import type { GetStatusReply } from '../../proto/relmap/v1/status_pb';
import type { RobotRow } from '../fleet/trouble';

export interface Fact {
  where: string;
  what: string;
  reason: string; // of the runbook: a reason or an alert; empty: none
  robot?: string; // leads to it in the fleet
  session?: number; // leads to it in the list
  urgent: boolean;
}

const kNearlyFull = 0.95; // of a share of the memory
// The shares that hold somebody back when they are full, and what is then noticed.
const feltWhenFull: Record<string, string> = {
  queues: 'robots are told to wait',
  reassembly: 'robots are told to wait',
  replies: 'callers are refused',
  views: 'long exports may be cut off (VIEW_EXPIRED)',
  sessions: 'new sessions are refused',
};
const kWorkerRecords = 256; // records that wait
const kLookupsS = 2; // as the alert RelmapLookupsBehind

export function isNearlyFull(share: { used: bigint; allowance: bigint }): boolean {
  return share.allowance > 0n && Number(share.used) >= kNearlyFull * Number(share.allowance);
}

export function needsAttention(s: GetStatusReply, robots: RobotRow[]): Fact[] {
  const facts: Fact[] = [];
  const say = (where: string, what: string, reason: string, more: Partial<Fact> = {}) =>
    facts.push({ where, what: plain(what, 600), reason, urgent: true, ...more });
  const unless = (where: string, reason: Reason, message: string, before = '') => {
    if (reason !== Reason.OK) say(where, before + message, reasonText(reason));
  };

  unless('storage', s.storageReason, s.storageMessage);
  for (const { name, reason, message } of s.components)
    if (reason !== s.storageReason && reason !== s.lcmReason) unless(name, reason, message);
  if (s.clockSteps > 0n)
    say('clock',
      `It was set ${s.lastClockStepS > 0 ? 'forward' : 'back'} by ${seconds(Math.abs(s.lastClockStepS))}, ${counted(s.clockSteps, 'time')} since the start: times of keyframes jump as much.`,
      'RelmapClockStepped', { urgent: false });
  unless('LCM', s.lcmReason, s.lcmMessage);
  if (s.connections) unless('connections', s.connections.reason, s.connections.message);
  unless('access list', s.accessReason, s.accessMessage, 'It stays as it was: ');
  unless('certificate', s.certificateReason, s.certificateMessage);
  for (const { robot, troubles } of robots)
    for (const { urgent, what, reason } of troubles.slice(0, 1))
      say(`robot ${plain(robot.robot || robot.uuid.slice(0, 8), 40)}`, what, reason, { urgent, robot: robot.robot || robot.uuid });
  for (const camera of s.doubtfulCameras)
    say(`session ${camera.session}`,
      `${camera.robot}, ${camera.name}: its camera's calibration is in doubt: ${counted(camera.contradicted, 'keyframe contradicts', 'keyframes contradict')} it ` +
        `(against ${camera.against.length === 1 ? 'session' : 'sessions'} ${camera.against.join(', ')}), and these make no closures. The last: ${camera.message}. ` +
        'Calibrate the camera, and take the drive in again.',
      'WRONG_CALIBRATION', { session: camera.session });
  if (s.placesLeftOut > 0n)
    say('places', `${counted(s.placesLeftOut, 'frame has', 'frames have')} no room in the place index: their places are not recognised.`, 'BUDGET_EXCEEDED');
  if (s.queued > kWorkerRecords) say('worker', `${counted(s.queued, 'record waits', 'records wait')} to become part of the map.`, 'RelmapWorkerBehind');
  if (s.lookupLagS > kLookupsS)
    say('lookups', `Place recognition is ${seconds(s.lookupLagS)} behind: ${counted(s.lookupLag, 'keyframe waits', 'keyframes wait')} for it.`, 'RelmapLookupsBehind');
  for (const share of s.memoryShares) {
    const felt = feltWhenFull[share.name];
    if (felt && isNearlyFull(share))
      say('memory', `${share.name} hold ${bytes(share.used)} of ${bytes(share.allowance)}: ${felt}.`, 'RelmapMemoryFull');
  }
  return [...facts.filter(({ urgent }) => urgent), ...facts.filter(({ urgent }) => !urgent)];
}

// "1,234 frames in 12 sessions, 3 labels, 61,234 closures in force"
export function mapText(s: GetStatusReply): string {
  return (
    `${counted(s.frames, 'frame')} in ${counted(s.sessions, 'session')}, ${counted(s.labels, 'label')}, ` +
    `${counted(s.loopClosures?.accepted ?? 0n, 'loop closure')} in force, ${count(s.places)} places that can be recognised`
  );
}
