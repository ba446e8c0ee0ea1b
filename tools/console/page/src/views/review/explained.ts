// A closure with all that is shown of it, loaded and decoded.
import type { ExplainEdgeReply } from '../../proto/relmap/v1/evidence_pb';
import { Reason } from '../../proto/relmap/v1/reason_pb';
import { edgeId, frameText, parseEdge } from '../../lib/ids';
import type { Match } from '../../lib/matches';
import { free, matchesOf, sideOf, type Side } from '../../lib/pictures';
import { reasonText } from '../../lib/reasons';
import { map } from '../../lib/rpc';

export interface Explained {
  reply: ExplainEdgeReply;
  frame: Side; // a, the older end
  view: Side; // b, the newer end
  runnerUp: Side | null;
  matches: Match[];
  noPoints: string;
}

export async function explain(name: string, signal: AbortSignal): Promise<Explained> {
  const reply = await map.explainEdge({ edge: edgeId(parseEdge(name)!), pictures: true }, { signal });
  const other = reply.edge?.uniqueness?.runnerUp;
  const [frame, view, runnerUp] = await Promise.all([
    sideOf(`${frameText(reply.edge?.a)}, the older end`, reply.pictureA),
    sideOf(`${frameText(reply.edge?.b)}, the newer end`, reply.pictureB),
    other ? sideOf(`${frameText(other)}, the runner-up`, reply.runnerUp) : null,
  ]);
  const matches = matchesOf(reply.correspondences);
  const refusal = reply.correspondencesMessage || reasonText(reply.correspondencesReason);
  const today = matches.length ? 'Geometry would not confirm it today' : 'No points are joined';
  const noPoints = reply.correspondencesReason === Reason.OK ? '' : `${today}: ${refusal}`;
  return { reply, frame, view, runnerUp, matches, noPoints };
}

export function freeExplained(explained: Explained) {
  for (const side of [explained.frame, explained.view, explained.runnerUp]) free(side?.picture);
}
