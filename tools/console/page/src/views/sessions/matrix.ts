// The loop closures between sessions, as a table of a window of them.
import type { ClosureMatrixCell } from '../../proto/relmap/v1/evidence_pb';

export const kWindow = 16; // sessions on a side

export const measures = {
  accepted: 'in force',
  suspicion: 'suspicion of the worst, %',
  candidate: 'candidates',
  quarantined: 'quarantined',
  removed: 'removed',
};
export type Measure = keyof typeof measures;

export function measureOf(text: string | null): Measure {
  return text !== null && Object.hasOwn(measures, text) ? (text as Measure) : 'accepted';
}

// What a cell shows: a whole number.
export function valueOf(cell: ClosureMatrixCell, measure: Measure): number {
  return measure === 'suspicion' ? Math.round(cell.suspicion * 100) : cell[measure];
}

export class Matrix {
  private cells = new Map<string, ClosureMatrixCell>();
  readonly sessions: number[]; // those that have closures, ascending

  constructor(cells: ClosureMatrixCell[]) {
    const numbers = new Set<number>();
    for (const cell of cells) {
      this.cells.set(`${cell.sessionA}:${cell.sessionB}`, cell);
      numbers.add(cell.sessionA).add(cell.sessionB);
    }
    this.sessions = [...numbers].sort((a, b) => a - b);
  }

  // In any order.
  cell(a: number, b: number): ClosureMatrixCell | undefined {
    return this.cells.get(a <= b ? `${a}:${b}` : `${b}:${a}`);
  }

  most(measure: Measure): number {
    let most = 0;
    for (const cell of this.cells.values()) most = Math.max(most, valueOf(cell, measure));
    return most;
  }

  // Pairs with something in force, the most suspicious first.
  suspicious(most: number): ClosureMatrixCell[] {
    return [...this.cells.values()]
      .filter((cell) => cell.mostSuspicious)
      .sort((a, b) => b.suspicion - a.suspicion || b.accepted - a.accepted)
      .slice(0, most);
  }
}

// The first of a window of `kWindow` of `all`, which a text of the address asks for.
export function windowStart(text: string | null, all: number): number {
  const start = Math.floor(Number(text ?? 0) / kWindow) * kWindow;
  const last = Math.max(0, Math.floor((all - 1) / kWindow) * kWindow);
  return Math.min(Math.max(0, Number.isFinite(start) ? start : 0), last);
}

// 0..4: how strong a cell's colour is. Roots, since counts of pairs differ by orders of magnitude.
export function heat(value: number, most: number): number {
  return value <= 0 || most <= 0 ? 0 : Math.max(1, Math.round(4 * Math.sqrt(Math.min(1, value / most))));
}
