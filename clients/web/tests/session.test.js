// The parts of the client that need no server, and the first code of docs/reference/clients/web.md as it is written.
// PAPILLA_URL: a server with --xr-dir dist.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { Foundation } from '../src/foundation.js';
import { crop, greatest } from '../src/window.js';
import { MAP_LEN, toHalf } from '../src/wire.js';
import { launch, openPage } from './browser.js';

const page = await readFile(new URL('../../../docs/reference/clients/web.md', import.meta.url), 'utf8');

test('f16 rounds to the nearest, ties to even, and clamps', () => {
  for (const [value, bits] of [[0, 0], [1, 0x3c00], [65504, 0x7bff], [1e9, 0x7bff], [-1, 0xbc00], [2 ** -24, 1], [2 ** -25, 0],
    [1.5 * 2 ** -24, 2], [1 + 2 ** -11, 0x3c00], [1 + 3 * 2 ** -11, 0x3c02], [2047.5 * 2 ** -25, 0x400], [Infinity, 0x7bff]]) {
    assert.equal(toHalf(value), bits, String(value));
  }
  assert.equal(toHalf(NaN) & 0x7e00, 0x7e00);
});

test('what is no pressure is refused before it is rounded, and cropping leaves none out', () => {
  for (const [value, code] of /** @type {[number, string][]} */ ([[NaN, 'not_finite'], [Infinity, 'not_finite'], [-Infinity, 'not_finite'], [-1e-30, 'negative_pressure']])) {
    const map = new Float32Array(MAP_LEN);
    map[3 * 224 + 5] = 1000;
    map[7 * 224 + 9] = value;
    const { column, row, width, height } = crop(map, { column: 0, row: 0, width: 0, height: 0 });
    assert.deepEqual([column, row, width, height], [5, 3, 5, 5]);
    assert.throws(() => greatest(map, row * 224 + column, 224, width, height), { code, message: /row 4, column 4/ });
  }
  assert.equal(greatest(Float32Array.of(0, -0, 3, 7, 2, 9), 0, 3, 2, 2), 7);
});

test('the foundation presses as its law says, and on soft objects as hard as they press back', () => {
  const penetration = Float32Array.of(-1, 0, 0.5, 1, 2);
  const pressures = new Float32Array(5);
  const near = (/** @type {number} */ found, /** @type {number} */ due) => assert.ok(Math.abs(found - due) <= 1e-6 * Math.abs(due), `${found}, not ${due}`);
  const foundation = new Foundation({ stiffness: 1000, exponent: 0.5, relief: 0.25 });
  foundation.pressures(penetration, pressures);
  [0, 0, 0, 1000 * Math.sqrt(0.5), 1000 * Math.sqrt(1.5)].forEach((due, i) => near(pressures[i], due));
  near(foundation.peakPa, 1000 * Math.sqrt(1.5));
  assert.equal(foundation.fingerShare, 1);
  // Springs in series: the finger of 1000 Pa/mm takes three quarters beside an object of 3000 Pa/mm.
  const springs = new Foundation({ stiffness: 1000, exponent: 1, relief: 0 });
  springs.pressures(penetration, pressures, 3000);
  near(springs.fingerShare, 0.75);
  near(pressures[4], 1500);
  springs.pressures(penetration, pressures, Infinity, 1200);
  near(pressures[4], 1200);
});

test('the first code of the page makes a SED map', async () => {
  const block = page.match(/```html\n<script type="module">\n([\s\S]*?)<\/script>\n```/);
  assert.ok(block, 'docs/reference/clients/web.md has no script');
  assert.ok(block[1].trim().split('\n').length <= 10);
  const browser = await launch();
  try {
    const tab = await openPage(browser);
    const said = tab.waitForEvent('console', { timeout: 60000 });
    await tab.addScriptTag({ type: 'module', content: block[1] });
    const text = (await said).text();
    const sed = Number(text.match(/^SED up to ([0-9.]+) J\/m3$/)?.[1]);
    assert.ok(sed > 1 && sed < 1e5, text);
  } finally {
    await browser.close();
  }
});
