// Keys of a view: <svelte:window onkeydown={keys({ j: next, k: previous })} />. They do nothing while somebody types,
// while a dialog is open, and after "g", which goes to another view.
export function keys(actions: Record<string, () => void>): (event: KeyboardEvent) => void {
  let going = false;
  return (event) => {
    const afterG = going;
    going = event.key === 'g' && !typing(event);
    if (afterG || typing(event) || event.ctrlKey || event.metaKey || event.altKey) return;
    if (document.querySelector('dialog[open]')) return;
    // An action named '+' is also that of '=', which is the same key without shift.
    const action = actions[event.key] ?? (event.key === '=' ? actions['+'] : undefined);
    if (!action) return;
    event.preventDefault();
    action();
  };
}

function typing(event: KeyboardEvent): boolean {
  const target = event.target as HTMLElement;
  if (target.matches('textarea, select')) return true;
  return target.matches('input') && !['range', 'checkbox', 'radio', 'button'].includes((target as HTMLInputElement).type);
}

// A key that nobody else has chosen. (crypto.randomUUID is missing where the console is served without TLS.)
export function newKey(): string {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, '0')).join('');
}

// Idempotency keys of edits. An edit that fails and is tried again at once keeps its key: if the daemon did it after all
// and only the answer was lost, it is not done twice. After any other edit it is a new one, for what the first one did may
// have been taken back since.
export class EditKeys {
  private last: { edit: string; key: string } | null = null;

  // `edit` says what is done to what: the same text means the same edit.
  of(edit: string): string {
    if (this.last?.edit !== edit) this.last = { edit, key: newKey() };
    return this.last.key;
  }

  done() {
    this.last = null;
  }
}
