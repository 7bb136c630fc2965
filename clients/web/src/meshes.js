// Meshes as they come: STL, OBJ, PLY and GLB as a shape of the hello. Needs three.js, whose loaders read the files, and for
// those of many triangles meshoptimizer and three-mesh-bvh.

import { BufferAttribute, BufferGeometry } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';
import { refusal } from './error.js';
import { vertexMm } from './frames.js';
import { decimated, distanceMm } from './meshes/decimate.js';

/** @typedef {[number, number, number]} Three */
/** @typedef {{shape: 'mesh', vertices_mm: Three[], triangles: Three[]}} MeshShape */
/** @typedef {import('./meshes/decimate.js').Triangles} Triangles */
/**
 * A mesh, and what was done to get it: `notes` says what was mended; `decimatedMm` is the greatest distance between what was
 * read and what is here, at sampled points, 0 if no triangle had to go; `trianglesRead`: how many there were with an area.
 * @typedef {{shape: MeshShape, notes: string[], decimatedMm: number, trianglesRead: number}} FileMesh
 */

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
 * file are one body. Where a mesh has more triangles than a hello holds, it is decimated, and `notes` says how far its surface
 * has moved. A surface that is open or crosses itself may be sent: the service tells its inside from its outside, and says in
 * the `warnings` of `ready` what it mended.
 * @param {ArrayBuffer} bytes the file
 * @param {string} name its name, whose ending says what it is: .stl, .obj, .ply or .glb
 * @param {{unit?: keyof typeof UNITS, axes?: 'file' | 'scene', bytesOf?: (shape: MeshShape) => number}} [how] `unit` of its
 *   lengths: by default m for GLB and mm for others; a size that looks wrong is then asked about. `axes`: `file` (the default)
 *   keeps the file's axes, `scene` takes them for those of three.js and turns them as `poseInFinger` does. `bytesOf`: how many
 *   bytes of a hello the shape takes; by default those of its JSON
 * @returns {Promise<FileMesh>} rejected with a PapillaError that names what is wrong
 */
export async function readMesh(bytes, name, { unit, axes = 'file', bytesOf = (shape) => JSON.stringify(shape).length } = {}) {
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
  const corners = cornersOf(geometries);
  if (corners.length === 0) throw bad(`${name} holds no triangle`);
  if (!corners.every((corner) => corner.every(Number.isFinite))) throw bad(`${name} holds a coordinate that is not finite`);
  const factor = factorOf(corners, ending === 'glb' ? 'm' : 'mm', unit, name);
  const scaled = (/** @type {Three} */ p) => /** @type {Three} */ (p.map((x) => factor * x));
  const turned = (/** @type {Three} */ p) => vertexMm(/** @type {Three} */ (scaled(p).map((x) => x / UNITS.m)));
  const placed = corners.map(axes === 'scene' ? turned : scaled);
  const rounded = rounding(placed);
  const mesh = welded(placed.map(rounded));
  if (mesh.triangles.length === 0) throw bad(`${name} holds no triangle with an area`);
  const notes = [];
  const flat = corners.length / 3 - mesh.triangles.length;
  if (flat > 0) notes.push(`${flat} triangles without area were left out`);
  const fewer = await fitting(mesh, name, rounded, bytesOf);
  let decimatedMm = 0;
  if (fewer !== mesh) {
    decimatedMm = distanceMm(mesh, fewer);
    notes.push(`${mesh.triangles.length} triangles became ${fewer.triangles.length}: at most ${Number(decimatedMm.toPrecision(3))} mm off`);
  }
  return { shape: shapeOf(fewer), notes, decimatedMm, trianglesRead: mesh.triangles.length };
}

const bad = (/** @type {string} */ message) => refusal('bad_contact', message);

/** @param {Triangles} mesh @returns {MeshShape} */
const shapeOf = ({ vertices, triangles }) => ({ shape: 'mesh', vertices_mm: vertices, triangles });

/** To 0.1 um: more digits would only fill the hello. A body below 1 mm, whose unit may be wrong, gets more. @param {Three[]} points */
function rounding(points) {
  const digits = Math.min(20, Math.max(4, 4 - Math.floor(Math.log10(sideOf(points)))));
  // + 0: no -0, which would be another corner than 0.
  return (/** @type {Three} */ p) => /** @type {Three} */ (p.map((x) => Number(x.toFixed(digits)) + 0));
}

/**
 * The mesh with so few triangles that a hello holds it, as many as come. @param {Triangles} mesh @param {string} name
 * @param {(point: Three) => Three} rounded @param {(shape: MeshShape) => number} bytesOf
 */
async function fitting(mesh, name, rounded, bytesOf) {
  let [most, fitting] = [TRIANGLES_MAX, mesh];
  for (;;) {
    if (mesh.triangles.length > most) {
      const { vertices, triangles } = await decimated(mesh, most, name);
      fitting = { vertices: vertices.map(rounded), triangles };
    }
    const [count, size] = [fitting.triangles.length, bytesOf(shapeOf(fitting))];
    if (size <= SHAPE_BYTES_MAX) return fitting;
    most = Math.floor((0.99 * count * SHAPE_BYTES_MAX) / size);
    if (most < 4) throw bad(`${name} takes ${size} bytes; a hello has room for ${SHAPE_BYTES_MAX}`);
  }
}

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

/** The corners of all triangles, three for each. @param {BufferGeometry[]} geometries */
function cornersOf(geometries) {
  /** @type {Three[]} */
  const corners = [];
  for (const geometry of geometries) {
    const position = geometry.getAttribute('position');
    if (!position) continue;
    const index = geometry.getIndex();
    const count = 3 * Math.floor((index ? index.count : position.count) / 3);
    for (let k = 0; k < count; k++) {
      const at = index ? index.getX(k) : k;
      corners.push([position.getX(at), position.getY(at), position.getZ(at)]);
    }
  }
  return corners;
}

/** Triangles with the corners that they share. @param {Three[]} corners @returns {Triangles} */
function welded(corners) {
  /** @type {Map<string, number>} */
  const numbers = new Map();
  /** @type {Three[]} */
  const vertices = [];
  const numberOf = (/** @type {Three} */ point) => {
    const key = point.join(' ');
    let number = numbers.get(key);
    if (number === undefined) {
      number = vertices.push(point) - 1;
      numbers.set(key, number);
    }
    return number;
  };
  /** @type {Three[]} */
  const triangles = [];
  for (let k = 0; k < corners.length; k += 3) {
    const [a, b, c] = [numberOf(corners[k]), numberOf(corners[k + 1]), numberOf(corners[k + 2])];
    if (a !== b && b !== c && c !== a) triangles.push([a, b, c]);
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
