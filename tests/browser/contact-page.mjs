// The page of a server with a contact model, for the tests that press: one page for each file of tests, its tier nano.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { BASE, launch } from './browser.mjs';

export const PATIENCE_MS = 90000;
export let browser;
export let page;
/** The service's list of tiers, with the times that it measures. */
export let listing;
/** What the page begins with: the model, the set of the ladder, the second model. */
export let begun;
const complaints = [];

/** Opens the page before the tests of a file and closes it after them; without a second model, unless `isCompared`. */
export function usePage({ isCompared = false } = {}) {
  before(async () => {
    browser = await launch();
    page = await browser.newPage({ viewport: { width: 1280, height: 900 }, colorScheme: 'light' });
    page.setDefaultTimeout(PATIENCE_MS);
    page.on('console', (message) => { if (['error', 'warning'].includes(message.type())) complaints.push(message.text()); });
    page.on('pageerror', (error) => complaints.push(String(error)));
    await page.goto(BASE, { timeout: PATIENCE_MS });
    await until(() => globalThis.papilla?.session.ready);
    // As the page has it: times go on being measured.
    listing = await page.evaluate(() => globalThis.papilla.listing);
    begun = await chosen();
    await page.selectOption('#tier', 'nano');
    await page.selectOption('#budget', '500000');
    if (!isCompared) await page.selectOption('#with', '');
  });
  after(async () => browser?.close());
}

/** The last test of a file. */
export function nothingWasComplainedAbout() {
  test('nothing was complained about', () => {
    assert.deepEqual(complaints, []);
  });
}

export const until = (condition, argument) => page.waitForFunction(condition, argument, { timeout: PATIENCE_MS });
export const chooseRadio = (name, value) => page.check(`input[name=${name}][value=${value}]`, { force: true });
export const keep = async (name) => { if (process.env.PAPILLA_SHOTS) await page.screenshot({ path: `${process.env.PAPILLA_SHOTS}/${name}.png`, fullPage: true }); };

export const chosen = async () => Promise.all(['tier', 'ladder-set', 'with'].map((id) => page.locator(`#${id}`).inputValue()));

/** Waits until the indenter is announced and has arrived, and a frame sent after that is answered. */
export async function settled() {
  await until(() => {
    const { control, session, contact } = globalThis.papilla;
    return session.ready && !contact.isOther && control.depthMm === (control.down || control.held ? Number(document.getElementById('depth').value) : 0);
  });
  const sent = await page.evaluate(() => globalThis.papilla.session.sequence);
  await until((after) => globalThis.papilla.answered.sequence > after, sent + 1);
}

/** What pushes back, and the pressure that was found. */
export const felt = () => page.evaluate(() => {
  const { answered, pictures: { finger }, press, meters } = globalThis.papilla;
  return {
    ...meters.pressNow, isUnsettled: document.getElementById('flags').textContent.includes('not settled'), isDrawn: finger.force !== null, pressurePa: Array.from(answered.pressurePa), sedJPerM3: Array.from(answered.sedJPerM3),
    normal: Array.from(press.normal), pointMm: Array.from(press.pointMm), uvPx: Array.from(press.uvPx),
    said: document.getElementById('force').textContent, inPicture: document.getElementById('finger-force').textContent,
  };
});
