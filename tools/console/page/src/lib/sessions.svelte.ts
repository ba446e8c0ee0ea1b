// All sessions of the map, for every view that names them; kept up while a view uses them:
//
//   $effect(() => sessions.use());
import { SessionState, type Session } from '../proto/relmap/v1/graph_pb';
import { live } from './live.svelte';
import { allPages, seldom } from './pages';
import { map, problemOf, type Problem } from './rpc';
import { afterEvents } from './session_list';

class Sessions {
  list = $state.raw<Session[]>([]); // ascending by number
  known = $state(false); // the list has been read
  problem = $state.raw<Problem | null>(null);
  byNumber = $derived(new Map(this.list.map((session) => [session.number, session])));
  frozen = $derived(new Set(this.list.filter((s) => s.state === SessionState.FROZEN).map((s) => s.number)));

  private users = 0;
  private end = () => {};
  private reading = false;
  private again = seldom(() => void this.read(), 3000);

  use(): () => void {
    if (this.users++ === 0) {
      void this.read();
      this.end = live.follow(
        (events) => {
          const after = afterEvents(this.list, events);
          this.list = after.list;
          if (after.again) this.again.ask();
        },
        () => this.again.ask(),
      );
    }
    return () => {
      if (--this.users === 0) this.end();
    };
  }

  async read() {
    if (this.reading) {
      this.again.ask();
      return;
    }
    this.reading = true;
    try {
      let list: Session[] = [];
      await allPages(
        (pageToken) => map.listSessions({ pageSize: 1000, pageToken }),
        (reply) => (list = list.concat(reply.sessions)),
        () => (list = []),
      );
      this.list = list.sort((a, b) => a.number - b.number);
      this.known = true;
      this.problem = null;
    } catch (error) {
      this.problem = problemOf(error);
      if (this.users) this.again.ask();
    } finally {
      this.reading = false;
    }
  }

  // "morning", or "session 6" for one without a name, or one that is not known (yet).
  nameOf(number: number): string {
    return this.byNumber.get(number)?.name || `session ${number}`;
  }
}

export const sessions = new Sessions();
