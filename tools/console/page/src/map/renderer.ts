// Draws batches by WebGL2. It knows nothing of tiles' addresses, of the network, or of what is chosen where.
import { Batch } from './batch';
import type { Box, Camera, Size } from './camera';
import { link, NoWebGl, type Program } from './gl';
import { scaleColour, sessionSlots, sessionTable, type ColourBy, type Palette, type Rgb } from './palette';
import { closureFragment, closureVertex, dotFragment, dotVertex, lineFragment, lineVertex } from './shaders';

export interface Layers {
  accepted: boolean;
  candidate: boolean;
  quarantined: boolean;
  removed: boolean;
  torn: boolean;
  headings: boolean;
}
export interface Look {
  palette: Palette;
  colour: ColourBy;
  layers: Layers;
  since: number; // seconds: the first frame
  range: number; // seconds to the last frame
  until: number; // seconds: nothing younger is drawn; infinite: all
  chosen: ReadonlySet<number>; // sessions that stand out; none: all do
}
export interface Item {
  batch: Batch;
  only: Box | null;
  ease: number; // 0..1 from the places in the layout before
}

export function shownStates(layers: Layers): number {
  return (
    (layers.candidate ? 2 : 0) | (layers.accepted ? 4 : 0) | (layers.quarantined ? 8 : 0) | (layers.removed ? 16 : 0) |
    (layers.torn ? 32 : 0)
  );
}

const colours: ColourBy[] = ['session', 'time', 'age', 'sd', 'source'];

export class Renderer {
  lost = false;
  drawCalls = 0;
  private gl: WebGL2RenderingContext;
  private line!: Program;
  private dot!: Program;
  private closure!: Program;
  private sessions: WebGLTexture | null = null;
  private scale: WebGLTexture | null = null;
  private tables = ''; // for what the textures were made
  private batches = new Set<Batch>();

  // Throws NoWebGl.
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly restored: () => void,
  ) {
    const gl = canvas.getContext('webgl2', { alpha: false, antialias: false, depth: false, stencil: false });
    if (!gl) throw new NoWebGl('This browser, or its settings, offers no WebGL2.');
    this.gl = gl;
    this.prepare();
    canvas.addEventListener('webglcontextlost', this.onLost);
    canvas.addEventListener('webglcontextrestored', this.onRestored);
  }

  private onLost = (event: Event) => {
    event.preventDefault(); // or it would never be restored
    this.lost = true;
  };
  private onRestored = () => {
    this.lost = false;
    this.prepare();
    for (const batch of this.batches) batch.upload(this.gl);
    this.restored();
  };

  private prepare() {
    const { gl } = this;
    this.line = link(gl, lineVertex, lineFragment);
    this.dot = link(gl, dotVertex, dotFragment);
    this.closure = link(gl, closureVertex, closureFragment);
    this.sessions = this.texture();
    this.scale = this.texture();
    this.tables = '';
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.disable(gl.DEPTH_TEST);
  }

  private texture(): WebGLTexture | null {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
    return texture;
  }

  add(batch: Batch) {
    this.batches.add(batch);
    if (!this.lost) batch.upload(this.gl);
  }
  remove(batch: Batch) {
    this.batches.delete(batch);
    batch.free(this.gl);
  }
  statesChanged(batch: Batch) {
    if (!this.lost) batch.updateStates(this.gl);
  }

  end() {
    this.canvas.removeEventListener('webglcontextlost', this.onLost);
    this.canvas.removeEventListener('webglcontextrestored', this.onRestored);
    for (const batch of this.batches) batch.free(this.gl);
    this.batches.clear();
    this.gl.getExtension('WEBGL_lose_context')?.loseContext();
  }

  private fillTables({ palette, chosen }: Look) {
    const made = `${palette.ground.join()} ${[...chosen].join()}`;
    if (made === this.tables) return;
    this.tables = made;
    const { gl } = this;
    const scale = new Uint8Array(256 * 4);
    for (let i = 0; i < 256; i++) scale.set([...scaleColour(palette, i / 255), 255], i * 4);
    gl.bindTexture(gl.TEXTURE_2D, this.scale);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, scale);
    gl.bindTexture(gl.TEXTURE_2D, this.sessions);
    const table = sessionTable(palette, chosen);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 64, sessionSlots / 64, 0, gl.RGBA, gl.UNSIGNED_BYTE, table);
  }

  draw(camera: Camera, size: Size, pixel: number, items: readonly Item[], look: Look) {
    if (this.lost) return;
    const { gl, canvas } = this;
    const width = Math.max(1, Math.round(size.width * pixel));
    const height = Math.max(1, Math.round(size.height * pixel));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    this.fillTables(look);
    this.drawCalls = 0;
    gl.viewport(0, 0, width, height);
    const ground = look.palette.ground;
    gl.clearColor(ground[0] / 255, ground[1] / 255, ground[2] / 255, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (!items.length) return;
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.sessions);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.scale);

    this.closures(camera, size, pixel, items, look, 0);
    // Chosen sessions lie over the faint ones.
    if (look.chosen.size) this.lines(camera, size, pixel, items, look, 1);
    this.lines(camera, size, pixel, items, look, 0);
    this.closures(camera, size, pixel, items, look, 1);
    gl.bindVertexArray(null);
  }

  private use(program: Program, camera: Camera, size: Size, pixel: number, look: Look) {
    const { gl } = this;
    const { at } = program;
    gl.useProgram(program.program);
    const scale = pixel / camera.mpp;
    const cos = Math.cos(camera.turn) * scale;
    const sin = Math.sin(camera.turn) * scale;
    gl.uniformMatrix2fv(at.u_turn!, false, [cos, sin, -sin, cos]);
    gl.uniform2f(at.u_half!, (size.width * pixel) / 2, (size.height * pixel) / 2);
    gl.uniform1f(at.u_until!, Number.isFinite(look.until) ? look.until - look.since : 1e30);
    gl.uniform1i(at.u_sessions!, 0);
    gl.uniform1i(at.u_scale!, 1);
    gl.uniform1i(at.u_colour!, colours.indexOf(look.colour));
    gl.uniform2f(at.u_range!, look.range, Math.min(look.until - look.since, look.range));
    const { palette } = look;
    this.colour(at.u_ground, palette.ground);
    this.colour(at.u_dim, palette.dim);
    this.colour(at.u_measured, palette.measured);
    this.colour(at.u_guess, palette.guess);
    this.colour(at.u_carried, palette.carried);
  }
  private colour(at: WebGLUniformLocation | null | undefined, [r, g, b]: Rgb) {
    if (at) this.gl.uniform3f(at, r / 255, g / 255, b / 255);
  }
  private place(program: Program, camera: Camera, { batch, ease, only }: Item) {
    const { gl } = this;
    const { at } = program;
    const { originX, originY, unit, old } = batch.tile;
    gl.uniform2f(at.u_offset!, originX - camera.x, originY - camera.y);
    gl.uniform1f(at.u_unit!, unit);
    gl.uniform1f(at.u_ease!, old ? ease : 1);
    if (!at.u_only) return;
    if (only) gl.uniform4f(at.u_only, only[0] - originX, only[1] - originY, only[2] - originX, only[3] - originY);
    else gl.uniform4f(at.u_only, -1e9, -1e9, 1e9, 1e9);
  }

  private lines(camera: Camera, size: Size, pixel: number, items: readonly Item[], look: Look, faint: 0 | 1) {
    const { gl } = this;
    // Lines are finer from far away, where there are many.
    const width = Math.max(1.5, Math.min(3, 2.4 - 0.55 * Math.log10(camera.mpp / 0.05)));
    this.use(this.line, camera, size, pixel, look);
    gl.uniform1i(this.line.at.u_faint!, faint);
    gl.uniform1f(this.line.at.u_width!, width * pixel);
    gl.uniform1f(this.line.at.u_check!, 2 ** Math.round(Math.log2(5 * camera.mpp)));
    for (const item of items) {
      const count = item.batch.bindLines(gl);
      if (!count) continue;
      this.place(this.line, camera, item);
      this.instances(count);
    }
    // Dots where frames are far enough from each other to be told apart.
    const near = camera.mpp < 0.06;
    if (near || camera.mpp < 2) {
      this.use(this.dot, camera, size, pixel, look);
      gl.uniform1i(this.dot.at.u_faint!, faint);
      gl.uniform3f(this.dot.at.u_sizes!, near ? (width + 2.5) * pixel : 0, (near ? 11 : 8) * pixel, 0);
      this.dots(camera, items, () => 1);
    }
    if (!look.layers.headings || faint) return;
    this.use(this.dot, camera, size, pixel, look);
    gl.uniform3f(this.dot.at.u_sizes!, 0, 0, 11 * pixel);
    this.dots(camera, items, (item) => spacing(item.batch, camera.mpp));
  }
  private dots(camera: Camera, items: readonly Item[], every: (item: Item) => number) {
    for (const item of items) {
      const count = item.batch.bindLines(this.gl);
      if (!count) continue;
      this.place(this.dot, camera, item);
      this.gl.uniform1i(this.dot.at.u_every!, every(item));
      this.instances(count);
    }
  }

  private closures(camera: Camera, size: Size, pixel: number, items: readonly Item[], look: Look, above: 0 | 1) {
    const states = shownStates(look.layers);
    if (!states || (!above && !look.layers.accepted)) return;
    const { gl } = this;
    const { at } = this.closure;
    const { palette } = look;
    this.use(this.closure, camera, size, pixel, look);
    gl.uniform1i(at.u_above!, above);
    gl.uniform1i(at.u_layers!, states);
    gl.uniform1f(at.u_pixel!, pixel);
    const { dim, candidate, accepted, quarantined, removed } = palette;
    const table = [dim, candidate, accepted, quarantined, removed].flat().map((value) => value / 255);
    gl.uniform3fv(at.u_states!, table);
    this.colour(at.u_torn, palette.torn);
    this.colour(at.u_suspicious, palette.suspicious);
    const drawn = new Set<Batch>();
    for (const item of items) {
      // A tile that stands in for several draws its closures once.
      if (drawn.has(item.batch)) continue;
      drawn.add(item.batch);
      const count = item.batch.bindClosures(gl);
      if (!count) continue;
      this.place(this.closure, camera, item);
      this.instances(count);
    }
  }

  private instances(count: number) {
    this.gl.drawArraysInstanced(this.gl.TRIANGLE_STRIP, 0, 4, count);
    this.drawCalls++;
  }
}

const steps = new WeakMap<Batch, number>();

// Of how many steps one gets an arrow, so that arrows stand some 60 pixels apart.
function spacing(batch: Batch, mpp: number): number {
  let step = steps.get(batch);
  if (step === undefined) {
    const { x, y, count, unit } = batch.tile;
    let sum = 0;
    let taken = 0;
    const stride = Math.max(1, Math.floor(count / 200));
    for (let i = 1; i < count; i += stride, taken++) sum += Math.hypot(x[i]! - x[i - 1]!, y[i]! - y[i - 1]!) * unit;
    step = Math.max(1e-3, sum / Math.max(1, taken));
    steps.set(batch, step);
  }
  return Math.max(1, 2 ** Math.round(Math.log2((60 * mpp) / step)));
}
