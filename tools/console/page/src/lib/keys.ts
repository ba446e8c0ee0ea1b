// A key that nobody else has chosen. (crypto.randomUUID is missing where the console is served without TLS.)
export function newKey(): string {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, '0')).join('');
}

// Idempotency keys of edits. An edit that failed keeps its key: if the daemon did it after all and only the answer was
// lost, trying again does not do it twice.
export class EditKeys {
  private failed = new Map<string, string>();

  // `edit` says what is done to what: the same text means the same edit.
  of(edit: string): string {
    const key = this.failed.get(edit) ?? newKey();
    this.failed.set(edit, key);
    return key;
  }

  done(edit: string) {
    this.failed.delete(edit);
  }
}
