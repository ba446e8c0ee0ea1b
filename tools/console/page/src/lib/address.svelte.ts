// What the address of the page says: the view, and what is shown in it. Whoever opens a copied address sees the same.
//
//   #/review?session=6&edge=6:9291/1
export class Address {
  view = $state('map');
  private parameters = $state.raw(new URLSearchParams());

  constructor() {
    this.read();
    window.addEventListener('hashchange', () => this.read());
  }

  private read() {
    const match = /^#\/([a-z]*)(?:\?(.*))?$/.exec(location.hash);
    this.view = match?.[1] || 'map';
    this.parameters = new URLSearchParams(match?.[2] ?? '');
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

// For links: <a href={href('map', { root: '6:120' })}>
export function href(view: string, parameters: Record<string, string> | URLSearchParams = {}): string {
  // Colons, commas and slashes stay readable: frames are 6:120, closures 6:120/1.
  const query = new URLSearchParams(parameters).toString().replace(/%3A/g, ':').replace(/%2F/g, '/').replace(/%2C/g, ',');
  return `#/${view}${query ? '?' + query : ''}`;
}

export const address = new Address();
