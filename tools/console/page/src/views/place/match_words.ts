// What the daemon says of a view, in words.
import { Verification } from '../../proto/relmap/v1/common_pb';
import type { MatchImageReply, PlaceMatch } from '../../proto/relmap/v1/map_pb';
import { Reason } from '../../proto/relmap/v1/reason_pb';
import { counted, metres } from '../../lib/format';
import { reasonText } from '../../lib/reasons';

export function percent(probability: number): string {
  if (probability > 0 && probability < 0.01) return 'under 1 %';
  if (probability < 1 && probability > 0.99) return 'over 99 %';
  return `${Math.round(probability * 100)} %`;
}

export interface Verdict {
  tone: 'good' | 'warn' | 'bad';
  text: string;
}

// The answer in one sentence.
export function verdictOf(reply: MatchImageReply): Verdict {
  const first = reply.places[0];
  switch (reply.reason) {
    case Reason.OK:
      return { tone: 'good', text: 'The place was recognised, and geometry confirms it.' };
    case Reason.NEW_PLACE:
      return { tone: 'warn', text: 'Most likely the map does not hold this place.' };
    case Reason.AMBIGUOUS_PLACE:
      return { tone: 'warn', text: 'Several places explain the picture about as well.' };
    case Reason.WRONG_CALIBRATION:
      return { tone: 'bad', text: 'What is seen fits another camera than the one that was chosen.' };
    default:
      return {
        tone: 'warn',
        text: first ? 'No place is confirmed: these are only likely by appearance.' : 'No place was recognised.',
      };
  }
}

export function verificationWords(place: PlaceMatch): string {
  const confirmed = `${counted(place.inliers, 'point')} agree over ${Math.round(place.spread * 100)} % of the picture`;
  switch (place.verification) {
    case Verification.STEREO:
    case Verification.PNP: {
      const t = place.frameFromView?.translation;
      const from = t ? `; taken ${metres(Math.hypot(t.x, t.y, t.z))} from there` : '';
      const f = place.estimatedFocalLength ? `; focal length about ${Math.round(place.estimatedFocalLength)} pixels` : '';
      return `confirmed in metres: ${confirmed}${from}${f}`;
    }
    case Verification.EPIPOLAR:
      return `confirmed, but without metres: ${confirmed}`;
    case Verification.HOMOGRAPHY:
      return `confirmed by one plane, without metres: ${confirmed}`;
    default:
      return `not confirmed: ${place.message || reasonText(place.reason)}`;
  }
}

export function isConfirmed(place: PlaceMatch): boolean {
  return place.verification !== Verification.NONE;
}

// What to do about a failure of a question, beyond its message; "" where the message says all.
export function advice(reason: string): string {
  switch (reason) {
    case 'NOT_CONNECTED':
      return 'No chain of edges in force joins the two. A missing closure may be proposed in Review, or the robot drives from one to the other once.';
    case 'OUT_OF_REACH':
      return 'They are further apart than one search may go. Route to a place in between first.';
    case 'COST_LIMIT':
      return 'All ways cost more than the limit.';
    case 'NO_SUCH_LABEL':
      return 'No frame has this label. Labels lists all that there are.';
    case 'NO_SUCH_FRAME':
      return 'A frame is session:index. Sessions lists the indices that each has.';
    case 'NEW_PLACE':
      return 'The map most likely does not hold the place of the picture.';
    case 'AMBIGUOUS_PLACE':
      return 'Choose one of the places above, or take a picture that shows more of what is particular.';
    case 'NO_CALIBRATION':
      return 'Say which session’s camera took the picture.';
    case 'TOO_FEW_FEATURES':
      return 'The picture shows too little: blur, darkness, a bare wall. Take another one.';
    case 'WRONG_CALIBRATION':
      return 'Choose another camera, or none.';
    case 'EMPTY_MAP':
      return 'The map holds no frames yet.';
    default:
      return '';
  }
}
