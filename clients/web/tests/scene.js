// The WebXR scene in headless Chromium, as the server serves it at /xr. PAPILLA_SHOTS=DIR keeps screenshots.

import { readFile } from 'node:fs/promises';
import { serverUrl } from './browser.js';

export const PATIENCE_MS = 60000;
/** The scene in a new page; what it complains of is collected. @param {import('playwright-core').Browser} browser @param {string} [first] script to run before the page's own */
export async function openScene(browser, first) {
  const page = await browser.newPage({ viewport: { width: 960, height: 600 } });
  page.setDefaultTimeout(PATIENCE_MS);
  /** @type {string[]} */
  const complaints = [];
  page.on('console', (message) => { if (message.type() === 'error') complaints.push(message.text()); });
  page.on('pageerror', (error) => complaints.push(String(error)));
  if (first) await page.addInitScript({ content: first });
  await page.goto(`${serverUrl()}/xr/?tier=half-space&budget_us=0`);
  await page.waitForFunction(() => /** @type {any} */ (globalThis).papillaXr?.touching.session?.ready, undefined, { timeout: PATIENCE_MS, polling: 20 });
  return { page, complaints };
}

/** What the first finger feels. @param {import('playwright-core').Page} page */
export const figures = (page) => page.evaluate(() => {
  const { finger, frames, isPresenting } = /** @type {any} */ (globalThis).papillaXr;
  const { touched, deepestMm, texture, foundation, sedMax, forceN, answers } = finger;
  return { touched: touched?.name ?? null, deepestMm, peakPa: foundation.peakPa, sedMax, forceN, answers, frames, painted: Math.max(...texture.image.data), isPresenting };
});

/** Waits for the answer to a frame of this moment. @param {import('playwright-core').Page} page */
export async function nextAnswer(page) {
  const { answers } = await figures(page);
  await page.waitForFunction((past) => /** @type {any} */ (globalThis).papillaXr.finger.answers > past + 3, answers, { timeout: PATIENCE_MS });
}

/** @param {import('playwright-core').Page} page @param {string} name */
export async function shot(page, name) {
  if (process.env.PAPILLA_SHOTS) await page.screenshot({ path: `${process.env.PAPILLA_SHOTS}/${name}.png` });
}

/** Where an object's top is on the screen. @param {import('playwright-core').Page} page @param {string} name */
export const onScreen = (page, name) => page.evaluate((wanted) => {
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
export async function until(page, what, holds, name) {
  await page.waitForFunction(holds, name, { timeout: PATIENCE_MS }).catch(async (error) => {
    throw new Error(`${what} ${name}: ${error.message} ${JSON.stringify(await figures(page))}`);
  });
}

/** Opens the scene with an emulated headset on. @param {import('playwright-core').Browser} browser @param {string} [first] script to run before the page's own */
export async function openHeadset(browser, first = '') {
  const iwer = await readFile(new URL('../node_modules/iwer/build/iwer.js', import.meta.url), 'utf8');
  const scene = await openScene(browser, `${first}
    ${iwer}
    globalThis.headset = new IWER.XRDevice(IWER.metaQuest3);
    globalThis.headset.installRuntime({ forceInstall: true });`);
  await scene.page.waitForSelector('#enter:not([hidden])');
  // Not page.click: it waits for frames of the window, and those are the headset's now.
  await scene.page.evaluate(() => document.getElementById('enter')?.click());
  await scene.page.waitForFunction(() => /** @type {any} */ (globalThis).papillaXr.isPresenting, undefined, { timeout: PATIENCE_MS });
  return scene;
}

/** Brings the first finger down on the hard ball with the controller or the hand. @param {import('playwright-core').Page} page @param {string} way */
export async function lower(page, way) {
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
  await page.waitForFunction(() => /** @type {any} */ (globalThis).papillaXr.finger.mesh.visible, undefined, { timeout: PATIENCE_MS });
  // The pad over the ball, then down by a centimetre of the world at a time until it touches. A tracked hand's fingertip is
  // not where the hand is, so the way is measured from where the pad stands.
  let now = await figures(page);
  for (let y = 1.13; y > 0.95 && !(now.touched && now.deepestMm > 0.8); y -= 0.01) {
    await page.evaluate((height) => {
      const { headset, papillaXr } = /** @type {any} */ (globalThis);
      const { mesh } = papillaXr.finger;
      const pad = mesh.localToWorld(mesh.position.clone().set(9, 0, -6.4));
      for (const one of [headset.controllers.right, headset.hands.right]) {
        one.position.set(one.position.x - 0.68 - pad.x, one.position.y + height - pad.y, one.position.z - 0.75 - pad.z);
      }
    }, y);
    const { frames } = await figures(page);
    await page.waitForFunction((past) => /** @type {any} */ (globalThis).papillaXr.frames > past + 1, frames, { timeout: PATIENCE_MS });
    now = await figures(page);
  }
  await nextAnswer(page);
  return figures(page);
}
