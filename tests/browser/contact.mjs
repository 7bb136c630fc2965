// The page against a server as it ships, with a contact model: a press is a solve there, and what pushes back is shown.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { largest, placeOfPeak } from './browser.mjs';
import { chooseRadio, felt, keep, nothingWasComplainedAbout, page, settled, until, usePage } from './contact-page.mjs';

usePage({ isCompared: true });

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

nothingWasComplainedAbout();
