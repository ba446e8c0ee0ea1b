// Where frames lie in the layout that is drawn, asked for once each.
import { postJson } from '../../lib/rpc';
import type { FramePlace } from '../../map/layout';

const atOnce = 10_000;

export class Places {
  private known = new Map<string, FramePlace | null>();
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
