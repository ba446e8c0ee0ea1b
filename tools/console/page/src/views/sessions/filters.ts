// Which sessions are listed, and in what order.
import type { Session } from '../../proto/relmap/v1/graph_pb';
import { SessionState } from '../../proto/relmap/v1/graph_pb';

export const kPerPage = 50;

export const stateWords: Record<SessionState, string> = {
  [SessionState.OPEN]: 'open',
  [SessionState.ENDED]: 'ended',
  [SessionState.FROZEN]: 'frozen',
  [SessionState.DELETING]: 'being deleted',
};

export const orders = {
  newest: { title: 'newest frame first', compare: (a: Session, b: Session) => Number(b.lastTimeUs - a.lastTimeUs) || b.number - a.number },
  number: { title: 'number', compare: (a: Session, b: Session) => a.number - b.number },
  name: { title: 'name', compare: (a: Session, b: Session) => a.name.localeCompare(b.name) || a.number - b.number },
  robot: { title: 'robot', compare: (a: Session, b: Session) => a.robot.localeCompare(b.robot) || b.number - a.number },
  frames: { title: 'most frames first', compare: (a: Session, b: Session) => b.frames - a.frames || a.number - b.number },
  refused: { title: 'most refused first', compare: (a: Session, b: Session) => b.refused - a.refused || b.number - a.number },
};
export type Order = keyof typeof orders;

export interface Filter {
  words: string; // all of them must be in its number, name or robot
  state: SessionState | null;
  order: Order;
}

export function filtered(sessions: Session[], { words, state, order }: Filter): Session[] {
  const wanted = words.toLowerCase().split(/\s+/).filter(Boolean);
  return sessions
    .filter((session) => state === null || session.state === state)
    .filter((session) => {
      const text = `${session.number} ${session.name} ${session.robot}`.toLowerCase();
      return wanted.every((word) => text.includes(word));
    })
    .sort(orders[order].compare);
}

export function orderOf(text: string | null): Order {
  return text !== null && Object.hasOwn(orders, text) ? (text as Order) : 'newest';
}

export function stateOf(text: string | null): SessionState | null {
  const state = Number(text ?? NaN);
  return text !== '' && state in stateWords ? (state as SessionState) : null;
}

// The page (from 0) on which the n-th of a list lies, and a page that exists.
export function pageOf(index: number): number {
  return index < 0 ? 0 : Math.floor(index / kPerPage);
}
export function pageCount(all: number): number {
  return Math.max(1, Math.ceil(all / kPerPage));
}
export function clampPage(text: string | null, all: number): number {
  const page = Math.floor(Number(text ?? 1)) - 1;
  return Math.min(Math.max(0, Number.isFinite(page) ? page : 0), pageCount(all) - 1);
}
