// Files of meshes as shapes of the hello. The balls of tests/meshes are those of the Python client's tests: trimesh wrote them.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { BoxGeometry, Group, Mesh } from 'three';
import { readMesh } from '../src/meshes.js';

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
    const mesh = await readMesh(await fileOf(`ball.${ending}`), `ball.${ending.toUpperCase()}`);
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
  const greatest = (/** @type {import('../src/meshes.js').MeshShape} */ mesh) => Math.max(...mesh.vertices_mm.map(([x]) => x));
  const inch = await readMesh(stl, 'ball.stl', { unit: 'in' });
  assert.ok(Math.abs(greatest(inch) / greatest(await readMesh(stl, 'ball.stl')) - 25.4) < 1e-9);
  const words = { code: 'bad_contact', message: /would measure 1200 mm.*'unit'/ };
  await assert.rejects(readMesh(text('v 0 0 0\nv 1200 0 0\nv 0 9 0\nf 1 2 3\n'), 'large.obj'), words);
  await assert.rejects(readMesh(glb, 'ball.glb', { unit: /** @type {any} */ ('feet') }), { message: /'feet' is none of mm, cm, m, in/ });
});

test('axes of a scene are turned as poses are', async () => {
  const file = await readMesh(text('v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n'), 'a.obj');
  const scene = await readMesh(text('v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n'), 'a.obj', { axes: 'scene' });
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
  const { vertices_mm: v, triangles } = await readMesh(bytes, 'part.glb');
  assert.deepEqual([v.length, triangles.length], [8, 12]);
  for (const [x, y, z] of v) assert.ok(Math.abs(Math.abs(x) - 1) < 1e-4 && Math.abs(Math.abs(y - 10) - 1) < 1e-4 && Math.abs(Math.abs(z) - 1) < 1e-4);
});

test('what is no mesh is named', async () => {
  await assert.rejects(readMesh(text(''), 'part.step'), { code: 'bad_contact', message: /part\.step: none of \.stl, \.obj, \.ply, \.glb/ });
  await assert.rejects(readMesh(text('v 0 0 0\n'), 'points.obj'), { message: /points\.obj holds no triangle/ });
  await assert.rejects(readMesh(text('glTF nothing'), 'cut.glb'), { message: /cut\.glb cannot be read/ });
  const nan = 'v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n';
  await assert.rejects(readMesh(text(nan), 'nan.obj'), { message: /not finite/ });
  const many = `v 0 0 0\nv 9 0 0\nv 0 9 0\n${'f 1 2 3\n'.repeat(16385)}`;
  await assert.rejects(readMesh(text(many), 'many.obj'), { message: /16385 triangles; a mesh may have 16384/ });
  // A strip of 16 384 triangles, whose coordinates have many digits: far from the origin they have too many bytes.
  const strip = (/** @type {number} */ scale, /** @type {number} */ from = 0) => {
    const at = (/** @type {number} */ k) => `v ${from + scale * (k / 8194)} ${from + scale * (((k % 2) + 1) / 3)} ${from + scale / 7}\n`;
    const face = (/** @type {number} */ k) => `f ${k + 1} ${k + 2} ${k + 3}\nf ${k + 1} ${k + 3} ${k + 2}\n`;
    return text([...Array.from({ length: 8194 }, (_, k) => at(k)), ...Array.from({ length: 8192 }, (_, k) => face(k))].join(''));
  };
  await assert.rejects(readMesh(strip(8, -400), 'strip.obj'), { message: /16384 triangles; a hello has room for 507904/ });
  const { vertices_mm: v, triangles } = await readMesh(strip(9), 'strip.obj');
  assert.equal(triangles.length, 16384);
  assert.ok(v.flat().every((x) => Math.abs(1e4 * x - Math.round(1e4 * x)) < 1e-6));
  // A body whose unit was said wrongly keeps its shape.
  const { vertices_mm: small } = await readMesh(strip(0.009), 'strip.obj', { unit: 'mm' });
  for (const [k, p] of small.entries()) p.forEach((x, axis) => assert.ok(Math.abs(1e3 * x - v[k][axis]) < 6e-4, `${p}`));
});
