// The page against a server as it ships, with a contact model: a press is a solve there, and what pushes back is shown.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { BASE, largest, launch, placeOfPeak } from './browser.mjs';

const PATIENCE_MS = 90000;
let browser;
let page;
const complaints = [];

before(async () => {
  browser = await launch();
  page = await browser.newPage({ viewport: { width: 1280, height: 900 }, colorScheme: 'light' });
  page.setDefaultTimeout(PATIENCE_MS);
  page.on('console', (message) => { if (['error', 'warning'].includes(message.type())) complaints.push(message.text()); });
  page.on('pageerror', (error) => complaints.push(String(error)));
  await page.goto(BASE, { timeout: PATIENCE_MS });
  await page.selectOption('#tier', 'nano');
  await page.selectOption('#budget', '500000');
});

after(async () => browser?.close());

const until = (condition, argument) => page.waitForFunction(condition, argument, { timeout: PATIENCE_MS });
const chooseRadio = (name, value) => page.check(`input[name=${name}][value=${value}]`, { force: true });
const keep = async (name) => { if (process.env.PAPILLA_SHOTS) await page.screenshot({ path: `${process.env.PAPILLA_SHOTS}/${name}.png`, fullPage: true }); };

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
  const { answered, finger, press, meters } = globalThis.papilla;
  return {
    ...meters.pressNow, isDrawn: finger.force !== null, pressurePa: Array.from(answered.pressurePa), sedJPerM3: Array.from(answered.sedJPerM3),
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
  for (const shape of ['sphere', 'edge', 'plate']) {
    await chooseRadio('shape', shape);
    await settled();
    const { force, forceN, normal, centreMm, pointMm } = await felt();
    assert.ok(-dot(force, normal) > 0.9 * forceN && forceN > 0.02, `${shape}: ${force}, normal ${normal}`);
    const apart = Math.hypot(...centreMm.map((x, k) => x - pointMm[k]));
    assert.ok(apart < 4, `${shape}: pressed at ${pointMm}, felt at ${centreMm}`);
  }
});

test('a larger ball pushes back harder, and so does a deeper press', async () => {
  await chooseRadio('shape', 'sphere');
  const forces = [];
  for (const [radius, depth] of [['3', '0.6'], ['9', '0.6'], ['9', '1.4']]) {
    await page.fill('#radius', radius);
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

test('replay sends maps as ever, and a press is solved again after it', async () => {
  await chooseRadio('mode', 'replay');
  await until(() => globalThis.papilla.session.ready && !globalThis.papilla.session.ready.method && globalThis.papilla.replay.judged);
  assert.equal(await page.evaluate(() => globalThis.papilla.finger.force), null);
  await chooseRadio('mode', 'press');
  await until(() => globalThis.papilla.session.ready?.method);
  await settled();
  assert.ok((await felt()).forceN > 0);
});

test('it fits a phone', async () => {
  await page.emulateMedia({ colorScheme: 'dark' });
  await page.setViewportSize({ width: 390, height: 844 });
  await settled();
  await keep('contact-dark-phone');
  const wide = await page.evaluate(() => document.documentElement.scrollWidth - window.innerWidth);
  assert.ok(wide <= 0, `the page is ${wide} px wider than the screen`);
  assert.ok(await page.locator('#finger-force').isVisible());
});

test('nothing was complained about', () => {
  assert.deepEqual(complaints, []);
});
