// The route that the address names: asked for when the page is opened with it, and drawn on the map.
import { untrack } from 'svelte';
import { address } from '../../lib/address.svelte';
import { caller } from '../../lib/caller.svelte';
import { isAborted, map, problemOf, type Problem } from '../../lib/rpc';
import { endRequest, parseEnd, readHow, routeRequest, type How } from '../place/ends';
import { withReply, type Route } from '../place/route';
import { framesOf, parseRoute } from './route_lines';

const parameters = ['route', 'by', 'alternatives', 'avoid'];

export class RouteState {
  private asked = $derived(parameters.map((name) => address.get(name) ?? '').join('\n'));
  ends = $derived(parseRoute(this.asked.split('\n')[0]!));
  how = $derived<How>((void this.asked, readHow((name) => address.get(name))));
  routes = $state.raw<Route[]>([]);
  busy = $state(false);
  problem = $state.raw<Problem | null>(null);
  // Which of the routes stands out, from 0.
  chosen = $derived(Math.max(0, Math.min(this.routes.length - 1, (Number(address.get('way')) || 1) - 1)));
  frames = $derived(this.busy ? [] : framesOf(this.routes));

  // For $effect: asks for what the address names, and again when the daemon is back.
  follow(): () => void {
    void [this.asked, caller.returns];
    const abort = new AbortController();
    untrack(() => void this.find(abort));
    return () => abort.abort();
  }

  private async find({ signal }: AbortController) {
    this.routes = [];
    this.problem = null;
    this.busy = !!this.ends;
    if (!this.ends) return;
    const [from, to] = this.ends.map((end) => endRequest(parseEnd(end), null));
    try {
      const request = { ...routeRequest(from!, to!, this.how), covariance: false };
      let routes: Route[] = [];
      for await (const reply of map.findRoute(request, { signal, timeoutMs: 120_000 })) routes = withReply(routes, reply);
      this.routes = routes;
    } catch (error) {
      if (isAborted(error)) return;
      this.problem = problemOf(error);
    }
    this.busy = false;
  }

  choose(index: number) {
    address.set({ way: index ? String(index + 1) : null });
  }
  clear() {
    address.set({ ...Object.fromEntries(parameters.map((name) => [name, null])), way: null }, true);
  }
}
