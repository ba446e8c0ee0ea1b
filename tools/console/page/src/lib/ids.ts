// Frames and closures as they are written everywhere in relmap: 6:120, and 6:120/1 for the closure that is stored with
// frame 6:120.
import type { EdgeId, FrameId } from '../proto/relmap/v1/common_pb';

export interface Frame {
  session: number;
  index: number;
}
export interface Edge extends Frame {
  ordinal: number;
}

export function frameText(frame: FrameId | Frame | undefined): string {
  return frame ? `${frame.session}:${frame.index}` : '';
}

// Null: the text is no frame, or has a number that no frame has.
export function parseFrame(text: string | null): Frame | null {
  const [session, index] = numbers(/^(\d{1,10}):(\d{1,10})$/, text);
  return session === undefined || index === undefined ? null : { session, index };
}

export function edgeText(edge: EdgeId | Edge | undefined): string {
  if (!edge) return '';
  if ("frame" in edge || "$typeName" in edge) return `${frameText((edge as EdgeId).frame)}/${edge.ordinal}`;
  return `${frameText(edge as Edge)}/${(edge as Edge).ordinal}`;
}

export function parseEdge(text: string | null): Edge | null {
  const [session, index, ordinal] = numbers(/^(\d{1,10}):(\d{1,10})\/(\d{1,10})$/, text);
  return session === undefined || index === undefined || ordinal === undefined ? null : { session, index, ordinal };
}

// As requests have it.
export function edgeId(edge: Edge): { frame: Frame; ordinal: number } {
  return { frame: { session: edge.session, index: edge.index }, ordinal: edge.ordinal };
}

// What the groups match, each a number of 32 bits; empty: something else.
function numbers(form: RegExp, text: string | null): number[] {
  const found = (form.exec(text ?? '') ?? []).slice(1).map(Number);
  return found.every((number) => number <= 0xffffffff) ? found : [];
}
