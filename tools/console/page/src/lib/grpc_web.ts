// Calls of gRPC-Web: unary ones and streams from the server. What fails throws a CallError. (The usual library takes
// grpc-status-details-bin for a google.rpc.Status; relmap's is a relmap.v1.Error.)
import { create, fromBinary, toBinary } from '@bufbuild/protobuf';
import type {
  DescMethodServerStreaming, DescMethodUnary, DescService, MessageInitShape, MessageShape,
} from '@bufbuild/protobuf';
import { ErrorSchema, type Error as Detail } from '../proto/relmap/v1/reason_pb';

export interface CallOptions {
  timeoutMs?: number; // 0: without end; if absent, the client's
  signal?: AbortSignal;
}

export type Client<S extends DescService> = {
  [M in keyof S['method']]: S['method'][M] extends DescMethodUnary<infer I, infer O>
    ? (request: MessageInitShape<I>, options?: CallOptions) => Promise<MessageShape<O>>
    : S['method'][M] extends DescMethodServerStreaming<infer I, infer O>
      ? (request: MessageInitShape<I>, options?: CallOptions) => AsyncIterable<MessageShape<O>>
      : never;
};

// The status codes of gRPC that are told apart here.
export const Code = {
  cancelled: 1, unknown: 2, deadline: 4, notAllowed: 7, unimplemented: 12, internal: 13, unavailable: 14,
  unauthenticated: 16,
} as const;

export class CallError extends Error {
  constructor(
    readonly code: number,
    message: string,
    readonly detail?: Detail, // what the daemon says against it
    readonly reason?: string, // what the console itself says
  ) {
    super(message);
  }
}

export function makeClient<S extends DescService>(service: S, baseUrl: string, timeoutMs: number): Client<S> {
  const client: Record<string, unknown> = {};
  for (const method of service.methods) {
    const call = (request: never, options: CallOptions = {}) =>
      messages(
        `${baseUrl}/${service.typeName}/${method.name}`,
        toBinary(method.input, create(method.input, request)),
        { timeoutMs, ...options },
        (bytes) => fromBinary(method.output, bytes),
      );
    client[method.localName] = method.methodKind === 'unary' ? (request: never, options?: CallOptions) => only(call(request, options)) : call;
  }
  return client as Client<S>;
}

async function only<T>(stream: AsyncIterable<T>): Promise<T> {
  let found: T | undefined;
  for await (const message of stream) found = message;
  if (found === undefined) throw new CallError(Code.internal, 'The daemon’s answer has no message.');
  return found;
}

async function* messages<T>(url: string, request: Uint8Array, options: CallOptions, decode: (bytes: Uint8Array) => T): AsyncGenerator<T> {
  const abort = new AbortController();
  let late = false;
  const cancel = () => abort.abort();
  if (options.signal?.aborted) cancel();
  options.signal?.addEventListener('abort', cancel);
  const timer = options.timeoutMs ? setTimeout(() => ((late = true), cancel()), options.timeoutMs) : undefined;
  try {
    const headers: Record<string, string> = { 'content-type': 'application/grpc-web+proto', 'x-grpc-web': '1' };
    if (options.timeoutMs) headers['grpc-timeout'] = `${options.timeoutMs}m`;
    const body = new Uint8Array(5 + request.length);
    new DataView(body.buffer).setUint32(1, request.length);
    body.set(request, 5);
    const response = await fetch(url, { method: 'POST', credentials: 'same-origin', headers, body, signal: abort.signal });
    if (!response.ok) throw await refused(response);
    if (response.headers.has('grpc-status')) throwUnlessOk((name) => response.headers.get(name));
    let ended = false;
    for await (const { flags, bytes } of frames(response)) {
      if (flags & 0x80) {
        const trailers = parseTrailers(new TextDecoder().decode(bytes));
        throwUnlessOk((name) => trailers.get(name) ?? null);
        ended = true;
      } else if (flags) {
        throw new CallError(Code.internal, 'The daemon’s answer is compressed, which was not asked for.');
      } else {
        yield decode(bytes);
      }
    }
    if (!ended) throw new CallError(Code.unavailable, 'The connection broke before the answer was complete.');
  } catch (error) {
    if (error instanceof CallError) throw error;
    if (late) throw new CallError(Code.deadline, 'The daemon did not answer in time.');
    if (abort.signal.aborted) throw new CallError(Code.cancelled, 'It was cancelled.');
    if (error instanceof TypeError) throw new CallError(Code.unavailable, 'The console does not answer. Does relmap-console still run?');
    throw new CallError(Code.internal, `The daemon’s answer cannot be read: ${String(error)}`);
  } finally {
    clearTimeout(timer);
    options.signal?.removeEventListener('abort', cancel);
    abort.abort(); // whoever leaves a stream early ends the call
  }
}

async function* frames(response: Response): AsyncGenerator<{ flags: number; bytes: Uint8Array }> {
  const reader = response.body!.getReader();
  let held = new Uint8Array(0);
  for (;;) {
    while (held.length >= 5) {
      const length = new DataView(held.buffer, held.byteOffset).getUint32(1);
      if (held.length < 5 + length) break;
      yield { flags: held[0]!, bytes: held.subarray(5, 5 + length) };
      held = held.subarray(5 + length);
    }
    const { value, done } = await reader.read();
    if (done) return;
    const more = new Uint8Array(held.length + value.length);
    more.set(held);
    more.set(value, held.length);
    held = more;
  }
}

export function parseTrailers(text: string): Map<string, string> {
  const trailers = new Map<string, string>();
  for (const line of text.split(/\r?\n/)) {
    const colon = line.indexOf(':');
    if (colon > 0) trailers.set(line.slice(0, colon).trim().toLowerCase(), line.slice(colon + 1).trim());
  }
  return trailers;
}

function throwUnlessOk(get: (name: string) => string | null) {
  const code = Number(get('grpc-status') ?? Code.unknown);
  if (code !== 0) throw new CallError(code, unescaped(get('grpc-message') ?? ''), detailOf(get('grpc-status-details-bin')));
}

function unescaped(message: string): string {
  try {
    return decodeURIComponent(message);
  } catch {
    return message;
  }
}

function detailOf(base64: string | null): Detail | undefined {
  if (!base64) return undefined;
  try {
    return fromBinary(ErrorSchema, Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0)));
  } catch {
    return undefined; // not of relmap
  }
}

// What the console answers by itself, or something between here and it.
async function refused(response: Response): Promise<CallError> {
  const codes: Record<number, number> = { 401: Code.unauthenticated, 403: Code.notAllowed, 404: Code.unimplemented };
  const code = codes[response.status] ?? (response.status >= 500 || response.status === 429 ? Code.unavailable : Code.unknown);
  try {
    const { reason, message } = (await response.json()) as { reason?: unknown; message?: unknown };
    return new CallError(code, String(message ?? response.statusText), undefined, typeof reason === 'string' ? reason : undefined);
  } catch {
    return new CallError(code, response.statusText || `HTTP ${response.status}`);
  }
}
