// The WebXR scene on a server with a contact model: several fingers touch. PAPILLA_URL: a server with --xr-dir dist.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, before, test } from 'node:test';
import { readMesh } from '../src/meshes.js';
import { launch, openPage } from './browser.js';
import { PATIENCE_MS, lower, nextAnswer, onScreen, openHeadset, openScene, shot, until } from './scene.js';

/** @type {import('playwright-core').Browser} */
let browser;

before(async () => { browser = await launch(); });
after(async () => browser?.close());

/** Fingers that are shown, and what each feels. @param {import('playwright-core').Page} page */
const felt = (page) => page.evaluate(() => {
  const { fingers } = /** @type {any} */ (globalThis).papillaXr;
  return fingers.filter((/** @type {any} */ f) => f.mesh.visible).map((/** @type {any} */ f) => ({
    name: f.name, touched: f.touched?.name ?? null, forceN: f.forceN, sedMax: f.sedMax, arrow: f.arrow.visible, at: f.mesh.position.toArray(),
  }));
});

test('the code of the page tells what pushes back', async () => {
  const text = await readFile(new URL('../../../docs/reference/clients/web.md', import.meta.url), 'utf8');
  const blocks = [...text.matchAll(/```html\n<script type="module">\n([\s\S]*?)<\/script>\n```/g)];
  assert.equal(blocks.length, 2, 'docs/reference/clients/web.md has a script for a map and one for a force');
  const page = await openPage(browser);
  const said = page.waitForEvent('console', { timeout: PATIENCE_MS });
  await page.addScriptTag({ type: 'module', content: blocks[1][1] });
  const words = (await said).text();
  const forceN = Number(words.match(/^pushes back with ([0-9.e-]+) N$/)?.[1]);
  assert.ok(forceN > 0.01 && forceN < 1, words);
  await page.close();
});

test('a mesh from a file presses like the ball that it holds', async () => {
  const file = await readFile(new URL('meshes/ball.stl', import.meta.url));
  const { shape: mesh } = await readMesh(file.buffer.slice(file.byteOffset, file.byteOffset + file.byteLength), 'ball.stl');
  const page = await openPage(browser);
  const forces = await page.evaluate(async (shapes) => {
    const { Hand } = await import(/** @type {any} */ ('/client/papilla.js'));
    const found = [];
    for (const shape of shapes) {
      const hand = await Hand.connect('', { objects: [{ shape }] });
      const { touch } = await hand.touch([{ at: [11.25, 0, -6.53 - 6 + 0.5], turn: [0, 0, 0, 1] }]);
      found.push(touch.forceN[2]);
      hand.close();
    }
    return found;
  }, [mesh, { shape: 'sphere', radius_mm: 6 }]);
  // Its facets lie in the ball, up to .1 mm below its surface.
  assert.ok(forces[0] < forces[1] && forces[0] > 0.7 * forces[1], `${forces} N`);
  await page.close();
});

test('two fingers press two objects with the mouse, and what pushes back is drawn', async () => {
  const { page, complaints } = await openScene(browser);
  await until(page, 'never said', () => /^ready: .*solved by the server/.test(document.getElementById('state')?.textContent ?? ''), 'solved');
  const [x, y] = await onScreen(page, 'hard ball');
  await page.mouse.move(x, y);
  await page.mouse.down();
  await until(page, 'never touched', (wanted) => {
    const { fingers } = /** @type {any} */ (globalThis).papillaXr;
    return fingers[0].touched?.name === wanted && fingers[0].deepestMm > 1 && fingers[1].answers > 0;
  }, 'hard ball');
  await page.waitForTimeout(1000);
  await nextAnswer(page);
  const [index, middle] = await felt(page);
  await shot(page, 'xr-two-fingers');
  const found = JSON.stringify([index, middle]);
  assert.deepEqual([index.name, index.touched, middle.name, middle.touched], ['index', 'hard ball', 'middle', 'soft ball'], found);
  assert.ok(index.arrow && middle.arrow && middle.forceN > 0.01, found);
  assert.ok(index.forceN > 2 * middle.forceN && index.sedMax > 2 * middle.sedMax, `the soft ball gives way: ${found}`);
  await until(page, 'never told', () => /index: hard ball.* N, .*\nmiddle: soft ball/.test(document.getElementById('figures')?.textContent ?? ''), 'both fingers');
  await page.mouse.up();
  await until(page, 'never left', () => /** @type {any} */ (globalThis).papillaXr.fingers.every((/** @type {any} */ f) => f.forceN === 0 && !f.arrow.visible), 'hard ball');
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a tracked hand touches with five fingers, as far apart as it is large', async () => {
  const { page, complaints } = await openHeadset(browser);
  const now = await lower(page, 'hand');
  await page.waitForFunction(() => /** @type {any} */ (globalThis).papillaXr.finger.forceN > 0.01, undefined, { timeout: PATIENCE_MS });
  const fingers = await felt(page);
  await shot(page, 'xr-five-fingers');
  assert.equal(now.touched, 'hard ball', JSON.stringify(now));
  assert.deepEqual(fingers.map((/** @type {any} */ f) => f.name), ['index', 'middle', 'ring', 'little', 'thumb']);
  const apart = Math.hypot(...fingers[0].at.map((/** @type {number} */ x, /** @type {number} */ k) => x - fingers[1].at[k]));
  assert.ok(apart > 0.12, `index and middle are ${apart} apart: a hand's own size would have them 0.02 apart`);
  assert.deepEqual(complaints, []);
  await page.close();
});
