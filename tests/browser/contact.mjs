// The page against a server as it ships, with a contact model: a press is a solve there, and what pushes back is shown.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { after, before, test } from 'node:test';
import { BASE, largest, launch, placeOfPeak } from './browser.mjs';
import { dome, glbOf, stlOf } from './meshes.mjs';

const PATIENCE_MS = 90000;
let browser;
let page;
let listing;
/** What the page begins with: the model, the set of the ladder, the second model. */
let begun;
const complaints = [];

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
});

after(async () => browser?.close());

const until = (condition, argument) => page.waitForFunction(condition, argument, { timeout: PATIENCE_MS });
const chooseRadio = (name, value) => page.check(`input[name=${name}][value=${value}]`, { force: true });
const keep = async (name) => { if (process.env.PAPILLA_SHOTS) await page.screenshot({ path: `${process.env.PAPILLA_SHOTS}/${name}.png`, fullPage: true }); };

const chosen = async () => Promise.all(['tier', 'ladder-set', 'with'].map((id) => page.locator(`#${id}`).inputValue()));

/** Waits until the indenter is announced and has arrived, and a frame sent after that is answered. */
async function settled() {
  await until(() => {
    const { control, session, contact } = globalThis.papilla;
    return session.ready && !contact.isOther && control.depthMm === (control.down || control.held ? Number(document.getElementById('depth').value) : 0);
  });
  const sent = await page.evaluate(() => globalThis.papilla.session.sequence);
  await until((after) => globalThis.papilla.answered.sequence > after, sent + 1);
}

/** What pushes back, and the pressure that was found. */
const felt = () => page.evaluate(() => {
  const { answered, pictures: { finger }, press, meters } = globalThis.papilla;
  return {
    ...meters.pressNow, isUnsettled: document.getElementById('flags').textContent.includes('not settled'), isDrawn: finger.force !== null, pressurePa: Array.from(answered.pressurePa), sedJPerM3: Array.from(answered.sedJPerM3),
    normal: Array.from(press.normal), pointMm: Array.from(press.pointMm), uvPx: Array.from(press.uvPx),
    said: document.getElementById('force').textContent, inPicture: document.getElementById('finger-force').textContent,
  };
});

const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);

test('a press is solved by the server, and the page says so', async () => {
  await settled();
  assert.equal(await page.locator('#solved').isVisible(), true);
  assert.equal(await page.locator('#estimate .estimate-only').isVisible(), false);
  assert.equal(await page.evaluate(() => globalThis.papilla.session.ready.version), 3);
  const { said, inPicture, forceN, areaMm2, isDrawn, pressurePa, sedJPerM3 } = await felt();
  assert.ok(forceN > 0.05 && areaMm2 > 5 && isDrawn && largest(pressurePa) > 1000 && largest(sedJPerM3) > 1, JSON.stringify({ forceN, areaMm2, isDrawn }));
  await until(() => /^\d+\.\d\d N$/.test(document.getElementById('force').textContent));
  assert.match(inPicture, /^\d+\.\d\d N$/, said);
  const wide = await page.evaluate(() => {
    const caption = document.querySelector('#finger-card figcaption');
    return caption.scrollWidth - caption.clientWidth;
  });
  assert.ok(wide <= 0, `the number is cut off by ${wide} px`);
  await keep('contact-light');
});

test('every indenter pushes back along its normal, from where it stands', async () => {
  const shapes = await page.locator('input[name=shape]').evaluateAll((all) => all.map((input) => input.value));
  assert.equal(shapes.length, 14, String(shapes));
  for (const shape of [...shapes, 'plate']) {
    await chooseRadio('shape', shape);
    await settled();
    const { force, forceN, normal, centreMm, pointMm, isUnsettled } = await felt();
    // A blade's flanks are narrower than a pixel. Its force may point aside, and then the page says that contact is not settled.
    const isAlong = -dot(force, normal) > 0.9 * forceN;
    assert.ok((isAlong || (shape === 'wedge' && isUnsettled)) && forceN > 0.02, `${shape}: ${force}, normal ${normal}`);
    const apart = Math.hypot(...centreMm.map((x, k) => x - pointMm[k]));
    assert.ok(apart < 4, `${shape}: pressed at ${pointMm}, felt at ${centreMm}`);
  }
});

test('a larger ball pushes back harder, and so does a deeper press', async () => {
  await chooseRadio('shape', 'sphere');
  const forces = [];
  for (const [radius, depth] of [['3', '0.6'], ['9', '0.6'], ['9', '1.4']]) {
    await page.fill('#size', radius);
    await page.fill('#depth', depth);
    await settled();
    forces.push((await felt()).forceN);
  }
  assert.ok(forces[0] < forces[1] && forces[1] < forces[2], String(forces));
});

test('the mouse moves the indenter, the wheel presses deeper, and lifting it ends the force', async () => {
  const box = await page.locator('#pad').boundingBox();
  const [row, column] = [135, 120];
  await page.mouse.move(box.x + ((column + 0.5) / 224) * box.width, box.y + ((row + 0.5) / 224) * box.height);
  await page.mouse.down();
  await settled();
  const shallow = await felt();
  const peak = placeOfPeak(shallow.pressurePa);
  assert.ok(Math.hypot(peak.row - row, peak.column - column) < 14, `pressure peaks at ${JSON.stringify(peak)}`);
  await page.mouse.wheel(0, -300);
  await settled();
  assert.ok((await felt()).forceN > 1.05 * shallow.forceN);
  await page.mouse.up();
  await page.focus('#pad');
  await page.keyboard.press('Escape');
  await settled();
  const lifted = await felt();
  assert.deepEqual([lifted.forceN, lifted.isDrawn, largest(lifted.pressurePa), lifted.inPicture], [0, false, 0, '0.00 N']);
  await page.keyboard.press(' ');
  await settled();
  assert.ok((await felt()).forceN > 0);
});

test('the finger is drawn as the service moved it: out of the object, and round the contact too', async () => {
  await chooseRadio('shape', 'plate');
  await page.fill('#depth', '1.5');
  await settled();
  await until(() => globalThis.papilla.pictures.finger.isMoved);
  const moved = () => page.evaluate(() => {
    const { pictures: { finger, movedMm }, press, atlas } = globalThis.papilla;
    const rest = atlas.skin.positionsMm;
    let [most, beside, deepest, off] = [0, 0, 0, 0];
    for (let i = 0; i < press.overlapMm.length; i++) {
      const [u, p] = [[0, 1, 2].map((k) => finger.positions[3 * i + k] - rest[3 * i + k]), [0, 1, 2].map((k) => finger.positions[3 * i + k])];
      const size = Math.hypot(...u);
      off = Math.max(off, ...u.map((x, k) => Math.abs(x - movedMm[3 * i + k])));
      most = Math.max(most, size);
      if (press.overlapMm[i] === 0) beside = Math.max(beside, size);
      const height = [0, 1, 2].reduce((sum, k) => sum + (p[k] - press.pointMm[k]) * press.normal[k], 0) - press.heightMm;
      if (press.overlapMm[i] > 0) deepest = Math.max(deepest, height);
    }
    return { most, beside, deepest, off, said: document.getElementById('moved').textContent };
  });
  const pressed = await moved();
  assert.ok(pressed.off < 1e-4, `drawn ${pressed.off} mm off what was answered`);
  assert.ok(pressed.most > 1 && pressed.most < 2, `the farthest vertex moves ${pressed.most} mm under a plate 1.5 mm deep`);
  assert.ok(pressed.deepest < 0.12, `skin is drawn ${pressed.deepest} mm inside the plate`);
  assert.ok(pressed.beside > 0.1, `beside the plate skin moves ${pressed.beside} mm`);
  assert.equal(pressed.said, `${pressed.most.toFixed(2)} mm`);
  await page.focus('#pad');
  await page.keyboard.press('Escape');
  await settled();
  await until(() => document.getElementById('moved').textContent === '0.00 mm');
  assert.equal((await moved()).most, 0);
  await page.keyboard.press(' ');
  await settled();
});

test('an answer says how wrong it is likely to be, where that is known', async () => {
  const said = (pattern, id = 'sed-sure') => until(([source, of]) => new RegExp(source, 'u').test(document.querySelector(`#${of} .wide`).textContent), [pattern.source, id]);
  await chooseRadio('shape', 'sphere');
  await page.fill('#size', '8');
  await page.fill('#depth', '1');
  await settled();
  await said(/^expected error [\d.]+ %; 9 in 10 such answers below [\d.]+ %$/);
  // What is smaller than that error is not drawn; where none is stated it is the network's usual one.
  const floor = (pattern) => until((source) => new RegExp(source, 'u').test(document.querySelector('#sed-scale [data-part=floor]').textContent), pattern.source);
  await floor(/^below [\d.]+ k?J\/m³, the error expected of the first answer, nothing is drawn$/);
  const [typical, bound, wide] = await page.evaluate(() => ['b', 'i', '.sure-bar'].map((name) => document.querySelector(`#sed-sure ${name}`).closest('.sure').querySelector(name).getBoundingClientRect().width));
  assert.ok(typical > 0 && typical < bound && bound <= wide, `${typical} ${bound} ${wide}`);
  await page.selectOption('#with', 'tier:small');
  await said(/^expected error/, 'other-sure');
  await page.selectOption('#with', '');
  await chooseRadio('shape', 'wedge');
  await page.fill('#depth', '2');
  await said(/^expected error: unknown for such a press$/);
  await floor(/, the usual error of nano, nothing is drawn$/);
  await page.focus('#pad');
  await page.keyboard.press('Escape');
  await until(() => document.getElementById('sed-sure').hidden);
  await page.keyboard.press(' ');
  await chooseRadio('shape', 'sphere');
  await page.fill('#depth', '1.4');
  await settled();
});

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

test('every hard case is refused or flagged, or answered without a fault', async () => {
  const due = { 'Not a number': 'refused', 'No rotation': 'refused', Checkerboard: 'flagged', 'Ten times the range': 'flagged', Blade: 'flagged', 'Off the edge': 'flagged', 'Metres for mm': 'flagged', 'Jump of 10 mm': 'plain' };
  for (const [name, kind] of Object.entries(due)) {
    await page.locator('#hard-cases button', { hasText: name }).click();
    await until((state) => document.getElementById('hard-case').dataset.state === state, kind);
    const said = await page.locator('#hard-case').innerText();
    assert.doesNotMatch(said, /NOT finite/);
    if (kind === 'refused') assert.match(said, /Refused with the error (not_finite|bad_contact)/);
    // Beside it, what finite elements do with a difficulty of the kind.
    const beside = await page.locator('#hard-beside').innerText();
    assert.match(beside, /converge|are evaluated|stop with an error/, name);
    if (name === 'Metres for mm') assert.match(beside, /moduli are in MPa, was k?Pa meant\?/);
    if (name === 'Blade') assert.match(beside, /Sharp wedge: \d+ converge, \d+ stop with an error/);
  }
  await page.locator('#hard-all > summary').click();
  await until(() => document.querySelectorAll('#hard-fe details').length > 15);
  assert.match(await page.locator('#hard-fe').innerText(), /\d+ variants of \d+ cases/);
  await page.locator('#hard-all > summary').click();
});

/** Drops a file on the page, as a visitor does; resolves when its mesh presses. */
async function drop(bytes, name) {
  const before = await page.evaluateHandle(() => globalThis.papilla.press.body);
  const base64 = Buffer.from(bytes).toString('base64');
  await page.evaluate(([data, file]) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([Uint8Array.from(atob(data), (c) => c.charCodeAt(0))], file));
    for (const type of ['dragover', 'drop']) document.dispatchEvent(new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true }));
  }, [base64, name]);
  await page.waitForFunction((old) => globalThis.papilla.press.body !== old, before, { timeout: PATIENCE_MS });
  await settled();
  return { note: await page.locator('#mesh-note').textContent(), size: await page.inputValue('#size'), forceN: (await felt()).forceN };
}

test('an STL or a GLB dropped on the page presses, in mm or in metres, and what was mended is said', async () => {
  await page.fill('#depth', '1.5');
  const closed = await drop(stlOf(dome({ radius: 6 })), 'part.stl');
  assert.match(closed.note, /^part\.stl: 384 triangles; its own size\. Its side/);
  assert.ok(closed.forceN > 0.01, `${closed.forceN} N`);
  assert.equal(Number(closed.size), 12);
  const near = ({ forceN }, why) => assert.ok(Math.abs(forceN / closed.forceN - 1) < 0.02, `${why}: ${forceN} N, of ${closed.forceN} N`);
  // The same name, another body: what was dropped last presses.
  const other = await drop(stlOf(dome({ radius: 9 })), 'part.stl');
  assert.ok(other.forceN > 1.05 * closed.forceN, `${other.forceN} N of a larger ball`);
  const metres = await drop(stlOf(dome({ radius: 0.006 })), 'metres.stl');
  assert.match(metres.note, /0\.0120 long in the file: taken as metres, 12 mm\./);
  near(metres, 'in metres');
  const open = await drop(stlOf(dome({ radius: 6, isOpen: true })), 'cup.stl');
  assert.match(open.note, /360 triangles; its own size\. The service asks: .*; 1 hole was closed; is this the body that is meant\?/);
  near(open, 'its hole closed, which the skin does not meet');
  const glb = await drop(glbOf(dome({ radius: 6, isOpen: true })), 'cup.glb');
  assert.match(glb.note, /360 triangles; its own size\. The service asks: .*; 1 hole was closed; is this the body that is meant\?/);
  near(glb, 'GLB');
  const inside = await drop(stlOf(dome({ radius: 6 }).map((facet) => facet.reverse())), 'inside-out.stl');
  assert.match(inside.note, /; 384 triangles were turned; /);
  near(inside, 'turned');
  const whole = await drop(stlOf(dome({ radius: 6 })), 'part.stl');
  assert.equal(whole.note, closed.note, 'of a closed one nothing is asked any more');
  await keep('mesh-dropped');
  assert.equal(await page.locator('body[data-dragging]').count(), 0, 'nothing is dragged any more');
});

test('what is no body is refused with the reason, and the last one goes on pressing', async () => {
  const before = await page.evaluate(() => globalThis.papilla.press.body.hello.triangles.length);
  const flat = dome({ radius: 6, isOpen: true }).map((facet) => facet.map(([x, y]) => [x, y, 0]));
  const note = await page.locator('#mesh-note').textContent();
  const size = await page.inputValue('#size');
  for (const [bytes, name, why] of [[stlOf(flat), 'sheet.stl', /sheet\.stl: the surface has no inside: .* give a sheet a thickness/], [new ArrayBuffer(10), 'notes.txt', /notes\.txt: none of \.stl, \.obj, \.ply, \.glb/]]) {
    await page.setInputFiles('#mesh-file', { name, mimeType: 'model/stl', buffer: Buffer.from(bytes) });
    await until((pattern) => new RegExp(pattern).test(document.getElementById('notice').textContent), why.source);
  }
  await settled();
  assert.equal(await page.evaluate(() => globalThis.papilla.press.body.hello.triangles.length), before);
  assert.deepEqual([await page.locator('#mesh-note').textContent(), await page.inputValue('#size')], [note, size]);
  assert.ok((await felt()).forceN > 0.01, 'it presses');
  // A hand meets the same objects, and takes a sheet back too.
  await chooseRadio('mode', 'hand');
  await until(() => globalThis.papilla.hand.count > 0);
  await page.setInputFiles('#mesh-file', { name: 'sheet.stl', mimeType: 'model/stl', buffer: Buffer.from(stlOf(flat)) });
  await until(() => /sheet\.stl: the surface has no inside/.test(document.getElementById('notice').textContent));
  const rounds = await page.evaluate(() => globalThis.papilla.hand.count);
  await until((count) => globalThis.papilla.hand.count > count, rounds);
  assert.equal(await page.evaluate(() => globalThis.papilla.press.body.hello.triangles.length), before);
  await chooseRadio('mode', 'press');
  await settled();
  await chooseRadio('shape', 'plate');
  await page.fill('#depth', '1');
  await settled();
});

test('a press is recorded and sent again, and goes into files', async () => {
  const saved = async (id) => {
    const [download] = await Promise.all([page.waitForEvent('download'), page.click(`#${id}`)]);
    return readFile(await download.path());
  };
  await page.click('#record');
  await page.fill('#depth', '0.5');
  await settled();
  await page.fill('#depth', '1.2');
  await settled();
  await page.click('#record');
  const depths = await page.evaluate(() => globalThis.papilla.timeline.recorded.map((frame) => frame.depthMm));
  assert.ok(depths.some((depth) => depth < 0.6) && depths.at(-1) === 1.2, String(depths));
  const rows = (await saved('save-csv')).toString().trim().split('\n');
  assert.equal(rows.length, depths.length + 1);
  assert.match(rows[0], /^ms,u_px,v_px,depth_mm,/);
  await page.fill('#depth', '1.5');
  await settled();
  await page.click('#play-record');
  await until(() => globalThis.papilla.control.depthMm < 1.3);
  await until(() => !globalThis.papilla.timeline.isPlaying && globalThis.papilla.control.depthMm === 1.5);
  assert.equal((await saved('save-npy')).subarray(1, 6).toString(), 'NUMPY');
  assert.equal((await saved('save-png')).subarray(1, 4).toString(), 'PNG');
  // What stands in the picture: of a choice what is chosen, and the ends of each scale.
  await page.selectOption('#with', 'tier:small');
  await until(() => globalThis.papilla.pictures.pair.of === 'tier:small');
  const words = await page.evaluate(async () => {
    const { pictureOf } = await import('./share.mjs');
    const [said, { fillText }] = [[], CanvasRenderingContext2D.prototype];
    CanvasRenderingContext2D.prototype.fillText = function write(text, ...at) {
      said.push(text);
      return fillText.call(this, text, ...at);
    };
    pictureOf(Object.values(globalThis.papilla.pictures.views), null);
    CanvasRenderingContext2D.prototype.fillText = fillText;
    return said;
  });
  assert.ok(['Pressure', 'SED by nano', 'SED by small', 'First − second'].every((title) => words.includes(title)), words.join('; '));
  assert.equal(words.filter((word) => /^≥ [\d.]+ (kPa|J\/m³|kJ\/m³)$/.test(word)).length, 3, words.join('; '));
  await page.selectOption('#with', '');
});

test('a link holds what is pressed and how it is computed', async () => {
  await chooseRadio('shape', 'ring');
  await page.fill('#size', '3');
  await page.fill('#depth', '0.8');
  await page.fill('#tilt', '12');
  const hash = await page.evaluate(() => { const { state } = globalThis.papilla; return new URLSearchParams(state).toString(); });
  const other = await browser.newPage();
  await other.goto(`${BASE}#${hash}`, { timeout: PATIENCE_MS });
  await other.waitForFunction(() => globalThis.papilla?.session.ready, undefined, { timeout: PATIENCE_MS });
  const [here, there] = await Promise.all([page, other].map((one) => one.evaluate(() => globalThis.papilla.state)));
  assert.deepEqual(there, here);
  assert.deepEqual([there.shape, there.size, there.tilt, there.with], ['ring', 3, '12', 'none']);
  await other.close();
});

test('a hand: five fingertips of one session, each pressed and lifted by itself', async () => {
  await chooseRadio('mode', 'hand');
  await chooseRadio('shape', 'sphere');
  await page.fill('#size', '4');
  await page.fill('#depth', '1.5');
  const rounds = (more) => page.evaluate((n) => globalThis.papilla.hand.count + n, more).then((wanted) => until((count) => globalThis.papilla.hand.count >= count, wanted));
  const digits = () => page.evaluate(() => Object.fromEntries(globalThis.papilla.hand.digits.map(({ id, forceN, depthMm, press, view }) => [id, { forceN, depthMm, uvPx: Array.from(press.uvPx), sed: Array.from(view.values) }])));
  const down = (share, name) => until(([id, depth]) => globalThis.papilla.hand.digits.find((digit) => digit.id === id).depthMm === depth, [name, share * 1.5]);
  const { hand: fingers } = await until(() => globalThis.papilla.hand.hand?.ready && { hand: globalThis.papilla.hand.hand.ready.fingers }).then((handle) => handle.jsonValue());
  assert.equal(fingers, 5);
  await down(1, 'index');
  await rounds(3);
  const all = await digits();
  assert.deepEqual(Object.keys(all), ['little', 'ring', 'middle', 'index', 'thumb']);
  assert.ok(all.little.forceN > 0.01 && all.little.forceN < all.ring.forceN && all.ring.forceN < all.index.forceN, JSON.stringify(Object.values(all).map((digit) => digit.forceN)));
  assert.match(await page.locator('#hand-time').textContent(), /^five answers in [\d.]+ ms, there and back; each [\d.]+ ms in the server; \d\.\d\d N in all/);
  await page.uncheck('.digit[data-digit=ring] input');
  await down(0, 'ring');
  const pad = page.locator('.digit[data-digit=index] .pad');
  await pad.scrollIntoViewIfNeeded();
  const box = await pad.boundingBox();

  await page.mouse.move(box.x + 0.5 * box.width, box.y + 0.7 * box.height);
  await page.mouse.down();
  await page.mouse.up();
  await rounds(3);
  const moved = await digits();
  assert.deepEqual([moved.ring.forceN, largest(moved.ring.sed)], [0, 0]);
  assert.ok(placeOfPeak(moved.index.sed).row > placeOfPeak(all.index.sed).row + 20, 'the index is pressed nearer to its base');
  assert.deepEqual([placeOfPeak(moved.thumb.sed), moved.thumb.uvPx], [placeOfPeak(all.thumb.sed), all.thumb.uvPx], 'the thumb stays');
  await chooseRadio('shape', 'plate');
  await until(() => globalThis.papilla.hand.hand?.ready && globalThis.papilla.hand.body === globalThis.papilla.press.body);
  await rounds(3);
  assert.ok((await digits()).thumb.forceN > 1.3 * all.thumb.forceN, 'all fingers meet the other shape');
  const link = await page.evaluate(() => new URLSearchParams(globalThis.papilla.state).get('mode'));
  assert.equal(link, 'hand');
  await chooseRadio('mode', 'press');
  assert.equal(await page.evaluate(() => globalThis.papilla.hand.hand), null);
  await settled();
  assert.ok((await felt()).forceN > 0);
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

test('nothing was complained about', () => {
  assert.deepEqual(complaints, []);
});
