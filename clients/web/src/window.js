// Rectangles of a map.

import { refusal } from './error.js';
import { MAP_LEN, SIDE_PX } from './wire.js';

/**
 * The rectangle of the samples that are not 0; 0 x 0 where all are.
 * @template {{column: number, row: number, width: number, height: number}} T
 * @param {Float32Array} map 224 x 224
 * @param {T} into written
 */
export function crop(map, into) {
  let first = 0;
  let end = MAP_LEN - 1;
  while (first < MAP_LEN && map[first] === 0) first++;
  into.column = into.row = into.width = into.height = 0;
  if (first === MAP_LEN) return into;
  while (map[end] === 0) end--;
  const row = (first / SIDE_PX) | 0;
  const last = (end / SIDE_PX) | 0;
  let left = SIDE_PX;
  let right = -1;
  for (let y = row; y <= last; y++) {
    const from = y * SIDE_PX;
    for (let x = 0; x < left; x++) if (map[from + x] !== 0) { left = x; break; }
    for (let x = SIDE_PX - 1; x > right; x--) if (map[from + x] !== 0) { right = x; break; }
  }
  into.column = left;
  into.row = row;
  into.width = right - left + 1;
  into.height = last - row + 1;
  return into;
}

/**
 * The greatest sample of a window; sample (x, y) is values[first + y * stride + x]. What is no pressure is refused as the
 * server would refuse it: as u16 or u8 it could not be told from one.
 * @param {Float32Array} values @param {number} first @param {number} stride
 * @param {number} width @param {number} height
 */
export function greatest(values, first, stride, width, height) {
  let most = 0;
  for (let y = 0; y < height; y++) {
    const from = first + y * stride;
    for (let x = 0; x < width; x++) {
      const value = values[from + x];
      if (!(value >= 0 && value < Infinity)) throw noPressure(value, x, y);
      if (value > most) most = value;
    }
  }
  return most;
}

/** @param {number} value @param {number} column @param {number} row */
function noPressure(value, column, row) {
  const code = Number.isFinite(value) ? 'negative_pressure' : 'not_finite';
  return refusal(code, `row ${row}, column ${column} of the window is ${value} Pa; pressure is finite and not negative`);
}
