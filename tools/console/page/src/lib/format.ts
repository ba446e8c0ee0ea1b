// Numbers, times and names as people read them.

const counts = new Intl.NumberFormat('en', { maximumFractionDigits: 0 });

export function count(value: number | bigint): string {
  return counts.format(value);
}

// "3 closures", "1 closure"
export function counted(value: number | bigint, one: string, many = one + 's'): string {
  return `${count(value)} ${Number(value) === 1 ? one : many}`;
}

export function bytes(value: number | bigint): string {
  let size = Number(value);
  for (const unit of ['B', 'kB', 'MB', 'GB']) {
    if (size < 1000) return `${size < 10 && unit !== 'B' ? size.toFixed(1) : size.toFixed(0)} ${unit}`;
    size /= 1000;
  }
  return `${size.toFixed(1)} TB`;
}

export function metres(value: number): string {
  if (!Number.isFinite(value)) return 'unknown';
  if (Math.abs(value) < 0.995) return `${(value * 100).toFixed(Math.abs(value) < 0.0995 ? 1 : 0)} cm`;
  if (Math.abs(value) < 9950) return `${value.toFixed(Math.abs(value) < 9.95 ? 1 : 0)} m`;
  return `${(value / 1000).toFixed(1)} km`;
}

export function seconds(value: number): string {
  if (value < 0.0995) return `${(value * 1000).toFixed(value < 0.00995 ? 1 : 0)} ms`;
  if (value < 9.95) return `${value.toFixed(1)} s`;
  if (value < 99.5) return `${value.toFixed(0)} s`;
  if (value < 5970) return `${(value / 60).toFixed(0)} min`;
  if (value < 171_000) return `${(value / 3600).toFixed(1)} h`;
  return `${(value / 86_400).toFixed(0)} days`;
}

// Of microseconds since 1970, UTC: "2026-11-30 21:04:05". Empty: not known, or no time that has a date.
export function time(us: bigint | number): string {
  const date = new Date(Number(us) / 1000);
  if (!us || Number.isNaN(date.getTime())) return '';
  return date.toISOString().replace('T', ' ').slice(0, 19);
}

// How long ago: "3 min ago".
export function ago(us: bigint | number, now = Date.now()): string {
  if (!us) return '';
  const passed = now / 1000 - Number(us) / 1e6;
  return passed < 1 ? 'just now' : `${seconds(passed)} ago`;
}

// What somebody wrote into a field of several lines, as the one line that the daemon takes.
export function line(text: string): string {
  return text.trim().replace(/\s+/g, ' ');
}

// A text that somebody else chose, harmless: control characters, those that cannot be seen and those that change the
// direction of writing are shown as their codes, and a long text is cut, never within a character.
export function plain(text: string, most = 200): string {
  const long = text.length > most;
  const cut = long && /[\ud800-\udbff]/.test(text[most - 1] ?? '') ? most - 1 : most;
  const shown = text.slice(0, cut).replace(
    /[\u0000-\u001f\u007f-\u009f\u00ad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb]|[\u{e0000}-\u{e007f}]|\p{Surrogate}/gu,
    (letter) => `\\u${letter.codePointAt(0)!.toString(16).padStart(4, '0')}`,
  );
  return long ? shown + '…' : shown;
}
