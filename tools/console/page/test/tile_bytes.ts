// Makes the bytes of tiles for tests.
export interface MadeTile {
  runs?: [session: number, first: number][];
  x?: number[];
  y?: number[];
  index?: number[];
  time?: number[];
  flags?: number[];
  old?: [number, number][];
  sd?: number[];
  closures?: { a: [number, number]; b: [number, number]; id: [number, number, number]; state?: number; flags?: number; suspicion?: number; sigmas?: number }[];
  unit?: number;
  origin?: [number, number];
}

export function tileBytes(made: MadeTile): ArrayBuffer {
  const { runs = [], x = [], closures = [], old, sd } = made;
  const y = made.y ?? x.map(() => 0);
  const parts: ArrayBufferView[] = [];
  const f32 = (values: number[]) => parts.push(Float32Array.from(values));
  const u32 = (values: number[]) => parts.push(Uint32Array.from(values));
  const u8 = (values: number[]) => parts.push(Uint8Array.from(values));
  u32([0x31544d52, runs.length, x.length, closures.length, (old ? 1 : 0) | (sd ? 2 : 0), 0]);
  parts.push(Float64Array.from(made.origin ?? [0, 0]));
  f32([made.unit ?? 1]);
  u32([0]);
  u32(runs.map(([session]) => session));
  u32(runs.map(([, first]) => first));
  u32(runs.map(() => 0));
  parts.push(Uint16Array.from(x), Uint16Array.from(y));
  u32(made.index ?? x.map((_, i) => i));
  u32(made.time ?? x.map(() => 0));
  u8(made.flags ?? x.map(() => 0));
  if (old) {
    f32(old.map(([at]) => at));
    f32(old.map(([, at]) => at));
  }
  if (sd) f32(sd);
  for (const place of [0, 1]) f32(closures.map(({ a }) => a[place]!));
  for (const place of [0, 1]) f32(closures.map(({ b }) => b[place]!));
  for (const part of [0, 1, 2]) u32(closures.map(({ id }) => id[part]!));
  u32(closures.map(() => 1)); // the session and index of the older end
  u32(closures.map(() => 0));
  u32(closures.map(() => 0)); // time
  u32(closures.map(() => 1)); // alike
  f32(closures.map(({ suspicion }) => suspicion ?? 0));
  f32(closures.map(({ sigmas }) => sigmas ?? 0));
  u8(closures.map(({ state }) => state ?? 2));
  u8(closures.map(({ flags }) => flags ?? 1));
  if (old) for (let i = 0; i < 4; i++) f32(closures.map(() => 0));

  const size = parts.reduce((sum, part) => sum + Math.ceil(part.byteLength / 4) * 4, 0);
  const bytes = new Uint8Array(size);
  let at = 0;
  for (const part of parts) {
    bytes.set(new Uint8Array(part.buffer, part.byteOffset, part.byteLength), at);
    at += Math.ceil(part.byteLength / 4) * 4;
  }
  return bytes.buffer;
}
