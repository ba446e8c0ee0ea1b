// The state of the layout, followed by asking for what is newer than the last answer.
import { getJson, isAborted, problemOf, type Problem } from '../../lib/rpc';
import type { Layout } from '../../map/layout';

// Between questions: the layout's progress is news several times a second. Whoever waits for the first picture asks on.
const leastMs = 250;
const firstMs = 30;

export class LayoutState {
  now = $state.raw<Layout | null>(null);
  problem = $state.raw<Problem | null>(null);

  private abort = new AbortController();
  private immediately = false;

  // For $effect: returns what ends it.
  follow(): () => void {
    let ended = false;
    let after: number | null = null;
    const run = async () => {
      let wait = 500;
      while (!ended) {
        this.abort = new AbortController();
        const began = Date.now();
        try {
          const query: string = after === null || this.immediately ? '' : `?after=${after}&wait=25`;
          this.immediately = false;
          const layout = await getJson<Layout>(`/map/layout${query}`, this.abort.signal);
          if (ended) return;
          this.now = layout;
          this.problem = null;
          after = layout.version;
          wait = layout.version ? leastMs : firstMs;
        } catch (error) {
          if (ended) return;
          if (!isAborted(error)) {
            this.problem = problemOf(error);
            wait = Math.min(wait * 2, 5000);
          }
        }
        const passed = Date.now() - began;
        if (passed < wait) await new Promise((resolve) => setTimeout(resolve, wait - passed));
      }
    };
    void run();
    return () => {
      ended = true;
      this.abort.abort();
    };
  }

  // Asks at once what there is: the version that is drawn has gone.
  again() {
    if (this.immediately) return;
    this.immediately = true;
    this.abort.abort();
  }
}
