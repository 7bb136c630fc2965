// The page with a contact model: an effect is computed while it is switched on, and shown.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { nothingWasComplainedAbout, page, settled, until, usePage } from './contact-page.mjs';

usePage();

test('an effect is computed only while it is switched on, and says what it brought', async () => {
  const effects = () => page.evaluate(() => globalThis.papilla.session.ready?.session_effects ?? null);
  await settled();
  assert.deepEqual(await effects(), []);
  assert.match(await page.locator('#effects-note').textContent(), /Nothing is named/);
  for (const [name, words] of [['afferents', /^fastest \d+ Hz$/], ['summary', /^\d+\.\d\d N on \d+ mm²$/], ['points', /J\/m³$/], ['contact_window', /^\d+ KiB an answer$/]]) {
    await page.check(`#effect-${name}`);
    await until((wanted) => globalThis.papilla.session.ready?.session_effects.includes(wanted), name);
    await until(([wanted, source]) => new RegExp(source, 'u').test(document.getElementById(`effect-${wanted}`).closest('tr').cells[2].textContent), [name, words.source]);
    await page.uncheck(`#effect-${name}`);
    await until(() => globalThis.papilla.session.ready?.session_effects.length === 0);
  }
  await page.check('#effect-spikes');
  await until(() => globalThis.papilla.spikes.units.length > 0);
  assert.ok(await page.locator('#spikes').isVisible());
  await page.uncheck('#effect-spikes');
  assert.equal(await page.locator('#spikes').isVisible(), false);
  // What follows a switch is held against what was before it.
  await until(() => globalThis.papilla.effects.recent.count >= 12);
  await page.check('#effect-summary');
  await until(() => /^Summary on: [+−].* ms a frame now/.test(document.getElementById('effects-note').textContent));
  await page.uncheck('#effect-summary');
});

test('friction is of the object, and shear comes with it', async () => {
  await page.check('#effect-shear_energy');
  await until(() => globalThis.papilla.session.ready?.session_effects.includes('shear_energy'));
  assert.match(await page.locator('#friction-out').textContent(), /^0\.50$/);
  await page.fill('#slide', '10');
  await until(() => Math.abs(globalThis.papilla.press.slidMm) > 1);
  await page.fill('#slide', '0');
  await page.fill('#friction', '0');
  await until(() => globalThis.papilla.session.ready?.session_effects.length === 0);
  assert.equal(await page.isChecked('#effect-shear_energy'), false);
  await settled();
});

test('friction that came with the switch of shear goes with it, and the second answer has shear too', async () => {
  await page.selectOption('#with', 'tier:small');
  await page.check('#effect-shear_energy');
  await until(() => globalThis.papilla.comparison.session.ready?.session_effects.includes('shear_energy'));
  await until(() => /unknown with friction or creep$/.test(document.querySelector('#other-sure .wide').textContent));
  assert.equal(await page.locator('#friction-out').textContent(), '0.50');
  await page.uncheck('#effect-shear_energy');
  assert.equal(await page.locator('#friction-out').textContent(), 'none');
  await until(() => globalThis.papilla.session.ready?.method === 'pixels');
  await page.selectOption('#with', '');
  await settled();
});

test('electrodes are shown as they lie, within their card', async () => {
  await page.check('#effect-actuators');
  await until(() => document.querySelectorAll('.electrodes i').length === 16);
  await until(() => [...document.querySelectorAll('.electrodes i')].some((one) => Number(one.style.opacity) > 0.1));
  const [card, table] = await page.evaluate(() => ['.effects', '#effects-list'].map((name) => document.querySelector(name).getBoundingClientRect().right));
  assert.ok(table <= card, `the table ends at ${table}, its card at ${card}`);
  await page.uncheck('#effect-actuators');
});

nothingWasComplainedAbout();
