// Events of the map as the stage needs them.
import { stepOf, type Fresh } from '../../map/trails';
import { EdgeKind, EdgeState, MotionSource } from '../../proto/relmap/v1/graph_pb';
import type { FramesAdded, MapEvent } from '../../proto/relmap/v1/watch_pb';
import { edgeText, frameText } from '../../lib/ids';

// A closure that is newer than the tiles.
export interface Loose {
  edge: string;
  a: string;
  b: string;
  state: number;
  since: number; // ms
}

export function freshOf({ frames }: FramesAdded): Fresh[] {
  return frames.flatMap(({ frame, timeUs, previousFromThis, source }) => {
    if (!frame) return [];
    const { translation, rotation } = previousFromThis ?? {};
    const step = translation && rotation ? stepOf(translation, rotation) : null;
    const guess = source === MotionSource.CONSTANT_VELOCITY || source === MotionSource.UNSENSED;
    return [{ session: frame.session, index: frame.index, timeMs: Number(timeUs / 1000n), step, guess }];
  });
}

// The new state of a closure; without ends: it is gone.
export function looseStates(event: MapEvent['event']): { edge: string; a: string; b: string; state: number } | null {
  if (event.case === 'edgeRemoved') {
    const edge = edgeText(event.value.edge);
    return edge ? { edge, a: '', b: '', state: EdgeState.UNSPECIFIED } : null;
  }
  if (event.case !== 'edgeChanged' || event.value.kind !== EdgeKind.LOOP) return null;
  const { id, a, b, state } = event.value;
  return { edge: edgeText(id), a: frameText(a), b: frameText(b), state };
}
