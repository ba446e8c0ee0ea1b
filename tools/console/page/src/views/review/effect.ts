// What an edit changes, in groups that people can take in.
import { EdgeState } from '../../proto/relmap/v1/graph_pb';
import type { ClosureChange, EditEffect } from '../../proto/relmap/v1/map_pb';
import { counted } from '../../lib/format';
import { edgeText } from '../../lib/ids';

export interface Group {
  title: string;
  changes: ClosureChange[];
}

// The named closure first in its group; groups without members are left out.
export function groupsOf(effect: EditEffect | undefined, name: string): Group[] {
  const all = [...(effect?.closures ?? [])].sort(
    (x, y) => Number(edgeText(y.id) === name) - Number(edgeText(x.id) === name),
  );
  const force = EdgeState.ACCEPTED;
  const groups: [string, (change: ClosureChange) => boolean][] = [
    ['out of force', (change) => change.before === force && change.after !== force],
    ['into force', (change) => change.before !== force && change.after === force],
    ['in another state, neither in force before nor after', (change) => change.before !== force && change.before !== change.after],
    ['in force as before, for another reason or in another way', () => true],
  ];
  const rest = new Set(all);
  return groups.flatMap(([title, fits]) => {
    const changes = [...rest].filter(fits);
    for (const change of changes) rest.delete(change);
    const comes = title === 'out of force' ? ['goes', 'go'] : title === 'into force' ? ['comes', 'come'] : ['is', 'are'];
    return changes.length ? [{ title: `${counted(changes.length, 'closure')} ${comes[changes.length === 1 ? 0 : 1]} ${title}`, changes }] : [];
  });
}

// How a closure is used by the map.
export function useText(change: ClosureChange): string {
  const use = (state: EdgeState, edge: boolean) =>
    state !== EdgeState.ACCEPTED ? '' : edge ? 'edge of the graph' : 'binds landmarks';
  const [before, after] = [use(change.before, change.edgeBefore), use(change.after, change.edgeAfter)];
  const bound = change.bound ? `, ${counted(change.bound, 'observation')} in ${counted(change.boundFrames, 'frame')}` : '';
  if (before === after) return before + bound;
  return (before && after ? `${before} → ${after}` : before || after) + bound;
}
