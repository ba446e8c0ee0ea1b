// What is wrong with a robot that brings keyframes, the same as `relmap top` and `relmap status` say.
import { counted, plain, seconds } from '../../lib/format';
import { reasonText } from '../../lib/reasons';
import { Reason } from '../../proto/relmap/v1/reason_pb';
import type { Robot } from '../../proto/relmap/v1/status_pb';

export interface Trouble {
  urgent: boolean; // false: it may have a good reason, as of a robot that was switched off
  word: string;
  reason: string; // of the runbook: a reason or an alert; empty: none
  what: string; // a sentence for the operator
}

const kReasons = [
  [Reason.SEQUENCE_CONFLICT, 'Two robots send keyframes of one session. Has a spool been copied?'],
  [Reason.SESSION_DELETED, 'It sends keyframes of a session that was deleted. They are not accepted; let it begin a new session.'],
  [Reason.SESSION_FROZEN, 'It sends keyframes of a session that is frozen. Thaw the session, or let the robot begin a new one.'],
  [Reason.RATE_LIMITED, 'It sends more than the daemon takes from one robot. It keeps the rest and sends it later.'],
] as const;

// All that is wrong with it, the worst first. `frozen`: the frozen sessions.
export function troublesOf(robot: Robot, frozen: ReadonlySet<number>): Trouble[] {
  const troubles: Trouble[] = [];
  const urgent = (word: string, reason: string, what: string) => troubles.push({ urgent: true, word, reason, what });
  const has = (list: { reason: Reason }[], reason: Reason) => list.some((each) => each.reason === reason);

  if (robot.blocked !== Reason.OK)
    urgent('blocked', reasonText(robot.blocked), 'Its keyframes cannot be written to the journal. It keeps them until they can.');
  if (robot.sameName.length > 0)
    urgent('same name', '',
      `Another robot sends under the same name, for session ${plain(robot.sameName[0]!, 8)}. Give each a name of its own (--robot).`);
  for (const [reason, what] of kReasons) {
    const refused = reason !== Reason.RATE_LIMITED && reason !== Reason.SEQUENCE_CONFLICT && has(robot.refused, reason);
    // It may have been thawed since.
    if (reason === Reason.SESSION_FROZEN ? refused && frozen.has(robot.session) : refused || has(robot.notTaken, reason))
      urgent('not accepted', reasonText(reason), what);
  }
  if (robot.session === 0 && robot.refused.length > 0)
    urgent('not begun', reasonText(robot.refused[0]!.reason), 'All that it sent was refused, so its session has not begun.');
  if (robot.droppedMessages > 0n)
    urgent('messages dropped', '',
      `It sends faster than the daemon reads: ${counted(robot.droppedMessages, 'message')} had no room. Nothing is lost; it sends them again.`);
  if (robot.silent)
    troubles.push({
      urgent: false,
      word: 'silent',
      reason: 'RelmapRobotSilent',
      what: `Nothing was heard of it for ${seconds(Number(robot.silentUs) / 1e6)}, and its session has not ended.`,
    });
  return troubles;
}

export interface RobotRow {
  robot: Robot;
  troubles: Trouble[];
}

// The worst first; among equals by name and session, so that rows keep their places.
export function worstFirst(robots: Robot[], frozen: ReadonlySet<number>): RobotRow[] {
  const rank = ({ troubles }: RobotRow) => (troubles.length === 0 ? 2 : troubles[0]!.urgent ? 0 : 1);
  const order = (a: string, b: string) => (a < b ? -1 : a > b ? 1 : 0);
  return robots
    .map((robot) => ({ robot, troubles: troublesOf(robot, frozen) }))
    .sort((a, b) =>
      rank(a) - rank(b) || order(a.robot.robot, b.robot.robot) || a.robot.session - b.robot.session || order(a.robot.uuid, b.robot.uuid));
}

// "3 robots stream, 1 of them needs attention; 2 are silent."
export function fleetText(rows: RobotRow[]): string {
  const silent = rows.filter(({ robot }) => robot.silent).length;
  const urgent = rows.filter(({ troubles }) => troubles[0]?.urgent).length;
  const heard = rows.length - silent;
  return (
    `${counted(heard, 'robot')} heard of in the last minute` +
    (urgent ? `; ${counted(urgent, 'needs', 'need')} attention` : '') +
    (silent ? `; ${counted(silent, 'has', 'have')} fallen silent` : '') +
    '.'
  );
}
