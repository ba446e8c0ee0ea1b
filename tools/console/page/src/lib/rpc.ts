// The daemon's services, called through the console, and what their failures say.
import { Code, ConnectError, createClient } from '@connectrpc/connect';
import { createGrpcWebTransport } from '@connectrpc/connect-web';
import { Admin } from '../proto/relmap/v1/admin_pb';
import { Map as MapService } from '../proto/relmap/v1/map_pb';
import { ErrorSchema } from '../proto/relmap/v1/reason_pb';
import { reasonText } from './reasons';

export { reasonText };

const transport = createGrpcWebTransport({ baseUrl: location.origin, useBinaryFormat: true, defaultTimeoutMs: 30_000 });
export const map = createClient(MapService, transport);
export const admin = createClient(Admin, transport);

// Long work and streams without end have no time limit of their own.
export const noTimeout = { timeoutMs: 0 } as const;

// Why something could not be done, for display: a reason of relmap (a paragraph of the runbook explains each), and a
// sentence that says what exactly is wrong.
export interface Problem {
  reason: string;
  message: string;
  requestId?: string;
}

export function problemOf(error: unknown): Problem {
  if (isAborted(error)) return { reason: 'CANCELLED', message: 'It was cancelled.' };
  if (error instanceof HttpError) return error.problem;
  const failure = ConnectError.from(error);
  const detail = failure.findDetails(ErrorSchema)[0];
  if (detail) return { reason: reasonText(detail.reason), message: detail.message, requestId: detail.requestId };
  switch (failure.code) {
    case Code.Unauthenticated:
      return { reason: 'UNAUTHENTICATED', message: 'You are not logged in, or your token has expired.' };
    case Code.DeadlineExceeded:
      return { reason: 'DEADLINE', message: 'The daemon did not answer in time.' };
    case Code.Unavailable:
    case Code.Unknown:
      return { reason: 'UNREACHABLE', message: failure.rawMessage || 'The console does not answer.' };
    default:
      return { reason: Code[failure.code]?.toUpperCase() ?? 'UNKNOWN', message: failure.rawMessage };
  }
}

export function isAborted(error: unknown): boolean {
  return (
    (error instanceof DOMException && error.name === 'AbortError') ||
    (error instanceof ConnectError && error.code === Code.Canceled)
  );
}

// ---- What the console itself answers (tools/console/README.md)

class HttpError extends Error {
  constructor(readonly problem: Problem) {
    super(problem.message);
  }
}

async function request(path: string, init?: RequestInit): Promise<Response> {
  let response: Response;
  try {
    response = await fetch(path, { credentials: 'same-origin', ...init });
  } catch (error) {
    if (isAborted(error)) throw error;
    throw new HttpError({ reason: 'UNREACHABLE', message: 'The console does not answer. Does relmap-console still run?' });
  }
  if (response.ok) return response;
  let problem: Problem = { reason: `HTTP_${response.status}`, message: response.statusText };
  try {
    problem = { ...problem, ...(await response.json()) };
  } catch {
    // The answer came from something between here and the console.
  }
  throw new HttpError(problem);
}

export async function getJson<T>(path: string, signal?: AbortSignal): Promise<T> {
  return (await request(path, signal ? { signal } : undefined)).json();
}

export async function postJson<T>(path: string, body: unknown, signal?: AbortSignal): Promise<T> {
  const init = { method: 'POST', headers: { 'content-type': 'application/json' }, body: JSON.stringify(body) };
  const response = await request(path, signal ? { ...init, signal } : init);
  return (response.status === 204 ? undefined : response.json()) as T;
}

// Bytes, or null where there are none (204).
export async function getBytes(path: string, signal?: AbortSignal): Promise<ArrayBuffer | null> {
  const response = await request(path, signal ? { signal } : undefined);
  return response.status === 204 ? null : response.arrayBuffer();
}
