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
