// Objects to touch: each a mesh, a signed distance in its own frame (mm, y up, the origin in its middle), a stiffness, and
// the shape that the server is told of.

import { CapsuleGeometry, Color, Mesh, MeshLambertMaterial, SphereGeometry } from 'three';
import { RoundedBoxGeometry } from 'three/addons/geometries/RoundedBoxGeometry.js';

/**
 * @typedef {object} Touchable
 * @property {string} name
 * @property {(x: number, y: number, z: number) => number} distanceMm negative inside
 * @property {number} objectPaPerMm stiffness; Infinity: rigid
 * @property {Mesh} mesh scaled from mm to the world
 * @property {number} reachMm radius around its middle
 * @property {import('../src/types.js').Shape} shape of docs/reference/indenters.md
 */

const ROUND_MM = 1.5;

/** @param {number} radius */
const sphere = (radius) => (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ z) => Math.hypot(x, y, z) - radius;

/** @param {number} half @param {number} halfHeight */
const block = (half, halfHeight) => (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ z) => {
  const [qx, qy, qz] = [Math.abs(x) - half + ROUND_MM, Math.abs(y) - halfHeight + ROUND_MM, Math.abs(z) - half + ROUND_MM];
  return Math.hypot(Math.max(qx, 0), Math.max(qy, 0), Math.max(qz, 0)) + Math.min(0, Math.max(qx, qy, qz)) - ROUND_MM;
};

/** A bar along x. @param {number} radius @param {number} half */
const bar = (radius, half) => (/** @type {number} */ x, /** @type {number} */ y, /** @type {number} */ z) =>
  Math.hypot(Math.max(0, Math.abs(x) - half), y, z) - radius;

/** A ball. @param {number} radius */
const ballShape = (radius) => ({ shape: 'sphere', radius_mm: radius });

/** A block, along its own z (up in the world) as high as two plates that overlap. @param {number} half @param {number} halfHeight */
const blockShape = (half, halfHeight) => {
  const part = { shape: 'plate', size_mm: [2 * half, 2 * half], edge_radius_mm: ROUND_MM };
  const off = halfHeight - 2 - ROUND_MM;
  return { shape: 'union', parts: [off, -off].map((z) => ({ part, at_mm: [0, 0, z] })) };
};

/** A bar along its own y (the world's x). @param {number} radius @param {number} half */
const barShape = (radius, half) => ({ shape: 'cylinder', radius_mm: radius, length_mm: 2 * (half + radius), end_radius_mm: radius });

/** Between the middles of neighbours, in the world's units. */
export const SPACING = 0.34;

/**
 * @param {number} mmToWorld
 * @returns {Touchable[]}
 */
export function makeObjects(mmToWorld) {
  const capsule = new CapsuleGeometry(2, 14, 8, 24).rotateZ(Math.PI / 2);
  const kinds = /** @type {const} */ ([
    ['hard ball', sphere(9), Infinity, new SphereGeometry(9, 40, 28), 0xb9c4cf, 9, ballShape(9)],
    ['soft ball', sphere(9), 4000, new SphereGeometry(9, 40, 28), 0x7fae6b, 9, ballShape(9)],
    ['hard block', block(9, 6), Infinity, new RoundedBoxGeometry(18, 12, 18, 6, ROUND_MM), 0xa9875f, 15, blockShape(9, 6)],
    ['soft cushion', block(9, 6), 4000, new RoundedBoxGeometry(18, 12, 18, 6, ROUND_MM), 0xc98fa8, 15, blockShape(9, 6)],
    ['thin bar', bar(2, 7), Infinity, capsule, 0x8a93a8, 10, barShape(2, 7)],
  ]);
  return kinds.map(([name, distanceMm, objectPaPerMm, geometry, colour, reachMm, shape], n) => {
    const mesh = new Mesh(geometry, new MeshLambertMaterial({ color: new Color(colour) }));
    mesh.name = name;
    mesh.scale.setScalar(mmToWorld);
    mesh.position.set((n - 2) * SPACING, 0.98, -0.75);
    return { name, distanceMm, objectPaPerMm, mesh, reachMm, shape };
  });
}
