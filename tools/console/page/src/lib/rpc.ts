// The daemon's services, called through the console, and what their failures say.
import { Admin } from '../proto/relmap/v1/admin_pb';
import { Map as MapService } from '../proto/relmap/v1/map_pb';
import { CallError, Code, makeClient } from './grpc_web';
import { reasonText } from './reasons';

export { reasonText };

const kTimeoutMs = 30_000;
export const map = makeClient(MapService, location.origin, kTimeoutMs);
export const admin = makeClient(Admin, location.origin, kTimeoutMs);

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
  if (!(error instanceof CallError)) return { reason: 'INTERNAL', message: `The page has a defect: ${String(error)}` };
  const { code, detail, reason, message } = error;
  if (detail) return { reason: reasonText(detail.reason), message: detail.message, requestId: detail.requestId };
  if (reason) return { reason, message };
  switch (code) {
    case Code.unauthenticated:
      return { reason: 'UNAUTHENTICATED', message: 'You are not logged in, or your token has expired.' };
    case Code.notAllowed:
      return { reason: 'NOT_ALLOWED', message };
    case Code.unimplemented:
      return { reason: 'UNIMPLEMENTED', message };
    case Code.deadline:
      return { reason: 'DEADLINE', message: message || 'The daemon did not answer in time.' };
    case Code.unavailable:
    case Code.unknown:
      return { reason: 'UNREACHABLE', message: message || 'The console does not answer.' };
    default:
      return { reason: 'INTERNAL', message: message || `The call failed with status ${code} of gRPC.` };
  }
}

export function isAborted(error: unknown): boolean {
  return (
    (error instanceof DOMException && error.name === 'AbortError') ||
    (error instanceof CallError && error.code === Code.cancelled)
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
