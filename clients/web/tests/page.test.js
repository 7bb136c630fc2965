// The WebXR scene on a server without a contact model; once with the mouse, once in an emulated headset.
// PAPILLA_URL: a server with --xr-dir dist.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { launch } from './browser.js';
import { figures, lower, nextAnswer, onScreen, openHeadset, openScene, shot, until } from './scene.js';

/** @type {import('playwright-core').Browser} */
let browser;

before(async () => { browser = await launch(); });
after(async () => browser?.close());

/** A browser that is slow to draw: its first frame comes after the session is ready and the mouse has moved. */
const LATE_FIRST_FRAME = `
  const draw = globalThis.requestAnimationFrame.bind(globalThis);
  globalThis.requestAnimationFrame = (step) => setTimeout(() => draw(step), Math.max(0, 4000 - performance.now()));`;

test('the mouse presses hard and soft objects, and SED is painted on the finger', async () => {
  const { page, complaints } = await openScene(browser, LATE_FIRST_FRAME);
  assert.match((await page.textContent('#state')) ?? '', /no contact model/);
  /** @type {Record<string, Awaited<ReturnType<typeof figures>>>} */
  const found = {};
  for (const name of ['hard ball', 'soft ball', 'hard block', 'soft cushion', 'thin bar']) {
    const [x, y] = await onScreen(page, name);
    await page.mouse.move(x, y);
    await page.mouse.down();
    await until(page, 'never touched', (wanted) => {
      const { finger } = /** @type {any} */ (globalThis).papillaXr;
      return finger.touched?.name === wanted && finger.deepestMm > 0.3;
    }, name);
    await page.waitForTimeout(1500);
    await nextAnswer(page);
    found[name] = await figures(page);
    await shot(page, `xr-${name.replaceAll(' ', '-')}`);
    await page.mouse.up();
    await until(page, 'never left', () => /** @type {any} */ (globalThis).papillaXr.finger.touched === null, name);
  }
  for (const [name, { sedMax, forceN, painted, peakPa }] of Object.entries(found)) {
    assert.ok(sedMax > 1 && forceN > 0.001 && painted > 10 && peakPa > 500, `${name}: ${JSON.stringify(found[name])}`);
  }
  assert.ok(found['hard ball'].peakPa > 1.3 * found['soft ball'].peakPa, JSON.stringify(found));
  assert.ok(found['hard block'].peakPa > 1.3 * found['soft cushion'].peakPa, JSON.stringify(found));
  await nextAnswer(page);
  assert.equal((await figures(page)).forceN, 0);
  assert.deepEqual(complaints, []);
  await page.close();
});

test('in a headset the finger follows the controller, then the hand', async () => {
  const { page, complaints } = await openHeadset(browser);
  for (const way of ['controller', 'hand']) {
    const now = await lower(page, way);
    await shot(page, `xr-${way}`);
    assert.equal(now.touched, 'hard ball', `${way}: ${JSON.stringify(now)}`);
    assert.ok(now.isPresenting && now.sedMax > 1 && now.painted > 10, `${way}: ${JSON.stringify(now)}`);
  }
  assert.deepEqual(complaints, []);
  await page.close();
});
