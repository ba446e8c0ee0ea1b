// Where frames lie in the layout that is drawn, asked for once each.
import { postJson } from '../../lib/rpc';
import { wrapped } from '../../map/camera';
import type { FramePlace } from '../../map/layout';

const atOnce = 10_000;

export class Places {
  private known = new Map<string, FramePlace | null>();
  private before = new Map<string, FramePlace>(); // in the version before, while marks are eased
  share = 1; // 0..1 of the way from there
  private version: number | null = null;
  private running = false;
  private wanted = new Set<string>();

  // `changed`: more is known. `again`: everything was asked anew, of another version.
  constructor(
    private readonly changed: (again: boolean) => void,
    private readonly failed: (error: unknown) => void,
  ) {}

  // undefined: not asked; null: not in the layout.
  get(frame: string): FramePlace | null | undefined {
    return this.known.get(frame);
  }

  // Where to draw what is marked there: on its way from the version before to this one, as the lines are.
  shown(frame: string): FramePlace | null {
    const to = this.known.get(frame) ?? null;
    const from = this.share < 1 && to ? this.before.get(frame) : undefined;
    if (!from || from.part !== to!.part) return to;
    const at = (one: number, other: number) => one + (other - one) * this.share;
    return { ...to!, x: at(from.x, to!.x), y: at(from.y, to!.y), heading: from.heading + wrapped(to!.heading - from.heading) * this.share };
  }

  want(frames: Iterable<string>) {
    let more = false;
    for (const frame of frames)
      if (frame && !this.known.has(frame) && !this.wanted.has(frame)) {
        this.wanted.add(frame);
        more = true;
      }
    if (more) void this.run();
  }

  // Another version is drawn, and these are needed of it. What was known of them stays until their places have come;
  // all others are forgotten.
  renew(version: number, frames: Iterable<string>) {
    this.version = version;
    this.wanted = new Set(frames);
    this.before = new Map([...this.known].filter((each): each is [string, FramePlace] => each[1] !== null));
    for (const frame of this.known.keys()) if (!this.wanted.has(frame)) this.known.delete(frame);
    void this.run(true);
  }

  private async run(again = false) {
    if (this.running) return;
    this.running = true;
    try {
      let anew = again;
      while (this.wanted.size) {
        const version = this.version;
        const frames = [...this.wanted].slice(0, atOnce);
        const reply = await postJson<{ version: number; places: (FramePlace | null)[] }>('/map/places', { frames });
        if (version !== this.version) {
          anew = true;
          continue; // another version is drawn by now
        }
        frames.forEach((frame, i) => {
          this.wanted.delete(frame);
          this.known.set(frame, reply.places[i] ?? null);
        });
        if (!this.wanted.size) this.changed(anew);
      }
    } catch (error) {
      this.wanted.clear();
      this.failed(error);
    } finally {
      this.running = false;
    }
  }
}
