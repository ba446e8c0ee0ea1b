// What the address says about the picture: parsed, and written.
import type { Layers } from '../../map/renderer';
import { colourings, type ColourBy } from '../../map/palette';

// The layers in the order of the list; `sample`: what the legend draws.
export interface LayerText {
  name: keyof AllLayers;
  title: string;
  what: string;
}
export interface AllLayers extends Layers {
  robots: boolean;
  labels: boolean;
}
export const layerTexts: LayerText[] = [
  { name: 'torn', title: 'torn closures', what: 'the layout cannot reconcile them with the rest: look at these first' },
  { name: 'accepted', title: 'closures in force', what: 'places that were recognised and agree with others; wide where suspicious' },
  { name: 'candidate', title: 'candidates', what: 'nothing agrees with them yet; not in force' },
  { name: 'quarantined', title: 'quarantined', what: 'others contradict them; not in force' },
  { name: 'removed', title: 'removed', what: 'an operator took them out' },
  { name: 'robots', title: 'robots', what: 'what streams now, with the trail of the last minute' },
  { name: 'labels', title: 'labels', what: 'names that somebody gave to frames' },
  { name: 'headings', title: 'direction', what: 'which way the robot drove' },
];
export const usualLayers = 'torn,accepted,robots,labels';

export function parseLayers(text: string | null): AllLayers {
  const on = new Set((text ?? usualLayers).split(','));
  return Object.fromEntries(layerTexts.map(({ name }) => [name, on.has(name)])) as unknown as AllLayers;
}
// null: as usual.
export function layersText(layers: AllLayers): string | null {
  const text = layerTexts.filter(({ name }) => layers[name]).map(({ name }) => name).join(',') || 'none';
  return text === usualLayers ? null : text;
}

export function parseColour(text: string | null): ColourBy {
  return colourings.find(({ by }) => by === text)?.by ?? 'session';
}

export function parseSessions(text: string | null): Set<number> {
  return new Set((text ?? '').split(',').map(Number).filter((number) => Number.isInteger(number) && number > 0));
}

// "2026-11-30T21:04:05Z" as seconds; infinite: now.
export function parseTime(text: string | null): number {
  const ms = text ? Date.parse(text) : NaN;
  return Number.isFinite(ms) ? ms / 1000 : Infinity;
}
export function timeText(seconds: number): string | null {
  return Number.isFinite(seconds) ? new Date(Math.round(seconds) * 1000).toISOString().slice(0, 19) + 'Z' : null;
}
