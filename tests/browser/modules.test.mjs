// The page's modules without a browser: what they must agree on with the server and with theory.

import assert from 'node:assert/strict';
import { cp, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';
import { pathToFileURL } from 'node:url';

// The page's files in one folder, as server/build.rs puts them into the binary.
const folder = await mkdtemp(join(tmpdir(), 'papilla-page-'));
after(() => rm(folder, { recursive: true }));
await cp(new URL('../../server/web/', import.meta.url), folder, { recursive: true });
await cp(new URL('../../clients/web/src/raster.js', import.meta.url), join(folder, 'raster.js'));
await writeFile(join(folder, 'package.json'), '{"type": "module"}');
const load = (name) => import(pathToFileURL(join(folder, name)));
const { Raster } = await load('raster.js');
const { countDifferences, fringeOf } = await load('mask.mjs');
const { HEADER_BYTES, MAP_LEN, RequestFrame, readAnswer } = await load('protocol.mjs');
const { AutoRange, TABLES, digits, roundUp } = await load('colour.mjs');
const { Atlas } = await load('atlas.mjs');
const { HERTZ, Press } = await load('press.mjs');
const { poseOf } = await load('contact.mjs');
const { errorFigures } = await load('replay.mjs');
const { Ring } = await load('stats.mjs');
const { adviseTier, logAxis, placeName, rungsOn, setsOf, short, showTime } = await load('ladder.mjs');

test('a request frame has the documented bytes', () => {
  const frame = RequestFrame.map();
  frame.stamp(0x04030201, 0x0102 * 2 ** 32 + 0x03040506);
  const bytes = [...new Uint8Array(frame.buffer, 0, HEADER_BYTES)];
  assert.deepEqual(bytes, [
    0x50, 0x50, 0x4c, 0x31, 3, 1, 0, 0, 1, 2, 3, 4, 224, 0, 224, 0,
    6, 5, 4, 3, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 0x3f,
    ...Array(16).fill(0),
  ]);
  assert.equal(frame.buffer.byteLength, HEADER_BYTES + 4 * MAP_LEN);
  const pose = RequestFrame.pose();
  assert.deepEqual([...new Uint8Array(pose.buffer, 4, 12)], [3, 4, 0, 0, 0, 0, 0, 0, 7, 0, 1, 0]);
  assert.equal(pose.buffer.byteLength, HEADER_BYTES + 28);
});

test('the pose of a press turns the indenter into the finger, wherever it stands', () => {
  for (const [normal, tangent] of [[[0, 0, -1], [1, 0, 0]], [[0, 0, 1], [0, 1, 0]], [[0, -1, 0], [0.6, 0, 0.8]], [[0.48, 0.64, -0.6], [0.8, -0.6, 0]]]) {
    const bitangent = [0, 1, 2].map((k) => normal[(k + 1) % 3] * tangent[(k + 2) % 3] - normal[(k + 2) % 3] * tangent[(k + 1) % 3]);
    const out = new Float32Array(7);
    poseOf({ shape: 'sphere', radiusMm: 4, heightMm: -0.5, pointMm: [1, 2, 3], normal, tangent, bitangent }, 1, out);
    const [x, y, z, w] = out.slice(3);
    assert.ok(Math.abs(Math.hypot(x, y, z, w) - 1) < 1e-6, String(out));
    // The rotation's columns are where the shape's axes go: it presses towards +z.
    const columns = [
      [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
      [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
      [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
    ];
    [tangent, bitangent.map((c) => -c), normal.map((c) => -c)].forEach((due, n) => due.forEach((c, k) => assert.ok(Math.abs(columns[n][k] - c) < 1e-6, `${normal}: column ${n}`)));
    normal.forEach((c, k) => assert.ok(Math.abs(out[k] - ([1, 2, 3][k] + 3.5 * c)) < 1e-6));
  }
});

function answerFrame(status, payload) {
  const data = new ArrayBuffer(HEADER_BYTES + payload);
  const view = new DataView(data);
  [0x50, 0x50, 0x4c, 0x31, 3, 2, 0, status].forEach((byte, i) => view.setUint8(i, byte));
  view.setUint32(8, 7, true);
  view.setUint32(24, 1234, true);
  view.setUint16(44, 3, true);
  view.setUint8(46, 1);
  return data;
}

test('answers are read, and damaged ones are named', () => {
  const into = {};
  const data = answerFrame(0, 4 * MAP_LEN);
  new DataView(data).setFloat32(HEADER_BYTES + 4, 2.5, true);
  assert.equal(readAnswer(data, into).sedJPerM3[1], 2.5);
  assert.deepEqual([into.status, into.sequence, into.serverUs], ['ok', 7, 1234]);
  assert.deepEqual([into.tierNumber, into.outOfRange, into.unfamiliar], [3, true, false]);
  assert.equal(readAnswer(answerFrame(1, 0), into).status, 'superseded');
  assert.equal(readAnswer(answerFrame(2, 0), into).status, 'late');
  assert.equal(into.sedJPerM3, null);
  assert.throws(() => readAnswer(answerFrame(0, 0), into), /not an f32 map/);
  assert.throws(() => readAnswer(new ArrayBuffer(31), into), /31 bytes/);
  const other = answerFrame(0, 0);
  new DataView(other).setUint8(0, 0);
  assert.throws(() => readAnswer(other, into), /PPL1/);
});

test('the raster owns each pixel once, borders included, and is linear', () => {
  // Two triangles share the diagonal of a square whose corners and diagonal pass through pixel centres.
  const uv = [10.5, 10.5, 20.5, 10.5, 20.5, 20.5, 10.5, 20.5];
  const raster = new Raster([0, 2, 1, 0, 3, 2], uv);
  assert.equal(raster.pixels.length, 11 * 11);
  const out = new Float32Array(MAP_LEN);
  raster.rasterise([10.5, 20.5, 20.5, 10.5], out);
  for (let row = 0; row < 224; row++) {
    for (let column = 0; column < 224; column++) {
      const inside = row >= 10 && row <= 20 && column >= 10 && column <= 20;
      const due = inside ? column + 0.5 : 0;
      assert.ok(Math.abs(out[row * 224 + column] - due) < 1e-5, `${row} ${column}`);
    }
  }
});

test('the raster decides exactly where rounding could not', () => {
  // The pixel centre (5.5, 5.5) lies on this edge to the last bit, or a hair (2^-20 px) off it.
  const centre = 5 * 224 + 5;
  for (const [shift, inside] of [[0, 1], [2 ** -20, 0], [-(2 ** -20), 1]]) {
    const raster = new Raster([0, 1, 2], [1.5 + shift, 1.5, 9.5 + shift, 9.5, 9.5 + shift, 1.5].map(Math.fround));
    assert.equal(raster.mask[centre], inside, `shifted by ${shift}`);
  }
});

test('a mask has a fringe one pixel wide, and every pixel that differs is counted', () => {
  const mask = new Uint8Array(MAP_LEN);
  for (const [row, column] of [[5, 5], [5, 6], [0, 223]]) mask[row * 224 + column] = 1;
  const pairs = [...fringeOf(mask)];
  // Ten around the two, three in the corner.
  assert.equal(pairs.length, 2 * 13);
  for (let n = 0; n < pairs.length; n += 2) {
    assert.deepEqual([mask[pairs[n]], mask[pairs[n + 1]]], [0, 1]);
    const [down, right] = [Math.floor(pairs[n] / 224) - Math.floor(pairs[n + 1] / 224), pairs[n] % 224 - pairs[n + 1] % 224];
    assert.ok(Math.max(Math.abs(down), Math.abs(right)) === 1, `${pairs[n]} beside ${pairs[n + 1]}`);
  }
  const rgba = Uint8ClampedArray.from({ length: 4 * MAP_LEN }, (_, i) => 255 * mask[Math.floor(i / 4)]);
  assert.equal(countDifferences(mask, rgba), 0);
  rgba[4 * (5 * 224 + 5)] = 0;
  rgba[0] = 255;
  assert.equal(countDifferences(mask, rgba), 2);
});

test('colour tables begin and end where the published maps do', () => {
  const near = (table, entry, rgb) => rgb.forEach((value, k) => {
    assert.ok(Math.abs(TABLES[table][4 * entry + k] - value) <= 5, `${table}[${entry}] channel ${k}`);
  });
  near('viridis', 0, [68, 1, 84]);
  near('viridis', 128, [33, 145, 140]);
  near('viridis', 255, [253, 231, 37]);
  near('inferno', 0, [0, 0, 4]);
  near('inferno', 128, [188, 55, 84]);
  near('inferno', 255, [252, 255, 164]);
});

test('scales are round, grow at once and shrink late', () => {
  assert.deepEqual([0.7, 1, 1.01, 2400, 9e4].map(roundUp), [0.8, 1, 1.5, 3000, 1e5]);
  const range = new AutoRange(1, 1000);
  assert.equal(range.update(70, 0), true);
  assert.equal(range.max, 80);
  assert.equal(range.update(10, 500), false);
  assert.equal(range.update(10, 1100), true);
  assert.equal(range.max, 10);
  assert.deepEqual([digits(0), digits(3.14159), digits(31.4), digits(0.001234)], ['0', '3.14', '31.4', '0.00123']);
});

test('percentiles are nearest ranks of the last 240 values', () => {
  const ring = new Ring();
  for (let i = 1000; i < 1100; i++) ring.push(i);
  for (let i = 1; i <= 240; i++) ring.push(i);
  assert.deepEqual(ring.percentiles([0, 0]), [120, 238]);
  assert.equal(ring.recent(0), 240);
});

/** A sphere's lower cap as an atlas: polar angle laid out as radius, pad down, tip (x = 0) up. */
function sphereAtlas(radiusMm) {
  const rings = 60;
  const spokes = 72;
  const positions = [[12, 0, -radiusMm]];
  const uv = [[112, 112]];
  const triangles = [];
  for (let i = 1; i <= rings; i++) {
    for (let j = 0; j < spokes; j++) {
      const polar = (0.9 * i) / rings;
      const round = (2 * Math.PI * j) / spokes;
      positions.push([12 + radiusMm * Math.sin(polar) * Math.cos(round), radiusMm * Math.sin(polar) * Math.sin(round), -radiusMm * Math.cos(polar)]);
      uv.push([112 - (100 * i * Math.sin(round)) / rings, 112 + (100 * i * Math.cos(round)) / rings]);
      const at = (ring, spoke) => (ring === 0 ? 0 : 1 + (ring - 1) * spokes + (spoke % spokes));
      triangles.push([at(i - 1, j), at(i, j + 1), at(i, j)]);
      if (i > 1) triangles.push([at(i - 1, j), at(i - 1, j + 1), at(i, j + 1)]);
    }
  }
  const patch = { positions_mm: positions, uv_px: uv };
  return new Atlas({ hash: 'sphere', mm_per_px: 0.1, triangles, skin: patch, interface: patch });
}

test('a plate on a sphere meets the contact law in closed form', () => {
  const radiusMm = 8;
  const depthMm = 0.8;
  const atlas = sphereAtlas(radiusMm);
  assert.ok(atlas.normals[2] < -0.99, 'the normals point out of the finger');
  const press = new Press(atlas);
  assert.ok(press.moveToPixel(112, 112.5));
  press.evaluate(depthMm);
  // Gap r^2 / 2R: contact radius a^2 = 2 R share depth, Hertz's peak, force 2/3 pi a^2 p0.
  const contactMm = Math.sqrt(2 * radiusMm * HERTZ.share * depthMm);
  const peakPa = ((2 * HERTZ.modulusPa) / Math.PI) * Math.sqrt(depthMm / radiusMm) * (1 + (contactMm / HERTZ.layerMm) ** 3);
  const near = (value, due, share, what) => assert.ok(Math.abs(value / due - 1) < share, `${what}: ${value}, due ${due}`);
  near(press.peakPa, peakPa, 0.02, 'peak, Pa');
  near(press.areaMm2, Math.PI * contactMm ** 2, 0.1, 'area, mm2');
  near(press.forceN, (1e-6 * 2 * Math.PI * contactMm ** 2 * peakPa) / 3, 0.05, 'force, N');
  press.evaluate(0);
  assert.equal(press.forceN, 0);
  assert.ok(press.pressurePa.every((p) => p === 0), 'no depth, no pressure, to the last bit');
});

test('a ray and a pixel find the same point of the skin', () => {
  const atlas = sphereAtlas(8);
  const hit = { triangle: 0, weightB: 0, weightC: 0 };
  assert.ok(atlas.locate(130, 120, hit));
  const point = [...atlas.interpolate(atlas.skin.positionsMm, 3, hit, [0, 0, 0])];
  const ray = { triangle: 0, weightB: 0, weightC: 0 };
  assert.ok(atlas.intersect([point[0], point[1], -50], [0, 0, 1], ray));
  const found = atlas.interpolate(atlas.skin.positionsMm, 3, ray, [0, 0, 0]);
  assert.ok(Math.hypot(...found.map((x, k) => x - point[k])) < 1e-4);
  assert.equal(atlas.intersect([point[0], point[1], 50], [0, 0, -1], ray), false, 'the inside is not hit');
});

test('error figures follow their definitions', () => {
  const truth = new Float32Array(MAP_LEN);
  const network = new Float32Array(MAP_LEN);
  truth.set([10, 4, 0.5, 0]);
  network.set([11, 4, 0, 0.5]);
  const figures = errorFigures(network, truth, Uint32Array.of(0, 1, 2, 3), {});
  const near = (value, due) => assert.ok(Math.abs(value - due) < 1e-9, `${value}, due ${due}`);
  near(figures.relativeL2, Math.sqrt(1.5 / 116.25));
  near(figures.farFieldL2, Math.sqrt(0.5 / 0.25));
  near(figures.peak, 0.1);
  near(figures.energy, 1 / 14.5);
});

test('a tier that is late makes way for the most accurate that is in time', () => {
  const tier = (name, ms, error, more = {}) => ({ name, predicted_latency_us: 1000 * ms, relative_l2_median: error, for_comparison: false, ...more });
  const tiers = [tier('form', 0.2, 0.5), tier('nano', 1, 0.14), tier('small', 4, 0.12), tier('unet', 3, 0.1, { for_comparison: true }), tier('large', 20, 0.1)];
  for (const [late, budgetMs, advised] of [['large', 11, 'small'], ['large', 2, 'nano'], ['small', 0.5, 'form'], ['large', 0.1, 'form'], ['form', 0.1, undefined]]) {
    assert.equal(adviseTier(tiers, late, budgetMs), advised, `${late} within ${budgetMs} ms`);
  }
});

/** What /v1/tiers answers, in small. */
function listing() {
  const errors = (median) => ({ s1: { samples: 4, relative_l2: { median, p95: 2 * median } } });
  const tract = (p50) => ({ tract: { p50, p99: 2 * p50 }, ort: null });
  return {
    tiers: [
      { name: 'nano', kind: 'network', predicted_latency_us: 900, calibrated_us: { p50: 700, p99: 800 }, relative_l2_median: 0.2 },
      { name: 'large', kind: 'network', predicted_latency_us: 30500, calibrated_us: null, relative_l2_median: 0.05 },
    ],
    ladder: {
      sets: [{ name: 's1', samples: 4 }, { name: 'deep', samples: 0 }],
      discretisation_error: { sed_relative_l2: 0.01, how: 'by hand' },
      rungs: [
        { name: 'fe-fine', kind: 'fe', model: null, seconds: { p50: 900, p99: 999 }, reference: true, errors: errors(0) },
        { name: 'fe-small', kind: 'fe', model: null, seconds: { p50: 4, p99: 5 }, errors: errors(0.3) },
        { name: 'nano', kind: 'network', model: 'nano', latency_ms: tract(0.5), errors: errors(0.1) },
        { name: 'large', kind: 'network', model: 'large', latency_ms: tract(20), errors: errors(0.04) },
        { name: 'unmeasured', kind: 'network', model: 'unmeasured', latency_ms: tract(1), errors: {} },
      ],
    },
  };
}

test('rungs have this server’s times, the reference its own error, and the front is what nothing beats', () => {
  const data = listing();
  assert.deepEqual(setsOf(data), ['s1']);
  const rungs = rungsOn(data, 's1');
  assert.deepEqual(rungs.map(({ name, timeMs, error }) => [name, timeMs, error]), [
    ['nano', 0.7, 0.1], ['large', 30.5, 0.04], ['fe-small', 4000, 0.3], ['fe-fine', 900000, 0.01],
  ]);
  assert.deepEqual(rungs.filter((rung) => rung.onFront).map((rung) => rung.name), ['nano', 'large', 'fe-fine']);
  assert.deepEqual(rungs.map((rung) => rung.tier), ['nano', 'large', null, null]);
  data.ladder = null;
  assert.deepEqual(setsOf(data), ['cards']);
  assert.deepEqual(rungsOn(data, 'cards').map((rung) => rung.error), [0.2, 0.05]);
});

test('axes hold their values and numbers, names keep clear of each other', () => {
  for (const values of [[3], [1, 1.1], [0.5, 2e6]]) {
    const axis = logAxis(values, 2, 2);
    assert.ok(axis.ticks.length >= 2, `${values}: ${axis.ticks}`);
    for (const value of [...values, ...axis.ticks]) assert.ok(axis.part(value) >= 0 && axis.part(value) <= 1, `${value}`);
  }
  assert.deepEqual([short(0.0302), short(12.34), short(150)], ['0.03', '12', '150']);
  assert.deepEqual([showTime(0.7), showTime(30500)], ['0.7 ms', '31 s']);
  const taken = [[195, 95, 205, 105]];
  const places = Array.from({ length: 40 }, () => placeName(taken, 200, 100, 60, 400));
  const found = places.filter((place) => place !== null);
  assert.ok(found.length > 3 && found.length < 40, `${found.length} names round one dot`);
  assert.equal(new Set(found.map(String)).size, found.length);
});
