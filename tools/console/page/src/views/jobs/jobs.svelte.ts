// The long work that this page has started. It lives as long as the page, whatever view is shown.
import { plain } from '../../lib/format';
import { newKey } from '../../lib/edit_keys';
import { admin, isAborted, noTimeout, problemOf, type Problem } from '../../lib/rpc';
import type { Finding, Progress, VerifySummary } from '../../proto/relmap/v1/admin_pb';
import { begun, kMostFindings, outcomeText, type JobKind, type JobState } from './job';

export class Job {
  state = $state.raw<JobState>(begun('verify', '', 0));
  problem = $state.raw<Problem | null>(null);
  readonly id = newKey();
  readonly session: number; // of a deletion; else 0
  private abort = new AbortController();

  constructor(kind: JobKind, title: string, session = 0) {
    this.state = begun(kind, title, Date.now());
    this.session = session;
  }

  get running() {
    return this.state.state === 'running';
  }

  // Ends the work, and of a deletion only its progress here: a deletion cannot be taken back.
  cancel() {
    this.abort.abort();
  }

  async follow(stream: (signal: AbortSignal) => AsyncIterable<Step>) {
    try {
      for await (const step of stream(this.abort.signal)) this.take(step);
      this.state = { ...this.state, state: 'done', outcome: outcomeText(this.state), endedMs: Date.now() };
    } catch (error) {
      const cancelled = isAborted(error);
      if (!cancelled) this.problem = problemOf(error);
      this.state = { ...this.state, state: cancelled ? 'cancelled' : 'failed', endedMs: Date.now() };
    }
  }

  private take({ progress, findings = [], summary }: Step) {
    const room = kMostFindings - this.state.findings.length;
    this.state = {
      ...this.state,
      progress: progress ?? this.state.progress,
      findings: findings.length && room > 0 ? [...this.state.findings, ...findings.slice(0, room)] : this.state.findings,
      findingCount: this.state.findingCount + findings.length,
      summary: summary ?? this.state.summary,
    };
  }
}

interface Step {
  progress?: Progress;
  findings?: Finding[];
  summary?: VerifySummary;
}

async function* steps(stream: AsyncIterable<Progress>): AsyncIterable<Step> {
  for await (const progress of stream) yield { progress };
}

class Jobs {
  list = $state.raw<Job[]>([]); // the newest first
  running = $derived(this.list.filter((job) => job.running));
  // Of these the daemon does one at a time.
  maintenance = $derived(this.running.find((job) => job.state.kind !== 'delete'));

  verify(sessions: number[]) {
    const title = sessions.length ? `Verify of ${sessions.length === 1 ? 'session' : 'sessions'} ${sessions.join(', ')}` : 'Verify of the whole map';
    this.begin(new Job('verify', title), (signal) => admin.verify({ sessions }, { ...noTimeout, signal }));
  }

  backup(folder: string) {
    this.begin(new Job('backup', `Backup to ${plain(folder)}`), (signal) => steps(admin.backup({ folder }, { ...noTimeout, signal })));
  }

  compact() {
    this.begin(new Job('compact', 'Compact'), (signal) => steps(admin.compact({}, { ...noTimeout, signal })));
  }

  // Also shows the progress of a deletion that runs already.
  deleteSession(session: number, uuid: string, name: string) {
    if (this.deletionOf(session)?.running) return;
    const idempotencyKey = newKey();
    this.begin(new Job('delete', `Deletion of session ${session}, ${plain(name, 60)}`, session), (signal) =>
      steps(admin.deleteSession({ session, uuid, idempotencyKey }, { ...noTimeout, signal })));
  }

  deletionOf(session: number): Job | undefined {
    return this.list.find((job) => job.session === session);
  }

  forget(job: Job) {
    this.list = this.list.filter((each) => each !== job);
  }

  private begin(job: Job, stream: (signal: AbortSignal) => AsyncIterable<Step>) {
    this.list = [job, ...this.list].slice(0, 50);
    void job.follow(stream);
  }
}

export const jobs = new Jobs();

// Work ends with the page that started it, except deletions.
window.addEventListener('beforeunload', (event) => {
  if (jobs.maintenance) event.preventDefault();
});
