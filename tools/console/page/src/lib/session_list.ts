// The list of sessions, kept up with what happens to the map.
import type { Session } from '../proto/relmap/v1/graph_pb';
import type { MapEvent } from '../proto/relmap/v1/watch_pb';

// The list after the events; `again`: they leave something open, so that it has to be read anew.
export function afterEvents(list: Session[], events: MapEvent[]): { list: Session[]; again: boolean } {
  const changed = new Map<number, Session>();
  const gone = new Set<number>();
  const find = (number: number) => changed.get(number) ?? list.find((session) => session.number === number);
  let again = false;
  for (const { event } of events) {
    switch (event.case) {
      case 'sessionChanged': {
        const known = find(event.value.number);
        const { name, robot, state, number } = event.value;
        if (known) changed.set(number, { ...known, name, robot, state });
        else again = true;
        break;
      }
      case 'framesAdded':
        for (const { frame, timeUs } of event.value.frames) {
          const known = frame && find(frame.session);
          if (!frame || !known) again = true;
          else if (frame.index > known.last || known.frames === 0) {
            const firstTimeUs = known.frames ? known.firstTimeUs : timeUs;
            const lastTimeUs = timeUs > known.lastTimeUs ? timeUs : known.lastTimeUs;
            const frames = known.frames + 1;
            changed.set(frame.session, { ...known, frames, last: frame.index, firstTimeUs, lastTimeUs });
          }
        }
        break;
      case 'sessionDeleted':
        gone.add(event.value.session);
        break;
      case 'framesRemoved':
      case 'skipped':
        again = true;
    }
  }
  if (!changed.size && !gone.size) return { list, again };
  return {
    list: list.filter(({ number }) => !gone.has(number)).map((session) => changed.get(session.number) ?? session),
    again,
  };
}
