// A tile, or other lines, in the memory of the graphics card. It is uploaded once; moving the picture changes uniforms.
import { instanced } from './gl';
import { sessionsOf, type Tile } from './tile';

const stride = 12; // bytes of a vertex: x, y, session (u16), flags (u8), one unused, seconds (f32)
const runStart = 16;

export class Batch {
  readonly bytes: number; // of the tile and of its copy on the graphics card
  private lines: WebGLVertexArrayObject | null = null;
  private closures: WebGLVertexArrayObject | null = null;
  private states: WebGLBuffer | null = null;
  private buffers: WebGLBuffer[] = [];

  // `since`: from which times are counted, seconds: 32-bit floats hold some months to the second.
  constructor(
    readonly tile: Tile,
    private readonly since: number,
  ) {
    const { count, closures, old, sd } = tile;
    this.bytes =
      tile.bytes + (count + 1) * (stride + (old ? 8 : 0)) + count * (sd ? 4 : 0) + closures.count * (old ? 48 : 32);
  }

  upload(gl: WebGL2RenderingContext) {
    this.buffers = [];
    const { tile } = this;
    if (tile.count) {
      this.lines = gl.createVertexArray();
      gl.bindVertexArray(this.lines);
      this.buffer(gl, this.vertices());
      instanced(gl, [
        { at: 0, size: 2, type: 'u16', offset: 0, stride },
        { at: 1, size: 2, type: 'u16', offset: stride, stride },
        { at: 2, size: 1, type: 'u16', whole: true, offset: stride + 4, stride },
        { at: 3, size: 1, type: 'u8', whole: true, offset: stride + 6, stride },
        { at: 4, size: 1, type: 'f32', offset: stride + 8, stride },
      ]);
      if (tile.sd) {
        this.buffer(gl, tile.sd);
        instanced(gl, [{ at: 5, size: 1, type: 'f32', offset: 0, stride: 4 }]);
      }
      if (tile.old) {
        const places = new Float32Array(2 * (tile.count + 1));
        for (let i = 0; i < tile.count; i++) {
          places[2 * i + 2] = tile.old[0][i]!;
          places[2 * i + 3] = tile.old[1][i]!;
        }
        this.buffer(gl, places);
        instanced(gl, [
          { at: 6, size: 2, type: 'f32', offset: 0, stride: 8 },
          { at: 7, size: 2, type: 'f32', offset: 8, stride: 8 },
        ]);
      }
    }
    if (tile.closures.count) this.uploadClosures(gl);
    gl.bindVertexArray(null);
  }

  // A vertex of no meaning first: instance i reads i as the vertex before, and i + 1.
  private vertices(): Uint8Array {
    const { tile } = this;
    const bytes = new Uint8Array((tile.count + 1) * stride);
    const shorts = new Uint16Array(bytes.buffer);
    const floats = new Float32Array(bytes.buffer);
    const sessions = sessionsOf(tile);
    for (let i = 0; i < tile.count; i++) {
      const at = i + 1;
      shorts[at * 6] = tile.x[i]!;
      shorts[at * 6 + 1] = tile.y[i]!;
      shorts[at * 6 + 2] = sessions[i]! % 65536;
      bytes[at * stride + 6] = tile.flags[i]! & 15;
      floats[at * 3 + 2] = tile.time[i] ? tile.time[i]! - this.since : -1;
    }
    for (const first of tile.runs.first) bytes[(first + 1) * stride + 6]! |= runStart;
    return bytes;
  }

  private uploadClosures(gl: WebGL2RenderingContext) {
    const { closures } = this.tile;
    const words = 8; // ax ay bx by, the sessions in one, time, suspicion, unused
    const floats = new Float32Array(closures.count * words);
    const shorts = new Uint16Array(floats.buffer);
    for (let i = 0; i < closures.count; i++) {
      floats.set([closures.ax[i]!, closures.ay[i]!, closures.bx[i]!, closures.by[i]!], i * words);
      shorts[(i * words + 4) * 2] = closures.session[i]! % 65536;
      shorts[(i * words + 4) * 2 + 1] = closures.sessionA[i]! % 65536;
      floats[i * words + 5] = closures.time[i] ? closures.time[i]! - this.since : -1;
      floats[i * words + 6] = closures.suspicion[i]!;
    }
    this.closures = gl.createVertexArray();
    gl.bindVertexArray(this.closures);
    this.buffer(gl, floats);
    instanced(gl, [
      { at: 0, size: 4, type: 'f32', offset: 0, stride: 32 },
      { at: 3, size: 2, type: 'u16', whole: true, offset: 16, stride: 32 },
      { at: 4, size: 1, type: 'f32', offset: 20, stride: 32 },
      { at: 5, size: 1, type: 'f32', offset: 24, stride: 32 },
    ]);
    this.states = this.buffer(gl, this.stateBytes(), gl.DYNAMIC_DRAW);
    instanced(gl, [{ at: 2, size: 2, type: 'u8', whole: true, offset: 0, stride: 2 }]);
    if (closures.old) {
      const places = new Float32Array(closures.count * 4);
      for (let i = 0; i < closures.count; i++) for (let k = 0; k < 4; k++) places[i * 4 + k] = closures.old[k]![i]!;
      this.buffer(gl, places);
      instanced(gl, [{ at: 1, size: 4, type: 'f32', offset: 0, stride: 16 }]);
    }
  }

  private stateBytes(): Uint8Array {
    const { closures } = this.tile;
    const bytes = new Uint8Array(closures.count * 2);
    for (let i = 0; i < closures.count; i++) {
      bytes[i * 2] = closures.state[i]!;
      bytes[i * 2 + 1] = closures.flags[i]!;
    }
    return bytes;
  }

  // After states in the tile were changed.
  updateStates(gl: WebGL2RenderingContext) {
    if (!this.states) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.states);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.stateBytes());
  }

  private buffer(gl: WebGL2RenderingContext, data: ArrayBufferView, use: number = gl.STATIC_DRAW): WebGLBuffer {
    const buffer = gl.createBuffer()!;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, data, use);
    this.buffers.push(buffer);
    return buffer;
  }

  // Binds, and says how many instances there are to draw.
  bindLines(gl: WebGL2RenderingContext): number {
    gl.bindVertexArray(this.lines);
    if (!this.tile.sd) gl.vertexAttrib1f(5, -1);
    return this.lines ? this.tile.count : 0;
  }
  bindClosures(gl: WebGL2RenderingContext): number {
    gl.bindVertexArray(this.closures);
    return this.closures ? this.tile.closures.count : 0;
  }

  free(gl: WebGL2RenderingContext) {
    for (const buffer of this.buffers) gl.deleteBuffer(buffer);
    gl.deleteVertexArray(this.lines);
    gl.deleteVertexArray(this.closures);
    this.lines = this.closures = this.states = null;
    this.buffers = [];
  }
}
