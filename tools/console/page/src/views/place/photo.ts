// What becomes of a photograph before it is sent: the daemon takes JPEG and PNG of at most 16 MB, and 64 or 8 megapixels
// (View in common.proto); more than 1600 pixels help it little and take time to send.

export const kMostSide = 1600;
const kMostBytes = 16_000_000;
const kMostPixels = { 'image/jpeg': 64e6, 'image/png': 8e6 } as const;

export interface Photo {
  type: string; // MIME
  bytes: number;
  width: number; // as it is shown
  height: number;
  turned: boolean; // it has notes (EXIF), which may say that it is to be turned
}

export type Plan = { send: 'as it is' } | { send: 'redrawn'; width: number; height: number; type: 'image/jpeg' } | { send: 'nothing'; why: string };

// keepSize: a session's camera is said to have taken it, whose calibration is of pictures of one size.
export function planPhoto(photo: Photo, keepSize: boolean): Plan {
  const { width, height } = photo;
  if (!(width > 0 && height > 0)) return { send: 'nothing', why: 'It has no size.' };
  const sent = photo.type === 'image/jpeg' || photo.type === 'image/png';
  const most = photo.type === 'image/png' ? kMostPixels['image/png'] : kMostPixels['image/jpeg'];
  const tooLarge = photo.bytes > kMostBytes || width * height > most;
  const factor = keepSize ? 1 : Math.min(1, kMostSide / Math.max(width, height));
  if (sent && !tooLarge && factor === 1 && !photo.turned) return { send: 'as it is' };
  if (width * factor * height * factor > kMostPixels['image/jpeg'])
    return { send: 'nothing', why: 'It has more than 64 megapixels. Say that its camera is not known: then it is reduced.' };
  return { send: 'redrawn', width: Math.max(1, Math.round(width * factor)), height: Math.max(1, Math.round(height * factor)), type: 'image/jpeg' };
}

// Whether a JPEG has EXIF notes. What the browser shows may be turned by them; the daemon sees the pixels as they are.
export function hasExif(head: Uint8Array): boolean {
  for (let at = 0; at + 4 < Math.min(head.length, 65_536); ++at)
    if (head[at] === 0x45 && head[at + 1] === 0x78 && head[at + 2] === 0x69 && head[at + 3] === 0x66) return true;
  return false;
}

// What a file is by its first bytes; "" for neither JPEG nor PNG.
export function typeOf(head: Uint8Array): string {
  if (head[0] === 0xff && head[1] === 0xd8 && head[2] === 0xff) return 'image/jpeg';
  if (head[0] === 0x89 && head[1] === 0x50 && head[2] === 0x4e && head[3] === 0x47) return 'image/png';
  return '';
}
