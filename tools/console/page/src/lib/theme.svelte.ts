// Light, dark, or as the system has it. Remembered by the browser.
type Choice = 'system' | 'light' | 'dark';
const order: Choice[] = ['system', 'light', 'dark'];

class Theme {
  choice = $state<Choice>('system');
  sign = $derived({ system: '◐', light: '☀', dark: '☾' }[this.choice]);
  private systemDark = matchMedia('(prefers-color-scheme: dark)');
  private system = $state(this.systemDark.matches);
  // What is shown now; the map's colours depend on it.
  dark = $derived(this.choice === 'dark' || (this.choice === 'system' && this.system));

  constructor() {
    const remembered = localStorage.getItem('relmap-theme') as Choice | null;
    if (remembered && order.includes(remembered)) this.choice = remembered;
    this.systemDark.addEventListener('change', (event) => (this.system = event.matches));
    this.show();
  }

  next = () => {
    this.choice = order[(order.indexOf(this.choice) + 1) % order.length]!;
    localStorage.setItem('relmap-theme', this.choice);
    this.show();
  };

  private show() {
    if (this.choice === 'system') delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = this.choice;
  }
}

export const theme = new Theme();
