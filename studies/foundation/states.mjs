// The finite-element states as the foundation sees them: for each state the penetration of every vertex of the
// undeformed skin into the indenter, and the map of the pressure that FE found there.

import { readFileSync } from 'node:fs';
import { Atlas } from '../../clients/web/papilla.js';
import { distanceMm, topMm } from './shapes.mjs';

/** @typedef {{set: string, split: string, indenter: string, depthMm: number, penetrationMm: Float32Array, pressurePa: Float32Array}} State */

const PIXELS = 224 * 224;

/**
 * An array of `fe-datagen dataset maps`: f32 or 64-bit integers.
 * @param {string} file @returns {Float32Array | BigInt64Array | BigUint64Array | Uint32Array}
 */
function readNpy(file) {
  const npy = readFileSync(file);
  const begin = 10 + npy.readUInt16LE(8);
  const kind = npy.toString('latin1', 10, begin).match(/'descr': '<(\w\d)'/)?.[1];
  const body = Uint8Array.from(npy.subarray(begin)).buffer;
  if (kind === 'f4') return new Float32Array(body);
  if (kind === 'i8') return new BigInt64Array(body);
  if (kind === 'u8') return new BigUint64Array(body);
  if (kind === 'u4') return new Uint32Array(body);
  throw new Error(`${file}: no reader for ${kind}`);
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
 * The states of a dataset of which `wanted` says yes, and its atlas.
 * @param {string} folder the dataset @param {string} maps what `fe-datagen dataset maps` made of it @param {string} set its name
 * @param {(split: string) => boolean} wanted
 * @returns {{atlas: Atlas, states: State[]}}
 */
export function readStates(folder, maps, set, wanted) {
  const manifest = JSON.parse(readFileSync(`${folder}/manifest.json`, 'utf8'));
  if (JSON.parse(readFileSync(`${maps}/maps.json`, 'utf8')).dataset_sha256 !== manifest.dataset_sha256) {
    throw new Error(`${maps} are not the maps of ${folder}: make them with fe-datagen dataset maps`);
  }
  const atlas = new Atlas(JSON.parse(readFileSync(`${folder}/atlas.json`, 'utf8')));
  const { campaign } = manifest;
  const [presses, depths, pressures] = ['press', 'depth_mm', 'pressure_pa'].map((name) => readNpy(`${maps}/${name}.npy`));
  const known = new Map(manifest.presses.map((/** @type {any} */ indentation) => [indentation.id, indentation]));
  const ways = new Map();
  /** @type {State[]} */
  const states = [];
  depths.forEach((/** @type {any} */ depth, /** @type {number} */ n) => {
    const indentation = known.get(Number(presses[n]));
    if (!wanted(indentation.split)) return;
    if (!ways.has(indentation.id)) {
      const shape = campaign.indenters?.find((/** @type {any} */ entry) => entry.name === indentation.indenter).indenter ?? campaign.indenter;
      ways.set(indentation.id, placed(atlas.skin.positionsMm, indentation, shape));
    }
    const penetrationMm = new Float32Array(atlas.vertexCount);
    ways.get(indentation.id)(depth, penetrationMm);
    const pressurePa = /** @type {Float32Array} */ (pressures).slice(n * PIXELS, (n + 1) * PIXELS);
    states.push({ set, split: indentation.split, indenter: indentation.indenter, depthMm: depth, penetrationMm, pressurePa });
  });
  return { atlas, states };
}
