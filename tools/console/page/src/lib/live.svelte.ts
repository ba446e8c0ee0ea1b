// What happens to the map while the page is open. Views list once, then apply events:
//
//   $effect(() => live.follow((events) => ..., () => list()));
import { fromBinary } from '@bufbuild/protobuf';
import { MapEventSchema, type MapEvent } from '../proto/relmap/v1/watch_pb';

export type FromWorker =
  | { kind: 'events'; events: Uint8Array[] }
  // resumed: nothing was missed since the stream broke.
  | { kind: 'connected'; resumed: boolean }
  | { kind: 'disconnected' };

type Listener = { events: (events: MapEvent[]) => void; again: () => void };

class Live {
  connected = $state(false);
  private listeners = new Set<Listener>();
  private port: { postMessage(message: unknown): void } | null = null;

  start() {
    if (this.port) return;
    if (typeof SharedWorker === 'function') {
      const worker = new SharedWorker('/watch_worker.js', { name: 'relmap-watch' });
      worker.port.onmessage = (message: MessageEvent<FromWorker>) => this.take(message.data);
      this.port = worker.port;
    } else {
      const worker = new Worker('/watch_worker.js');
      worker.onmessage = (message: MessageEvent<FromWorker>) => this.take(message.data);
      this.port = worker;
    }
    window.addEventListener('pagehide', () => this.port?.postMessage('leave'));
  }

  // After a login.
  again() {
    this.port?.postMessage('again');
  }

  // Calls `events` with what happens, and `again` when the lists must be read anew, since events were lost. Returns what
  // ends it, for $effect.
  follow(events: (events: MapEvent[]) => void, again: () => void): () => void {
    const listener = { events, again };
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  private take(message: FromWorker) {
    switch (message.kind) {
      case 'connected':
        this.connected = true;
        if (!message.resumed) for (const listener of this.listeners) listener.again();
        break;
      case 'disconnected':
        this.connected = false;
        break;
      case 'events': {
        const events = message.events.map((bytes) => fromBinary(MapEventSchema, bytes));
        if (events.some((event) => event.event.case === 'resync'))
          for (const listener of this.listeners) listener.again();
        for (const listener of this.listeners) listener.events(events);
      }
    }
  }
}

export const live = new Live();
