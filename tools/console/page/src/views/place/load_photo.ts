// A file of a photograph, as it is sent and shown.
import { free, ready, type Ready } from '../../lib/pictures';
import { hasExif, planPhoto, typeOf } from './photo';

export interface Loaded {
  name: string;
  data: Uint8Array;
  picture: Ready; // what is sent
  note: string; // what was done to it
}

// Throws an Error that says what is wrong with it.
export async function loadPhoto(file: Blob, name: string, keepSize: boolean): Promise<Loaded> {
  const bytes = new Uint8Array(await file.arrayBuffer());
  let bitmap: ImageBitmap;
  try {
    bitmap = await createImageBitmap(file);
  } catch {
    throw new Error(`${name || 'This'} is no picture that this browser can read. Use JPEG or PNG.`);
  }
  try {
    const type = typeOf(bytes);
    const { width, height } = bitmap;
    const plan = planPhoto({ type, bytes: bytes.length, width, height, turned: type === 'image/jpeg' && hasExif(bytes) }, keepSize);
    if (plan.send === 'nothing') throw new Error(`${name}: ${plan.why}`);
    if (plan.send === 'as it is') return await made(name, bytes, type, '');
    const canvas = document.createElement('canvas');
    canvas.width = plan.width;
    canvas.height = plan.height;
    const context = canvas.getContext('2d')!;
    context.imageSmoothingQuality = 'high';
    context.drawImage(bitmap, 0, 0, plan.width, plan.height);
    const blob = await new Promise<Blob | null>((resolve) => canvas.toBlob(resolve, plan.type, 0.92));
    if (!blob) throw new Error(`${name} could not be redrawn.`);
    const note = plan.width === width ? '' : `reduced from ${width} × ${height} to ${plan.width} × ${plan.height} pixels`;
    return await made(name, new Uint8Array(await blob.arrayBuffer()), plan.type, note);
  } finally {
    bitmap.close();
  }
}

async function made(name: string, data: Uint8Array, type: string, note: string): Promise<Loaded> {
  const picture = await ready(data, 1, type);
  if (!picture) throw new Error(`${name} is damaged.`);
  return { name, data, picture, note };
}

export function freePhoto(loaded: Loaded | null) {
  free(loaded?.picture);
}
