// Closures in words: states, reasons, doubts, verdicts, and what an edit changes. The same words as `relmap edges`.
import type { MotionVerdict } from '../proto/relmap/v1/evidence_pb';
import { DoubtKind, EdgeState, MotionSource, type Uniqueness } from '../proto/relmap/v1/graph_pb';
import { Verification } from '../proto/relmap/v1/common_pb';
import { Reason } from '../proto/relmap/v1/reason_pb';
import { counted, metres } from './format';
import { frameText } from './ids';
import { reasonText } from './reasons';

export function stateText(state: EdgeState): string {
  switch (state) {
    case EdgeState.ACCEPTED:
      return 'in force';
    case EdgeState.CANDIDATE:
      return 'candidate';
    case EdgeState.QUARANTINED:
      return 'quarantined';
    case EdgeState.REMOVED:
      return 'removed';
    default:
      return 'unknown';
  }
}

// A sign for each state, so that it is told not only by colour.
export function stateSign(state: EdgeState): string {
  return { 0: '?', 1: '○', 2: '●', 3: '◐', 4: '✕' }[state] ?? '?';
}

const stateReasons: { [reason: number]: string } = {
  [Reason.CONSISTENT]: 'closures of neighbouring frames agree with it',
  [Reason.LONE]: 'no other closure agrees with it yet',
  [Reason.INCONSISTENT]: 'a larger set of closures contradicts it',
  [Reason.CONTRADICTS_MOTION]: 'the robot’s own motion contradicts it',
  [Reason.ACCEPTED_BY_OPERATOR]: 'an operator put it into force',
  [Reason.CARRIED]: 'other closures agree: the robot was carried before it saw this place',
  [Reason.BEYOND_DOUBT]: 'its geometry is strong, and no other place comes near it',
  [Reason.LOOKS_ALIKE]: 'pictures point to another place that looks alike, or the robot was carried there',
  [Reason.NOT_SEEN_BEYOND]: 'going on from there, the robot saw nothing of what the map shows',
  [Reason.AMBIGUOUS_PLACE]: 'another place explains the picture about as well',
  [Reason.REMOVED_BY_OPERATOR]: 'an operator took it out',
  [Reason.REMOVED_ALONE]: 'an operator took out this one alone, without those that agree with it',
  [Reason.REMOVED_WITH_SET]: 'it agrees with one that an operator took out',
  [Reason.SESSION_DELETED]: 'it replaces the path through a session that was deleted',
};

// Why a closure is in its state.
export function stateReasonText(reason: Reason): string {
  return stateReasons[reason] ?? reasonText(reason);
}

export function doubtText(kind: DoubtKind): string {
  switch (kind) {
    case DoubtKind.FEW_INLIERS:
      return 'few points agree';
    case DoubtKind.POOR_SPREAD:
      return 'the points lie in one part of the picture';
    case DoubtKind.IMPROBABLE:
      return 'improbable by appearance';
    case DoubtKind.RUNNER_UP:
      return 'another place fits nearly as well';
    case DoubtKind.CHANGED:
      return 'much looks different';
    case DoubtKind.CONTRADICTION:
      return 'contradicted';
    case DoubtKind.LONELY:
      return 'stands alone';
    case DoubtKind.TENSION:
      return 'under tension';
    case DoubtKind.UNSEEN:
      return 'what should follow was not seen';
    default:
      return 'doubtful';
  }
}

// What to look at because of a doubt.
export function doubtAdvice(kind: DoubtKind): string {
  switch (kind) {
    case DoubtKind.CONTRADICTION:
      return 'Look at what the motion says and at the closures that contradict it.';
    case DoubtKind.LONELY:
      return 'Drive there again: one more closure that agrees decides.';
    case DoubtKind.TENSION:
    case DoubtKind.UNSEEN:
      return 'Look at the pictures; remove it if they show two places.';
    case DoubtKind.RUNNER_UP:
      return 'Compare with the picture of the runner-up.';
    case DoubtKind.CHANGED:
      return 'Another place, or one that was rebuilt: see where the points are.';
    case DoubtKind.FEW_INLIERS:
    case DoubtKind.POOR_SPREAD:
      return 'See where the points are: points on one poster or one car prove little.';
    default:
      return '';
  }
}

// From this suspicion on a closure is called suspicious, in reports and here.
export const kSuspicious = 0.5;

export interface Said {
  tone: 'good' | 'bad' | 'neutral';
  short: string;
  text: string;
}

// What the way between the ends without the closure says of it.
export function verdictText(verdict: MotionVerdict | undefined): Said {
  if (!verdict) return { tone: 'neutral', short: 'not known', text: 'The daemon does not tell.' };
  const way =
    `The way without it (${counted(verdict.edges, 'edge')}, ${metres(verdict.distanceM)}) leads ` +
    `${metres(verdict.metresApart)} and ${((verdict.radiansApart * 180) / Math.PI).toFixed(1)}° from where the closure ` +
    `says: ${verdict.sigmasApart.toFixed(1)} standard deviations.`;
  const text = verdict.edges > 0 ? way : verdict.message;
  switch (verdict.verdict) {
    case Reason.OK:
      return { tone: 'good', short: 'agrees with it', text };
    case Reason.CONTRADICTS_MOTION:
      return { tone: 'bad', short: 'contradicts it', text };
    case Reason.CARRIED:
      return { tone: 'neutral', short: 'does not agree, since the robot was carried', text };
    case Reason.NOT_CONNECTED:
      return { tone: 'neutral', short: 'says nothing', text: 'There is no other way between the two ends.' };
    default:
      return { tone: 'neutral', short: 'says nothing', text: verdict.message || reasonText(verdict.verdict) };
  }
}

export function verificationText(verification: Verification): string {
  switch (verification) {
    case Verification.STEREO:
      return 'points in space against points in space';
    case Verification.PNP:
      return 'points in the picture against points in space';
    case Verification.EPIPOLAR:
      return 'points of two pictures, without metres';
    case Verification.HOMOGRAPHY:
      return 'points of one plane in two pictures, without metres';
    case Verification.IMPORTED:
      return 'not verified here: imported';
    case Verification.COMPOUNDED:
      return 'replaces the path through a deleted session';
    default:
      return 'not verified';
  }
}

export function uniquenessText(found: Uniqueness | undefined): string {
  if (!found) return 'It is not known whether another place fits, too.';
  const other = found.runnerUp
    ? `The best of the other places is ${frameText(found.runnerUp)}, with ${counted(found.runnerUpInliers, 'inlier')} and ` +
      `probability ${found.runnerUpProbability.toFixed(2)}; geometry confirms ${counted(found.alike, 'other place')}.`
    : 'Geometry confirms no other place.';
  const differs =
    found.differs === undefined ? '' : ` ${(found.differs * 100).toFixed(0)} % of what both should show differs.`;
  const changed = found.compared
    ? ` Of ${counted(found.compared, 'part')} of the picture ${found.changed} do not show what was seen there.`
    : '';
  return other + differs + changed;
}

// "anna", "the daemon"; "somebody" where the map does not know.
export function authorText(author: string): string {
  return author === 'relmapd' ? 'the daemon' : author || 'somebody';
}

export function motionSourceText(source: MotionSource): string {
  switch (source) {
    case MotionSource.ONE_EYE:
      return 'one eye';
    case MotionSource.GYRO:
      return 'the gyro only';
    case MotionSource.CONSTANT_VELOCITY:
      return 'a guess: as fast as before';
    case MotionSource.UNSENSED:
      return 'nothing: it may have been carried';
    default:
      return 'vision';
  }
}
