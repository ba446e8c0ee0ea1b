// The closures to look at, in the order of the daemon's list, and what happens to them while somebody looks.
import type { MessageInitShape } from '@bufbuild/protobuf';
import type { FrameId } from '../../proto/relmap/v1/common_pb';
import { EdgeKind, EdgeState, type Edge } from '../../proto/relmap/v1/graph_pb';
import { EdgeOrder, type ListEdgesRequestSchema } from '../../proto/relmap/v1/map_pb';
import type { MapEvent } from '../../proto/relmap/v1/watch_pb';
import { edgeText, frameText, parseFrame } from '../../lib/ids';

// ---- Which closures

export interface Filters {
  states: EdgeState[];
  order: 'suspicion' | 'time';
  session: string;
  other: string; // with session: only closures between the two
  min: string; // suspicion, 0..1
  from: string; // UTC: 2026-11-30T21:04
  until: string;
  near: string; // a frame
  within: string; // metres around it; empty: 30 edges
}

const stateNames: [string, EdgeState][] = [
  ['accepted', EdgeState.ACCEPTED],
  ['candidate', EdgeState.CANDIDATE],
  ['quarantined', EdgeState.QUARANTINED],
  ['removed', EdgeState.REMOVED],
];
export const allStates = stateNames.map(([, state]) => state);

// Of the address. Without any it lists those in force, the most suspicious first.
export function readFilters(get: (name: string) => string | null): Filters {
  const states = (get('states') ?? 'accepted')
    .split(',')
    .flatMap((name) => (name === 'all' ? allStates : stateNames.filter(([each]) => each === name).map(([, state]) => state)));
  return {
    states: states.length ? [...new Set(states)] : [EdgeState.ACCEPTED],
    order: get('order') === 'time' ? 'time' : 'suspicion',
    session: get('session') ?? '',
    other: get('other') ?? '',
    min: get('min') ?? '',
    from: get('since') ?? '',
    until: get('until') ?? '',
    near: get('near') ?? '',
    within: get('within') ?? '',
  };
}

export function writeFilters(filters: Filters): Record<string, string | null> {
  const names = stateNames.filter(([, state]) => filters.states.includes(state)).map(([name]) => name);
  const states = names.length === stateNames.length ? 'all' : names.join(',');
  return {
    states: states === 'accepted' ? null : states,
    order: filters.order === 'time' ? 'time' : null,
    session: filters.session || null,
    other: filters.other || null,
    min: filters.min || null,
    since: filters.from || null,
    until: filters.until || null,
    near: filters.near || null,
    within: filters.within || null,
  };
}

// What is wrong with filters that somebody typed, or "".
export function filterProblem(filters: Filters): string {
  const number = (text: string) => /^\d{1,10}$/.test(text) && Number(text) > 0;
  if (filters.session && !number(filters.session)) return 'A session is a number, as in its list.';
  if (filters.other && !number(filters.other)) return 'The other session is a number, as in its list.';
  if (filters.other && !filters.session) return 'Choose a session before the other one.';
  if (filters.min && !(Number(filters.min) >= 0 && Number(filters.min) <= 1)) return 'Suspicion is from 0 to 1.';
  if (filters.near && !parseFrame(filters.near)) return 'A frame is written session:index, as 6:120.';
  if (filters.within && !(Number(filters.within) > 0)) return 'The distance is a number of metres over 0.';
  if (filters.within && !filters.near) return 'Enter the frame around which to look.';
  for (const time of [filters.from, filters.until])
    if (time && !microseconds(time)) return 'A time is written 2026-11-30T21:04, in UTC.';
  if (filters.from && filters.until && microseconds(filters.from) >= microseconds(filters.until))
    return 'The beginning of the time must be before its end.';
  return '';
}

function microseconds(time: string): bigint {
  const ms = Date.parse(/^\d{4}-\d\d-\d\d$/.test(time) ? `${time}T00:00Z` : `${time}Z`);
  return Number.isFinite(ms) ? BigInt(ms) * 1000n : 0n;
}

export function requestOf(
  filters: Filters,
  pageSize: number,
  pageToken: string,
): MessageInitShape<typeof ListEdgesRequestSchema> {
  const root = parseFrame(filters.near);
  return {
    kinds: [EdgeKind.LOOP],
    states: filters.states.length === allStates.length ? [] : filters.states,
    session: Number(filters.session) || 0,
    otherSession: Number(filters.other) || 0,
    minSuspicion: Number(filters.min) || 0,
    fromUs: microseconds(filters.from),
    untilUs: microseconds(filters.until),
    ...(root ? { region: { root, maxMetres: Number(filters.within) || 0, maxEdges: filters.within ? 1_000_000 : 0 } } : {}),
    order: filters.order === 'time' ? EdgeOrder.TIME : EdgeOrder.SUSPICION,
    pageSize,
    pageToken,
  };
}

// ---- The list

export interface Row {
  name: string; // 6:120/1
  a: FrameId;
  b: FrameId;
  state: EdgeState;
  suspicion: number | null; // null: not known yet, of a closure that came by an event
  timeUs: bigint;
  edge: Edge;
  // Who changed it since it was listed: "" for nobody.
  changedBy: string;
  gone: boolean; // with a session that was deleted
}

export interface Notice {
  name: string;
  state: EdgeState | null; // null: gone
  author: string;
  note: string;
  timeUs: bigint;
  sequence: string; // of the journal: all that one edit changed has the same
}

export interface Queue {
  rows: Row[];
  next: string; // token of the next page; "": the list is complete
  fresh: Set<string>; // closures that came or changed, fit the filters, and are not in the list
}

export const emptyQueue: Queue = { rows: [], next: '', fresh: new Set() };

export function rowOf(edge: Edge): Row {
  return {
    name: edgeText(edge.id),
    a: edge.a!,
    b: edge.b!,
    state: edge.state,
    suspicion: edge.suspicion ? edge.suspicion.value : null,
    timeUs: edge.timeUs,
    edge,
    changedBy: '',
    gone: false,
  };
}

// A page more. What is listed already stays where it is.
export function withPage(queue: Queue, edges: Edge[], next: string): Queue {
  const known = new Set(queue.rows.map((row) => row.name));
  const rows = [...queue.rows, ...edges.map(rowOf).filter((row) => !known.has(row.name))];
  const fresh = new Set(queue.fresh);
  for (const row of rows) fresh.delete(row.name);
  return { rows, next, fresh };
}

// The list after events, and what to tell of them. A closure stays in its row, even if its state is now another than
// the filters ask for: nothing moves under the eyes of whoever looks at it.
export function withEvents(queue: Queue, events: MapEvent[], filters: Filters): { queue: Queue; notices: Notice[] } {
  const notices: Notice[] = [];
  const at = new Map(queue.rows.map((row, index) => [row.name, index]));
  let rows = queue.rows;
  let fresh = queue.fresh;
  const change = (index: number, changes: Partial<Row>) => {
    if (rows === queue.rows) rows = [...rows];
    rows[index] = { ...rows[index]!, ...changes };
  };
  for (const { event, author, note, timeUs, journalSequence } of events) {
    const sequence = String(journalSequence);
    if (event.case === 'edgeChanged') {
      const edge = event.value;
      if (edge.kind !== EdgeKind.LOOP) continue;
      const name = edgeText(edge.id);
      const index = at.get(name);
      if (index !== undefined) {
        if (rows[index]!.state !== edge.state) change(index, { state: edge.state, changedBy: author });
      } else if (mayFit(edge, filters) && !fresh.has(name)) {
        if (fresh === queue.fresh) fresh = new Set(fresh);
        fresh.add(name);
      }
      notices.push({ name, state: edge.state, author, note, timeUs, sequence });
    } else if (event.case === 'edgeRemoved') {
      const name = edgeText(event.value.edge);
      const index = at.get(name);
      if (index !== undefined) change(index, { gone: true, changedBy: author });
      notices.push({ name, state: null, author, note, timeUs, sequence });
    }
  }
  return { queue: rows === queue.rows && fresh === queue.fresh ? queue : { ...queue, rows, fresh }, notices };
}

// As far as an event tells: it has neither suspicion nor a region.
function mayFit(edge: Edge, filters: Filters): boolean {
  if (!filters.states.includes(edge.state)) return false;
  const ends = [edge.a?.session, edge.b?.session];
  const [session, other] = [Number(filters.session), Number(filters.other)];
  if (session && other) return (ends[0] === session && ends[1] === other) || (ends[0] === other && ends[1] === session);
  return !session || ends.includes(session);
}

// ---- Going through it

// The closure `by` rows after this one; null: there is none. From a closure that is not in the list to its first.
export function step(queue: Queue, name: string | null, by: number): string | null {
  const index = queue.rows.findIndex((row) => row.name === name);
  if (index < 0) return queue.rows[0]?.name ?? null;
  return queue.rows[index + by]?.name ?? null;
}

// What should be loaded: the closure itself, the next two, the previous one.
export function around(queue: Queue, name: string): string[] {
  const index = queue.rows.findIndex((row) => row.name === name);
  if (index < 0) return [name];
  return [index, index + 1, index + 2, index - 1].flatMap((each) => queue.rows[each]?.name ?? []);
}

// Whether the next page should be asked for: somebody is near the end of what is listed.
export function nearEnd(queue: Queue, name: string | null): boolean {
  if (!queue.next) return false;
  const index = queue.rows.findIndex((row) => row.name === name);
  return index >= queue.rows.length - 10;
}

export function endsText(row: { a?: FrameId | undefined; b?: FrameId | undefined }): string {
  return `${frameText(row.a)} – ${frameText(row.b)}`;
}
