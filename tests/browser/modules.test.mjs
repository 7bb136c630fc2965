// The page's modules without a browser: what they must agree on with the server and with theory.

import assert from 'node:assert/strict';
import { cp, mkdtemp, readFile, readdir, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { dome, stlOf } from './meshes.mjs';

// The page's files in one folder, as server/build.rs puts them into the binary.
const folder = await mkdtemp(join(tmpdir(), 'papilla-page-'));
after(() => rm(folder, { recursive: true }));
const client = new URL('../../clients/web/src/', import.meta.url);
for (const name of await readdir(client)) if (name.endsWith('.js')) await cp(new URL(name, client), join(folder, name));
// Over the client's: what needs three.js is bundled with it.
await cp(new URL('../../server/web/', import.meta.url), folder, { recursive: true });
await writeFile(join(folder, 'package.json'), '{"type": "module"}');
// Modules that draw ask for the theme as soon as they are loaded; here nothing is drawn.
globalThis.matchMedia = () => ({ matches: false, addEventListener: () => {} });
const load = (name) => import(pathToFileURL(join(folder, name)));
const { Raster } = await load('raster.js');
const { countDifferences, fringeOf } = await load('mask.mjs');
const { sureWords } = await load('sure.mjs');
const { HEADER_BYTES, MAP_LEN, RequestFrame, readAnswer } = await load('protocol.mjs');
const { AutoRange, TABLES, digits, percentile, roundDown, roundUp } = await load('colour.mjs');
const { Atlas } = await load('atlas.mjs');
const { HERTZ, Press } = await load('press.mjs');
const { poseOf } = await load('contact.mjs');
const { errorFigures } = await load('replay.mjs');
const { Ring } = await load('stats.mjs');
const { OCTAHEDRON, SHAPES, heightsOfMesh, mostBytesOf, scaled } = await load('shapes.mjs');
const { indenterMesh } = await load('indenter.mjs');
const { meshOf, sizeFor, trianglesOf } = await load('files.mjs');
const { bodyMesh, borderOf, followingOf, nailMesh } = await load('body.mjs');
const { hashOf, npyOf, pythonOf, stateOf } = await load('share.mjs');
const { rowsNear } = await load('spikes.mjs');
const { CASES, verdictOf } = await load('hard.mjs');
const { countsOf, examplesOf } = await load('beside.mjs');
const { adviseTier, logAxis, placeName, rungsOn, setsOf, short, showTime } = await load('ladder.mjs');
const { defaultFor, errorFrom, setFor, suiting, suits, tierAfter, tierFor } = await load('tiers.mjs');
const { aboutSet, aboutTier, nameOfSet, nameOfTier } = await load('words.mjs');

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
    poseOf({ body: { faceMm: 4 }, heightMm: -0.5, pointMm: [1, 2, 3], normal, tangent, bitangent }, 1, out);
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
  for (const [at, side] of [[12, 224], [14, 224]]) view.setUint16(at, payload ? side : 0, true);
  view.setUint32(36, 77, true);
  view.setUint32(40, 88, true);
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
  assert.deepEqual([into.queueUs, into.networkUs, into.bytes], [77, 88, HEADER_BYTES + 4 * MAP_LEN]);
  assert.equal(readAnswer(answerFrame(1, 0), into).status, 'superseded');
  assert.equal(readAnswer(answerFrame(2, 0), into).status, 'late');
  assert.equal(into.sedJPerM3, null);
  const wrong = answerFrame(0, 8);
  assert.throws(() => readAnswer(wrong, into), /not an f32 map/);
  const cut = answerFrame(0, 4 * 6);
  [[12, 3], [14, 2], [32, 221], [34, 7]].forEach(([place, value]) => new DataView(cut).setUint16(place, value, true));
  new DataView(cut).setFloat32(HEADER_BYTES + 4 * 5, 9.5, true);
  const { sedJPerM3 } = readAnswer(cut, into);
  assert.deepEqual([sedJPerM3.length, sedJPerM3[8 * 224 + 223], sedJPerM3[0]], [MAP_LEN, 9.5, 0], 'a window is a whole map, 0 outside');
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

test('scales are round, grow at once, and shrink late and step by step, unless they are locked', () => {
  assert.deepEqual([0.7, 1, 1.01, 2400, 9e4].map(roundUp), [0.8, 1, 1.5, 3000, 1e5]);
  assert.deepEqual([80, 15, 10, 1].map((value) => Number(roundDown(value).toPrecision(6))), [60, 10, 8, 0.8]);
  const range = new AutoRange(1, 1000, 500);
  assert.equal(range.update(70, 0), true);
  assert.equal(range.max, 80);
  assert.equal(range.update(10, 500), false);
  assert.equal(range.update(79, 1400), false, 'one high frame holds it');
  assert.equal(range.update(10, 1500), false);
  assert.equal(range.update(10, 2400), false);
  assert.deepEqual([range.update(10, 2500), range.max], [true, 60]);
  assert.equal(range.update(10, 2900), false);
  assert.deepEqual([range.update(10, 3000), range.max], [true, 50]);
  range.locked = true;
  assert.equal(range.update(1000, 3100), false);
  assert.equal(range.max, 50);
  assert.deepEqual([digits(0), digits(3.14159), digits(31.4), digits(0.001234)], ['0', '3.14', '31.4', '0.00123']);
});

test('one bright line at the edge does not take the scale', () => {
  const values = new Float32Array(MAP_LEN);
  const pixels = Uint32Array.from({ length: MAP_LEN }, (_, i) => i);
  for (let i = 0; i < 5000; i++) values[i] = 1 + i / 5000;
  for (let i = 5000; i < 5050; i++) values[i] = 40;
  const most = percentile(values, pixels, 40, 0.98);
  assert.ok(most > 1.9 && most < 2.1, `${most}`);
  assert.equal(percentile(new Float32Array(MAP_LEN), pixels, 0, 0.98), 0);
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

test('where frames are late the most accurate network within the budget is advised, and never a closed form', () => {
  const tier = (name, ms, error, more = {}) => ({ name, kind: 'network', predicted_latency_us: 1000 * ms, relative_l2_median: error, named_only: null, ...more });
  const method = (name, ms, error) => ({ name, contact_us: 1000 * ms, errors: [{ pressure_relative_l2: { median: error } }] });
  const tiers = [tier('form', 0.2, 0.5, { kind: 'closed_form' }), tier('nano', 1, 0.14), tier('small', 4, 0.12), tier('unet', 3, 0.1, { named_only: 'outdone' }), tier('large', 20, 0.1)];
  const methods = [method('springs', 0.1, 0.4), method('pixels', 8, 0.08)];
  const of = (budgetMs, given) => adviseTier({ tiers, methods }, { tier: 'large', method: 'pixels', budgetMs, given });
  assert.deepEqual([of(11, 'pressure').tier, of(2, 'pressure').tier], ['small', 'nano']);
  assert.match(of(0.5, 'pressure').text, /^no model is that fast here; the fastest, nano, takes some 1 ms$/);
  assert.deepEqual([of(13, 'poses').tier, of(13, 'poses').method], ['small', 'pixels']);
  assert.deepEqual([of(5, 'poses').tier, of(5, 'poses').method], ['small', 'springs']);
  assert.match(of(1, 'poses').text, /the fastest, nano with contact springs, takes some 1.1 ms$/);
});

/** Tiers that learnt one pressure each, a tier that learnt both, and a closed form; errors of maps, then of poses. */
function twoWorlds() {
  const tier = (name, learnt, ms, errors, kind = 'network') => ({
    name, learnt, kind, named_only: null, predicted_latency_us: 1000 * ms, relative_l2_median: errors[0], relative_l2_median_from_poses: errors[1],
  });
  return {
    default: 'small', default_for_pressure: 'small-maps', judged_on: 'heldout-presses', methods: [{ name: 'pixels', contact_us: 8000 }],
    tiers: [
      tier('form', 'fe', 0.2, [0.5, 0.5], 'closed_form'), tier('tiny', 'both', 1, [0.17, 0.16]), tier('small', 'contact', 4, [0.15, 0.09]), tier('large', 'contact', 20, [0.14, 0.08]),
      tier('small-maps', 'fe', 4, [0.08, 0.14]), tier('large-maps', 'fe', 40, [0.06, 0.13]), tier('mine', 'contact', 3, [0.2, 0.1]),
    ],
  };
}

test('a network is advised for what is given, and judged by its error from that', () => {
  const data = twoWorlds();
  const of = (budgetMs, given, tier) => adviseTier(data, { tier, method: given === 'poses' ? 'pixels' : null, budgetMs, given });
  assert.equal(of(30, 'pressure', 'large-maps').tier, 'small-maps', 'of maps small-maps has the least error within 30 ms');
  assert.equal(of(30, 'poses', 'small').tier, 'large', 'of poses large has');
  assert.equal(of(15, 'poses', 'large').tier, 'small');
  // What nobody has measured from poses is judged by its error from maps.
  for (const tier of data.tiers) tier.relative_l2_median_from_poses = null;
  assert.equal(of(100, 'poses', 'small').tier, 'large');
  // Where no network learnt what is given, those that there are.
  data.tiers = data.tiers.filter(({ learnt }) => learnt === 'fe');
  assert.equal(of(100, 'poses', '').tier, 'large-maps');
});

test('another input takes the sibling that learnt it, a default a default, and goes back likewise', () => {
  const data = twoWorlds();
  const to = (name, before, now) => tierAfter(data, name, before, now);
  assert.deepEqual(['poses', 'pressure'].map((given) => defaultFor(data, given)), ['small', 'small-maps']);
  for (const [press, replay] of [['small', 'small-maps'], ['large', 'large-maps'], ['tiny', 'tiny'], ['form', 'form'], ['mine', 'mine'], ['', '']]) {
    assert.equal(to(press, 'poses', 'pressure'), replay);
    assert.equal(to(replay, 'pressure', 'poses'), press);
  }
  // Who names a network of the other kind in the same mode keeps it.
  assert.equal(to('small-maps', 'poses', 'poses'), 'small-maps');
  data.default = 'large';
  assert.deepEqual([to('large', 'poses', 'pressure'), to('small-maps', 'pressure', 'poses')], ['small-maps', 'large'], 'defaults need not be siblings');
  assert.deepEqual([tierFor(data, 'small', 'pressure'), tierFor(data, 'none', 'pressure')], ['small-maps', 'none']);
  assert.deepEqual(suiting(data.tiers, 'pressure').map(({ name }) => name), ['form', 'tiny', 'small-maps', 'large-maps']);
  assert.deepEqual(suiting(data.tiers, 'poses').map(({ name }) => name), ['form', 'tiny', 'small', 'large', 'mine']);
});

test('errors, sets and words are those of what is given', () => {
  const data = twoWorlds();
  const [, tiny, small, , maps] = data.tiers;
  assert.deepEqual([errorFrom(small, 'poses'), errorFrom(small, 'pressure'), errorFrom({ ...small, relative_l2_median_from_poses: null }, 'poses')], [0.09, 0.15, 0.15]);
  const sets = ['heldout-presses', 'reference', 'poses'];
  assert.deepEqual(['poses', 'pressure'].map((given) => setFor(data, sets, given)), ['poses', 'heldout-presses']);
  assert.equal(setFor(data, ['reference'], 'poses'), 'reference');
  assert.equal(setFor({ ...data, tiers: [{ ...small, relative_l2_median_from_poses: null }] }, sets, 'poses'), 'heldout-presses', 'the service does not judge by it');
  assert.deepEqual(['poses', 'nowhere'].map(nameOfSet), ['from poses', 'nowhere']);
  const about = aboutSet([{ name: 'poses', samples: 86, about: 'the states of `heldout-presses`, pressed by contact' }], 'poses');
  assert.match(about, /^86 simulations: the states of “new presses”, pressed by contact; for poses the service chooses by these/);
  assert.deepEqual(['nano-maps', 'small-maps', 'large-maps', 'small'].map(nameOfTier), ['nano for maps', 'small for maps', 'large for maps', 'small']);
  assert.deepEqual([suits(small, 'pressure'), suits(small, 'poses'), suits(maps, 'poses'), suits(tiny, 'poses'), suits(tiny, 'pressure')], [false, true, false, true, true]);
  assert.match(aboutTier('small', small, 'pressure'), /^It learnt the pressure that contact finds from poses; here maps/);
  assert.match(aboutTier('small-maps', maps, 'poses'), /^For sessions that give maps of pressure\. It learnt the pressure of finite elements; here contact/);
  assert.deepEqual([aboutTier('small', small, 'poses'), aboutTier('small-maps')], ['', 'For sessions that give maps of pressure.']);
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

test('every shape presses with the point its pose names, and is drawn as it is sent', () => {
  for (const [name, { size, make }] of Object.entries(SHAPES)) {
    for (const mm of size ? [size[1], size[3], size[2]] : [0]) {
      const { hello, faceMm, profile, halfMm } = make(mm);
      let least = Infinity;
      for (let i = 0; i <= 200; i++) for (let j = 0; j <= 200; j++) least = Math.min(least, profile((i / 100 - 1) * halfMm * 0.999, (j / 100 - 1) * halfMm * 0.999));
      assert.ok(least >= -1e-9 && least < 0.35, `${name} of ${mm}: its surface comes to ${least} mm from its face`);
      assert.ok(Number.isFinite(faceMm) && hello.shape === name, name);
      assert.ok(profile(3 * halfMm, 0) > 6 && profile(0, 3 * halfMm) > 6, `${name}: beside it there is nothing`);
    }
  }
  const { heights, columns, sideMm } = heightsOfMesh(scaled(OCTAHEDRON, 8));
  assert.ok(Math.abs(heights[48 * columns + 48] - 4) < 1e-6 && sideMm === 8, 'the tip of an octahedron stands over its middle');
});

test('an STL and a GLB of one body are one mesh, and what is none says so', async () => {
  const points = [[0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]];
  const faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
  const mesh = await meshOf(stlOf(faces.map((face) => face.map((k) => points[k]))), 'body.stl');
  assert.deepEqual([mesh.vertices_mm.length, mesh.triangles.length, mesh.sideMm], [4, 4, 10]);
  const text = `solid x\n${faces.map((face) => `facet normal 0 0 0 outer loop ${face.map((k) => `vertex ${points[k].join(' ')}`).join(' ')} endloop endfacet`).join('\n')}\nendsolid`;
  assert.deepEqual((await meshOf(new TextEncoder().encode(text).buffer, 'body.STL')).triangles, mesh.triangles);
  // The same in metres, moved by its node and indexed.
  const bin = new ArrayBuffer(48 + 24);
  new Float32Array(bin, 0, 12).set(points.flat().map((x) => x / 1000));
  new Uint16Array(bin, 48, 12).set(faces.flat());
  const json = JSON.stringify({
    asset: { version: '2.0' }, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0, translation: [1, 2, 3] }], meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1 }] }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 4, type: 'VEC3' }, { bufferView: 1, componentType: 5123, count: 12, type: 'SCALAR' }],
    bufferViews: [{ buffer: 0, byteLength: 48 }, { buffer: 0, byteOffset: 48, byteLength: 24 }], buffers: [{ byteLength: 72 }],
  }).padEnd(800);
  const glb = new ArrayBuffer(12 + 8 + json.length + 8 + 72);
  const view = new DataView(glb);
  [0x46546c67, 2, glb.byteLength, json.length, 0x4e4f534a].forEach((word, k) => view.setUint32(4 * k, word, true));
  new Uint8Array(glb, 20).set(new TextEncoder().encode(json));
  view.setUint32(20 + json.length, 72, true);
  view.setUint32(24 + json.length, 0x004e4942, true);
  new Uint8Array(glb, 28 + json.length).set(new Uint8Array(bin));
  const other = await meshOf(glb, 'body.glb');
  assert.deepEqual(other.triangles, mesh.triangles);
  other.vertices_mm.flat().forEach((x, k) => assert.ok(Math.abs(x - mesh.vertices_mm.flat()[k]) < 1e-3, `${x}`));
  await assert.rejects(meshOf(new ArrayBuffer(10), 'notes.txt'), /notes\.txt: none of \.stl, \.obj, \.ply, \.glb/);
  await assert.rejects(meshOf(new ArrayBuffer(10), 'cut.stl'), /cut\.stl cannot be read/);
  await assert.rejects(meshOf(stlOf(Array(16385).fill([[0, 0, 0], [1, 0, 0], [0, 1, 0]])), 'large.stl'), /large\.stl has 16385 triangles, of which 16384 fit into a hello; it cannot be reduced/);
});

test('a mesh is drawn as it is, its lowest point at the origin and its normals outward', async () => {
  const body = SHAPES.mesh.make(12, await meshOf(stlOf(dome({ radius: 6 })), 'dome.stl'));
  const drawn = indenterMesh({ shape: 'mesh', body });
  assert.equal(drawn.length, 3 * 6 * body.hello.triangles.length);
  let [least, most, lowest] = [Infinity, -Infinity, null];
  for (let k = 0; k < drawn.length; k += 6) {
    const [x, y, z] = drawn.subarray(k, k + 3);
    [least, most] = [Math.min(least, z), Math.max(most, z)];
    if (z === least) lowest = [x, y, z];
    // The middle of the base is inside of the rest: what faces away from the finger is the base itself.
    const outward = drawn[k + 3] * x + drawn[k + 4] * y + drawn[k + 5] * (z - 6);
    assert.ok(outward > -1e-5, `vertex ${k / 6} looks inward: ${outward}`);
  }
  assert.ok(Math.abs(least) < 1e-5 && Math.abs(most - 6) < 1e-5, `${least} to ${most}`);
  assert.ok(Math.hypot(...lowest) < 1e-5, `${lowest}`);
});

test('a mesh of many triangles becomes one that fits into a hello, however large it is made', async () => {
  const mesh = await meshOf(stlOf(dome({ radius: 60, around: 256, up: 64 })), 'large.stl');
  assert.ok(mesh.trianglesRead === 32768 && mesh.triangles.length < 16384 && mesh.triangles.length > 15000, `${mesh.triangles.length}`);
  const [size, why] = sizeFor(mesh.sideMm);
  assert.equal(why, '120 mm in the file, made 10 mm');
  const offMm = Number(trianglesOf(mesh, size).match(/^32768 triangles became \d+: at most ([0-9.e-]+) mm off at a size of 10 mm$/)[1]);
  assert.ok(offMm > 0 && offMm < 0.01 && Math.abs(offMm / (mesh.decimatedMm / 12) - 1) < 0.01, `${offMm} of ${mesh.decimatedMm} mm`);
  for (const sizeMm of [3, 10.01, 23.7, 30]) {
    const bytes = JSON.stringify(SHAPES.mesh.make(sizeMm, mesh).hello).length;
    assert.ok(bytes <= mostBytesOf(mesh) && bytes < 496 * 1024, `${bytes} bytes at ${sizeMm} mm`);
  }
});

test('a file in metres is taken as such where that is a size of things that are touched', () => {
  assert.deepEqual(sizeFor(12.3456), [12.35, 'its own size']);
  assert.deepEqual(sizeFor(0.012), [12, '0.0120 long in the file: taken as metres, 12 mm']);
  assert.deepEqual(sizeFor(120), [10, '120 mm in the file, made 10 mm']);
});

test('the finger is closed around its patch, and its nail lies on the nail side', () => {
  const atlas = sphereAtlas(8);
  const border = borderOf(atlas.triangles);
  assert.equal(border.length, 72, 'the border of the cap is its last ring');
  const nail = nailMesh();
  for (let k = 0; k < nail.length; k += 6) assert.ok(nail[k + 2] > 0 && nail.slice(k, k + 6).every(Number.isFinite), 'the nail faces +z');
  assert.ok(bodyMesh(atlas).every(Number.isFinite));
});

test('a link holds its state, and arrays are those of NumPy', () => {
  const state = { shape: 'ring', size: 4.5, effects: 'spikes points', tier: '' };
  assert.deepEqual(stateOf(hashOf(state)), { shape: 'ring', size: '4.5', effects: 'spikes points' });
  const map = Float32Array.from({ length: MAP_LEN }, (_, i) => i);
  const bytes = npyOf([map, map], 224);
  const length = new DataView(bytes.buffer).getUint16(8, true);
  assert.equal((10 + length) % 64, 0);
  assert.match(new TextDecoder('latin1').decode(bytes.slice(0, 10 + length)), /^\x93NUMPY\x01\x00..\{'descr': '<f4', 'fortran_order': False, 'shape': \(2, 224, 224\), \} *\n$/s);
  assert.equal(new DataView(bytes.buffer).getFloat32(10 + length + 4 * (MAP_LEN + 7), true), 7);
  const program = pythonOf({ origin: 'http://127.0.0.1:7224', terms: { tier: 'small', effects: [], objects: [{ shape: { shape: 'sphere', radius_mm: 4 } }], map: true, method: null }, pose: [1, 2, 3, 0, 0, 0, 1] });
  assert.match(program, /objects=\[\{"shape": \{"shape": "sphere", "radius_mm": 4\}\}\],/);
  assert.match(program, /map=True,/);
  assert.doesNotMatch(program, /effects|method/);
});

test('a fibre keeps its row, the nearest of its class on top', () => {
  const units = [['ra', 0], ['sa1', 50], ['sa1', 10], ['pc', 0], ['sa1', 30]].map(([name, u]) => ({ class: name, px: [u, 0] }));
  assert.deepEqual([...rowsNear(units, [11, 0])], [0, 2, 0, 0, 1]);
  const many = Array.from({ length: 100 }, (_, k) => ({ class: 'sa1', px: [k, 0] }));
  assert.equal([...rowsNear(many, [0, 0])].filter((row) => row >= 0).length, 16);
});

test('what came of a hard case is told as it is', () => {
  const plain = { status: 'ok', outOfRange: false, unfamiliar: false, unsettled: false, cutOff: false, coarseClock: false, noContact: false };
  assert.deepEqual(verdictOf({ problem: { code: 'not_finite', message: 'NaN' }, warnings: [] }, 1).kind, 'refused');
  assert.equal(verdictOf({ answer: { ...plain, unfamiliar: true }, warnings: [] }, 1).kind, 'flagged');
  assert.equal(verdictOf({ answer: plain, warnings: [{ question: 'was m meant?' }] }, 1).kind, 'flagged');
  assert.equal(verdictOf({ answer: plain, warnings: [] }, 1).kind, 'plain');
  assert.equal(verdictOf({ answer: { ...plain, status: 'late' }, warnings: [] }, 1).kind, 'refused');
});

test('the hard cases of the finite elements are those of the report', async () => {
  const { fileOf } = await import('./stability.mjs');
  const file = await readFile(new URL('../../server/web/stability.json', import.meta.url), 'utf8');
  assert.equal(file, await fileOf(), 'write it anew: node tests/browser/stability.mjs');
  const { summary, cases } = JSON.parse(file);
  const ends = cases.flatMap(({ variants }) => variants.map(([, end]) => end));
  const count = (...words) => ends.filter((end) => words.includes(end)).length;
  for (const { name, beside } of CASES) for (const other of beside) assert.ok(cases.some((one) => one.name === other), `${name} stands beside ${other}, which is no case`);
  const wedge = cases.find((one) => one.name === 'sharp-wedge').variants;
  assert.match(countsOf(wedge), /^\d+ converge, \d+ stop with an error$/);
  const shown = examplesOf(wedge);
  assert.ok(shown.some(([, end]) => end === 'refused') && shown.some(([, end]) => end === 'converged'), 'both ends are shown');
  assert.match(examplesOf(cases.find((one) => one.name === 'relaxation-times').variants, /NaN/)[0][0], /NaN/, 'what is alike comes first');
  assert.ok(shown.filter(([, end]) => end === 'refused').every(([, , why]) => why.length > 20), 'each error says why');
  assert.equal(summary, `${ends.length} variants of ${cases.length} cases: ${count('converged', 'evaluated')} converged or evaluated, ${count('refused')} refused, 0 break their promise.`);
});

test('an answer says how wrong it is likely to be, or that nobody knows', () => {
  assert.equal(sureWords(null), '', 'a service that tells nothing');
  assert.equal(sureWords(Float32Array.of(0.0944, 0.214, 0.01, 0.05)), 'expected error 9.4 %; 9 in 10 such answers below 21 %');
  assert.equal(sureWords(Float32Array.of(0.12, Infinity, 0, 0)), 'expected error 12 %');
  assert.match(sureWords(new Float32Array(4).fill(Infinity)), /unknown/);
});

test('the rest of the finger follows the edge of its skin, and nothing far from it moves', () => {
  const atlas = sphereAtlas(8);
  const mesh = bodyMesh(atlas);
  const { vertex, weight } = followingOf(atlas, mesh);
  const border = new Set(borderOf(atlas.triangles));
  assert.ok(vertex.every((at) => border.has(at)));
  let [on, far] = [0, 0];
  for (let n = 0; n < vertex.length; n++) {
    const away = Math.hypot(...[0, 1, 2].map((k) => mesh[6 * n + k] - atlas.skin.positionsMm[3 * vertex[n] + k]));
    if (away < 1e-5) on += weight[n] > 0.9999 ? 1 : NaN;
    if (away > 9) far += weight[n] < 2e-4 ? 1 : NaN;
  }
  assert.ok(on > 100 && far > 10, `${on} vertices on the edge, ${far} far away`);
});
