// Pictures that came as bytes, made ready to be drawn.
import type { FramePicture } from '../proto/relmap/v1/graph_pb';
import type { Match, Shot } from './matches';
import type { Correspondence } from '../proto/relmap/v1/evidence_pb';
import { reasonText } from './reasons';

export interface Ready extends Shot {
  url: string;
  element: HTMLImageElement; // keeps it decoded
}

// One side of a pair: its picture, or why there is none.
export interface Side {
  name: string; // frame 6:120, or what the picture is
  picture: Ready | null;
  missing: string;
}

// Decodes it, so that it is drawn at once when it is shown. Null where the bytes are none or are damaged.
export async function ready(data: Uint8Array, scale: number, type = 'image/jpeg'): Promise<Ready | null> {
  if (data.length === 0) return null;
  const url = URL.createObjectURL(new Blob([data as Uint8Array<ArrayBuffer>], { type }));
  const element = new Image();
  element.src = url;
  try {
    await element.decode();
  } catch {
    URL.revokeObjectURL(url);
    return null;
  }
  return { url, element, width: element.naturalWidth, height: element.naturalHeight, scale };
}

export function free(picture: Ready | null | undefined) {
  if (picture) URL.revokeObjectURL(picture.url);
}

export async function sideOf(name: string, picture: FramePicture | undefined): Promise<Side> {
  if (!picture) return { name, picture: null, missing: 'The daemon sent no picture.' };
  const decoded = await ready(picture.data, picture.scale || 1);
  const why = picture.message || (picture.data.length ? 'The picture that is kept is damaged.' : reasonText(picture.reason));
  return { name, picture: decoded, missing: decoded ? '' : why };
}

export function matchesOf(correspondences: Correspondence[]): Match[] {
  return correspondences.map(({ u, v, frameU, frameV, inlier, residual }) => ({
    u, v, frameU, frameV, inlier, ...(residual === undefined ? {} : { residual }),
  }));
}
