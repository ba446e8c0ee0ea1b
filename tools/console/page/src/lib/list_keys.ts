// Keys that step through the rows of whatever list the view shows: j and k go to the next and the previous, and Enter
// opens the one that has the focus. A row is marked by data-row, and in it what Enter presses by data-open.
import { keys } from './keys';

const rows = () => [...document.querySelectorAll<HTMLElement>('[data-row]')];

function step(by: number) {
  const list = rows();
  const now = list.findIndex((row) => row.contains(document.activeElement));
  const next = list[now < 0 ? (by > 0 ? 0 : list.length - 1) : now + by];
  if (!next) return;
  next.tabIndex = -1;
  next.focus();
}

const stepping = keys({ j: () => step(1), k: () => step(-1) });

export function listKeys(event: KeyboardEvent) {
  if (!document.querySelector('[data-row]')) return;
  stepping(event);
  const row = event.target as HTMLElement;
  if (event.key === 'Enter' && row.matches('[data-row]')) row.querySelector<HTMLElement>('[data-open]')?.click();
}
