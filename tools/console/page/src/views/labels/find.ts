// Labels as the view asks for them and shows them.
import type { LabelledFrames } from '../../proto/relmap/v1/graph_pb';

export type By = 'words' | 'prefix';

export function byOf(text: string | null): By {
  return text === 'prefix' ? 'prefix' : 'words';
}

export function request(query: string, by: By): { words: string } | { prefix: string } {
  return by === 'prefix' ? { prefix: query } : { words: query.trim() };
}

const kMostBytes = 64;

// What is wrong with a label that is typed; empty: nothing.
export function wrongWith(label: string): string {
  if (!label.trim()) return 'A label has at least one character that is not white space.';
  const size = new TextEncoder().encode(label).length;
  return size > kMostBytes ? `A label has at most ${kMostBytes} bytes; this one has ${size}.` : '';
}

// The pages of a list together: a label may go on with the next page.
export function joined(pages: LabelledFrames[][]): LabelledFrames[] {
  const all: LabelledFrames[] = [];
  for (const page of pages)
    for (const each of page) {
      const last = all[all.length - 1];
      if (last?.label === each.label) all[all.length - 1] = { ...last, frames: [...last.frames, ...each.frames] };
      else all.push(each);
    }
  return all;
}
