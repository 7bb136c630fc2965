// The WebXR scene in headless Chromium, as the server serves it at /xr; once with the mouse, once in an emulated headset.
// PAPILLA_URL: a server with --xr-dir dist. PAPILLA_SHOTS=DIR keeps screenshots.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, before, test } from 'node:test';
import { launch, serverUrl } from './browser.js';

const PATIENCE_MS = 60000;
/** @type {import('playwright-core').Browser} */
let browser;

before(async () => { browser = await launch(); });
after(async () => browser?.close());

/** The scene in a new page; what it complains of is collected. @param {string} [first] script to run before the page's own */
async function openScene(first) {
  const page = await browser.newPage({ viewport: { width: 960, height: 600 } });
  page.setDefaultTimeout(PATIENCE_MS);
  /** @type {string[]} */
  const complaints = [];
  page.on('console', (message) => { if (message.type() === 'error') complaints.push(message.text()); });
  page.on('pageerror', (error) => complaints.push(String(error)));
  if (first) await page.addInitScript({ content: first });
  await page.goto(`${serverUrl()}/xr/?tier=half-space&budget_us=0`);
  await page.waitForFunction(() => /** @type {any} */ (globalThis).papillaXr?.session.ready, undefined, { timeout: PATIENCE_MS, polling: 20 });
  return { page, complaints };
}

/** @param {import('playwright-core').Page} page */
const figures = (page) => page.evaluate(() => {
  const s = /** @type {any} */ (globalThis).papillaXr;
  const { touched, deepestMm, texture, foundation } = s.finger;
  return { touched: touched?.name ?? null, deepestMm, peakPa: foundation.peakPa, sedMax: s.sedMax, forceN: s.forceN, answers: s.answers, frames: s.frames, painted: Math.max(...texture.image.data), isPresenting: s.isPresenting };
});

/** Waits for the answer to a frame of this moment. @param {import('playwright-core').Page} page */
async function nextAnswer(page) {
  const { answers } = await figures(page);
  await page.waitForFunction((past) => /** @type {any} */ (globalThis).papillaXr.answers > past + 3, answers, { timeout: PATIENCE_MS });
}

/** @param {import('playwright-core').Page} page @param {string} name */
async function shot(page, name) {
  if (process.env.PAPILLA_SHOTS) await page.screenshot({ path: `${process.env.PAPILLA_SHOTS}/${name}.png` });
}

/** Where an object's top is on the screen. @param {import('playwright-core').Page} page @param {string} name */
const onScreen = (page, name) => page.evaluate((wanted) => {
  const { objects, scene, renderer } = /** @type {any} */ (globalThis).papillaXr;
  const { mesh } = objects.find((/** @type {any} */ o) => o.name === wanted);
  const { camera } = scene.userData;
  const at = mesh.position.clone();
  mesh.geometry.computeBoundingBox();
  at.y += 0.8 * mesh.scale.y * mesh.geometry.boundingBox.max.y;
  at.project(camera);
  return [((at.x + 1) / 2) * renderer.domElement.clientWidth, ((1 - at.y) / 2) * renderer.domElement.clientHeight];
}, name);

/** Waits until something holds in the page, or says what it shows instead. @param {import('playwright-core').Page} page @param {string} what @param {(wanted: string) => boolean} holds @param {string} name */
async function until(page, what, holds, name) {
  await page.waitForFunction(holds, name, { timeout: PATIENCE_MS }).catch(async (error) => {
    throw new Error(`${what} ${name}: ${error.message} ${JSON.stringify(await figures(page))}`);
  });
}

/** A browser that is slow to draw: its first frame comes after the session is ready and the mouse has moved. */
const LATE_FIRST_FRAME = `
  const draw = globalThis.requestAnimationFrame.bind(globalThis);
  globalThis.requestAnimationFrame = (step) => setTimeout(() => draw(step), Math.max(0, 4000 - performance.now()));`;

test('the mouse presses hard and soft objects, and SED is painted on the finger', async () => {
  const { page, complaints } = await openScene(LATE_FIRST_FRAME);
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
  const iwer = await readFile(new URL('../node_modules/iwer/build/iwer.js', import.meta.url), 'utf8');
  const { page, complaints } = await openScene(`${iwer}
    globalThis.headset = new IWER.XRDevice(IWER.metaQuest3);
    globalThis.headset.installRuntime({ forceInstall: true });`);
  await page.waitForSelector('#enter:not([hidden])');
  // Not page.click: it waits for frames of the window, and those are the headset's now.
  await page.evaluate(() => document.getElementById('enter')?.click());
  await page.waitForFunction(() => /** @type {any} */ (globalThis).papillaXr.isPresenting, undefined, { timeout: PATIENCE_MS });
  for (const way of ['controller', 'hand']) {
    await page.evaluate((primary) => {
      const { headset } = /** @type {any} */ (globalThis);
      headset.position.set(0, 1.5, 0);
      headset.primaryInputMode = primary;
      for (const one of [headset.controllers.right, headset.hands.right]) {
        one.position.set(-0.68, 1.4, -0.75);
        one.quaternion.set(0, 0, 0, 1);
      }
    }, way);
    await page.waitForTimeout(1000);
    await page.waitForFunction(() => /** @type {any} */ (globalThis).papillaXr.mesh.visible, undefined, { timeout: PATIENCE_MS });
    // The pad over the hard ball, then down by a centimetre of the world at a time until it touches. A tracked hand's
    // fingertip is not where the hand is, so the way is measured from where the pad stands.
    let now = await figures(page);
    for (let y = 1.13; y > 0.95 && !(now.touched && now.deepestMm > 0.8); y -= 0.01) {
      await page.evaluate((height) => {
        const { headset, papillaXr } = /** @type {any} */ (globalThis);
        const pad = papillaXr.mesh.localToWorld(papillaXr.mesh.position.clone().set(9, 0, -6.4));
        for (const one of [headset.controllers.right, headset.hands.right]) {
          one.position.set(one.position.x - 0.68 - pad.x, one.position.y + height - pad.y, one.position.z - 0.75 - pad.z);
        }
      }, y);
      const { frames } = await figures(page);
      await page.waitForFunction((past) => /** @type {any} */ (globalThis).papillaXr.frames > past + 1, frames, { timeout: PATIENCE_MS });
      now = await figures(page);
    }
    await nextAnswer(page);
    now = await figures(page);
    await shot(page, `xr-${way}`);
    assert.equal(now.touched, 'hard ball', `${way}: ${JSON.stringify(now)}`);
    assert.ok(now.isPresenting && now.sedMax > 1 && now.painted > 10, `${way}: ${JSON.stringify(now)}`);
  }
  assert.deepEqual(complaints, []);
  await page.close();
});
