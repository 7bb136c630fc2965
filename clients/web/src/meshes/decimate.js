// Fewer triangles for a mesh that has too many, and how far its surface has moved by that.

/*!
 * meshoptimizer: Copyright (C) 2016-2026 Arseny Kapoulkine. SPDX-License-Identifier: MIT
 * three-mesh-bvh: Copyright (C) 2018 Garrett Johnson. SPDX-License-Identifier: MIT
 */

import { MeshoptSimplifier } from 'meshoptimizer/simplifier';
import { BufferAttribute, BufferGeometry, MathUtils, Mesh, Vector3 } from 'three';
import { MeshSurfaceSampler } from 'three/addons/math/MeshSurfaceSampler.js';
import { MeshBVH } from 'three-mesh-bvh';
import { refusal } from '../error.js';

/** @typedef {[number, number, number]} Three */
/** @typedef {{vertices: Three[], triangles: Three[]}} Triangles vertices in mm, and triangles with shared vertices */

/** Points on each of the two surfaces, beside its vertices, from which the distance to the other is measured: one for each triangle that is left. */
const SAMPLES = 16000;
const SEED = 1;
/**
 * Ways to decimate, the first that keeps a closed surface closed is taken. Regular triangles come first: long thin ones
 * would cost the service more in every frame.
 * @type {import('meshoptimizer/simplifier').SimplifierFlags[][]}
 */
const WAYS = [['RegularizeLight'], ['Regularize'], []];
/** The number of triangles bounds the decimation, and no error, which is measured afterwards. */
const ANY_ERROR = 1e9;

/**
 * The mesh with `most` triangles at most. Vertices move to where they keep the surface best.
 * @param {Triangles} mesh @param {number} most @param {string} name
 * @returns {Promise<Triangles>} rejected with a PapillaError if it has to be opened for that, or cannot be reduced so far
 */
export async function decimated(mesh, most, name) {
  const given = `${name} has ${mesh.triangles.length} triangles, of which ${most} fit into a hello`;
  try {
    await MeshoptSimplifier.ready;
  } catch (error) {
    throw bad(`${given}; WebAssembly, which would reduce them, does not run: ${error instanceof Error ? error.message : String(error)}`);
  }
  const isClosed = closed(mesh.triangles);
  let fewest = Infinity;
  for (const way of WAYS) {
    const fewer = simplified(mesh, most, way, isClosed);
    fewest = Math.min(fewest, fewer.triangles.length);
    if (fewer.triangles.length >= 4 && fewer.triangles.length <= most && (!isClosed || closed(fewer.triangles))) return fewer;
  }
  if (fewest > most) throw bad(`${given}; it cannot be reduced below ${fewest}: decimate it by a mesh program, or leave parts out`);
  throw bad(`${name}: decimation to ${most} triangles opens the surface; decimate it by a mesh program`);
}

/**
 * Greatest distance, mm, of the vertices and of sampled points of each surface from the other. @param {Triangles} one
 * @param {Triangles} other
 */
export function distanceMm(one, other) {
  const middle = middleOf(one.vertices);
  const surfaces = [one, other].map((mesh) => geometryOf(mesh, middle));
  const [point, nearest] = [new Vector3(), { point: new Vector3(), distance: 0, faceIndex: 0 }];
  let greatest = 0;
  surfaces.forEach((geometry, k) => {
    // It sorts the triangles of its geometry, which the sampler does not mind.
    const tree = new MeshBVH(surfaces[1 - k]);
    const look = () => { greatest = Math.max(greatest, tree.closestPointToPoint(point, nearest)?.distance ?? Infinity); };
    const positions = geometry.getAttribute('position');
    for (let n = 0; n < positions.count; n++) {
      point.fromBufferAttribute(positions, n);
      look();
    }
    MathUtils.seededRandom(SEED);
    const sampler = new MeshSurfaceSampler(new Mesh(geometry)).build();
    // Its types lack it.
    /** @type {any} */ (sampler).setRandomGenerator(() => MathUtils.seededRandom());
    for (let n = 0; n < SAMPLES; n++) {
      sampler.sample(point);
      look();
    }
  });
  return greatest;
}

const bad = (/** @type {string} */ message) => refusal('bad_contact', message);

/**
 * What meshoptimizer makes of it in one way. @param {Triangles} mesh @param {number} most
 * @param {import('meshoptimizer/simplifier').SimplifierFlags[]} way @param {boolean} isClosed @returns {Triangles}
 */
function simplified(mesh, most, way, isClosed) {
  // About its middle, since meshoptimizer computes in 32 bits.
  const middle = middleOf(mesh.vertices);
  const [positions, indices] = [positionsOf(mesh.vertices, middle), Uint32Array.from(mesh.triangles.flat())];
  const [count] = MeshoptSimplifier.simplifyWithUpdate(indices, positions, 3, new Float32Array(0), 0, [], null, 3 * most, ANY_ERROR, ['ErrorAbsolute', ...way]);
  /** @type {Map<number, number>} */
  const numbers = new Map();
  /** @type {Three[]} */
  const vertices = [];
  const corner = (/** @type {number} */ at) => {
    let number = numbers.get(at);
    if (number === undefined) {
      const moved = middle.map((x, axis) => x + positions[3 * at + axis]);
      number = vertices.push(/** @type {Three} */ (moved)) - 1;
      numbers.set(at, number);
    }
    return number;
  };
  /** @type {Three[]} */
  const triangles = [];
  const left = indices.subarray(0, count);
  for (const [a, b, c] of isClosed ? withoutFlakes(left) : threes(left)) triangles.push([corner(a), corner(b), corner(c)]);
  return { vertices, triangles };
}

/** @param {Uint32Array} indices @returns {Generator<Three>} */
function* threes(indices) {
  for (let k = 0; k < indices.length; k += 3) yield [indices[k], indices[k + 1], indices[k + 2]];
}

/** Triangles but for those that lie on each other, face to face: what is left of a small body that went. @param {Uint32Array} indices */
function withoutFlakes(indices) {
  /** @type {Map<string, Three>} */
  const found = new Map();
  for (const [a, b, c] of threes(indices)) {
    const least = Math.min(a, b, c);
    const [first, second, third] = least === a ? [a, b, c] : least === b ? [b, c, a] : [c, a, b];
    if (!found.delete(`${first} ${third} ${second}`)) found.set(`${first} ${second} ${third}`, [a, b, c]);
  }
  return found.values();
}

/** Whether each edge has two triangles. @param {Three[]} triangles */
function closed(triangles) {
  /** @type {Map<number, number>} */
  const counts = new Map();
  for (const triangle of triangles) {
    for (let k = 0; k < 3; k++) {
      const [a, b] = [triangle[k], triangle[(k + 1) % 3]];
      const edge = Math.min(a, b) * 2 ** 26 + Math.max(a, b);
      counts.set(edge, (counts.get(edge) ?? 0) + 1);
    }
  }
  for (const count of counts.values()) if (count !== 2) return false;
  return true;
}

/** The middle of their box. @param {Three[]} vertices @returns {Three} */
function middleOf(vertices) {
  /** @type {[Three, Three]} */
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (const vertex of vertices) {
    for (let axis = 0; axis < 3; axis++) {
      low[axis] = Math.min(low[axis], vertex[axis]);
      high[axis] = Math.max(high[axis], vertex[axis]);
    }
  }
  return /** @type {Three} */ (low.map((x, axis) => (x + high[axis]) / 2));
}

/** @param {Three[]} vertices @param {Three} middle */
function positionsOf(vertices, middle) {
  const positions = new Float32Array(3 * vertices.length);
  vertices.forEach((vertex, k) => positions.set(vertex.map((x, axis) => x - middle[axis]), 3 * k));
  return positions;
}

/** @param {Triangles} mesh @param {Three} middle */
function geometryOf({ vertices, triangles }, middle) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positionsOf(vertices, middle), 3));
  return geometry.setIndex(new BufferAttribute(Uint32Array.from(triangles.flat()), 1));
}
