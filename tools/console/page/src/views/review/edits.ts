// Edits of closures: what they ask the daemon for, and what undoes them (docs/operations.md has the same table).
import { EdgeState } from '../../proto/relmap/v1/graph_pb';
import type { EditEffect } from '../../proto/relmap/v1/map_pb';
import { Reason } from '../../proto/relmap/v1/reason_pb';
import { edgeText } from '../../lib/ids';

export type What = 'remove' | 'removeAlone' | 'restore' | 'accept' | 'withdraw';
export type Made = What | 'propose' | 'proposeAccepted';

// An edit that this operator made in this browser session.
export interface Done {
  id: string; // its idempotency key
  name: string; // the closure, 6:120/1
  ends: string; // "6:10 – 6:120"
  what: Made;
  note: string;
  when: number; // ms
  sequence: string; // of the journal
  state: EdgeState; // of the closure afterwards
  changed: number; // closures that it changed, this one included
  undo: What[]; // steps, in their order; those that are left, if somebody began
  undone: boolean;
  byUndo: boolean; // it took back another one
}

export function requestOf(what: What): { state: EdgeState; decided: boolean; alone: boolean } {
  switch (what) {
    case 'remove':
      return { state: EdgeState.REMOVED, decided: false, alone: false };
    case 'removeAlone':
      return { state: EdgeState.REMOVED, decided: false, alone: true };
    case 'restore':
      return { state: EdgeState.ACCEPTED, decided: false, alone: false };
    case 'accept':
      return { state: EdgeState.ACCEPTED, decided: true, alone: false };
    case 'withdraw':
      return { state: EdgeState.CANDIDATE, decided: false, alone: false };
  }
}

// What undoes an edit. A closure that had been removed alone is removed alone again.
export function undoOf(what: Made, name: string, effect: EditEffect | undefined): What[] {
  switch (what) {
    case 'remove':
    case 'removeAlone':
      return ['restore'];
    case 'restore': {
      const own = effect?.closures.find((change) => edgeText(change.id) === name);
      return [own?.reasonBefore === Reason.REMOVED_ALONE ? 'removeAlone' : 'remove'];
    }
    case 'accept':
      return ['withdraw'];
    case 'withdraw':
      return ['accept'];
    case 'propose':
      return ['removeAlone'];
    case 'proposeAccepted':
      return ['withdraw', 'removeAlone'];
  }
}

// What may be done to a closure in this state.
export function possible(state: EdgeState, reason: Reason): Record<What, boolean> {
  const removed = state === EdgeState.REMOVED;
  const decided = reason === Reason.ACCEPTED_BY_OPERATOR;
  return {
    remove: !removed,
    removeAlone: !removed,
    restore: removed,
    accept: !(state === EdgeState.ACCEPTED && decided),
    withdraw: state === EdgeState.ACCEPTED && decided,
  };
}

export const titles: Record<What, string> = {
  remove: 'Remove',
  removeAlone: 'Remove alone',
  restore: 'Restore',
  accept: 'Accept',
  withdraw: 'Withdraw the decision',
};

// What each does, in a sentence for whoever is about to do it.
export const meanings: Record<What, string> = {
  remove:
    'Takes the closure out of the map, with all closures that agree with it: what agreed with a wrong one is wrong, too. ' +
    'It can be restored.',
  removeAlone:
    'Takes out this closure alone, such as a reflection or a moved object among right ones. Those that agree with it stay ' +
    'in force. It can be restored.',
  restore: 'Undoes the removal: the closure, and those that were removed with it, return to their former states.',
  accept:
    'Puts the closure into force by your decision: it is never outvoted, and closures that contradict it are put out of ' +
    'force. You can withdraw it.',
  withdraw: 'Takes your decision back: the map judges the closure by itself, as if nobody had decided.',
};

export const madeTexts: Record<Made, string> = {
  remove: 'Removed, with those that agree',
  removeAlone: 'Removed alone',
  restore: 'Restored',
  accept: 'Accepted',
  withdraw: 'Decision withdrawn',
  propose: 'Proposed',
  proposeAccepted: 'Proposed and accepted',
};

// ---- The list, the newest first

const kMost = 200;

export function withDone(list: Done[], done: Done): Done[] {
  return [done, ...list].slice(0, kMost);
}

// The first step that undoes it is done. It is undone with the last one.
export function withStepUndone(list: Done[], id: string, sequence: string): Done[] {
  return list.map((done) => {
    if (done.id !== id) return done;
    const undo = done.undo.slice(1);
    return undo.length ? { ...done, undo, sequence } : { ...done, undone: true };
  });
}

// Whether an edit of this closure changes nothing but its own state.
export function onlyItself(name: string, effect: EditEffect | undefined, alsoChanged: readonly unknown[]): boolean {
  const { closures = [], carried = [], notCarried = [] } = effect ?? {};
  return !alsoChanged.length && !carried.length && !notCarried.length && closures.every(({ id }) => edgeText(id) === name);
}

// The edit that "undo" takes back: going back, not to and fro.
export function lastToUndo(list: Done[]): Done | null {
  return list.find((done) => !done.undone && !done.byUndo) ?? null;
}

// Whether an event tells of one of these edits, or of what happened to a closure before the last of them.
export function isOld(list: Done[], event: { name: string; sequence: string }): boolean {
  const at = BigInt(event.sequence || 0);
  return list.some(({ name, sequence }) => {
    const done = BigInt(sequence || 0);
    return done === at || (name === event.name && done > at);
  });
}

// Others have changed the closure since: undoing is still asked for, but whoever does it should know. "" if not.
export function conflictOf(
  done: Done,
  history: { journalSequence: bigint; author: string; state: EdgeState }[],
  words: { state: (state: EdgeState) => string; author: (author: string) => string },
): string {
  const since = history.filter((event) => event.journalSequence > BigInt(done.sequence || 0));
  const last = since.at(-1);
  if (!last || !done.sequence) return '';
  return `Since then ${words.author(last.author)} has changed this closure: it is now ${words.state(last.state)}.`;
}

export function readList(text: string | null): Done[] {
  try {
    const list = JSON.parse(text ?? '[]') as unknown;
    return Array.isArray(list) ? (list as Done[]).filter((each) => each && typeof each.name === 'string' && Array.isArray(each.undo)) : [];
  } catch {
    return [];
  }
}
