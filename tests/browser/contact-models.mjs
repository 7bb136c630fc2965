// The page with a contact model: which network answers, what a second one makes of the same contact, and the line of the ladder.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { BASE, largest } from './browser.mjs';
import { begun, browser, chooseRadio, chosen, felt, listing, nothingWasComplainedAbout, page, PATIENCE_MS, settled, until, usePage } from './contact-page.mjs';

usePage({ isCompared: true });

test('replay sends maps as ever, and a press is solved again after it', async () => {
  await chooseRadio('mode', 'replay');
  await until(() => globalThis.papilla.session.ready && !globalThis.papilla.session.ready.method && globalThis.papilla.replay.judged);
  assert.equal(await page.evaluate(() => globalThis.papilla.pictures.finger.force), null);
  assert.ok(await page.locator('#effect-shear_energy').isDisabled());
  await chooseRadio('mode', 'press');
  assert.ok(await page.locator('#effect-shear_energy').isEnabled());
  await until(() => globalThis.papilla.session.ready?.method);
  await settled();
  assert.ok((await felt()).forceN > 0);
});

test('each mode has the networks that learnt what it gives, and goes on with the sibling', async () => {
  const others = async () => page.locator('#tier optgroup option').evaluateAll((all) => all.map((option) => option.value));
  const learnt = (what) => listing.tiers.filter((tier) => tier.kind === 'network' && tier.learnt === what).map(({ name }) => name);
  const answers = (tier) => until((name) => globalThis.papilla.session.ready?.tier === name && globalThis.papilla.answered.tier === name, tier);
  const fastest = listing.tiers.filter(({ name, kind, learnt: of, named_only: only }) => kind === 'network' && of !== 'fe' && !only && name !== listing.default)
    .reduce((a, b) => (b.predicted_latency_us < a.predicted_latency_us ? b : a)).name;
  assert.deepEqual(begun, [listing.default, 'poses', `tier:${fastest}`]);
  assert.deepEqual(await others(), learnt('fe'));
  const label = (name) => page.locator(`#tier option[value=${name}]`).textContent();
  const percent = (value) => `${(100 * value).toFixed(100 * value < 9.95 ? 1 : 0)} % off`;
  const nano = listing.tiers.find(({ name }) => name === 'nano');
  assert.ok((await label('nano')).includes(percent(nano.relative_l2_median_from_poses)), await label('nano'));
  await chooseRadio('mode', 'replay');
  await answers('nano-maps');
  assert.deepEqual((await chosen()).slice(0, 2), ['nano-maps', listing.judged_on]);
  assert.deepEqual(await others(), learnt('contact'));
  assert.ok((await label('nano')).includes(percent(nano.relative_l2_median)), await label('nano'));
  // A link and a program are of a press, whatever is replayed.
  assert.deepEqual(await page.evaluate(() => [globalThis.papilla.state.tier, globalThis.papilla.tierOfPress]), ['nano', 'nano']);
  // What did not learn it can be had, and says so.
  await page.selectOption('#tier', 'nano');
  await answers('nano');
  await until(() => /nano: it learnt the pressure that contact finds from poses; here maps/.test(document.getElementById('budget-note').textContent));
  await page.selectOption('#tier', listing.default_for_pressure);
  await chooseRadio('mode', 'press');
  await answers(listing.default);
  await until(() => !/learnt/.test(document.getElementById('budget-note').textContent));
  assert.deepEqual((await chosen()).slice(0, 2), [listing.default, 'poses']);
  await page.selectOption('#tier', '');
  await chooseRadio('mode', 'replay');
  await until(() => globalThis.papilla.session.ready && !globalThis.papilla.session.ready.method);
  assert.deepEqual(await page.evaluate(() => [document.getElementById('tier').value, globalThis.papilla.state.tier]), ['', 'by-budget']);
  assert.ok(!learnt('contact').includes(await page.evaluate(() => globalThis.papilla.session.ready.tier)), 'the service chooses by what is given');
  await chooseRadio('mode', 'press');
  await page.selectOption('#tier', 'nano');
  await answers('nano');
  await settled();
});

test('a link that names no model leads to the default, and one by budget to the budget', async () => {
  const context = await browser.newContext();
  for (const [hash, tier] of [['', listing.default], ['#tier=by-budget', ''], ['#tier=small-maps', 'small-maps'], ['#tier=nowhere', listing.default]]) {
    const other = await context.newPage();
    await other.goto(`${BASE}${hash}`, { timeout: PATIENCE_MS });
    await other.waitForFunction(() => globalThis.papilla?.session.ready, undefined, { timeout: PATIENCE_MS });
    assert.equal(await other.locator('#tier').inputValue(), tier, hash);
    await other.close();
  }
  await context.close();
});

test('a second model answers the same contact, and the difference is of that pair', async () => {
  await page.selectOption('#with', 'tier:small');
  await settled();
  await until(() => globalThis.papilla.pictures.pair.apart > 0 && / % apart/.test(document.getElementById('apart').textContent));
  const { first, second, difference, apart, pixels } = await page.evaluate(() => {
    const { pictures: { pair }, atlas } = globalThis.papilla;
    return { first: Array.from(pair.first), second: Array.from(pair.second), difference: Array.from(pair.difference), apart: pair.apart, pixels: Array.from(atlas.interface.raster.pixels) };
  });
  // The press stands still, so that the frame that is on its way is the same contact.
  let [error, size] = [0, 0];
  for (const i of pixels) {
    assert.ok(Math.abs(difference[i] - (first[i] - second[i])) <= 1e-3 * largest(first));
    error += difference[i] ** 2;
    size += second[i] ** 2;
  }
  assert.ok(Math.abs(Math.sqrt(error / size) / apart - 1) < 1e-3, `${Math.sqrt(error / size)}, shown ${apart}`);
  assert.ok(apart < 1 && largest(second) > 1);
  await page.selectOption('#with', 'method:springs');
  await until(() => globalThis.papilla.comparison.session.ready?.method === 'springs');
  await until(() => /contact [\d.]+, network [\d.]+$/.test(document.getElementById('other-ms').textContent));
  await page.selectOption('#with', '');
  assert.equal(await page.locator('#other .stack').isVisible(), false);
  // Who compares with nothing may choose again.
  assert.equal(await page.locator('#with').isVisible(), true);
});

test('the second answer is found from poses as the first one is, and states the error of its own way', async () => {
  /** The errors that an answer states, %. */
  const stated = async (id) => (await page.locator(`#${id} .wide`).textContent()).match(/[\d.]+(?= %)/g)?.map(Number) ?? [];
  const comparedBy = (tier, method) => until((due) => {
    const { ready } = globalThis.papilla.comparison.session ?? {};
    return ready?.tier === due[0] && ready.method === due[1] && globalThis.papilla.session.ready?.method === due[1];
  }, [tier, method]);
  await page.selectOption('#tier', 'small');
  await settled();
  const alone = await stated('sed-sure');
  await page.selectOption('#tier', 'nano');
  await page.selectOption('#with', 'tier:small');
  await comparedBy('small', 'pixels');
  await until(() => /^expected error \d/.test(document.querySelector('#other-sure .wide').textContent));
  await settled();
  const second = await stated('other-sure');
  assert.equal(second.length, 2);
  second.forEach((error, k) => assert.ok(Math.abs(error - alone[k]) <= 0.1 + 0.01 * alone[k], `${second} %, alone ${alone} %`));
  assert.match(await page.locator('#sed-ms').innerText(), /^[\d.]+ ms\ncontact [\d.]+, network [\d.]+$/);
  // What is not compared follows the first answer.
  await page.selectOption('#method', 'springs');
  await comparedBy('small', 'springs');
  await page.selectOption('#method', '');
  await comparedBy('small', 'pixels');
  await page.selectOption('#with', 'method:springs');
  await page.selectOption('#tier', 'large');
  await until(() => globalThis.papilla.comparison.session.ready?.tier === 'large');
  // A network that did not learn the pressure of contact states no error, and the page says why.
  await page.selectOption('#with', 'tier:small-maps');
  await until(() => /unknown, as it learnt maps of pressure$/.test(document.querySelector('#other-sure .wide').textContent));
  await page.selectOption('#with', '');
  await page.selectOption('#tier', 'nano');
  await settled();
});

test('a drag along the line of the ladder goes from model to model', async () => {
  const plot = page.locator('#ladder-plot');
  await plot.scrollIntoViewIfNeeded();
  /** Where the models on the line lie, px of the page, from the fastest to the slowest. */
  const rungs = await page.evaluate(() => {
    const { ladder } = globalThis.papilla;
    const { left, top } = document.getElementById('ladder-plot').getBoundingClientRect();
    return ladder.rungs.filter((rung) => rung.tier !== null && rung.onServedFront).map((rung) => ({ tier: rung.tier, x: left + ladder.x(rung.timeMs), top: top + 4 }));
  });
  assert.ok(rungs.length > 1, JSON.stringify(rungs));
  const [first, last] = [rungs[0], rungs.at(-1)];
  await page.mouse.move(first.x, first.top);
  await page.mouse.down();
  await until((tier) => globalThis.papilla.session.ready?.tier === tier, first.tier);
  await page.mouse.move(last.x, last.top, { steps: 6 });
  await page.mouse.up();
  await until((tier) => globalThis.papilla.session.ready?.tier === tier && document.getElementById('tier').value === tier, last.tier);
  await page.selectOption('#tier', 'nano');
  await settled();
});

nothingWasComplainedAbout();
