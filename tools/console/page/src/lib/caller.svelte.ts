// Who is logged in, whether the daemon answers, and its status, which is asked for every two seconds.
import { create } from '@bufbuild/protobuf';
import { GetStatusReplySchema, type GetStatusReply } from '../proto/relmap/v1/status_pb';
import { getJson, isAborted, map, postJson, problemOf, type Problem } from './rpc';

export interface About {
  version: string;
  login: 'token' | 'key' | 'none';
  server: string;
}

class Caller {
  // connecting: nothing is known yet; login: credentials are needed; ready: calls succeed; unreachable: none does.
  state = $state<'connecting' | 'login' | 'ready' | 'unreachable'>('connecting');
  about = $state.raw<About | null>(null);
  status = $state.raw<GetStatusReply>(create(GetStatusReplySchema));
  problem = $state.raw<Problem | null>(null); // while the state is unreachable, or login after it was ready
  name = $derived(this.status.callerName);
  role = $derived(this.status.callerRole);
  // Edits are offered to operators. Whatever is offered, the daemon decides.
  canEdit = $derived(this.status.callerRole === 'operator');

  // How often the daemon has come back after it did not answer: what could not be read then is worth asking for again.
  returns = $state(0);

  private asking: Promise<void> | null = null;
  private refusal: unknown = null; // with which the daemon asks for a login

  async start() {
    const key = /[#&]key=([^&]+)/.exec(location.hash)?.[1];
    if (key) {
      // The key must not stay in the address, which people copy.
      history.replaceState(null, '', location.pathname);
      await this.login(decodeURIComponent(key)).catch(() => {});
    }
    await this.ask();
    setInterval(() => void this.ask(), 2000);
    document.addEventListener('visibilitychange', () => void this.ask());
  }

  // Throws what the console or the daemon says against it.
  async login(token: string) {
    await postJson('/login', { token });
    await this.asking; // which was without it
    await this.ask();
    if (this.state === 'login') throw this.refusal;
  }

  async logout() {
    await postJson('/logout', {}).catch(() => {});
    location.reload();
  }

  // Asks now, for instance after a call of one's own failed.
  async ask() {
    if (document.hidden && this.state === 'ready') return;
    await (this.asking ??= this.askNow());
  }

  private async askNow() {
    try {
      const [about, status] = await Promise.allSettled([
        this.about ?? getJson<About>('/about'),
        map.getStatus({}, { timeoutMs: 5000 }),
      ]);
      if (about.status === 'rejected') throw about.reason;
      this.about = about.value;
      if (status.status === 'rejected') throw status.reason;
      this.status = status.value;
      if (this.state === 'unreachable') ++this.returns;
      this.state = 'ready';
      this.problem = null;
    } catch (error) {
      if (isAborted(error)) return;
      const problem = problemOf(error);
      if (problem.reason === 'UNAUTHENTICATED') {
        this.problem = this.state === 'ready' || this.state === 'unreachable' ? problem : null;
        this.state = 'login';
        this.refusal = error;
      } else {
        this.problem = problem;
        this.state = 'unreachable';
      }
    } finally {
      this.asking = null;
    }
  }
}

export const caller = new Caller();
