// What the address of the page says: the view, and what is shown in it. Whoever opens a copied address sees the same.
//
//   #/review?session=6&edge=6:9291/1
import { href, parseAddress } from './address_text';

export { href };

export class Address {
  view = $state('map');
  private parameters = $state.raw(new URLSearchParams());

  constructor() {
    this.read();
    window.addEventListener('hashchange', () => this.read());
  }

  private read() {
    ({ view: this.view, parameters: this.parameters } = parseAddress(location.hash));
  }

  get(name: string): string | null {
    return this.parameters.get(name);
  }

  // Changes parameters of this view; null takes one out. `keep`: leaves a step in the browser's history.
  set(changes: Record<string, string | null>, keep = false) {
    const parameters = new URLSearchParams(this.parameters);
    for (const [name, value] of Object.entries(changes)) {
      if (value === null || value === '') parameters.delete(name);
      else parameters.set(name, value);
    }
    if (parameters.toString() === this.parameters.toString()) return;
    this.write(this.view, parameters, keep);
  }

  // Goes to another view.
  go(view: string, parameters: Record<string, string> = {}) {
    this.write(view, new URLSearchParams(parameters), true);
  }

  private write(view: string, parameters: URLSearchParams, keep: boolean) {
    const url = href(view, parameters);
    if (keep) history.pushState(null, '', url);
    else history.replaceState(null, '', url);
    this.view = view;
    this.parameters = parameters;
  }
}

export const address = new Address();
