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

export function parseFrame(text: string | null): Frame | null {
  const match = /^(\d{1,10}):(\d{1,10})$/.exec(text ?? '');
  return match ? { session: Number(match[1]), index: Number(match[2]) } : null;
}

export function edgeText(edge: EdgeId | Edge | undefined): string {
  if (!edge) return '';
  if ("frame" in edge || "$typeName" in edge) return `${frameText((edge as EdgeId).frame)}/${edge.ordinal}`;
  return `${frameText(edge as Edge)}/${(edge as Edge).ordinal}`;
}

export function parseEdge(text: string | null): Edge | null {
  const match = /^(\d{1,10}):(\d{1,10})\/(\d{1,10})$/.exec(text ?? '');
  return match ? { session: Number(match[1]), index: Number(match[2]), ordinal: Number(match[3]) } : null;
}

// As requests have it.
export function edgeId(edge: Edge): { frame: Frame; ordinal: number } {
  return { frame: { session: edge.session, index: edge.index }, ordinal: edge.ordinal };
}
