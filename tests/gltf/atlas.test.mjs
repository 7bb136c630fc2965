// /v1/atlas.glb: valid by Khronos' validator, and the same vertices as /v1/atlas.
//   PAPILLA_URL=http://127.0.0.1:7224 npm test

import assert from "node:assert/strict";
import { test } from "node:test";

import validator from "gltf-validator";

const url = process.env.PAPILLA_URL ?? "http://127.0.0.1:7224";
const answer = await fetch(`${url}/v1/atlas.glb`);
const file = new Uint8Array(await answer.arrayBuffer());
const atlas = await (await fetch(`${url}/v1/atlas`)).json();

const view = new DataView(file.buffer);
const documentBytes = view.getUint32(12, true);
const gltf = JSON.parse(new TextDecoder().decode(file.subarray(20, 20 + documentBytes)));
const binaryAt = 20 + documentBytes + 8;

/** The vectors of an accessor, as lists of numbers. */
function vectors(number) {
  const accessor = gltf.accessors[number];
  const { byteOffset } = gltf.bufferViews[accessor.bufferView];
  const size = { SCALAR: 1, VEC2: 2, VEC3: 3 }[accessor.type];
  const at = (i) => accessor.componentType === 5126
    ? view.getFloat32(binaryAt + byteOffset + 4 * i, true)
    : view.getUint32(binaryAt + byteOffset + 4 * i, true);
  return Array.from({ length: accessor.count }, (_, i) =>
    Array.from({ length: size }, (_, axis) => at(size * i + axis)));
}

test("the validator finds nothing", async () => {
  assert.equal(answer.headers.get("content-type"), "model/gltf-binary");
  const report = await validator.validateBytes(file, { maxIssues: 0 });
  const { numErrors, numWarnings, messages } = report.issues;
  assert.deepEqual([numErrors, numWarnings], [0, 0], JSON.stringify(messages.slice(0, 5)));
  assert.equal(report.info.totalTriangleCount, 2 * atlas.triangles.length);
  assert.equal(report.info.hasTextures, true);
});

test("the validator would find something", async () => {
  const damaged = file.slice();
  damaged[binaryAt] ^= 0xff; // an index far beyond the vertices
  damaged[binaryAt + 3] ^= 0x7f;
  const report = await validator.validateBytes(damaged);
  assert.ok(report.issues.numErrors > 0);
});

test("the finger points ahead, its nail up, in metres", () => {
  const { rotation: [x, y, z, w], scale } = gltf.nodes.find(({ name }) => name === "finger");
  assert.deepEqual(scale, [0.001, 0.001, 0.001]);
  const back = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)];
  const nail = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)];
  assert.deepEqual([back, nail], [[0, 0, 1], [0, 1, 0]]);
});

test("vertices, triangles and pixels are the atlas's, in its order", () => {
  const close = (a, b, what) => assert.ok(Math.abs(a - b) < 1e-5 * Math.max(1, Math.abs(b)), what);
  assert.equal(gltf.asset.extras.atlas_hash, atlas.hash);
  for (const patch of ["skin", "interface"]) {
    const mesh = gltf.meshes.find(({ name }) => name === patch);
    const { attributes, indices } = mesh.primitives[0];
    const [positions, uvs, normals] =
      [attributes.POSITION, attributes.TEXCOORD_0, attributes.NORMAL].map(vectors);
    assert.deepEqual(vectors(indices).flat(), atlas.triangles.flat());
    for (const [i, due] of atlas[patch].positions_mm.entries()) {
      due.forEach((value, axis) => close(positions[i][axis], value, `${patch} vertex ${i}`));
      atlas[patch].uv_px[i].forEach((value, axis) => close(224 * uvs[i][axis], value, `uv ${i}`));
    }
    // The pad looks down: at the lowest vertex the normal points to -z.
    const lowest = positions.reduce((best, p, i) => (p[2] < positions[best][2] ? i : best), 0);
    assert.ok(normals[lowest][2] < -0.95, `normal ${normals[lowest]}`);
  }
});
