// What is asked of the audit log.

export interface AuditQuery {
  who: string;
  method: string;
  failed: boolean;
  from: string; // "2026-11-30T21:04", UTC, as an input gives it; empty: any
  until: string;
  reads: boolean; // also what only reads
}

// Microseconds since 1970; 0: none, or no time.
export function timeUs(text: string): bigint {
  const ms = /^\d{4}-\d\d-\d\dT\d\d:\d\d(:\d\d(\.\d+)?)?$/.test(text) ? Date.parse(text + 'Z') : NaN;
  return Number.isNaN(ms) ? 0n : BigInt(ms) * 1000n;
}

// What is wrong with it; empty: nothing.
export function wrongWith({ from, until }: AuditQuery): string {
  return timeUs(from) && timeUs(until) && timeUs(until) <= timeUs(from) ? 'The time until which must be later than the time from which.' : '';
}

export function request(query: AuditQuery) {
  return {
    who: query.who.trim(),
    method: query.method.trim(),
    failed: query.failed,
    fromUs: timeUs(query.from),
    untilUs: timeUs(query.until),
  };
}

// All methods that are audited: those that only operators may call.
export const auditedMethods = [
  'Map.SetEdgeState', 'Map.ProposeEdge', 'Map.SetLabel', 'Map.ImportGraph',
  'Admin.Verify', 'Admin.Backup', 'Admin.Compact', 'Admin.Repair', 'Admin.Reindex', 'Admin.GetStats', 'Admin.WaitIdle',
  'Admin.Commit', 'Admin.SetLogLevel', 'Admin.FreezeSession', 'Admin.DeleteSession', 'Admin.ListAudit',
];

// Of these, those that change nothing and keep nobody waiting; this page makes some of them by itself.
const reading = new Set(['Admin.GetStats', 'Admin.WaitIdle', 'Admin.ListAudit']);

// Whether an entry is to be shown. What failed always is, and what was asked for by name.
export function isShown(query: AuditQuery, entry: { method: string; outcome: number }): boolean {
  return query.reads || query.method !== '' || entry.outcome !== 0 || !reading.has(entry.method);
}
