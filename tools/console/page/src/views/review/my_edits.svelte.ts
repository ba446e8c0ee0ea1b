// The edits of this operator in this browser session: made, and to be undone.
import type { SetEdgeStateReply } from '../../proto/relmap/v1/map_pb';
import { edgeId, type Edge as EdgeName } from '../../lib/ids';
import { map } from '../../lib/rpc';
import { readList, requestOf, withDone, withStepUndone, type Done, type What } from './edits';

const kKey = 'relmap-closure-edits';

class MyEdits {
  list = $state.raw<Done[]>(readList(sessionStorage.getItem(kKey)));

  add(done: Done) {
    this.keep(withDone(this.list, done));
  }
  stepUndone(id: string, sequence: string) {
    this.keep(withStepUndone(this.list, id, sequence));
  }
  private keep(list: Done[]) {
    this.list = list;
    sessionStorage.setItem(kKey, JSON.stringify(list));
  }
}
export const myEdits = new MyEdits();

export interface How {
  dryRun: boolean;
  note?: string;
  key?: string;
  shown?: bigint;
}

// An edit on a large map takes as long as the map is solved again.
export function setEdgeState(edge: EdgeName, what: What, how: How): Promise<SetEdgeStateReply> {
  return map.setEdgeState(
    {
      edge: edgeId(edge),
      ...requestOf(what),
      dryRun: how.dryRun,
      note: how.note ?? '',
      idempotencyKey: how.key ?? '',
      shown: what === 'remove' || what === 'removeAlone' ? (how.shown ?? 0n) : 0n,
    },
    { timeoutMs: 180_000 },
  );
}
