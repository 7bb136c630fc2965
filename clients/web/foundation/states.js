// The committed FE indentations as the foundation sees them: for each state the penetration of every vertex of the
// undeformed skin into the indenter, and the pressure that the FE code found there.

import { readFileSync } from 'node:fs';
import { inflateRawSync } from 'node:zlib';
import { distanceMm, topMm } from './shapes.js';

/** @typedef {{set: string, split: string, indenter: string, depthMm: number, forceN: number, penetrationMm: Float32Array, pressurePa: Float32Array}} State */

/**
 * Arrays of an .npz by name; f32 and little-endian, as `fe-datagen` writes them.
 * @param {string} file @returns {Map<string, Float32Array>}
 */
function readNpz(file) {
  const zip = readFileSync(file);
  let end = zip.length - 22;
  while (zip.readUInt32LE(end) !== 0x06054b50) end--;
  /** @type {Map<string, Float32Array>} */
  const arrays = new Map();
  for (let n = zip.readUInt16LE(end + 10), at = zip.readUInt32LE(end + 16); n > 0; n--) {
    const [method, size] = [zip.readUInt16LE(at + 10), zip.readUInt32LE(at + 20)];
    const [nameLen, extraLen, commentLen] = [28, 30, 32].map((k) => zip.readUInt16LE(at + k));
    const name = zip.toString('utf8', at + 46, at + 46 + nameLen).replace('.npy', '');
    const local = zip.readUInt32LE(at + 42);
    const data = local + 30 + zip.readUInt16LE(local + 26) + zip.readUInt16LE(local + 28);
    const packed = zip.subarray(data, data + size);
    const npy = method === 8 ? inflateRawSync(packed) : packed;
    const body = 10 + npy.readUInt16LE(8);
    if (npy.toString('latin1', 10, body).includes("'<f4'")) {
      arrays.set(name, new Float32Array(Uint8Array.from(npy.subarray(body)).buffer));
    }
    at += 46 + nameLen + extraLen + commentLen;
  }
  return arrays;
}

/** Columns are the indenter's axes: yaw about z, then pitch about y, then roll about x. @param {any} indentation */
function rotation(indentation) {
  const [p, r, y] = [indentation.pitch_deg, indentation.roll_deg, indentation.yaw_deg].map((deg) => (deg * Math.PI) / 180);
  const [sp, cp, sr, cr, sy, cy] = [Math.sin(p), Math.cos(p), Math.sin(r), Math.cos(r), Math.sin(y), Math.cos(y)];
  const turn = [[cp * cy, -cp * sy, sp], [sy, cy, 0], [-sp * cy, sp * sy, cp]];
  return [turn[0], [0, 1, 2].map((k) => cr * turn[1][k] - sr * turn[2][k]), [0, 1, 2].map((k) => sr * turn[1][k] + cr * turn[2][k])];
}

/**
 * Distance of every vertex from the indenter when it has gone `depthMm` beyond its first touch: as
 * docs/reference/indenters.md says, from the skin point that a flat plate in that pose would touch first.
 * @param {Float32Array} positionsMm @param {any} indentation @param {any} shape
 * @returns {(depthMm: number, out: Float32Array) => void}
 */
function placed(positionsMm, indentation, shape) {
  const turn = rotation(indentation);
  const count = positionsMm.length / 3;
  const local = new Float64Array(positionsMm.length);
  for (let i = 0; i < count; i++) {
    for (let k = 0; k < 3; k++) {
      local[3 * i + k] = [0, 1, 2].reduce((sum, m) => sum + turn[m][k] * positionsMm[3 * i + m], 0);
    }
  }
  let first = 0;
  for (let i = 1; i < count; i++) if (local[3 * i + 2] < local[3 * first + 2]) first = i;
  const origin = [local[3 * first] + indentation.offset_mm[0], local[3 * first + 1] + indentation.offset_mm[1], local[3 * first + 2] - topMm(shape)];
  const gap = (/** @type {number} */ i, /** @type {number} */ travel) =>
    distanceMm(shape, local[3 * i] - origin[0], local[3 * i + 1] - origin[1], local[3 * i + 2] - origin[2] - travel);
  let touch = Infinity;
  for (let i = 0; i < count; i++) {
    // The way of a vertex into the shape, in steps as long as its distance.
    for (let travel = 0, n = 0; travel < Math.min(touch, 30) && n < 400; n++) {
      const free = gap(i, travel);
      if (free < 1e-7) { touch = travel; break; }
      travel += Math.max(free, 1e-6);
    }
  }
  if (touch === Infinity) throw new Error(`indentation ${indentation.id} of '${indentation.indenter}' never touches`);
  return (depthMm, out) => {
    for (let i = 0; i < count; i++) out[i] = Math.max(0, -gap(i, touch + depthMm));
  };
}

/**
 * All states of a dataset.
 * @param {string} folder @param {string} set its name
 * @returns {State[]}
 */
export function readStates(folder, set) {
  const manifest = JSON.parse(readFileSync(`${folder}/manifest.json`, 'utf8'));
  const positionsMm = Float32Array.from(JSON.parse(readFileSync(`${folder}/atlas.json`, 'utf8')).skin.positions_mm.flat());
  const count = positionsMm.length / 3;
  const { campaign } = manifest;
  /** @type {State[]} */
  const states = [];
  for (const indentation of manifest.presses) {
    const shape = campaign.indenters?.find((/** @type {any} */ entry) => entry.name === indentation.indenter).indenter ?? campaign.indenter;
    const penetrate = placed(positionsMm, indentation, shape);
    const shard = readNpz(`${folder}/${indentation.file}`);
    const [depths, pressures, forces] = ['depth_mm', 'pressure_pa', 'force_n'].map((name) => /** @type {Float32Array} */ (shard.get(name)));
    depths.forEach((depthMm, n) => {
      const penetrationMm = new Float32Array(count);
      penetrate(depthMm, penetrationMm);
      const forceN = Math.hypot(forces[3 * n], forces[3 * n + 1], forces[3 * n + 2]);
      states.push({ set, split: indentation.split, indenter: indentation.indenter, depthMm, forceN, penetrationMm, pressurePa: pressures.slice(n * count, (n + 1) * count) });
    });
  }
  return states;
}
