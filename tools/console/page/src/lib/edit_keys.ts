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
