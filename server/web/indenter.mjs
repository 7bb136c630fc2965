// Meshes of the indenters, in their own frame: x along the first tangent, y along the second, z out
// of the finger; the lowest point at the origin; mm. And of the arrow that shows a force.

import { surfaceMesh } from './shapes.mjs';

const PLATE_MM = { half: 10, thick: 1.2 };
const BAR_HALF_MM = 10;
const ROUND = 48;
/** Radii of an arrow, and where its head begins: shares of its length. */
const ARROW = { shaftMm: 0.45, headMm: 1.1, head: 0.35 };

/** Interleaved positions and normals (6 floats a vertex), plain triangles, of a press's indenter. */
export function indenterMesh({ shape, sizeMm, body }) {
  const vertices = [];
  if (shape === 'plate') box(vertices);
  else if (shape === 'sphere') sphere(vertices, sizeMm);
  else if (shape === 'cylinder') bar(vertices, sizeMm);
  else if (shape === 'mesh') facets(vertices, body);
  else return surfaceMesh(body);
  return Float32Array.from(vertices);
}

/** An arrow along z, one long, its tip at the origin; radii in mm. */
export function arrowMesh() {
  const vertices = [];
  const { shaftMm, headMm, head } = ARROW;
  const profile = [[0, -1], [shaftMm, -1], [shaftMm, -head], [headMm, -head], [0, 0]];
  const at = ([radius, z], round) => [radius * Math.cos(round), radius * Math.sin(round), z];
  for (let k = 0; k + 1 < profile.length; k++) {
    const [from, to] = [profile[k], profile[k + 1]];
    // A cap looks along z, all else away from the axis.
    const out = from[1] === to[1] ? () => [0, 0, -1] : (round) => [Math.cos(round), Math.sin(round), 0];
    for (let j = 0; j < ROUND; j++) {
      const [a, b] = [(j * 2 * Math.PI) / ROUND, ((j + 1) * 2 * Math.PI) / ROUND];
      quad(vertices, [at(from, a), at(from, b), at(to, b), at(to, a)], [out(a), out(b), out(b), out(a)]);
    }
  }
  return Float32Array.from(vertices);
}

/** A mesh as it is, turned about x so that its side towards +z comes down on the finger. */
function facets(out, { hello, faceMm }) {
  for (const triangle of hello.triangles) {
    const [a, b, c] = triangle.map((k) => hello.vertices_mm[k]).map(([x, y, z]) => [x, -y, faceMm - z]);
    const [u, v] = [b, c].map((corner) => corner.map((x, axis) => x - a[axis]));
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const length = Math.hypot(...normal) || 1;
    for (const corner of [a, b, c]) out.push(...corner, ...normal.map((x) => x / length));
  }
}

function quad(out, corners, normals) {
  for (const k of [0, 1, 2, 0, 2, 3]) out.push(...corners[k], ...normals[k]);
}

function box(out) {
  const { half, thick } = PLATE_MM;
  const point = (axis, side, a, b) => {
    const p = [0, 0, 0];
    p[axis] = side;
    p[(axis + 1) % 3] = a;
    p[(axis + 2) % 3] = b;
    return [p[0] * half, p[1] * half, (p[2] + 1) * 0.5 * thick];
  };
  for (let axis = 0; axis < 3; axis++) {
    for (const side of [-1, 1]) {
      const normal = [0, 0, 0];
      normal[axis] = side;
      const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([a, b]) => point(axis, side, a, b));
      quad(out, corners, [normal, normal, normal, normal]);
    }
  }
}

function sphere(out, radius) {
  const point = (i, j) => {
    const [polar, round] = [(i * Math.PI) / (ROUND / 2), (j * 2 * Math.PI) / ROUND];
    const n = [Math.sin(polar) * Math.cos(round), Math.sin(polar) * Math.sin(round), -Math.cos(polar)];
    return { n, p: [radius * n[0], radius * n[1], radius * (n[2] + 1)] };
  };
  for (let i = 0; i < ROUND / 2; i++) {
    for (let j = 0; j < ROUND; j++) {
      const corners = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
      quad(out, corners.map((c) => c.p), corners.map((c) => c.n));
    }
  }
}

function bar(out, radius) {
  const point = (j, y) => {
    const round = (j * 2 * Math.PI) / ROUND;
    const n = [Math.sin(round), 0, -Math.cos(round)];
    return { n, p: [radius * n[0], y, radius * (n[2] + 1)] };
  };
  for (let j = 0; j < ROUND; j++) {
    const corners = [point(j, -BAR_HALF_MM), point(j + 1, -BAR_HALF_MM), point(j + 1, BAR_HALF_MM), point(j, BAR_HALF_MM)];
    quad(out, corners.map((c) => c.p), corners.map((c) => c.n));
  }
}
