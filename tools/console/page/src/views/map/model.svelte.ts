// The Map view: what the address, the daemon and the robots say, made into what the stage shows. The address decides
// what is shown, so all that somebody chooses is written there first.
import { untrack } from 'svelte';
import { address } from '../../lib/address.svelte';
import { plain } from '../../lib/format';
import { parseEdge, parseFrame } from '../../lib/ids';
import { live } from '../../lib/live.svelte';
import { allPages, seldom } from '../../lib/pages';
import { Poll } from '../../lib/poll.svelte';
import { map, problemOf, type Problem } from '../../lib/rpc';
import { sessions } from '../../lib/sessions.svelte';
import { theme } from '../../lib/theme.svelte';
import { around, cameraText, corners, fit, fromRelative, headingUp, pan, parseCamera, relativeTo, type Camera } from '../../map/camera';
import { inView, type InView } from '../../map/in_view';
import { drawable, type FramePlace, type Torn } from '../../map/layout';
import { palette } from '../../map/palette';
import { noMarks, type RouteMark } from '../../map/overlay';
import type { Picked } from '../../map/pick';
import type { Look } from '../../map/renderer';
import { easeMs, type Stage } from '../../map/stage';
import { Trails } from '../../map/trails';
import type { Edge } from '../../proto/relmap/v1/graph_pb';
import type { MapEvent } from '../../proto/relmap/v1/watch_pb';
import { worstFirst } from '../fleet/trouble';
import { freshOf, looseStates, type Loose } from './events';
import { LayoutState } from './layout_state.svelte';
import { makeMarks } from './marks';
import { Places } from './places';
import { routeMarks } from './route_lines';
import { RouteState } from './route_state.svelte';
import { layersText, parseColour, parseLayers, parseSessions, parseTime, timeText, type AllLayers } from './shown';

const tornNamed = 60; // of which the number of standard deviations stands on the map
const labelsMost = 3000;
const looseMs = 120_000; // for so long a new closure is drawn without a tile that has it

export interface Hover {
  picked: Picked;
  px: number;
  py: number;
}

export class MapModel {
  layout = new LayoutState();
  route = new RouteState();
  robots = new Poll(async () => (await map.listRobots({})).robots, 2000);
  stage = $state.raw<Stage | null>(null);
  lost = $state(false);
  hover = $state.raw<Hover | null>(null);
  view = $state.raw<InView | null>(null); // null: not counted yet
  waiting = $state(false); // tiles of the picture are missing
  trouble = $state.raw<Problem | null>(null); // with tiles or places
  note = $state(''); // why the picture does not go where the address says
  rootPlace = $state.raw<FramePlace | null>(null);
  playing = $state(false);
  until = $state(Infinity); // seconds
  labelled = $state.raw<ReadonlyMap<string, string[]>>(new Map());
  edge = $state.raw<Edge | null>(null); // the selected closure
  edgeProblem = $state.raw<Problem | null>(null);
  changes = $state(0); // events that touched what is selected

  colour = $derived(parseColour(address.get('colour')));
  layersText = $derived(address.get('layers'));
  layers = $derived(parseLayers(this.layersText));
  sessionsText = $derived(address.get('sessions') ?? '');
  chosen = $derived(parseSessions(this.sessionsText));
  root = $derived(parseFrame(address.get('root')) ? address.get('root')! : '');
  frame = $derived(parseFrame(address.get('frame')) ? address.get('frame')! : '');
  edgeName = $derived(parseEdge(address.get('edge')) ? address.get('edge')! : '');
  robot = $derived(address.get('robot') ?? ''); // followed
  session = $derived(Number(address.get('session')) || 0); // to be gone to
  at = $derived(address.get('at'));
  rows = $derived(worstFirst(this.robots.value ?? [], sessions.frozen));
  torn = $derived(this.layout.now?.torn ?? []);

  readonly trails = new Trails();
  private loose = new Map<string, Loose>();
  private heads = new Map<number, FramePlace>(); // where a session's newest frame was last seen
  private places = new Places(
    (again) => this.placesKnown(again),
    (error) => (this.trouble = problemOf(error)),
  );
  private routes: RouteMark[] = [];
  private written: string | null = null; // the camera as it was last written to the address
  private pending = true; // the picture is to go where the address says
  private arrived = false;
  private byHand = false;
  private marking = 0;
  private labelsAgain = seldom(() => void this.readLabels(), 2000);
  private trailsAgain = seldom(() => this.places.want(this.trails.asked()), 500);

  // ---- What happens

  start(): () => void {
    const ends = [
      sessions.use(),
      this.layout.follow(),
      this.robots.start(),
      live.follow(
        (events) => this.take(events),
        () => this.again(),
      ),
    ];
    void this.readLabels();
    return () => {
      for (const end of ends) end();
      this.labelsAgain.end();
      this.trailsAgain.end();
      if (this.marking) cancelAnimationFrame(this.marking);
    };
  }

  private again() {
    this.trails.clear();
    this.loose.clear();
    this.labelsAgain.ask();
    void this.robots.now();
  }

  private take(events: MapEvent[]) {
    const states = new Map<string, number>();
    let touched = false;
    for (const { event } of events) {
      switch (event.case) {
        case 'framesAdded':
          this.trails.add(freshOf(event.value));
          this.trailsAgain.ask();
          break;
        case 'edgeChanged':
        case 'edgeRemoved': {
          const change = looseStates(event);
          if (!change) break;
          states.set(change.edge, change.state);
          if (change.a && change.b) {
            this.loose.set(change.edge, { ...change, a: change.a, b: change.b, since: Date.now() });
            this.places.want([change.a, change.b]);
          } else this.loose.delete(change.edge);
          touched ||= change.edge === this.edgeName || change.a === this.frame || change.b === this.frame;
          break;
        }
        case 'frameLabels': {
          const frame = event.value.frame;
          if (!frame) break;
          const name = `${frame.session}:${frame.index}`;
          const labelled = new Map(this.labelled);
          if (event.value.labels.length) labelled.set(name, event.value.labels);
          else labelled.delete(name);
          this.labelled = labelled;
          touched ||= name === this.frame;
          break;
        }
        case 'framesRemoved':
          this.trails.remove(event.value.session, event.value.first);
          break;
        case 'sessionDeleted':
          this.trails.remove(event.value.session);
          this.labelsAgain.ask();
          break;
        case 'robotChanged':
          void this.robots.now();
      }
    }
    if (states.size) this.stage?.stateChanged(states);
    if (touched) this.changes++;
    this.markSoon();
  }

  private async readLabels() {
    try {
      const labelled = new Map<string, string[]>();
      await allPages(
        (pageToken) => map.findLabels({ pageToken }),
        ({ labels }) => {
          for (const { label, frames } of labels)
            for (const { session, index } of frames) {
              const name = `${session}:${index}`;
              labelled.set(name, [...(labelled.get(name) ?? []), label]);
            }
        },
        () => labelled.clear(),
      );
      this.labelled = labelled;
    } catch {
      this.labelsAgain.ask();
    }
  }

  // ---- For effects of the view

  look(): Look {
    const time = this.layout.now?.time ?? { first_ms: 0, last_ms: 0 };
    return {
      palette: palette(theme.dark),
      colour: this.colour,
      layers: this.layers,
      since: Math.floor(time.first_ms / 1000),
      range: (time.last_ms - time.first_ms) / 1000,
      until: this.until,
      chosen: this.chosen,
    };
  }

  // The frame from which standard deviations are told.
  get sdRoot(): string | null {
    return this.colour === 'sd' ? this.root || this.layout.now?.parts[0]?.root || null : null;
  }

  // Frames whose places are needed.
  private needed(): string[] {
    const frames = [this.root, this.frame];
    if (this.edge?.a && this.edge.b) for (const { session, index } of [this.edge.a, this.edge.b]) frames.push(`${session}:${index}`);
    if (this.layers.torn) for (const { a, b } of this.torn.slice(0, tornNamed)) frames.push(a, b);
    if (this.layers.labels) frames.push(...[...this.labelled.keys()].slice(0, labelsMost));
    for (const { robot } of this.rows) frames.push(this.headFrame(robot.session));
    const session = sessions.byNumber.get(this.session);
    if (session) frames.push(...along(session));
    for (const route of this.route.frames) for (const frame of route) frames.push(frame);
    return frames.filter((frame) => frame);
  }

  // For an effect, which runs again when others are needed.
  needPlaces() {
    this.places.want(this.needed());
    this.layRoutes();
    this.markSoon();
    this.arrive();
  }

  private layRoutes() {
    const { frames, chosen } = this.route;
    this.routes = routeMarks(frames, chosen, (frame) => this.places.shown(frame));
  }

  private headFrame(session: number): string {
    const known = sessions.byNumber.get(session);
    return known && !this.trails.points(session).length ? `${session}:${known.last}` : '';
  }

  // The address was changed, by somebody or by this page.
  addressChanged() {
    const time = parseTime(address.get('time'));
    untrack(() => {
      if (!this.playing && timeText(time) !== timeText(this.until)) this.until = time;
      if (this.at !== null && this.at === this.written) return;
      this.pending = true;
      this.note = '';
      this.needPlaces();
    });
  }

  async readEdge() {
    const id = parseEdge(this.edgeName);
    const name = this.edgeName;
    if (!id) {
      this.edge = null;
      this.edgeProblem = null;
      return;
    }
    try {
      let found: Edge | undefined;
      await allPages(
        (pageToken) => map.listEdges({ frame: { session: id.session, index: id.index }, pageToken }),
        ({ edges }) =>
          (found ??= edges.find(
            ({ id: other }) =>
              other?.frame?.session === id.session && other.frame.index === id.index && other.ordinal === id.ordinal,
          )),
        () => (found = undefined),
      );
      if (name !== this.edgeName) return;
      this.edge = found ?? null;
      this.edgeProblem = found ? null : { reason: 'NO_SUCH_EDGE', message: `There is no closure ${name}.` };
    } catch (error) {
      if (name !== this.edgeName) return;
      this.edge = null;
      this.edgeProblem = problemOf(error);
    }
    if (!this.edge && this.pending) this.arrive();
  }

  // ---- Places, marks

  swapped(version: number) {
    this.trouble = null;
    const now = Date.now();
    for (const [edge, { since }] of this.loose) if (now - since > looseMs) this.loose.delete(edge);
    const loose = [...this.loose.values()].flatMap(({ a, b }) => [a, b]);
    this.places.renew(version, [...this.needed(), ...loose, ...this.trails.asked()]);
    // As long as nobody has moved it, the picture shows all of a map that grows.
    if (this.arrived && !this.byHand && !this.pending && this.stage && !this.stage.showsAll) this.stage.all(easeMs);
    this.arrive();
  }

  private placesKnown(again: boolean) {
    this.trails.lay(this.trails.asked().map((frame) => this.places.get(frame) ?? null), Date.now());
    const before = this.rootPlace;
    this.rootPlace = (this.root && this.places.get(this.root)) || null;
    if (again && before && this.rootPlace && before.frame === this.rootPlace.frame && this.stage && !this.pending) {
      // The root stays where it is in the picture, and the map moves around it.
      this.stage.goto(fromRelative(this.rootPlace, relativeTo(before, this.stage.aim)), easeMs);
    }
    this.layRoutes();
    this.markSoon();
    this.arrive();
  }

  // What is marked moves with the lines.
  private ease() {
    const before = this.places.share;
    const { stage } = this;
    this.places.share = stage ? stage.easing(performance.now()) : 1;
    if (this.places.share === before) return;
    this.layRoutes();
    if (this.places.share < 1) this.markSoon();
  }

  markSoon = () => {
    if (!this.marking)
      this.marking = requestAnimationFrame(() => {
        this.marking = 0;
        this.ease();
        this.mark();
      });
  };

  private mark() {
    const { stage } = this;
    if (!stage) return;
    if (stage.version === null) {
      stage.marks = noMarks;
      stage.redraw();
      return;
    }
    for (const { robot } of this.rows) {
      const place = this.places.get(this.headFrame(robot.session));
      if (place) this.heads.set(robot.session, place);
    }
    const past = Number.isFinite(this.until);
    stage.marks = makeMarks({
      place: (frame) => this.places.shown(frame),
      layers: this.layers,
      past,
      rows: this.rows,
      followed: this.robot,
      head: (session) => this.head(session),
      trails: this.trails,
      labelled: this.labelled,
      torn: past ? [] : this.torn.slice(0, tornNamed),
      parts: stage.layout?.parts ?? [],
      loose: past ? [] : this.loose.values(),
      frame: this.frame,
      edge: this.edgeName ? this.edge : null,
      root: this.root,
      routes: this.routes,
      ends: this.route.ends,
      crosshair: stage.marks.crosshair,
    });
    if (this.robot && !this.pending) this.followRobot();
    stage.redraw();
  }

  head(session: number): { x: number; y: number; heading: number } | null {
    return this.trails.head(session)?.place ?? this.heads.get(session) ?? null;
  }

  private followRobot() {
    const row = this.rows.find(({ robot }) => robot.robot === this.robot && this.head(robot.session));
    const place = row && this.head(row.robot.session);
    if (!place || !this.stage) return;
    const aim = this.stage.aim;
    if (Math.hypot(place.x - aim.x, place.y - aim.y) > 2 * aim.mpp) this.stage.goto({ ...aim, x: place.x, y: place.y });
  }

  // ---- Where the picture goes

  private arrive() {
    const { stage } = this;
    if (!this.pending || !stage || stage.version === null) return;
    const camera = this.destination(stage);
    if (camera === 'wait') return;
    this.pending = false;
    const first = !this.arrived;
    this.arrived = true;
    if (camera === 'all') {
      this.byHand = false;
      stage.goto({ ...stage.camera, turn: 0 }, 0);
      stage.all(first ? 0 : 350);
    } else {
      this.byHand = true;
      stage.goto(camera, first ? 0 : 350);
    }
  }

  private destination(stage: Stage): Camera | 'wait' | 'all' {
    // All that the address names must be placed first.
    const rootPlace = this.root ? this.places.get(this.root) : null;
    if (this.root && rootPlace === undefined) return 'wait';
    const turn = rootPlace ? headingUp(rootPlace.heading) : 0;
    const at = parseCamera(this.at);
    if (at) return rootPlace ? fromRelative(rootPlace, at) : at;
    const near = (place: { x: number; y: number }): Camera => ({
      x: place.x, y: place.y, mpp: this.arrived ? Math.min(stage.camera.mpp, 0.1) : 0.05, turn,
    });
    const missing = (what: string): 'all' => {
      this.note = `${what} is not in the layout that is drawn${this.layout.now?.coarse ? ', which is a rough one' : ''}.`;
      return 'all';
    };
    if (this.edgeName) {
      if (this.edgeProblem) return missing(`Closure ${this.edgeName}`);
      const { a, b } = this.edge ?? {};
      if (!a || !b || this.edgeOf() !== this.edgeName) return 'wait';
      const ends = [a, b].map(({ session, index }) => this.places.get(`${session}:${index}`));
      if (ends.some((end) => end === undefined)) return 'wait';
      const known = ends.filter((end) => !!end);
      if (!known.length) return missing(`Closure ${this.edgeName}`);
      return fit(around(known), stage.size, Math.min(stage.size.width, stage.size.height) / 4, turn, 0.03);
    }
    if (this.frame) {
      const place = this.places.get(this.frame);
      if (place === undefined) return 'wait';
      return place ? near(place) : missing(`Frame ${this.frame}`);
    }
    if (this.robot) {
      if (!this.robots.value || !sessions.known) return 'wait';
      const of = this.rows.filter(({ robot }) => robot.robot === this.robot && robot.session);
      for (const { robot } of of) {
        const head = this.head(robot.session) ?? this.places.get(this.headFrame(robot.session));
        if (head) return near(head);
        if (this.places.get(this.headFrame(robot.session)) === undefined && this.headFrame(robot.session)) return 'wait';
      }
      return missing(`The robot ${plain(this.robot, 60)}`);
    }
    if (this.session) {
      const session = sessions.byNumber.get(this.session);
      if (!session && sessions.known) {
        this.note = `The map has no session ${this.session}.`;
        return 'all';
      }
      if (!session) return 'wait';
      const found = along(session).map((frame) => this.places.get(frame));
      if (found.some((place) => place === undefined)) return 'wait';
      const known = found.filter((place) => !!place);
      if (!known.length) return missing(`Session ${this.session}`);
      address.set({ session: null, sessions: String(this.session) });
      return fit(around(known), stage.size, 60, turn, 0.01);
    }
    const { ends } = this.route;
    if (ends && !this.route.problem) {
      const frames = this.route.frames.flat();
      const found = frames.map((frame) => this.places.get(frame));
      if (this.route.busy || found.some((place) => place === undefined)) return 'wait';
      const known = found.filter((place) => !!place);
      if (!known.length) return missing('The route');
      // Beside what is said of it.
      const beside = stage.size.width > 900 ? 350 : 0;
      return pan(fit(around(known), { ...stage.size, width: stage.size.width - beside }, 50, turn, 0.01), -beside / 2, 0);
    }
    if (this.root) return rootPlace ? near(rootPlace) : missing(`Frame ${this.root}`);
    return 'all';
  }
  private edgeOf(): string {
    const id = this.edge?.id;
    return id?.frame ? `${id.frame.session}:${id.frame.index}/${id.ordinal}` : '';
  }

  moved(byHand: boolean) {
    if (!byHand) return;
    this.byHand = true;
    this.pending = false;
    if (this.robot) address.set({ robot: null });
  }

  settled() {
    const { stage } = this;
    if (!stage) return;
    this.waiting = stage.version !== null && !stage.complete;
    this.trouble = stage.trouble ? problemOf(stage.trouble) : null;
    this.summarise(stage);
    if (this.pending || !this.byHand || stage.version === null || this.robot) return;
    const root = this.root ? this.rootPlace : null;
    if (this.root && !root) return;
    this.written = cameraText(root ? relativeTo(root, stage.camera) : stage.camera);
    address.set({ at: this.written });
  }

  private summarise(stage: Stage) {
    const points = corners(stage.camera, stage.size).map(([x, y]) => ({ x, y }));
    const { width, height } = stage.size;
    const inside = (x: number, y: number) => {
      const [px, py] = stage.screen(x, y);
      return px >= 0 && py >= 0 && px <= width && py <= height;
    };
    this.view = inView(stage.tiles, inside, around(points), this.until);
  }

  // ---- What somebody does

  select(picked: { frame?: string; edge?: string } | null) {
    address.set({ frame: picked?.frame ?? null, edge: picked?.edge ?? null });
  }
  clicked(picked: Picked | null) {
    if (!picked) this.select(null);
    else if (picked.kind === 'frame') this.select({ frame: `${picked.session}:${picked.index}` });
    else this.select({ edge: `${picked.session}:${picked.index}/${picked.ordinal}` });
  }
  // Selects, and goes there.
  visit(what: { frame?: string; edge?: string; robot?: string; session?: number }) {
    address.set({
      frame: what.frame ?? null,
      edge: what.edge ?? null,
      robot: what.robot ?? null,
      session: what.session ? String(what.session) : null,
      at: null,
    }, true);
  }
  drawFrom(frame: string) {
    this.rootPlace = this.places.get(frame) ?? null;
    const camera = this.stage?.camera;
    // Without a frame x is to the right again; what is in the middle stays there.
    const at = !frame && camera ? cameraText({ ...camera, turn: 0 }) : null;
    address.set({ root: frame || null, at, robot: null }, true);
  }
  setLayer(name: keyof AllLayers, on: boolean) {
    address.set({ layers: layersText({ ...this.layers, [name]: on }) });
  }
  setColour(by: string) {
    address.set({ colour: by === 'session' ? null : by });
  }
  choose(session: number, on: boolean) {
    const chosen = new Set(this.chosen);
    if (on) chosen.add(session);
    else chosen.delete(session);
    address.set({ sessions: [...chosen].sort((a, b) => a - b).join(',') });
  }
  setUntil(seconds: number, write = true) {
    this.until = seconds;
    if (write) address.set({ time: timeText(seconds) });
  }

  // In twenty seconds from the first frame to the last.
  play(): void {
    const time = this.layout.now?.time;
    if (this.playing || !time) {
      this.playing = false;
      address.set({ time: timeText(this.until) });
      return;
    }
    const [first, last] = [time.first_ms / 1000, time.last_ms / 1000];
    if (!Number.isFinite(this.until) || this.until >= last) this.until = first;
    this.playing = true;
    let before = performance.now();
    const step = (now: number) => {
      if (!this.playing || !this.stage) return;
      const until = this.until + ((now - before) / 20_000) * (last - first);
      before = now;
      if (until >= last) {
        this.playing = false;
        this.setUntil(Infinity);
        return;
      }
      this.until = until;
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  // The next of the torn closures, the worst first.
  nextTorn(step: 1 | -1) {
    const { torn } = this;
    if (!torn.length) return;
    const now = torn.findIndex((each) => this.isSelected(each));
    const next = now < 0 ? (step > 0 ? 0 : torn.length - 1) : (now + step + torn.length) % torn.length;
    this.visitTorn(torn[next]!);
  }
  visitTorn({ edge, b }: Torn) {
    this.visit(edge ? { edge } : { frame: b });
  }
  isSelected({ edge, b }: Torn): boolean {
    return edge ? edge === this.edgeName : !this.edgeName && b === this.frame;
  }

  get drawable(): boolean {
    return drawable(this.layout.now);
  }
}

// Frames along a session, for its extent. Of indices that have no frame the places are null.
function along({ number, first, last }: { number: number; first: number; last: number }): string[] {
  const steps = Math.min(40, last - first);
  const indices = new Set([...Array(steps + 1).keys()].map((i) => first + Math.round(((last - first) * i) / Math.max(1, steps))));
  return [...indices].map((index) => `${number}:${index}`);
}
