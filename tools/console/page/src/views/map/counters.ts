// What the map costs, for tests and for those who look into it: window.relmapMap, read only, while the Map view is open.
//
//   version, complete         the layout that is drawn; whether all its tiles for this picture have come
//   frames                    drawn since the view was opened
//   vertices, tiles, drawCalls   of the last frame
//   scriptMs: { last, median, worst }   script of a frame, of the last 240 frames
//   pickMs                    the last search for what lies under the pointer
//   fetchedBytes, heldBytes   tiles that came; tiles held, with their copies on the graphics card
//   ease                      how far the lines of the last frame were from the layout before to this one, 0..1
//   routePoints               places through which routes are drawn
//   robots, trailPoints       robots drawn; frames of theirs that are newer than the tiles
//   camera                    { x, y, mpp, turn }
import type { Camera } from '../../map/camera';
import type { Stage } from '../../map/stage';
import type { Trails } from '../../map/trails';

export interface Counters {
  readonly version: number | null;
  readonly complete: boolean;
  readonly frames: number;
  readonly vertices: number;
  readonly tiles: number;
  readonly drawCalls: number;
  readonly scriptMs: { last: number; median: number; worst: number };
  readonly pickMs: number;
  readonly fetchedBytes: number;
  readonly heldBytes: number;
  readonly ease: number;
  readonly routePoints: number;
  readonly robots: number;
  readonly trailPoints: number;
  readonly camera: Camera;
}
declare global {
  interface Window {
    relmapMap?: Counters;
  }
}

// Returns what takes them away.
export function publishCounters(stage: Stage, trails: Trails): () => void {
  const { counters } = stage;
  window.relmapMap = Object.freeze({
    get version() {
      return stage.version;
    },
    get complete() {
      return stage.complete;
    },
    get frames() {
      return counters.frames;
    },
    get vertices() {
      return counters.vertices;
    },
    get tiles() {
      return counters.tiles;
    },
    get drawCalls() {
      return counters.drawCalls;
    },
    get scriptMs() {
      const sorted = [...counters.scriptMs].sort((a, b) => a - b);
      const median = sorted[Math.floor(sorted.length / 2)] ?? 0;
      return { last: counters.scriptMs.at(-1) ?? 0, median, worst: sorted.at(-1) ?? 0 };
    },
    get pickMs() {
      return counters.pickMs;
    },
    get fetchedBytes() {
      return counters.fetched;
    },
    get heldBytes() {
      return stage.held;
    },
    get ease() {
      return counters.ease;
    },
    get routePoints() {
      return stage.marks.routes.reduce((sum, { points }) => sum + points, 0);
    },
    get robots() {
      return stage.marks.robots.length;
    },
    get trailPoints() {
      return trails.fresh;
    },
    get camera() {
      return { ...stage.camera };
    },
  });
  return () => delete window.relmapMap;
}
