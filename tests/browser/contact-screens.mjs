// The page with a contact model: what is in sight, on a desk and on a phone.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { chooseRadio, keep, nothingWasComplainedAbout, page, settled, until, usePage } from './contact-page.mjs';

usePage();

test('every choice is read whole, and a flag leaves the contact in sight', async () => {
  for (const width of [390, 1280, 1440]) {
    await page.setViewportSize({ width, height: 900 });
    const cut = await page.evaluate(() => [...document.querySelectorAll('.field select, .inline select')].filter((select) => select.checkVisibility()).flatMap((select) => {
      const copy = Object.assign(select.cloneNode(true), { style: 'width: max-content; max-width: none' });
      select.after(copy);
      const [needed, has] = [copy.offsetWidth, select.offsetWidth];
      copy.remove();
      return needed > has ? [`${select.id}: ${needed} of ${has} px`] : [];
    }));
    assert.deepEqual(cut, [], `${width} px wide`);
  }
  await chooseRadio('shape', 'wedge');
  await page.fill('#depth', '2');
  await until(() => document.querySelectorAll('#flags span').length >= 2);
  /** The rows of the map that the flags cover, and the one that is pressed. */
  const rows = () => page.evaluate(() => {
    const [flags, map] = ['#flags', '#sed .stack'].map((name) => document.querySelector(name).getBoundingClientRect());
    return { from: (224 * (flags.top - map.top)) / map.height, to: (224 * (flags.bottom - map.top)) / map.height, pressed: globalThis.papilla.press.uvPx[1] };
  });
  const atFoot = await rows();
  assert.ok(atFoot.to - atFoot.from < 90 && atFoot.from > atFoot.pressed + 5, JSON.stringify(atFoot));
  const place = await page.evaluate(() => Array.from(globalThis.papilla.press.uvPx));
  await page.evaluate(() => { globalThis.papilla.press.moveToPixel(112, 200); globalThis.papilla.control.changed = true; });
  await until(() => document.getElementById('flags').dataset.at === 'top' && !document.getElementById('flags').hidden);
  const atTop = await rows();
  assert.ok(atTop.to < atTop.pressed - 20, JSON.stringify(atTop));
  await page.evaluate((uv) => { globalThis.papilla.press.moveToPixel(...uv); globalThis.papilla.control.changed = true; }, place);
  await page.fill('#depth', '1');
  await chooseRadio('shape', 'plate');
  await settled();
});

test('the first screen shows the three promises, on a phone one at a time', async () => {
  /** What of the elements does not lie on the first screen, above what lies at its foot. */
  const beyond = (selectors) => page.evaluate((all) => {
    window.scrollTo(0, 0);
    const bar = document.querySelector('.quick');
    const foot = getComputedStyle(bar).position === 'fixed' ? bar.getBoundingClientRect().top : window.innerHeight;
    return all.filter((selector) => {
      const element = document.querySelector(selector);
      const box = element?.getBoundingClientRect();
      const end = bar.contains(element) ? window.innerHeight : foot;
      return !element?.checkVisibility() || box.top < 0 || box.left < 0 || box.bottom > end || (box.right > window.innerWidth && selector !== '#shapes');
    });
  }, selectors);
  await chooseRadio('shape', 'sphere');
  const pair = ['#pad', '#sed .stack', '#sed-ms', '#other .stack', '#other-ms', '#difference .stack', '#apart'];
  await page.selectOption('#with', 'tier:small');
  await until(() => globalThis.papilla.pictures.pair.apart > 0);
  await page.setViewportSize({ width: 1440, height: 900 });
  await settled();
  const due = ['#ladder-plot', '#ladder-now', '#effect-summary', '#frame-bar', '#hard-cases', '.verdict'];
  assert.deepEqual(await beyond([...pair, ...due]), [], 'on a desk');
  await page.setViewportSize({ width: 390, height: 844 });
  await settled();
  for (const [promise, own] of Object.entries({ ladder: ['#ladder-plot', '#ladder-now'], effects: ['#frame-bar', '#effect-shear_energy', '#effect-relaxation', '#effect-afferents'], hard: ['#hard-cases', '.verdict'] })) {
    await chooseRadio('promise', promise);
    assert.deepEqual(await beyond([...pair, '#mode', '#shapes', '#depth', '#promise', ...own]), [], `${promise}, on a phone`);
    assert.match(await page.locator(`#tab-${promise}`).textContent(), /\d|answered|refused/);
    await keep(`promise-${promise}-phone`);
  }
  await chooseRadio('promise', 'ladder');
  await page.selectOption('#with', '');
});

test('it fits a phone', async () => {
  await page.emulateMedia({ colorScheme: 'dark' });
  await page.setViewportSize({ width: 390, height: 844 });
  await settled();
  await keep('contact-dark-phone');
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
  assert.ok(wide <= 0, `the page is ${wide} px wider than the screen`);
  assert.ok(await page.locator('#finger-force').isVisible());
  await chooseRadio('mode', 'hand');
  await until(() => globalThis.papilla.hand.hand?.ready);
  const beyond = await page.evaluate(() => [document.documentElement.scrollWidth - window.innerWidth, ...[...document.querySelectorAll('.digit')].map((digit) => digit.getBoundingClientRect().right - window.innerWidth)]);
  assert.ok(beyond.every((px) => px <= 0), `beyond the screen: ${beyond} px`);
  await keep('hand-dark-phone');
  await chooseRadio('mode', 'press');
});

nothingWasComplainedAbout();
