// A tile of the map as the console sends it (tools/console/README.md), checked: whatever its bytes are, decoding ends in
// a tile that can be drawn or in a TileError. The arrays are views of the bytes that came.

export class TileError extends Error {}

export interface Closures {
  count: number;
  ax: Float32Array; // ends, metres from the origin: a is the older one
  ay: Float32Array;
  bx: Float32Array;
  by: Float32Array;
  session: Uint32Array; // of the closure's id: the newer end, and the ordinal
  index: Uint32Array;
  ordinal: Uint32Array;
  sessionA: Uint32Array; // the older end
  indexA: Uint32Array;
  time: Uint32Array; // seconds UTC, 0: not known
  alike: Uint32Array; // closures that it stands for
  suspicion: Float32Array; // 0..1
  sigmas: Float32Array; // by how many standard deviations the layout stretches it
  state: Uint8Array; // EdgeState
  flags: Uint8Array;
  old: [Float32Array, Float32Array, Float32Array, Float32Array] | null;
}
export const closureInGraph = 1;
export const closureTorn = 2;

export interface Tile {
  originX: number; // metres
  originY: number;
  unit: number; // metres per unit of x and y
  runs: { session: Uint32Array; first: Uint32Array; part: Uint32Array };
  count: number; // vertices
  x: Uint16Array;
  y: Uint16Array;
  index: Uint32Array;
  time: Uint32Array; // seconds UTC, 0: not known
  flags: Uint8Array;
  old: [Float32Array, Float32Array] | null; // metres from the origin
  sd: Float32Array | null; // metres, relative to the root; infinite: not known
  closures: Closures;
  bytes: number;
}
export const stepGuess = 1;
export const stepCarried = 2;
export const vertexCut = 4;
export const vertexEnd = 8;

const magic = 0x31544d52;
const header = 48;
const most = 4_000_000; // of anything in one tile

class Reader {
  private at = header;
  constructor(private readonly buffer: ArrayBuffer) {}
  private take(bytes: number, what: string): number {
    const at = this.at;
    if (at + bytes > this.buffer.byteLength)
      throw new TileError(`The tile ends within ${what}: it has ${this.buffer.byteLength} bytes.`);
    this.at = at + Math.ceil(bytes / 4) * 4;
    return at;
  }
  u32 = (count: number, what: string) => new Uint32Array(this.buffer, this.take(4 * count, what), count);
  u16 = (count: number, what: string) => new Uint16Array(this.buffer, this.take(2 * count, what), count);
  u8 = (count: number, what: string) => new Uint8Array(this.buffer, this.take(count, what), count);
  // `infinite`: infinity has a meaning there.
  f32(count: number, what: string, infinite = false): Float32Array {
    const values = new Float32Array(this.buffer, this.take(4 * count, what), count);
    for (let i = 0; i < count; i++)
      if (!(infinite ? values[i]! >= 0 : Number.isFinite(values[i]!)))
        throw new TileError(`The tile has ${values[i]} as ${what} ${i}.`);
    return values;
  }
  end() {
    if (this.at < this.buffer.byteLength)
      throw new TileError(`The tile has ${this.buffer.byteLength} bytes, of which ${this.at} have a meaning.`);
  }
}

export function decodeTile(buffer: ArrayBuffer): Tile {
  if (buffer.byteLength < header) throw new TileError(`The tile has ${buffer.byteLength} bytes only.`);
  const view = new DataView(buffer);
  if (view.getUint32(0, true) !== magic) throw new TileError('These bytes are no tile.');
  const [runs, count, closures, flags] = [4, 8, 12, 16].map((at) => view.getUint32(at, true)) as [
    number,
    number,
    number,
    number,
  ];
  if (runs > most || count > most || closures > most)
    throw new TileError(`The tile says that it has ${runs} runs, ${count} vertices, ${closures} closures.`);
  const originX = view.getFloat64(24, true);
  const originY = view.getFloat64(32, true);
  const unit = view.getFloat32(40, true);
  if (!Number.isFinite(originX) || !Number.isFinite(originY) || !Number.isFinite(unit) || unit <= 0)
    throw new TileError(`The tile lies at ${originX}, ${originY} in units of ${unit} m.`);

  const reader = new Reader(buffer);
  const session = reader.u32(runs, 'the sessions of runs');
  const first = reader.u32(runs, 'the beginnings of runs');
  const part = reader.u32(runs, 'the parts of runs');
  for (let run = 0; run < runs; run++) {
    const least = run ? first[run - 1]! + 1 : 0;
    if (first[run]! < least || first[run]! >= count || (run === 0 && first[0] !== 0))
      throw new TileError(`Run ${run} of the tile begins at vertex ${first[run]} of ${count}.`);
  }
  if (count && !runs) throw new TileError(`The tile has ${count} vertices of no run.`);
  const tile: Tile = {
    originX,
    originY,
    unit,
    runs: { session, first, part },
    count,
    x: reader.u16(count, 'x'),
    y: reader.u16(count, 'y'),
    index: reader.u32(count, 'frames'),
    time: reader.u32(count, 'times'),
    flags: reader.u8(count, 'flags'),
    old: flags & 1 ? [reader.f32(count, 'old x'), reader.f32(count, 'old y')] : null,
    sd: flags & 2 ? reader.f32(count, 'standard deviation', true) : null,
    closures: readClosures(reader, closures, (flags & 1) !== 0),
    bytes: buffer.byteLength,
  };
  reader.end();
  return tile;
}

function readClosures(reader: Reader, count: number, old: boolean): Closures {
  const place = () => reader.f32(count, "a closure's place");
  const number = () => reader.u32(count, 'the ids of closures');
  // An object literal evaluates its members in their order, which is that of the bytes.
  return {
    count,
    ax: place(),
    ay: place(),
    bx: place(),
    by: place(),
    session: number(),
    index: number(),
    ordinal: number(),
    sessionA: number(),
    indexA: number(),
    time: number(),
    alike: number(),
    suspicion: reader.f32(count, 'suspicion'),
    sigmas: reader.f32(count, 'stretch', true),
    // Copied: an event may change a state.
    state: reader.u8(count, 'states').slice(),
    flags: reader.u8(count, 'flags of closures'),
    old: old ? [place(), place(), place(), place()] : null,
  };
}

// The session of each vertex.
export function sessionsOf(tile: Tile): Uint32Array {
  const sessions = new Uint32Array(tile.count);
  const { session, first } = tile.runs;
  for (let run = 0; run < first.length; run++) sessions.fill(session[run]!, first[run]!, first[run + 1] ?? tile.count);
  return sessions;
}
