// The colours of the map. They differ for people who are colour-blind, too: the scale rises steadily in lightness (it is
// viridis, cut where it would not stand out from the ground), and what has a state has a pattern or a width of its own.
export type Rgb = [number, number, number];

export type ColourBy = 'session' | 'time' | 'age' | 'sd' | 'source';
export const colourings: { by: ColourBy; title: string }[] = [
  { by: 'session', title: 'session' },
  { by: 'time', title: 'time' },
  { by: 'age', title: 'age' },
  { by: 'sd', title: 'uncertainty' },
  { by: 'source', title: 'source of motion' },
];

export interface Palette {
  ground: Rgb;
  text: Rgb;
  dim: Rgb;
  sessions: Rgb[];
  scale: Rgb[]; // stops at even distances
  measured: Rgb;
  guess: Rgb;
  carried: Rgb;
  accepted: Rgb;
  candidate: Rgb;
  quarantined: Rgb;
  removed: Rgb;
  suspicious: Rgb;
  torn: Rgb;
  selected: Rgb;
  route: Rgb; // on a casing of the text's colour
}

export function rgb(hex: string): Rgb {
  return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)) as Rgb;
}
export function css(colour: Rgb, alpha = 1): string {
  return alpha < 1 ? `rgb(${colour.join(' ')} / ${alpha})` : `rgb(${colour.join(' ')})`;
}

const light: Palette = {
  ground: rgb('#f6f7f9'),
  text: rgb('#16202b'),
  dim: rgb('#8b96a3'),
  sessions: ['#0072b2', '#b8480a', '#00856a', '#a3498c', '#7a6a00', '#332288', '#2f8fb8', '#882255', '#5d8a1d', '#5c4a3a'].map(rgb),
  scale: ['#440154', '#46327e', '#365c8d', '#277f8e', '#1a9a80', '#4db052'].map(rgb),
  measured: rgb('#0072b2'),
  guess: rgb('#a8480f'),
  carried: rgb('#a3338c'),
  accepted: rgb('#6f9a83'),
  candidate: rgb('#2f6fb5'),
  quarantined: rgb('#9a6700'),
  removed: rgb('#8b96a3'),
  suspicious: rgb('#c25e00'),
  torn: rgb('#d1003f'),
  selected: rgb('#111820'),
  route: rgb('#ffcf33'),
};
const dark: Palette = {
  ground: rgb('#10161d'),
  text: rgb('#e7ecf2'),
  dim: rgb('#66758a'),
  sessions: ['#5cb3f0', '#f09060', '#3fc9a0', '#e58cc8', '#e0d060', '#a79cf5', '#8fdcf5', '#f2a0a8', '#a8cf58', '#c9b09a'].map(rgb),
  scale: ['#5a5fc0', '#3f7fc0', '#28a09c', '#4ac16d', '#a0da39', '#fde725'].map(rgb),
  measured: rgb('#5cb3f0'),
  guess: rgb('#f0a060'),
  carried: rgb('#ee8ed8'),
  accepted: rgb('#3f7d63'),
  candidate: rgb('#6aa5f0'),
  quarantined: rgb('#e0b040'),
  removed: rgb('#66758a'),
  suspicious: rgb('#ffa040'),
  torn: rgb('#ff4f74'),
  selected: rgb('#ffffff'),
  route: rgb('#b3520a'),
};
export function palette(darkTheme: boolean): Palette {
  return darkTheme ? dark : light;
}

// Neighbouring numbers have different colours; with more sessions than colours they repeat.
export function sessionColour(palette: Palette, session: number): Rgb {
  return palette.sessions[(session + palette.sessions.length - 1) % palette.sessions.length]!;
}

export function scaleColour(palette: Palette, share: number): Rgb {
  const at = Math.max(0, Math.min(1, share)) * (palette.scale.length - 1);
  const stop = Math.min(palette.scale.length - 2, Math.floor(at));
  const [from, to] = [palette.scale[stop]!, palette.scale[stop + 1]!];
  return [0, 1, 2].map((i) => Math.round(from[i]! + (to[i]! - from[i]!) * (at - stop))) as Rgb;
}

// ---- Where a value lies on the scale, 0..1. The shader computes the same (shaders.ts).

// Of ages, what is young is told apart finely: by the logarithm, from ten seconds. Young is at the end of the scale.
export function ageShare(age: number, range: number): number {
  return 1 - Math.log(1 + Math.max(0, age) / 10) / Math.log(1 + Math.max(10, range) / 10);
}
export const sdRange = [0.01, 100] as const; // metres
export function sdShare(sd: number): number {
  return Math.log(Math.max(sd, sdRange[0]) / sdRange[0]) / Math.log(sdRange[1] / sdRange[0]);
}

// Sessions as the shader looks them up: red, green, blue, and how strongly they are drawn. Numbers from 4096 on share
// the entries of others.
export const sessionSlots = 4096;
export function sessionTable(palette: Palette, chosen: ReadonlySet<number>): Uint8Array {
  const table = new Uint8Array(sessionSlots * 4);
  const kept = new Set([...chosen].map((session) => session % sessionSlots));
  for (let slot = 0; slot < sessionSlots; slot++) {
    table.set(sessionColour(palette, slot), slot * 4);
    table[slot * 4 + 3] = kept.size === 0 || kept.has(slot) ? 255 : 50;
  }
  return table;
}
