// A long piece of work of the daemon (Admin), as its stream tells of it.
import { bytes, count, counted, seconds } from '../../lib/format';
import type { Finding, Progress, VerifySummary } from '../../proto/relmap/v1/admin_pb';

export type JobKind = 'verify' | 'backup' | 'compact' | 'delete';

export interface JobState {
  kind: JobKind;
  title: string; // "Verify all sessions"
  startedMs: number;
  endedMs: number; // 0: it runs
  state: 'running' | 'done' | 'failed' | 'cancelled';
  progress: Progress | null;
  findings: Finding[]; // the first kMostFindings
  findingCount: number;
  summary: VerifySummary | null;
  outcome: string; // in words, when it is done
}

export const kMostFindings = 500;

export function begun(kind: JobKind, title: string, nowMs: number): JobState {
  return {
    kind, title, startedMs: nowMs, endedMs: 0, state: 'running', progress: null, findings: [], findingCount: 0,
    summary: null, outcome: '',
  };
}

// 0..1; null: not known.
export function share(progress: Progress | null): number | null {
  if (!progress || progress.total === 0n) return null;
  return Math.min(1, Number(progress.done) / Number(progress.total));
}

// "1,200 of 4,000 frames", "1.2 GB of 3.4 GB"
export function progressText(progress: Progress | null): string {
  if (!progress) return 'asked for; the daemon has not answered yet';
  const amount = (value: bigint) => (progress.unit === 'bytes' ? bytes(value) : count(value));
  const unit = progress.unit === 'bytes' || !progress.unit ? '' : ' ' + progress.unit;
  const done = progress.total ? `${amount(progress.done)} of ${amount(progress.total)}${unit}` : `${amount(progress.done)}${unit}`;
  return progress.step ? `${progress.step}: ${done}` : done;
}

// How long it will take yet, or empty if too little is done to tell.
export function remainingText(job: JobState, nowMs: number): string {
  const done = share(job.progress);
  const passed = (nowMs - job.startedMs) / 1000;
  if (done === null || done < 0.05 || passed < 3 || done >= 1) return '';
  return `about ${seconds((passed * (1 - done)) / done)} to go`;
}

// What it came to, in words.
export function outcomeText(job: JobState): string {
  const outcome = job.progress?.outcome;
  if (outcome?.case === 'backup') {
    const { folder, bytes: size, durableSequence } = outcome.value;
    return `The backup is in ${folder}: ${bytes(size)}, with the journal up to record ${count(durableSequence)}.`;
  }
  if (outcome?.case === 'compact') {
    const { bytesBefore, bytesAfter } = outcome.value;
    if (bytesAfter >= bytesBefore) return `There was nothing to free: the map has ${bytes(bytesAfter)}.`;
    return `The map has ${bytes(bytesAfter)} now, ${bytes(bytesBefore - bytesAfter)} less than before.`;
  }
  if (job.summary) {
    const { sessions, frames, edges, landmarks, findings } = job.summary;
    const read = `${counted(sessions, 'session')}, ${counted(frames, 'frame')}, ${counted(edges, 'edge')} and ${counted(landmarks, 'landmark')}`;
    return findings ? `${counted(findings, 'finding')} in ${read}.` : `The map is sound: ${read} were checked.`;
  }
  if (job.kind === 'delete') return 'All its frames are deleted.';
  return 'Done.';
}
