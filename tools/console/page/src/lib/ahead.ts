// Holds what is shown and what will probably be shown next, loaded ahead: a bounded number of values by name.
export class Ahead<T> {
  private held = new Map<string, T>(); // the one used longest ago first
  private failures = new Map<string, unknown>();
  private stale = new Set<string>();
  private running = new Map<string, AbortController>();
  private wanted: string[] = [];

  // `drop` frees what a value holds; `told` is called when a value or a failure came.
  constructor(
    private readonly load: (name: string, signal: AbortSignal) => Promise<T>,
    private readonly drop: (value: T) => void,
    private readonly told: (name: string) => void,
    private readonly most = 8,
  ) {}

  // The most urgent first: it is loaded at once, and the others after it, one at a time. What else is being loaded is
  // cancelled.
  want(names: string[]) {
    this.wanted = names.slice(0, this.most);
    for (const [name, controller] of this.running)
      if (!this.wanted.includes(name)) {
        controller.abort();
        this.running.delete(name);
      }
    for (const name of [...this.wanted].reverse()) this.touch(name);
    this.go();
  }

  value(name: string): T | undefined {
    return this.held.get(name);
  }

  failure(name: string): unknown {
    return this.failures.get(name);
  }

  // Loads these anew if they are wanted; until then their old values are shown.
  refresh(names: Iterable<string>) {
    for (const name of names) {
      this.failures.delete(name);
      if (!this.held.has(name) && !this.running.has(name)) continue;
      this.stale.add(name);
      this.running.get(name)?.abort();
      this.running.delete(name);
    }
    this.go();
  }

  names(): string[] {
    return [...this.held.keys()];
  }

  clear() {
    this.wanted = [];
    for (const controller of this.running.values()) controller.abort();
    this.running.clear();
    for (const value of this.held.values()) this.drop(value);
    this.held.clear();
    this.failures.clear();
    this.stale.clear();
  }

  private touch(name: string) {
    const value = this.held.get(name);
    if (value === undefined) return;
    this.held.delete(name);
    this.held.set(name, value);
  }

  private go() {
    const due = (name: string) =>
      (!this.held.has(name) || this.stale.has(name)) && !this.failures.has(name) && !this.running.has(name);
    const [first, ...rest] = this.wanted;
    if (first !== undefined && due(first)) void this.start(first);
    if (this.running.size > 0) return;
    const next = rest.find(due);
    if (next !== undefined) void this.start(next);
  }

  private async start(name: string) {
    const controller = new AbortController();
    this.running.set(name, controller);
    this.stale.delete(name);
    try {
      const value = await this.load(name, controller.signal);
      if (this.running.get(name) !== controller) return this.drop(value); // cancelled, but too late to stop it
      const old = this.held.get(name);
      this.held.set(name, value);
      this.touch(name);
      if (old !== undefined) this.drop(old);
      this.evict();
    } catch (error) {
      if (this.running.get(name) !== controller) return;
      this.failures.set(name, error);
    }
    this.running.delete(name);
    this.told(name);
    this.go();
  }

  private evict() {
    for (const [name, value] of this.held) {
      if (this.held.size <= this.most) return;
      if (this.wanted.includes(name)) continue;
      this.held.delete(name);
      this.stale.delete(name);
      this.drop(value);
    }
  }
}
