// The picture of the map: camera, tiles and what lies over them, drawn when something has changed. It is told what to
// show, and tells what the pointer does. No framework: the picture moves 60 times a second.
import {
  between, fit, pan, toScreen, toWorld, zoomAt, type Box, type Camera, type Size,
} from './camera';
import { drawable, whole, type Layout } from './layout';
import { noMarks, Overlay, type Marks } from './overlay';
import { pickClosure, pickFrame, type Picked, type PickRules } from './pick';
import { Renderer, shownStates, type Item, type Look } from './renderer';
import { Scene } from './scene';
import { closureTorn, type Tile } from './tile';
import { affordable, ancestor, cover, keyOf, tileBox, tilesInView, zoomFor, type Drawn, type TileId } from './tiling';

export interface StageEvents {
  moved(byHand: boolean): void; // the camera is elsewhere
  settled(): void; // nothing has moved for a while
  clicked(picked: Picked | null, px: number, py: number): void;
  hovered(picked: Picked | null, px: number, py: number): void;
  swapped(version: number): void; // another version of the layout is drawn
  expired(): void; // the console has a newer layout
  lost(lost: boolean): void; // the graphics context
}

export const easeMs = 600;
const vertexBudget = 200_000;
const patience = 4000; // ms, for the tiles of a new version, before it is shown as far as it has come
const reach = 9; // pixels from the pointer to what it means

export class Stage {
  camera: Camera = { x: 0, y: 0, mpp: 1, turn: 0 };
  size: Size = { width: 1, height: 1 };
  look: Look;
  marks: Marks = noMarks;
  states = new Map<string, number>(); // of closures that changed since the tiles were made

  readonly counters = {
    frames: 0, // drawn
    scriptMs: [] as number[], // of the last 240 frames drawn
    vertices: 0, // in the last frame
    drawCalls: 0,
    tiles: 0,
    pickMs: 0, // the last pick
    ease: 1, // 0..1, from the places in the layout before
    fetched: 0, // bytes of tiles, in all
  };
  // The picture has all that belongs to it.
  get complete(): boolean {
    return !!this.scene && !this.next && this.scene.store.settled && this.scene.store.missing === 0;
  }
  get trouble(): unknown {
    return this.scene?.store.trouble ?? null;
  }
  get held(): number {
    return (this.scene?.store.bytes ?? 0) + (this.next?.store.bytes ?? 0);
  }
  get version(): number | null {
    return this.scene?.layout.version ?? null;
  }
  get layout(): Layout | null {
    return this.scene?.layout ?? null;
  }

  private renderer: Renderer;
  private overlay: Overlay;
  private scene: Scene | null = null;
  private next: Scene | null = null;
  private nextSince = 0;
  private drawn: { item: Item; id: TileId }[] = [];
  private requested = 0;
  private settle: ReturnType<typeof setTimeout> | null = null;
  private flight: { from: Camera; to: Camera; since: number; ms: number } | null = null;
  private resize: ResizeObserver;
  private pointers = new Map<number, { x: number; y: number }>();
  private dragged = 0;
  private hover: { x: number; y: number } | null = null;
  private calm = matchMedia('(prefers-reduced-motion: reduce)');

  // Throws NoWebGl.
  constructor(
    private readonly host: HTMLElement,
    lines: HTMLCanvasElement,
    over: HTMLCanvasElement,
    look: Look,
    private readonly events: StageEvents,
  ) {
    this.look = look;
    this.renderer = new Renderer(lines, () => {
      events.lost(false);
      this.redraw();
    });
    lines.addEventListener('webglcontextlost', () => events.lost(true));
    this.overlay = new Overlay(over);
    this.resize = new ResizeObserver(() => {
      this.measure();
      this.redraw();
    });
    this.resize.observe(host);
    this.measure();
    host.addEventListener('pointerdown', this.down);
    host.addEventListener('pointermove', this.move);
    host.addEventListener('pointerup', this.up);
    host.addEventListener('pointercancel', this.cancel);
    host.addEventListener('pointerleave', this.leave);
    host.addEventListener('wheel', this.wheel, { passive: false });
    host.addEventListener('dblclick', this.twice);
  }

  end() {
    if (this.requested) cancelAnimationFrame(this.requested);
    if (this.settle) clearTimeout(this.settle);
    this.resize.disconnect();
    this.scene?.end();
    this.next?.end();
    this.renderer.end();
  }

  private measure() {
    this.size = { width: this.host.clientWidth || 1, height: this.host.clientHeight || 1 };
  }

  // ---- What is shown

  // `root`: with standard deviations relative to this frame.
  show(layout: Layout, root: string | null) {
    if (!drawable(layout)) {
      this.scene?.end();
      this.next?.end();
      this.scene = this.next = null;
      this.redraw();
      return;
    }
    const now = this.next ?? this.scene;
    if (now && now.layout.version === layout.version && now.root === root && now.layout.map_uuid === layout.map_uuid) return;
    this.next?.end();
    this.next = null;
    const same = this.scene?.layout.map_uuid === layout.map_uuid;
    const from = this.scene && same && this.scene.layout.version !== layout.version ? this.scene.layout.version : null;
    const scene = new Scene(layout, root, from, this.renderer, (tile) => this.override(tile), () => this.redraw());
    if (!this.scene || !same) {
      this.scene?.end();
      this.scene = scene;
      this.events.swapped(layout.version);
    } else {
      this.next = scene;
      this.nextSince = performance.now();
      setTimeout(() => this.redraw(), patience + 50);
    }
    this.redraw();
  }

  // A closure changed its state. The tiles are corrected at once.
  stateChanged(changes: ReadonlyMap<string, number>) {
    for (const [edge, state] of changes) this.states.set(edge, state);
    for (const scene of [this.scene, this.next])
      if (scene) for (const batch of scene.store.values()) if (this.override(batch.tile, changes)) this.renderer.statesChanged(batch);
    this.redraw();
  }
  private override(tile: Tile, changes: ReadonlyMap<string, number> = this.states): boolean {
    if (!changes.size) return false;
    let changed = false;
    const { closures } = tile;
    for (let i = 0; i < closures.count; i++) {
      const state = changes.get(`${closures.session[i]}:${closures.index[i]}/${closures.ordinal[i]}`);
      if (state === undefined || state === closures.state[i]) continue;
      closures.state[i] = state;
      changed = true;
    }
    return changed;
  }

  // ---- The camera

  goto(camera: Camera, ms = 350, byHand = false) {
    if (this.calm.matches || ms === 0) {
      this.flight = null;
      this.camera = camera;
    } else {
      this.flight = { from: this.camera, to: camera, since: performance.now(), ms };
    }
    this.moved(byHand);
  }
  gotoBox(box: Box, least = 0.004, ms = 350) {
    this.goto(fit(box, this.size, Math.min(60, this.size.width / 8), this.camera.turn, least), ms);
  }
  // Where a flight ends.
  get aim(): Camera {
    return this.flight?.to ?? this.camera;
  }
  all(ms = 350) {
    if (this.scene) this.gotoBox(whole(this.scene.layout), 0.004, ms);
  }
  get showsAll(): boolean {
    if (!this.scene) return true;
    const [left, bottom, right, top] = whole(this.scene.layout);
    const { width, height } = this.size;
    return [[left, bottom], [left, top], [right, bottom], [right, top]].every(([x, y]) => {
      const [px, py] = toScreen(this.aim, this.size, x!, y!);
      return px >= 0 && py >= 0 && px <= width && py <= height;
    });
  }
  zoom(factor: number) {
    this.goto(zoomAt(this.aim, this.size, this.size.width / 2, this.size.height / 2, factor), 180, true);
  }
  shift(dx: number, dy: number) {
    this.goto(pan(this.aim, dx, dy), 120, true);
  }
  private moved(byHand: boolean) {
    this.events.moved(byHand);
    this.redraw();
  }

  redraw = () => {
    if (!this.requested) this.requested = requestAnimationFrame(this.frame);
    if (this.settle) clearTimeout(this.settle);
    this.settle = setTimeout(() => this.events.settled(), 250);
  };

  // ---- A frame

  private frame = () => {
    this.requested = 0;
    const begin = performance.now();
    this.fly(begin);
    this.choose(begin);
    const pixel = Math.min(2, window.devicePixelRatio || 1);
    this.renderer.draw(this.camera, this.size, pixel, this.drawn.map(({ item }) => item), this.look);
    const tiles = this.tiles;
    const drawn = (edge: string) => tiles.some((tile) => tornOf(tile).has(edge));
    this.overlay.draw(this.camera, this.size, pixel, this.marks, this.look.palette, drawn);
    const { counters } = this;
    counters.frames++;
    counters.ease = this.easing(begin);
    counters.drawCalls = this.renderer.drawCalls;
    counters.scriptMs.push(performance.now() - begin);
    if (counters.scriptMs.length > 240) counters.scriptMs.shift();
    // However long a frame takes, the last one shows where it ends.
    if (this.flight || counters.ease < 1) this.redraw();
  };

  private fly(now: number) {
    if (!this.flight) return;
    const { from, to, since, ms } = this.flight;
    const share = smooth((now - since) / ms);
    this.camera = share >= 1 ? to : between(from, to, share);
    if (share >= 1) this.flight = null;
  }
  // How far the lines are on their way from the layout before.
  easing(now: number): number {
    const since = this.scene?.easedFrom;
    return since == null ? 1 : smooth((now - since) / easeMs);
  }

  // Which tiles the picture consists of.
  private choose(now: number) {
    const { scene } = this;
    this.drawn = [];
    this.counters.vertices = 0;
    if (!scene) return;
    if (this.next) {
      this.next.store.want(this.needed(this.next));
      if (this.next.store.settled || now - this.nextSince > patience) this.swap(now);
    }
    const current = this.scene!;
    const tiles = this.needed(current);
    // Ancestors, too, if nothing else is missing: they are shown as soon as somebody goes farther.
    const parents = new Map(tiles.map((tile) => ancestor(tile, Math.min(2, tile.z))).map((tile) => [keyOf(tile), tile]));
    for (const tile of tiles) parents.delete(keyOf(tile));
    if (!this.next) current.store.want([...tiles, ...parents.values()]);
    if (current.expired) this.events.expired();

    const ease = this.easing(now);
    if (ease >= 1) current.easedFrom = null;
    for (const { tile, only } of cover(tiles, current.store.has)) this.add(current, { tile, only }, ease);
    const unique = new Set(this.drawn.map(({ item }) => item.batch));
    for (const batch of unique) this.counters.vertices += batch.tile.count;
    this.counters.tiles = unique.size;
    this.counters.fetched = Math.max(this.counters.fetched, current.store.fetched);
  }
  private add(scene: Scene, { tile, only }: Drawn, ease: number) {
    const batch = scene.store.use(tile);
    if (batch) this.drawn.push({ item: { batch, only: only ? tileBox(scene.layout.world, only) : null, ease }, id: tile });
  }
  private needed(scene: Scene): TileId[] {
    const { world, zooms } = scene.layout;
    return affordable(
      zoomFor(this.camera.mpp, world, zooms),
      (z) => tilesInView(this.camera, this.size, world, z),
      (tile) => scene.count(tile),
      vertexBudget,
    ).tiles;
  }

  private swap(now: number) {
    const next = this.next!;
    this.scene?.end();
    this.scene = next;
    this.next = null;
    if (next.from !== null && !this.calm.matches) next.easedFrom = now;
    next.noMoreOld();
    this.events.swapped(next.layout.version);
  }

  // ---- What is where

  private rules(): PickRules {
    const { layers, chosen, until } = this.look;
    const states = shownStates(layers);
    return {
      until,
      session: (session) => !chosen.size || chosen.has(session),
      closure: (tile, i) => {
        const { closures } = tile;
        if (chosen.size && !chosen.has(closures.session[i]!) && !chosen.has(closures.sessionA[i]!)) return false;
        return (states & (1 << closures.state[i]!)) !== 0 || (layers.torn && (closures.flags[i]! & closureTorn) !== 0);
      },
    };
  }

  // What is meant at a pixel: a closure where it is nearer than a line.
  pick(px: number, py: number): Picked | null {
    const begin = performance.now();
    const [x, y] = toWorld(this.camera, this.size, px, py);
    const metres = reach * this.camera.mpp;
    const rules = this.rules();
    let best: Picked | null = null;
    for (const { item, id } of this.drawn) {
      const box = this.scene ? (item.only ?? tileBox(this.scene.layout.world, id)) : null;
      if (box && x > box[0] - metres && y > box[1] - metres && x < box[2] + metres && y < box[3] + metres) {
        const frame = pickFrame(item.batch.tile, x, y, best?.away ?? metres, rules);
        if (frame) best = frame;
      }
    }
    for (const { item } of this.drawn) {
      // A closure's whole length counts, but lines lie over what is beyond doubt.
      const closure = pickClosure(item.batch.tile, x, y, best ? Math.min(best.away, metres) : metres, rules);
      if (closure) best = closure;
    }
    this.counters.pickMs = performance.now() - begin;
    return best;
  }

  // Tiles whose content the picture shows, for lists of what is in view.
  get tiles(): Tile[] {
    return [...new Set(this.drawn.map(({ item }) => item.batch.tile))];
  }
  screen(x: number, y: number): [number, number] {
    return toScreen(this.camera, this.size, x, y);
  }

  // ---- The pointer

  private at(event: MouseEvent): { x: number; y: number } {
    const box = this.host.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }
  private down = (event: PointerEvent) => {
    if (event.button !== 0) return;
    this.host.setPointerCapture(event.pointerId);
    if (!this.pointers.size) this.dragged = 0;
    this.pointers.set(event.pointerId, this.at(event));
    this.flight = null;
  };
  private move = (event: PointerEvent) => {
    const before = this.pointers.get(event.pointerId);
    const now = this.at(event);
    if (!before) {
      const first = !this.hover;
      this.hover = now;
      if (first) requestAnimationFrame(this.tellHover);
      return;
    }
    this.dragged += Math.hypot(now.x - before.x, now.y - before.y);
    if (this.dragged < 4 && this.pointers.size === 1) return;
    if (this.pointers.size === 1) {
      this.camera = pan(this.camera, now.x - before.x, now.y - before.y);
    } else {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)![1];
      const wide = (point: { x: number; y: number }) => Math.max(10, Math.hypot(point.x - other.x, point.y - other.y));
      this.camera = pan(this.camera, (now.x - before.x) / 2, (now.y - before.y) / 2);
      this.camera = zoomAt(this.camera, this.size, (now.x + other.x) / 2, (now.y + other.y) / 2, wide(now) / wide(before));
    }
    this.pointers.set(event.pointerId, now);
    this.events.hovered(null, 0, 0);
    this.moved(true);
  };
  private up = (event: PointerEvent) => {
    if (!this.pointers.delete(event.pointerId)) return;
    if (this.dragged < 4 && !this.pointers.size) {
      const { x, y } = this.at(event);
      this.events.clicked(this.pick(x, y), x, y);
    }
  };
  private cancel = (event: PointerEvent) => {
    this.pointers.delete(event.pointerId);
  };
  private leave = () => {
    this.hover = null;
    this.events.hovered(null, 0, 0);
  };
  private tellHover = () => {
    const at = this.hover;
    this.hover = null;
    if (at && !this.pointers.size && !this.flight) this.events.hovered(this.pick(at.x, at.y), at.x, at.y);
  };
  private wheel = (event: WheelEvent) => {
    event.preventDefault();
    this.flight = null;
    const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1;
    const { x, y } = this.at(event);
    const factor = Math.exp(-Math.max(-300, Math.min(300, event.deltaY * lines)) * (event.ctrlKey ? 0.01 : 0.0018));
    this.camera = zoomAt(this.camera, this.size, x, y, factor);
    this.events.hovered(null, 0, 0);
    this.moved(true);
  };
  private twice = (event: MouseEvent) => {
    const { x, y } = this.at(event);
    this.goto(zoomAt(this.camera, this.size, x, y, 2), 200, true);
  };
}

const tornIn = new WeakMap<Tile, Set<string>>();
function tornOf(tile: Tile): Set<string> {
  let torn = tornIn.get(tile);
  if (!torn) {
    const { closures } = tile;
    torn = new Set();
    for (let i = 0; i < closures.count; i++)
      if (closures.flags[i]! & closureTorn) torn.add(`${closures.session[i]}:${closures.index[i]}/${closures.ordinal[i]}`);
    tornIn.set(tile, torn);
  }
  return torn;
}

function smooth(share: number): number {
  const at = Math.max(0, Math.min(1, share));
  return at * at * (3 - 2 * at);
}
