// The samples of the daemon's health that the console keeps (tools/console/README.md), and the lines drawn of them.

export interface Sample {
  t: number; // ms since 1970
  reachable: boolean;
  // Absent: the daemon did not answer then.
  keyframes_per_s?: number;
  frames?: number;
  queued?: number;
  lookup_lag?: number;
  pending_frames?: number;
  relaxation_p50_us?: number;
  relaxation_p99_us?: number;
  memory_used?: number;
  memory_budget?: number;
  resident_bytes?: number;
  disk_bytes?: number;
  refused?: number;
  accepted?: number;
  candidate?: number;
  quarantined?: number;
  removed?: number;
}
export type Key = Exclude<keyof Sample, 't' | 'reachable'>;
export type Values = (number | null)[]; // of each sample; null: not known

export const kSpanMs = 3_600_000;

// Old and new ones together, ascending, of the last hour.
export function merged(old: Sample[], more: Sample[]): Sample[] {
  const last = old[old.length - 1]?.t ?? -Infinity;
  const all = [...old, ...more.filter((sample) => sample.t > last)];
  const newest = all[all.length - 1]?.t ?? 0;
  return all.filter((sample) => sample.t > newest - kSpanMs);
}

export function valuesOf(samples: Sample[], key: Key): Values {
  return samples.map((sample) => {
    const value = sample.reachable ? sample[key] : undefined;
    return typeof value === 'number' && Number.isFinite(value) ? value : null;
  });
}

// How much a count has grown since the first sample. A count that falls began anew, with the daemon.
export function grown(values: Values): Values {
  let sum = 0;
  let last: number | null = null;
  return values.map((value) => {
    if (value === null) return null;
    if (last !== null) sum += value >= last ? value - last : value;
    last = value;
    return sum;
  });
}

// The end of an axis that begins at 0: a short number.
export function niceTop(most: number): number {
  if (!(most > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(most));
  return [1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10].map((factor) => factor * power).find((top) => top >= most * 0.999)!;
}

export function most(lines: Values[]): number {
  let top = 0;
  for (const line of lines) for (const value of line) if (value !== null && value > top) top = value;
  return top;
}

// A path of SVG, `width` by `height`, time to the right; broken where a value is not known or samples are missing.
export function pathOf(times: number[], values: Values, span: { from: number; to: number }, top: number, width: number, height: number): string {
  let path = '';
  let drawn = -Infinity; // when the last point was
  values.forEach((value, i) => {
    if (value === null) {
      drawn = -Infinity;
      return;
    }
    const x = ((times[i]! - span.from) / (span.to - span.from)) * width;
    const y = height - (Math.min(value, top) / top) * height;
    path += `${times[i]! - drawn > 60_000 ? 'M' : 'L'}${x.toFixed(1)} ${y.toFixed(1)}`;
    drawn = times[i]!;
  });
  return path;
}

// The index of the sample nearest to a time; -1: there is none.
export function nearest(times: number[], time: number): number {
  let best = -1;
  times.forEach((each, i) => {
    if (best < 0 || Math.abs(each - time) < Math.abs(times[best]! - time)) best = i;
  });
  return best;
}

// The indices of samples for a table: the last of every `everyMs`, the newest first.
export function rowsOf(times: number[], everyMs: number): number[] {
  const rows: number[] = [];
  for (let i = times.length - 1; i >= 0; --i)
    if (rows.length === 0 || Math.floor(times[i]! / everyMs) !== Math.floor(times[rows[rows.length - 1]!]! / everyMs)) rows.push(i);
  return rows;
}
