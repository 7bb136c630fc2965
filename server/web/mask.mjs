// What the page does with a patch's mask: 1 for a pixel that shows the patch, 0 outside.

import { MAP_LEN, SIDE_PX } from './protocol.mjs';

/** Number of pixels on which a mask and a grey image's RGBA bytes disagree. */
export function countDifferences(mask, rgba) {
  let differing = 0;
  for (let i = 0; i < MAP_LEN; i++) {
    if ((mask[i] === 1) !== (rgba[4 * i] >= 128)) differing++;
  }
  return differing;
}

/**
 * Pixels just outside the mask, each followed by a pixel inside beside it. A filter reads both at the
 * rim, and a 0 from outside would darken it.
 */
export function fringeOf(mask) {
  const pairs = [];
  for (let row = 0; row < SIDE_PX; row++) {
    for (let column = 0; column < SIDE_PX; column++) {
      if (mask[row * SIDE_PX + column]) continue;
      const inside = neighbourInside(mask, row, column);
      if (inside >= 0) pairs.push(row * SIDE_PX + column, inside);
    }
  }
  return Uint32Array.from(pairs);
}

/** A pixel of the mask beside (row, column), straight neighbours first; -1 if there is none. */
function neighbourInside(mask, row, column) {
  for (const [down, right] of [[0, 1], [0, -1], [1, 0], [-1, 0], [1, 1], [1, -1], [-1, 1], [-1, -1]]) {
    const r = row + down;
    const c = column + right;
    if (r >= 0 && c >= 0 && r < SIDE_PX && c < SIDE_PX && mask[r * SIDE_PX + c]) return r * SIDE_PX + c;
  }
  return -1;
}

/** In words, where the masks of this atlas differ from the server's own pictures of them. */
export async function differencesFromServer(atlas) {
  const words = [];
  for (const patch of ['skin', 'interface']) {
    const response = await fetch(`v1/atlas/mask.png?patch=${patch}`);
    if (!response.ok) throw new Error(`v1/atlas/mask.png: HTTP ${response.status}`);
    const image = await createImageBitmap(await response.blob(), { colorSpaceConversion: 'none' });
    // Read on the processor: a graphics processor that draws the finger would be waited for.
    const context = new OffscreenCanvas(image.width, image.height).getContext('2d', { willReadFrequently: true });
    context.drawImage(image, 0, 0);
    const differing = countDifferences(atlas[patch].raster.mask, context.getImageData(0, 0, image.width, image.height).data);
    if (differing > 0) words.push(`${differing} pixels of the ${patch} mask differ from the server's`);
  }
  return words;
}
