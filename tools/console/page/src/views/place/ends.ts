// The ends of a route, and what it shall avoid, as people type them and as the address has them:
//
//   from=6:120  to=kitchen  to=label:6:120 (a label that looks like a frame)  from=robot:cart  avoid=6:130,stairs,long-loops
import type { MessageInitShape } from '@bufbuild/protobuf';
import type { View } from '../../proto/relmap/v1/common_pb';
import { RouteBy, type FindRouteRequestSchema, type RouteEndSchema } from '../../proto/relmap/v1/map_pb';
import { frameText, parseFrame } from '../../lib/ids';

export type Kind = 'frame' | 'label' | 'robot' | 'picture';
export interface End {
  kind: Kind;
  text: string; // of a picture: its name, for display
}

export function parseEnd(text: string | null): End {
  const given = text ?? '';
  if (given.startsWith('robot:')) return { kind: 'robot', text: given.slice(6) };
  if (given.startsWith('label:')) return { kind: 'label', text: given.slice(6) };
  return { kind: !given || parseFrame(given) ? 'frame' : 'label', text: given };
}

// For the address; a picture is not in it.
export function endText(end: End): string | null {
  const text = end.text.trim();
  if (!text || end.kind === 'picture') return null;
  if (end.kind === 'robot') return `robot:${text}`;
  return end.kind === 'label' && (parseEnd(text).kind !== 'label' || /^label:/.test(text)) ? `label:${text}` : text;
}

// What is missing or wrong, or "".
export function endProblem(end: End, hasPicture: boolean): string {
  if (end.kind === 'picture') return hasPicture ? '' : 'Choose a picture.';
  if (!end.text.trim()) return { frame: 'Enter a frame, as 6:120.', label: 'Enter a label.', robot: 'Enter the name of a robot.' }[end.kind];
  if (end.kind === 'frame' && !parseFrame(end.text.trim())) return 'A frame is written session:index, as 6:120.';
  return '';
}

export function endRequest(end: End, view: Partial<View> | null): MessageInitShape<typeof RouteEndSchema> {
  const text = end.text.trim();
  switch (end.kind) {
    case 'frame':
      return { end: { case: 'frame', value: parseFrame(text)! } };
    case 'label':
      return { end: { case: 'label', value: text } };
    case 'robot':
      return { end: { case: 'robot', value: text } };
    case 'picture':
      return { end: { case: 'view', value: (view ?? {}) as View } };
  }
}

// In words, for headings.
export function endWords(end: End): string {
  switch (end.kind) {
    case 'frame':
      return end.text;
    case 'label':
      return `“${end.text}”`;
    case 'robot':
      return `the robot ${end.text}`;
    case 'picture':
      return 'where the picture was taken';
  }
}

// ---- How

export interface How {
  by: 'distance' | 'time' | 'certainty';
  alternatives: number; // 0..5
  avoidFrames: string[];
  avoidLabels: string[];
  noLongLoops: boolean;
}

const kMostAlternatives = 5;

export function readHow(get: (name: string) => string | null): How {
  const by = get('by');
  const avoid = (get('avoid') ?? '').split(',').map((item) => unescape_(item.trim())).filter(Boolean);
  const alternatives = Number(get('alternatives') ?? 2);
  return {
    by: by === 'time' || by === 'certainty' ? by : 'distance',
    alternatives: Number.isInteger(alternatives) ? Math.min(kMostAlternatives, Math.max(0, alternatives)) : 2,
    avoidFrames: avoid.filter((item) => parseFrame(item)),
    avoidLabels: avoid.filter((item) => !parseFrame(item) && item !== 'long-loops').map((item) => item.replace(/^label:/, '')),
    noLongLoops: avoid.includes('long-loops'),
  };
}

export function writeHow(how: How): Record<string, string | null> {
  const labels = how.avoidLabels.map((label) =>
    escape_(parseFrame(label) || label === 'long-loops' || label.startsWith('label:') ? `label:${label}` : label),
  );
  const avoid = [...how.avoidFrames, ...labels, ...(how.noLongLoops ? ['long-loops'] : [])].join(',');
  return {
    by: how.by === 'distance' ? null : how.by,
    alternatives: how.alternatives === 2 ? null : String(how.alternatives),
    avoid: avoid || null,
  };
}

// A comma in a label is none of the list.
function escape_(text: string): string {
  return text.replace(/%/g, '%25').replace(/,/g, '%2C');
}
function unescape_(text: string): string {
  return text.replace(/%2C/gi, ',').replace(/%25/g, '%');
}

export function routeRequest(
  from: MessageInitShape<typeof RouteEndSchema>,
  to: MessageInitShape<typeof RouteEndSchema>,
  how: How,
): MessageInitShape<typeof FindRouteRequestSchema> {
  return {
    from,
    to,
    by: { distance: RouteBy.DISTANCE, time: RouteBy.TIME, certainty: RouteBy.CERTAINTY }[how.by],
    alternatives: how.alternatives,
    covariance: true,
    filter: {
      avoidFrames: how.avoidFrames.map((frame) => parseFrame(frame)!),
      avoidLabels: how.avoidLabels,
      noLongLoops: how.noLongLoops,
    },
  };
}

// The parameters of the map for this route: its ends as they were found, and which of the alternatives stands out.
type Found = Parameters<typeof frameText>[0];
export function mapParameters(first: Found, last: Found, how: How, chosen = 0): Record<string, string> {
  const parameters: Record<string, string> = { route: `${frameText(first)},${frameText(last)}` };
  for (const [name, value] of Object.entries(writeHow(how))) if (value) parameters[name] = value;
  if (chosen) parameters.way = String(chosen + 1);
  return parameters;
}
