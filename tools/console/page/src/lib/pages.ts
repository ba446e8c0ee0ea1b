// All pages of a list. If the version of the map that they were of is gone, the list is read anew, twice at most.
import { problemOf } from './rpc';

export async function allPages<R extends { nextPageToken: string }>(
  page: (pageToken: string) => Promise<R>,
  take: (reply: R) => void,
  anew: () => void,
): Promise<void> {
  for (let tries = 0; ; ++tries) {
    try {
      anew();
      let token = '';
      do {
        const reply = await page(token);
        take(reply);
        token = reply.nextPageToken;
      } while (token);
      return;
    } catch (error) {
      if (tries === 2 || problemOf(error).reason !== 'VIEW_EXPIRED') throw error;
    }
  }
}

// Calls `work` when asked to, but at most every `ms`: events come by hundreds a second.
export function seldom(work: () => void, ms: number): { ask: () => void; end: () => void } {
  let timer: ReturnType<typeof setTimeout> | null = null;
  let last = 0;
  return {
    ask() {
      timer ??= setTimeout(
        () => {
          timer = null;
          last = Date.now();
          work();
        },
        Math.max(150, last + ms - Date.now()),
      );
    },
    end() {
      if (timer) clearTimeout(timer);
      timer = null;
    },
  };
}
