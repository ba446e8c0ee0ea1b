// Asks again and again while a view is open and seen, and keeps the last answer when a call fails.
import { isAborted, problemOf, type Problem } from './rpc';

const kSoonMs = 5000;

export class Poll<T> {
  value = $state.raw<T | null>(null);
  problem = $state.raw<Problem | null>(null);
  private asking = false;
  private again = false;

  constructor(
    private ask: (last: T | null) => Promise<T>,
    private everyMs: number,
  ) {}

  // For $effect: returns what ends it.
  start(): () => void {
    void this.now();
    const seen = () => void this.now();
    const timer = setInterval(seen, this.everyMs);
    // After a failure it asks sooner.
    const soon = setInterval(() => this.problem && this.everyMs > kSoonMs && seen(), kSoonMs);
    document.addEventListener('visibilitychange', seen);
    return () => {
      clearInterval(timer);
      clearInterval(soon);
      document.removeEventListener('visibilitychange', seen);
    };
  }

  // Asks at once; if an answer is on its way, once more after it.
  async now() {
    if (document.hidden && this.value) return;
    if (this.asking) {
      this.again = true;
      return;
    }
    this.asking = true;
    try {
      do {
        this.again = false;
        this.value = await this.ask(this.value);
        this.problem = null;
      } while (this.again);
    } catch (error) {
      if (!isAborted(error)) this.problem = problemOf(error);
    } finally {
      this.asking = false;
    }
  }
}
