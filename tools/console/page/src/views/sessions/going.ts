// What goes with a session when it is deleted.
import { counted } from '../../lib/format';
import type { ClosureMatrixCell } from '../../proto/relmap/v1/evidence_pb';
import type { LabelledFrames, Session } from '../../proto/relmap/v1/graph_pb';

// What has to be typed to delete it: its name, as it is shown.
export function wordToType(session: Session, shown: string): string {
  return shown.trim() || `session ${session.number}`;
}

export interface Going {
  closures: number; // of any state, within it and with others
  inForceWithOthers: number;
  others: number; // sessions that it has closures in force with
  labels: string[];
}

export function goingWith(session: number, cells: ClosureMatrixCell[], labels: LabelledFrames[]): Going {
  const going: Going = { closures: 0, inForceWithOthers: 0, others: 0, labels: [] };
  for (const cell of cells) {
    if (cell.sessionA !== session && cell.sessionB !== session) continue;
    going.closures += cell.accepted + cell.candidate + cell.quarantined + cell.removed;
    if (cell.sessionA === cell.sessionB || cell.accepted === 0) continue;
    going.inForceWithOthers += cell.accepted;
    ++going.others;
  }
  for (const { label, frames } of labels)
    if (frames.some((frame) => frame.session === session)) going.labels.push(label);
  return going;
}

export function closuresText(going: Going): string {
  if (going.closures === 0) return 'no loop closure';
  return (
    counted(going.closures, 'loop closure') +
    (going.others
      ? `, of which ${counted(going.inForceWithOthers, 'joins', 'join')} it to ${counted(going.others, 'other session')}`
      : ', none in force with another session')
  );
}
