import { Reason } from '../proto/relmap/v1/reason_pb';

// "DISK_FULL"; a number for a reason that this page does not know.
export function reasonText(reason: Reason): string {
  return Reason[reason] ?? `REASON_${reason}`;
}
