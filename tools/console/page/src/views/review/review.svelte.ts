// The state of the view: the list of closures, which of them is shown, and what others do meanwhile.
import { untrack } from 'svelte';
import { Ahead } from '../../lib/ahead';
import { address } from '../../lib/address.svelte';
import { edgeText, parseEdge } from '../../lib/ids';
import { isAborted, map, problemOf, type Problem } from '../../lib/rpc';
import type { MapEvent } from '../../proto/relmap/v1/watch_pb';
import { explain, freeExplained, type Explained } from './explained';
import {
  around, emptyQueue, filterProblem, nearEnd, readFilters, requestOf, step, withEvents, withPage, writeFilters,
  type Filters, type Notice, type Queue,
} from './queue';

const kPage = 100;

export class Review {
  filters = $derived(readFilters((name) => address.get(name)));
  queue = $state.raw<Queue>(emptyQueue);
  loading = $state(false);
  listed = $state(false); // at least once, with these filters
  problem = $state.raw<Problem | null>(null);
  notices = $state.raw<Notice[]>([]);
  chosen = $derived(parseEdge(address.get('edge')) ? address.get('edge') : null);
  // Changes with every event that may have changed the map around the chosen closure.
  version = $state(0);

  private told = $state(0); // makes what the cache holds reactive
  private ahead = new Ahead<Explained>(explain, freeExplained, () => ++this.told);
  private asked = new AbortController();
  private due: ReturnType<typeof setTimeout> | null = null;
  private changedNames = new Set<string>();

  explained = $derived.by(() => {
    void this.told;
    return this.chosen ? this.ahead.value(this.chosen) : undefined;
  });
  failure = $derived.by(() => {
    void this.told;
    const failure = this.chosen ? this.ahead.failure(this.chosen) : undefined;
    return failure === undefined ? null : problemOf(failure);
  });
  place = $derived(this.queue.rows.findIndex((row) => row.name === this.chosen));

  // Lists from the beginning. Without `keep` the first of the list is chosen.
  async list(keep = true) {
    this.asked.abort();
    const asked = (this.asked = new AbortController());
    const wrong = filterProblem(this.filters);
    this.problem = wrong ? { reason: 'INVALID_ARGUMENT', message: wrong } : null;
    if (wrong) {
      this.queue = emptyQueue;
      return;
    }
    this.loading = true;
    try {
      const reply = await map.listEdges(requestOf(this.filters, kPage, ''), { signal: asked.signal });
      this.queue = withPage(emptyQueue, reply.edges, reply.nextPageToken);
      this.listed = true;
      if (!this.chosen || !keep) this.open(this.queue.rows[0]?.name ?? null);
      else this.load();
    } catch (error) {
      if (isAborted(error)) return;
      this.problem = problemOf(error);
    } finally {
      if (this.asked === asked) this.loading = false;
    }
  }

  async more() {
    if (this.loading || !this.queue.next) return;
    this.loading = true;
    const asked = this.asked;
    try {
      const reply = await map.listEdges(requestOf(this.filters, kPage, this.queue.next), { signal: asked.signal });
      this.queue = withPage(this.queue, reply.edges, reply.nextPageToken);
    } catch (error) {
      if (isAborted(error)) return;
      const problem = problemOf(error);
      // The version of the map that was listed is gone: what there is now, as far as it was seen.
      if (problem.reason === 'VIEW_EXPIRED') await this.listAgainTo(this.queue.rows.length + kPage, asked);
      else this.problem = problem;
    } finally {
      if (this.asked === asked) this.loading = false;
    }
  }

  private async listAgainTo(rows: number, asked: AbortController) {
    try {
      let queue = emptyQueue;
      do {
        const request = requestOf(this.filters, Math.min(5000, Math.max(kPage, rows)), queue.next);
        const reply = await map.listEdges(request, { signal: asked.signal });
        queue = withPage(queue, reply.edges, reply.nextPageToken);
      } while (queue.next && queue.rows.length < rows);
      this.queue = queue;
    } catch (error) {
      if (!isAborted(error)) this.problem = problemOf(error);
    }
  }

  setFilters(filters: Filters) {
    address.set(writeFilters(filters), true);
  }

  open(name: string | null) {
    address.set({ edge: name });
    this.load();
  }

  // To the next (1) or previous (-1) of the list.
  go(by: number) {
    const next = step(this.queue, this.chosen, by);
    if (next) this.open(next);
    if (nearEnd(this.queue, this.chosen)) void this.more();
  }

  // Loads what is shown, and ahead what will be.
  load() {
    untrack(() => {
      if (this.chosen) this.ahead.want(around(this.queue, this.chosen));
    });
  }

  // After an edit of one's own, or to try again what failed.
  again(name: string) {
    this.ahead.refresh([name]);
    ++this.version;
  }

  take(events: MapEvent[]) {
    const { queue, notices } = withEvents(this.queue, events, this.filters);
    this.queue = queue;
    if (!notices.length) return;
    this.notices = [...notices].reverse().concat(this.notices).slice(0, 20);
    for (const notice of notices) this.changedNames.add(notice.name);
    this.due ??= setTimeout(() => this.reload(), 250);
  }

  // What is shown of a closure also tells the states of those that agree with it.
  private reload() {
    this.due = null;
    const names = this.ahead.names().filter((name) => {
      const agreements = this.ahead.value(name)?.reply.agreements ?? [];
      return this.changedNames.has(name) || agreements.some((each) => this.changedNames.has(edgeText(each.edge)));
    });
    this.changedNames.clear();
    this.ahead.refresh(names);
    ++this.version;
  }

  end() {
    this.asked.abort();
    if (this.due) clearTimeout(this.due);
    this.ahead.clear();
  }
}
