// Files of meshes as shapes of the hello. The balls of tests/meshes are those of the Python client's tests: trimesh wrote them.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { BoxGeometry, Group, Mesh, SphereGeometry, TorusGeometry } from 'three';
import { STLExporter } from 'three/addons/exporters/STLExporter.js';
import { SHAPE_BYTES_MAX, TRIANGLES_MAX, readMesh } from '../src/meshes.js';

/** @param {string} name @returns {Promise<ArrayBuffer>} */
async function fileOf(name) {
  const bytes = await readFile(new URL(`meshes/${name}`, import.meta.url));
  return bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
}

const text = (/** @type {string} */ words) => new TextEncoder().encode(words).buffer;

/** Six times the volume, by the corners as they are turned. @param {import('../src/meshes.js').MeshShape} mesh */
function volume({ vertices_mm: v, triangles }) {
  let sum = 0;
  for (const [a, b, c] of triangles.map((t) => t.map((k) => v[k]))) {
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum / 6;
}

for (const ending of ['stl', 'obj', 'ply', 'glb']) {
  test(`a ball of 6 mm in .${ending} is that ball`, async () => {
    const { shape: mesh, notes, decimatedMm } = await readMesh(await fileOf(`ball.${ending}`), `ball.${ending.toUpperCase()}`);
    assert.deepEqual([notes, decimatedMm], [[], 0]);
    // Corners that coincide are one: half as many as triangles, and two.
    assert.deepEqual([mesh.shape, mesh.triangles.length, mesh.vertices_mm.length], ['mesh', 320, 162]);
    for (const vertex of mesh.vertices_mm) assert.ok(Math.abs(Math.hypot(...vertex) - 6) < 2e-4, String(vertex));
    const due = (4 / 3) * Math.PI * 6 ** 3;
    assert.ok(volume(mesh) < due && volume(mesh) > 0.95 * due, `${volume(mesh)} mm3`);
    for (const triangle of mesh.triangles) assert.ok(triangle.every((k) => k >= 0 && k < 162));
  });
}

test('a unit is taken, and a size that looks wrong is asked about', async () => {
  const [stl, glb] = [await fileOf('ball.stl'), await fileOf('ball.glb')];
  const greatest = (/** @type {import('../src/meshes.js').FileMesh} */ { shape }) => Math.max(...shape.vertices_mm.map(([x]) => x));
  const inch = await readMesh(stl, 'ball.stl', { unit: 'in' });
  assert.ok(Math.abs(greatest(inch) / greatest(await readMesh(stl, 'ball.stl')) - 25.4) < 1e-9);
  const words = { code: 'bad_contact', message: /would measure 1200 mm.*'unit'/ };
  await assert.rejects(readMesh(text('v 0 0 0\nv 1200 0 0\nv 0 9 0\nf 1 2 3\n'), 'large.obj'), words);
  await assert.rejects(readMesh(glb, 'ball.glb', { unit: /** @type {any} */ ('feet') }), { message: /'feet' is none of mm, cm, m, in/ });
});

test('axes of a scene are turned as poses are', async () => {
  const { shape: file } = await readMesh(text('v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n'), 'a.obj');
  const { shape: scene } = await readMesh(text('v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n'), 'a.obj', { axes: 'scene' });
  scene.vertices_mm.forEach((vertex, k) => {
    const [x, y, z] = file.vertices_mm[k];
    [z, x, y].forEach((due, axis) => assert.ok(Math.abs(vertex[axis] - due) < 1e-12));
  });
  assert.ok(volume(file) > 0 && Math.abs(volume(scene) - volume(file)) < 1e-12);
});

test('objects of a GLB stand where their nodes say', async () => {
  const { GLTFExporter } = await import('three/addons/exporters/GLTFExporter.js');
  // The exporter wants a browser's reader of blobs.
  Object.assign(globalThis, { FileReader: class {
    /** @param {Blob} blob */
    async readAsArrayBuffer(blob) {
      Object.assign(this, { result: await blob.arrayBuffer() });
      /** @type {any} */ (this).onloadend();
    }
  } });
  const part = new Mesh(new BoxGeometry(0.002, 0.002, 0.002));
  part.position.set(0.01, 0, 0);
  const turned = new Group().add(part);
  turned.rotation.z = Math.PI / 2;
  const bytes = /** @type {ArrayBuffer} */ (await new GLTFExporter().parseAsync(turned, { binary: true }));
  const { shape: { vertices_mm: v, triangles } } = await readMesh(bytes, 'part.glb');
  assert.deepEqual([v.length, triangles.length], [8, 12]);
  for (const [x, y, z] of v) assert.ok(Math.abs(Math.abs(x) - 1) < 1e-4 && Math.abs(Math.abs(y - 10) - 1) < 1e-4 && Math.abs(Math.abs(z) - 1) < 1e-4);
});

test('what is no mesh is named', async () => {
  await assert.rejects(readMesh(text(''), 'part.step'), { code: 'bad_contact', message: /part\.step: none of \.stl, \.obj, \.ply, \.glb/ });
  await assert.rejects(readMesh(text('v 0 0 0\n'), 'points.obj'), { message: /points\.obj holds no triangle/ });
  await assert.rejects(readMesh(text('glTF nothing'), 'cut.glb'), { message: /cut\.glb cannot be read/ });
  const nan = 'v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n';
  await assert.rejects(readMesh(text(nan), 'nan.obj'), { message: /not finite/ });
  const flat = 'v 0 0 0\nv 1 0 0\nf 1 2 2\n';
  await assert.rejects(readMesh(text(flat), 'flat.obj'), { message: /flat\.obj holds no triangle with an area/ });
});

/** How many edges have not two triangles. @param {import('../src/meshes.js').MeshShape} mesh */
function oddEdges({ triangles }) {
  /** @type {Map<string, number>} */
  const counts = new Map();
  for (const t of triangles) {
    for (let k = 0; k < 3; k++) {
      const edge = [t[k], t[(k + 1) % 3]].sort((a, b) => a - b).join(' ');
      counts.set(edge, (counts.get(edge) ?? 0) + 1);
    }
  }
  return [...counts.values()].filter((count) => count !== 2).length;
}

/** A geometry as the STL that a program would write. @param {import('three').BufferGeometry[]} geometries */
function stlOf(...geometries) {
  const group = new Group();
  for (const geometry of geometries) group.add(new Mesh(geometry));
  return /** @type {ArrayBuffer} */ (new STLExporter().parse(group, { binary: true }).buffer);
}

/** Points all over its triangles. @param {import('../src/meshes.js').MeshShape} mesh */
function* pointsOn({ vertices_mm: v, triangles }) {
  for (const [a, b, c] of triangles.map((t) => t.map((k) => v[k]))) {
    for (const [p, q] of [[1, 0], [0, 1], [0, 0], [1 / 3, 1 / 3], [0.5, 0], [0, 0.5], [0.5, 0.5]]) yield a.map((x, k) => x + p * (b[k] - x) + q * (c[k] - x));
  }
}

/** @type {[string, import('three').BufferGeometry, number, (p: number[]) => number, number][]} */
const SMOOTH = [
  ['a ball', new SphereGeometry(10, 320, 160), 2, ([x, y, z]) => Math.hypot(x, y, z) - 10, (4 / 3) * Math.PI * 10 ** 3],
  ['a torus', new TorusGeometry(10, 3, 160, 320), 0, ([x, y, z]) => Math.hypot(Math.hypot(x, y) - 10, z) - 3, 2 * Math.PI ** 2 * 10 * 3 ** 2],
];
for (const [name, geometry, euler, offMm, dueMm3] of SMOOTH) {
  test(`${name} of 100 000 triangles becomes one that a hello holds, stays closed, and its distance is said`, async () => {
    const { shape, notes, decimatedMm, trianglesRead } = await readMesh(stlOf(geometry), 'fine.stl');
    assert.ok(trianglesRead > 100_000 && JSON.stringify(shape).length <= SHAPE_BYTES_MAX);
    // Not far fewer than fit.
    assert.ok(shape.triangles.length <= TRIANGLES_MAX && shape.triangles.length > 0.9 * TRIANGLES_MAX, `${shape.triangles.length}`);
    assert.deepEqual(notes.slice(-1), [`${trianglesRead} triangles became ${shape.triangles.length}: at most ${Number(decimatedMm.toPrecision(3))} mm off`]);
    assert.equal(oddEdges(shape), 0);
    assert.equal(shape.vertices_mm.length - shape.triangles.length / 2, euler, 'no handle came or went');
    // So far the facets of the file lie below the smooth surface: by the height of an arc, once for each way round.
    const faceted = 2 * 13 * (1 - Math.cos(Math.PI / 320));
    let greatest = 0;
    for (const point of pointsOn(shape)) greatest = Math.max(greatest, Math.abs(offMm(point)));
    // Sampled points need not hit the place that is farthest off.
    assert.ok(greatest < 1.1 * decimatedMm + faceted && greatest > 0.5 * decimatedMm, `${greatest} mm from the smooth surface, ${decimatedMm} said`);
    assert.ok(decimatedMm < 0.03, `${decimatedMm} mm`);
    assert.ok(Math.abs(volume(shape) / dueMm3 - 1) < 2e-3, `${volume(shape)} of ${dueMm3} mm3`);
  });
}

test('a surface that is open, or whose sheets share an edge, is decimated too', async () => {
  const cup = await readMesh(stlOf(new SphereGeometry(10, 320, 160, 0, 2 * Math.PI, 0, Math.PI / 2)), 'cup.stl');
  assert.ok(cup.shape.triangles.length <= TRIANGLES_MAX && cup.decimatedMm < 0.03, `${cup.decimatedMm}`);
  for (const [x, y, z] of cup.shape.vertices_mm) assert.ok(Math.abs(Math.hypot(x, y, z) - 10) < 0.03 && y > -0.03);
  // Two boxes that touch along an edge: four triangles have it.
  const boxes = [new BoxGeometry(10, 10, 10, 60, 60, 60), new BoxGeometry(10, 10, 10, 60, 60, 60).translate(10, 10, 0)];
  const pair = await readMesh(stlOf(...boxes), 'pair.stl');
  assert.ok(pair.trianglesRead === 86_400 && pair.shape.triangles.length <= TRIANGLES_MAX, pair.notes.join());
  assert.ok(pair.decimatedMm < 0.06 && Math.abs(volume(pair.shape) - 2000) < 0.1, `${pair.decimatedMm} mm, ${volume(pair.shape)} mm3`);
});

test('a mesh that cannot be reduced so far is refused by its name', async () => {
  const many = `v 0 0 0\nv 9 0 0\nv 0 9 0\n${'f 1 2 3\n'.repeat(16385)}`;
  const words = /^bad_contact: many\.obj has 16385 triangles, of which 16384 fit into a hello; it cannot be reduced below 16385: decimate it by a mesh program/;
  await assert.rejects(readMesh(text(many), 'many.obj'), { code: 'bad_contact', message: words });
});

test('small bodies that have no triangle to spare go as a whole, which the distance says', async () => {
  const four = Array.from({ length: 5000 }, (_, k) => {
    const [x, y] = [(k % 100) / 5, Math.floor(k / 100) / 5];
    const [a, b, c, d] = [1, 2, 3, 4].map((n) => 4 * k + n);
    return `v ${x} ${y} 0\nv ${x + 0.1} ${y} 0\nv ${x} ${y + 0.1} 0\nv ${x} ${y} 0.1\nf ${a} ${c} ${b}\nf ${a} ${b} ${d}\nf ${b} ${c} ${d}\nf ${c} ${a} ${d}\n`;
  });
  const { shape, decimatedMm } = await readMesh(text(four.join('')), 'gravel.obj');
  assert.equal(oddEdges(shape), 0);
  // Each that stays is whole: it has four triangles and as many corners.
  assert.equal(shape.vertices_mm.length, shape.triangles.length);
  // Lost bodies stood farther from what stays than one of them is long.
  assert.ok(decimatedMm > 0.1, `${decimatedMm} mm`);
});

test('what a hello holds is counted in bytes, by default those of the JSON', async () => {
  const { shape } = await readMesh(await fileOf('ball.stl'), 'ball.stl');
  const bytesOf = (/** @type {import('../src/meshes.js').MeshShape} */ { triangles }) => 4000 * triangles.length;
  const fewer = await readMesh(await fileOf('ball.stl'), 'ball.stl', { bytesOf });
  assert.ok(fewer.shape.triangles.length <= SHAPE_BYTES_MAX / 4000 && fewer.shape.triangles.length > 0.9 * (SHAPE_BYTES_MAX / 4000), fewer.notes.join());
  assert.ok(shape.triangles.length === 320 && oddEdges(fewer.shape) === 0);
  await assert.rejects(readMesh(await fileOf('ball.stl'), 'ball.stl', { bytesOf: () => 1e9 }), { message: /ball\.stl takes 1000000000 bytes; a hello has room for 507904/ });
});

test('coordinates have four decimals, and those of a body whose unit was said wrongly more', async () => {
  const [ball, small] = [await readMesh(await fileOf('ball.stl'), 'ball.stl'), await readMesh(await fileOf('ball.glb'), 'ball.glb', { unit: 'mm' })];
  for (const [k, p] of ball.shape.vertices_mm.entries()) {
    p.forEach((x, axis) => assert.ok(Math.abs(1e4 * x - Math.round(1e4 * x)) < 1e-6 && Math.abs(1e3 * small.shape.vertices_mm[k][axis] - x) < 6e-4, `${p}`));
  }
});
