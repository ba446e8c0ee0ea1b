// Follows what happens to the map for all tabs of this browser, over one stream: over HTTP/1.1 a browser has six
// connections to a host. Runs as a SharedWorker, or where there is none in a worker of each tab.
//
// It passes the events on as they come, as bytes, and reads of each only the resume token. So it needs no library for
// protobuf, which would be a third of all the script of the page.
import type { FromWorker } from './lib/live.svelte';

interface Port {
  postMessage(message: FromWorker): void;
  onmessage: ((message: MessageEvent) => void) | null;
}
const ports = new Set<Port>();
let token: Uint8Array | null = null;
let connected = false;
let stream = new AbortController();

function tell(message: FromWorker) {
  for (const port of ports) port.postMessage(message);
}

// Events are told together, at most every 50 ms: a robot's drive makes hundreds a second.
let pending: Uint8Array[] = [];
let timer: ReturnType<typeof setTimeout> | null = null;
function collect(event: Uint8Array) {
  pending.push(event);
  timer ??= setTimeout(() => {
    timer = null;
    tell({ kind: 'events', events: pending });
    pending = [];
  }, 50);
}

// WatchMapRequest: resume_token = 2, from = 3 (1 is now).
function request(): Uint8Array {
  return token ? Uint8Array.of(0x12, ...varint(token.length), ...token) : Uint8Array.of(0x18, 1);
}

function varint(value: number): number[] {
  return value < 128 ? [value] : [(value & 127) | 128, ...varint(value >> 7)];
}

// MapEvent.resume_token = 6, or null.
function resumeToken(event: Uint8Array): Uint8Array | null {
  let at = 0;
  const number = () => {
    let value = 0;
    for (let shift = 0; at < event.length; shift += 7) {
      const byte = event[at++]!;
      value += (byte & 127) * 2 ** shift;
      if (byte < 128) break;
    }
    return value;
  };
  while (at < event.length) {
    const tag = number();
    switch (tag & 7) {
      case 0:
        number();
        break;
      case 1:
        at += 8;
        break;
      case 5:
        at += 4;
        break;
      case 2: {
        const length = number();
        if (tag >> 3 === 6) return event.slice(at, at + length);
        at += length;
        break;
      }
      default:
        return null;
    }
  }
  return null;
}

// One call of WatchMap, until it ends or breaks. Returns the status with which it ended, -1: none came.
async function watch(): Promise<number> {
  stream = new AbortController();
  const message = request();
  const body = new Uint8Array(5 + message.length);
  new DataView(body.buffer).setUint32(1, message.length);
  body.set(message, 5);
  // The daemon says something at least every 15 seconds.
  let silence = setTimeout(() => stream.abort(), 40_000);
  try {
    const response = await fetch('/relmap.v1.Map/WatchMap', {
      method: 'POST',
      headers: { 'content-type': 'application/grpc-web+proto', 'x-grpc-web': '1' },
      body,
      signal: stream.signal,
    });
    const early = response.headers.get('grpc-status');
    if (early) return Number(early);
    if (!response.ok || !response.body) return -1;
    const reader = response.body.getReader();
    let held = new Uint8Array(0);
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return -1;
      clearTimeout(silence);
      silence = setTimeout(() => stream.abort(), 40_000);
      const bytes = new Uint8Array(held.length + value.length);
      bytes.set(held);
      bytes.set(value, held.length);
      let at = 0;
      const view = new DataView(bytes.buffer);
      while (bytes.length - at >= 5) {
        const length = view.getUint32(at + 1);
        if (bytes.length - at < 5 + length) break;
        const frame = bytes.slice(at + 5, at + 5 + length);
        if (bytes[at]! & 0x80) return Number(/grpc-status: *(\d+)/.exec(new TextDecoder().decode(frame))?.[1] ?? -1);
        take(frame);
        at += 5 + length;
      }
      held = bytes.slice(at);
    }
  } catch {
    return -1;
  } finally {
    clearTimeout(silence);
  }
}

let wait = 500;
function take(event: Uint8Array) {
  if (!connected) {
    connected = true;
    tell({ kind: 'connected', resumed: token !== null });
  }
  token = resumeToken(event) ?? token;
  wait = 500;
  collect(event);
}

const kInvalidArgument = 3;
async function follow() {
  for (;;) {
    // A token that the daemon does not know is of another map: from here on, and the tabs read their lists anew.
    if ((await watch()) === kInvalidArgument) token = null;
    if (connected) {
      connected = false;
      tell({ kind: 'disconnected' });
    }
    await new Promise((resolve) => setTimeout(resolve, wait));
    wait = Math.min(wait * 2, 5000);
  }
}

function add(port: Port) {
  ports.add(port);
  port.onmessage = (message) => {
    if (message.data === 'leave') ports.delete(port);
    // Somebody has logged in anew: the stream is made again with what the browser has now.
    if (message.data === 'again') {
      wait = 500;
      stream.abort();
    }
  };
  port.postMessage(connected ? { kind: 'connected', resumed: false } : { kind: 'disconnected' });
}

if ('onconnect' in self) {
  (self as unknown as { onconnect: (event: MessageEvent) => void }).onconnect = (event) => add(event.ports[0]!);
} else {
  add(self as unknown as Port);
}
void follow();
