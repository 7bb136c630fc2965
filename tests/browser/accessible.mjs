// Who cannot see, point or bear motion can use the pages: rules of WCAG as axe-core checks them, keys, and
// what is spared to those who ask for less motion. Against a server with a contact model.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, before, test } from 'node:test';
import { BASE, launch } from './browser.mjs';

const PATIENCE_MS = 90000;
const WIDE = { width: 1440, height: 900 };
const PHONE = { width: 390, height: 844 };
const RULES = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'];
const BEST = [...RULES, 'best-practice'];
let browser;
let axe;

before(async () => {
  browser = await launch();
  axe = await readFile(new URL('node_modules/axe-core/axe.min.js', import.meta.url), 'utf8');
});

after(async () => browser?.close());

/** Opens a page of the service and waits until it answers. */
async function open(path, terms) {
  const context = await browser.newContext(terms);
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  await page.goto(`${BASE}${path}`, { timeout: PATIENCE_MS });
  return page;
}

const answers = (page) => page.waitForFunction(() => document.body.dataset.live === '', undefined, { timeout: PATIENCE_MS });

/** What breaks a rule, in words, each with `where` it was seen. */
async function broken(page, where, rules = BEST) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate((values) => globalThis.axe.run(document, { runOnly: { type: 'tag', values } }), rules);
  return violations.flatMap(({ id, nodes }) => nodes.map(({ target, failureSummary }) => `${where}: ${id}: ${target}: ${failureSummary.replace(/\s+/g, ' ')}`));
}

test('the page breaks no rule of accessibility, in any mode, in both colours, wide and narrow', async () => {
  const found = [];
  for (const [viewport, colorScheme] of [[WIDE, 'light'], [WIDE, 'dark'], [PHONE, 'light'], [PHONE, 'dark']]) {
    const where = `${colorScheme}, ${viewport.width} px wide`;
    const page = await open('#shape=sphere&effects=spikes+actuators', { viewport, colorScheme });
    await answers(page);
    for (const mode of ['press', 'hand', 'replay']) {
      await page.check(`input[name=mode][value=${mode}]`, { force: true });
      await page.waitForFunction((due) => due !== 'replay' || globalThis.papilla.replay.judged, mode, { timeout: PATIENCE_MS });
      found.push(...await broken(page, `${mode}, ${where}`));
    }
    await page.evaluate(() => { document.getElementById('more').open = true; });
    // A phone shows one of the three at a time.
    if (viewport === PHONE) await page.check('input[name=promise][value=hard]', { force: true });
    await page.locator('#hard-all > summary').click();
    await page.waitForSelector('#hard-fe details');
    await page.locator('#hard-fe summary').first().click();
    found.push(...await broken(page, `all unfolded, ${where}`));
    await page.context().close();
  }
  assert.deepEqual(found, []);
});

test('the other pages break none either', async () => {
  const found = [];
  for (const colorScheme of ['light', 'dark']) {
    const api = await open('api.html', { colorScheme });
    await api.waitForSelector('.operation');
    await api.locator('.operation summary').first().click();
    found.push(...await broken(api, `api.html, ${colorScheme}`));
    await api.context().close();
    const scene = await open('xr/', { colorScheme });
    await scene.waitForFunction(() => document.getElementById('state').textContent !== 'connecting');
    // Its canvas fills the page, as headsets want it: it lies in no landmark.
    found.push(...await broken(scene, `xr, ${colorScheme}`, RULES));
    await scene.context().close();
  }
  assert.deepEqual(found, []);
});

test('whoever asks for less motion is spared what moves by itself', async () => {
  const page = await open('#shape=sphere&depth=0.2', { reducedMotion: 'reduce' });
  assert.equal(await page.evaluate(() => document.getAnimations().length), 0);
  await answers(page);
  await page.fill('#depth', '2.4');
  const passed = await page.evaluate(() => new Promise((resolve) => {
    requestAnimationFrame(() => requestAnimationFrame(() => resolve(globalThis.papilla.control.depthMm)));
  }));
  assert.equal(passed, 2.4, 'the indenter is where it is to be, without a way to it');
  await page.context().close();
});

test('the page can be used by keys alone: a shape, a depth, a place, a model, a hard case', async () => {
  const page = await open('#shape=plate', { viewport: WIDE });
  await answers(page);
  /** Goes on by Tab to the element. */
  const tabTo = async (selector) => {
    for (let k = 0; k < 200; k++) {
      await page.keyboard.press('Tab');
      if (await page.evaluate((wanted) => document.activeElement.matches(wanted), selector)) return;
    }
    assert.fail(`Tab does not lead to ${selector}`);
  };
  const chooser = page.waitForEvent('filechooser', { timeout: 1000 }).then(() => 'asked', () => 'not asked');
  await tabTo('input[name=shape]');
  await page.keyboard.press('ArrowLeft');
  assert.equal(await page.evaluate(() => globalThis.papilla.press.shape), 'mesh', 'past the first chip is the last');
  assert.equal(await chooser, 'not asked', 'nobody is asked for a file on the way');
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('ArrowRight');
  assert.equal(await page.evaluate(() => globalThis.papilla.press.shape), 'sphere');
  await tabTo('#depth');
  await page.keyboard.press('End');
  assert.equal(await page.inputValue('#depth'), '3');
  await tabTo('#pad');
  const before = await page.evaluate(() => globalThis.papilla.press.uvPx[1]);
  await page.keyboard.press('ArrowDown');
  assert.ok(await page.evaluate(() => globalThis.papilla.press.uvPx[1]) > before);
  await tabTo('#ladder-plot .served[aria-pressed=false]');
  const tier = await page.evaluate(() => document.activeElement.dataset.tier);
  await page.keyboard.press('Enter');
  await page.waitForFunction((name) => globalThis.papilla.session.ready?.tier === name, tier, { timeout: PATIENCE_MS });
  await tabTo('#hard-cases button[aria-pressed=false]');
  await page.keyboard.press(' ');
  await page.waitForFunction(() => /flagged|refused|plain/.test(document.getElementById('hard-case').dataset.state), undefined, { timeout: PATIENCE_MS });
  await page.context().close();
});
