// Meshes as they come: STL, OBJ, PLY and GLB as a shape of the hello. Needs three.js, whose loaders read the files.

import { BufferAttribute, BufferGeometry } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';
import { refusal } from './error.js';
import { vertexMm } from './frames.js';

/** @typedef {[number, number, number]} Three */
/** @typedef {{shape: 'mesh', vertices_mm: Three[], triangles: Three[]}} MeshShape */

/** Most triangles of one mesh of a session. */
export const TRIANGLES_MAX = 16384;
/** Most bytes of one mesh as JSON: a hello may have 512 KiB, and holds more than a mesh. */
export const SHAPE_BYTES_MAX = 496 * 1024;
/** Units of a file, in mm. */
export const UNITS = /** @type {const} */ ({ mm: 1, cm: 10, m: 1000, in: 25.4 });
/** A size beyond these is asked about, mm. */
const PLAUSIBLE_MM = { least: 0.5, most: 500 };

/** @type {Record<string, (bytes: ArrayBuffer) => BufferGeometry[] | Promise<BufferGeometry[]>>} */
const READERS = {
  stl: (bytes) => [new STLLoader().parse(bytes)],
  obj: (bytes) => geometriesOf(new OBJLoader().parse(new TextDecoder().decode(bytes))),
  ply: (bytes) => [new PLYLoader().parse(bytes)],
  glb: async (bytes) => geometriesOf((await new GLTFLoader().parseAsync(bytes, '')).scene),
};

/**
 * A file of triangles as a shape of the hello. Corners that coincide become one, triangles without area go; all objects of a
 * file are one body. A surface that is open or crosses itself may be sent: the service tells its inside from its outside, and
 * says in the `warnings` of `ready` what it mended.
 * @param {ArrayBuffer} bytes the file
 * @param {string} name its name, whose ending says what it is: .stl, .obj, .ply or .glb
 * @param {{unit?: keyof typeof UNITS, axes?: 'file' | 'scene'}} [how] `unit` of its lengths: by default m for GLB and mm for
 *   others; a size that looks wrong is then asked about. `axes`: `file` (the default) keeps the file's axes, `scene` takes
 *   them for those of three.js and turns them as `poseInFinger` does
 * @returns {Promise<MeshShape>} rejected with a PapillaError that names what is wrong
 */
export async function readMesh(bytes, name, { unit, axes = 'file' } = {}) {
  const ending = name.split('.').pop()?.toLowerCase() ?? '';
  const reader = READERS[ending];
  if (!reader) throw bad(`${name}: none of .${Object.keys(READERS).join(', .')}`);
  /** @type {BufferGeometry[]} */
  let geometries;
  try {
    geometries = await reader(bytes);
  } catch (error) {
    throw bad(`${name} cannot be read: ${error instanceof Error ? error.message : String(error)}`);
  }
  const { vertices, triangles } = joined(geometries);
  if (triangles.length === 0) throw bad(`${name} holds no triangle`);
  if (triangles.length > TRIANGLES_MAX) {
    throw bad(`${name} has ${triangles.length} triangles; a mesh may have ${TRIANGLES_MAX} at most: reduce it first`);
  }
  if (!vertices.flat().every(Number.isFinite)) throw bad(`${name} holds a coordinate that is not finite`);
  const factor = factorOf(vertices, ending === 'glb' ? 'm' : 'mm', unit, name);
  const scaled = (/** @type {Three} */ p) => /** @type {Three} */ (p.map((x) => factor * x));
  const turned = (/** @type {Three} */ p) => vertexMm(/** @type {Three} */ (scaled(p).map((x) => x / UNITS.m)));
  const placed = vertices.map(axes === 'scene' ? turned : scaled);
  // To 0.1 um: more digits would only fill the hello. A body below 1 mm, whose unit may be wrong, gets more.
  const digits = Math.min(20, Math.max(4, 4 - Math.floor(Math.log10(sideOf(placed)))));
  const short = (/** @type {Three} */ p) => /** @type {Three} */ (p.map((x) => Number(x.toFixed(digits))));
  /** @type {MeshShape} */
  const shape = { shape: 'mesh', vertices_mm: placed.map(short), triangles };
  const size = JSON.stringify(shape).length;
  if (size > SHAPE_BYTES_MAX) {
    throw bad(`${name} takes ${size} bytes with its ${triangles.length} triangles; a hello has room for ${SHAPE_BYTES_MAX}: reduce it first`);
  }
  return shape;
}

const bad = (/** @type {string} */ message) => refusal('bad_contact', message);

/**
 * The geometry of each mesh of a scene, in the scene's axes. @param {import('three').Object3D} scene
 * @returns {BufferGeometry[]}
 */
function geometriesOf(scene) {
  scene.updateMatrixWorld(true);
  /** @type {BufferGeometry[]} */
  const found = [];
  scene.traverse((node) => {
    if (!('isMesh' in node)) return;
    const { geometry } = /** @type {import('three').Mesh} */ (node);
    const placed = new BufferGeometry();
    const position = geometry.getAttribute('position');
    // Interleaved or of integers in some files.
    const numbers = new Float32Array(3 * position.count);
    for (let k = 0; k < position.count; k++) numbers.set([position.getX(k), position.getY(k), position.getZ(k)], 3 * k);
    placed.setAttribute('position', new BufferAttribute(numbers, 3)).setIndex(geometry.getIndex());
    found.push(placed.applyMatrix4(node.matrixWorld));
  });
  return found;
}

/**
 * All triangles with the corners that they share. @param {BufferGeometry[]} geometries
 * @returns {{vertices: Three[], triangles: Three[]}}
 */
function joined(geometries) {
  /** @type {Map<string, number>} */
  const numbers = new Map();
  /** @type {Three[]} */
  const vertices = [];
  /** @type {Three[]} */
  const triangles = [];
  for (const geometry of geometries) {
    const position = geometry.getAttribute('position');
    if (!position) continue;
    const index = geometry.getIndex();
    const corner = (/** @type {number} */ k) => {
      const at = index ? index.getX(k) : k;
      /** @type {Three} */
      const point = [position.getX(at), position.getY(at), position.getZ(at)];
      const key = point.map((x) => x + 0).join(' ');
      let number = numbers.get(key);
      if (number === undefined) {
        number = vertices.push(point) - 1;
        numbers.set(key, number);
      }
      return number;
    };
    const count = index ? index.count : position.count;
    for (let k = 0; k + 2 < count; k += 3) {
      const [a, b, c] = [corner(k), corner(k + 1), corner(k + 2)];
      if (a !== b && b !== c && c !== a) triangles.push([a, b, c]);
    }
  }
  return { vertices, triangles };
}

/** The longest side of their box. @param {Three[]} vertices */
function sideOf(vertices) {
  const side = (/** @type {number} */ axis) => {
    let [low, high] = [Infinity, -Infinity];
    for (const vertex of vertices) [low, high] = [Math.min(low, vertex[axis]), Math.max(high, vertex[axis])];
    return high - low;
  };
  return Math.max(side(0), side(1), side(2));
}

/**
 * Millimetres of one unit of the file. @param {Three[]} vertices @param {'m' | 'mm'} own @param {keyof typeof UNITS | undefined} unit
 * @param {string} name
 */
function factorOf(vertices, own, unit, name) {
  if (unit !== undefined) {
    if (!(unit in UNITS)) throw bad(`the unit '${unit}' is none of ${Object.keys(UNITS).join(', ')}`);
    return UNITS[unit];
  }
  const sizeMm = sideOf(vertices) * UNITS[own];
  if (sizeMm < PLAUSIBLE_MM.least || sizeMm > PLAUSIBLE_MM.most) {
    throw bad(`${name} would measure ${Number(sizeMm.toPrecision(4))} mm if it is in ${own}: give 'unit', also if that is so`);
  }
  return UNITS[own];
}
