// A visitor's own STL or GLB as the service takes meshes: vertices in mm, triangles that share them and
// bound a body.

import { mended } from './mend.mjs';

const MOST_TRIANGLES = 16384;
const GLB_MAGIC = 0x46546c67;
const GLB_JSON = 0x4e4f534a;
const GLB_BIN = 0x004e4942;
const FLOAT = 5126;
const INDEX = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array };
const TRIANGLES = 4;
export const MM_PER_M = 1000;
const STL_HEAD = 84;
const STL_FACET = 50;
/** Corners closer than this share of the greatest side are one vertex. */
const WELD = 1e-5;

/** The mesh in a file: vertices in mm about the middle of their box, triangles, and what was mended. Throws an Error that says what is wrong with it. */
export function meshOf(buffer, name) {
  const view = new DataView(buffer);
  const isGlb = buffer.byteLength >= 12 && view.getUint32(0, true) === GLB_MAGIC;
  if (!isGlb && !/\.stl$/i.test(name)) throw new Error(`${name} is neither an STL nor a GLB file`);
  const corners = isGlb ? cornersOfGlb(buffer, view) : cornersOfStl(buffer, view);
  if (corners.length === 0) throw new Error(`${name} holds no triangle`);
  const count = corners.length / 9;
  if (count > MOST_TRIANGLES) throw new Error(`${name} has ${count} triangles; a mesh may have ${MOST_TRIANGLES} at most: reduce it first`);
  if (corners.some((x) => !Number.isFinite(x))) throw new Error(`${name} holds a coordinate that is not finite`);
  const mesh = mended({ name, ...welded(corners) });
  if (mesh.triangles.length > MOST_TRIANGLES) throw new Error(`${name} has holes, and closed it would have ${mesh.triangles.length} triangles; a mesh may have ${MOST_TRIANGLES} at most: reduce it first`);
  const flat = count - mesh.given;
  if (flat > 0) mesh.said.unshift(`${flat} ${flat === 1 ? 'triangle' : 'triangles'} without area left out`);
  return mesh;
}

function cornersOfStl(buffer, view) {
  const facets = buffer.byteLength >= STL_HEAD ? view.getUint32(80, true) : 0;
  if (facets > 0 && buffer.byteLength === STL_HEAD + STL_FACET * facets) {
    const corners = new Float64Array(9 * facets);
    for (let n = 0; n < facets; n++) {
      for (let k = 0; k < 9; k++) corners[9 * n + k] = view.getFloat32(STL_HEAD + STL_FACET * n + 12 + 4 * k, true);
    }
    return corners;
  }
  const text = new TextDecoder().decode(buffer);
  const found = text.matchAll(/vertex\s+(\S+)\s+(\S+)\s+(\S+)/g);
  const corners = Float64Array.from(Array.from(found, (match) => match.slice(1, 4).map(Number)).flat());
  if (corners.length % 9 !== 0) throw new Error('the STL file ends within a triangle');
  return corners;
}

function cornersOfGlb(buffer, view) {
  let [json, bin] = [null, null];
  for (let at = 12; at + 8 <= buffer.byteLength;) {
    const [length, type] = [view.getUint32(at, true), view.getUint32(at + 4, true)];
    if (at + 8 + length > buffer.byteLength) throw new Error('the GLB file is cut off');
    if (type === GLB_JSON) json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, at + 8, length)));
    if (type === GLB_BIN) bin = { offset: at + 8, length };
    at += 8 + length;
  }
  if (!json || !bin) throw new Error('the GLB file lacks its scene or its data');
  const out = [];
  const visit = (index, parent) => {
    const node = json.nodes[index];
    const matrix = multiply(parent, matrixOf(node));
    if (node.mesh !== undefined) for (const primitive of json.meshes[node.mesh].primitives) addPrimitive(out, buffer, bin, json, primitive, matrix);
    for (const child of node.children ?? []) visit(child, matrix);
  };
  const roots = json.scenes?.[json.scene ?? 0]?.nodes ?? json.nodes.map((_, k) => k);
  for (const root of roots) visit(root, IDENTITY);
  return Float64Array.from(out);
}

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

function matrixOf({ matrix, translation = [0, 0, 0], rotation = [0, 0, 0, 1], scale = [1, 1, 1] }) {
  if (matrix) return matrix;
  const [x, y, z, w] = rotation;
  const columns = [
    [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
    [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
    [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
  ];
  return [...columns.flatMap((column, k) => [...column.map((c) => c * scale[k]), 0]), ...translation, 1];
}

function multiply(a, b) {
  const out = [];
  for (let column = 0; column < 4; column++) {
    for (let row = 0; row < 4; row++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
      out.push(sum);
    }
  }
  return out;
}

function addPrimitive(out, buffer, bin, json, primitive, m) {
  if ((primitive.mode ?? TRIANGLES) !== TRIANGLES) throw new Error('the GLB file holds strips, lines or points; triangles are due');
  const packed = primitive.extensions?.KHR_draco_mesh_compression ?? json.extensionsRequired?.find((name) => /compression/.test(name));
  if (packed) throw new Error('the GLB file is compressed; export it without compression');
  const place = (index) => {
    const accessor = json.accessors[index];
    const { byteOffset = 0, byteStride } = json.bufferViews[accessor.bufferView];
    return { accessor, at: bin.offset + byteOffset + (accessor.byteOffset ?? 0), byteStride };
  };
  const position = place(primitive.attributes.POSITION);
  if (position.accessor.componentType !== FLOAT) throw new Error('the GLB file has quantised positions; export it with floats');
  const view = new DataView(buffer);
  const vertex = (k) => {
    const at = position.at + k * (position.byteStride ?? 12);
    const [x, y, z] = [0, 4, 8].map((more) => view.getFloat32(at + more, true));
    return [0, 1, 2].map((row) => MM_PER_M * (m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]));
  };
  let indices = Array.from({ length: position.accessor.count }, (_, k) => k);
  if (primitive.indices !== undefined) {
    const { accessor, at } = place(primitive.indices);
    const Kind = INDEX[accessor.componentType];
    indices = Array.from(new Kind(buffer.slice(at, at + accessor.count * Kind.BYTES_PER_ELEMENT)));
  }
  for (const index of indices) out.push(...vertex(index));
}

/** Corners that coincide become one vertex; triangles without area go. */
function welded(corners) {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let k = 0; k < corners.length; k++) {
    low[k % 3] = Math.min(low[k % 3], corners[k]);
    high[k % 3] = Math.max(high[k % 3], corners[k]);
  }
  const side = Math.max(...high.map((x, axis) => x - low[axis]));
  if (!(side > 0)) throw new Error('the mesh has no size');
  const cell = side * WELD;
  const numbers = new Map();
  const vertices = [];
  const indexOf = (k) => {
    const point = [0, 1, 2].map((axis) => corners[k + axis] - (low[axis] + high[axis]) / 2);
    const key = point.map((x) => Math.round(x / cell)).join(' ');
    if (!numbers.has(key)) {
      numbers.set(key, vertices.length);
      vertices.push(point);
    }
    return numbers.get(key);
  };
  const triangles = [];
  for (let k = 0; k < corners.length; k += 9) {
    const [a, b, c] = [indexOf(k), indexOf(k + 3), indexOf(k + 6)];
    if (a !== b && b !== c && c !== a) triangles.push([a, b, c]);
  }
  return { vertices_mm: vertices, triangles, given: triangles.length, sideMm: side };
}
