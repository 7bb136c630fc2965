// What haptic devices get of a hand of the real service, in headless Chromium. PAPILLA_URL: a server with a contact model.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { launch, openPage } from './browser.js';

/** @type {import('playwright-core').Browser} */
let browser;

before(async () => { browser = await launch(); });
after(async () => browser?.close());

test('a controller follows the force, keeps its rate, and stops when frames stop', async () => {
  const page = await openPage(browser);
  const found = await page.evaluate(async () => {
    const { Device, Hand, force, vibrate } = await import(/** @type {any} */ ('/client/papilla.js'));
    const hand = await Hand.connect('', { tier: 'half-space', objects: [{ shape: { shape: 'sphere', radius_mm: 10 } }] });
    let nowMs = 1000;
    const device = new Device(force(1, 0.01), { maxHz: 20, clockMs: () => nowMs });
    /** @type {[number, number][]} */
    const pulses = [];
    // What a headset's browser has: https://www.w3.org/TR/gamepad-extensions.
    const gamepad = { hapticActuators: [{ pulse: (/** @type {number} */ value, /** @type {number} */ ms) => pulses.push([value, ms]) }] };
    const forces = [];
    for (let step = 0; step < 40; step++) {
      const answer = await hand.touch([{ at: [11.25, 0, -16.53 + 0.02 * step] }]);
      forces.push(Math.hypot(...answer.touch.forceN));
      device.feed(answer);
      nowMs += 10;
      vibrate(gamepad, device.poll());
    }
    const during = pulses.splice(0);
    const last = device.levels[0][0];
    // Not tracked: at once.
    device.feed(await hand.notTracked());
    const untracked = device.levels[0][0];
    device.feed(await hand.touch([{ at: [11.25, 0, -15.8] }]));
    hand.close();
    for (let step = 0; step < 40; step++) {
      nowMs += 10;
      vibrate(gamepad, device.poll());
    }
    return { forces, during, last, untracked, after: pulses, none: vibrate(null, device.stop()), stopped: device.levels[0][0] };
  });
  assert.ok(found.forces[39] > 0.1, String(found.forces[39]));
  // 400 ms at 20 Hz, all but those of forces below the threshold.
  assert.ok(found.during.length >= 5 && found.during.length <= 9, JSON.stringify(found.during));
  assert.ok(found.during.every(([value, ms], i) => ms === 100 && (i === 0 || value >= found.during[i - 1][0])), JSON.stringify(found.during));
  assert.ok(Math.abs(found.last - Math.min(1, (found.forces[39] - 0.01) / 0.99)) < 1e-6);
  assert.equal(found.untracked, 0);
  assert.equal(found.after.at(-1)?.[0], 0, 'the last command stops the motor');
  assert.equal(found.after.filter(([value]) => value === 0).length, 1);
  assert.deepEqual([found.none, found.stopped], [false, 0]);
  await page.close();
});

test('a glove gets an array, and a hand its spikes and shear', async () => {
  const page = await openPage(browser);
  const found = await page.evaluate(async () => {
    const { Device, Hand, actuators } = await import(/** @type {any} */ ('/client/papilla.js'));
    const pads = { radius_mm: 1, gain: 0.002, actuators: [8, 11.25, 14.5].map((x) => ({ at: { mm: [x, 0, -6.5] } })) };
    const objects = [{ shape: { shape: 'sphere', radius_mm: 10 } }];
    const hand = await Hand.connect('', { tier: 'half-space', objects, fingers: [{}, {}], shear: true, effects: ['actuators', 'spikes'], actuators: pads });
    const glove = new Device(actuators(), { fingers: 2, clockMs: () => 0 });
    await hand.touch([{ at: [11.25, 0, -20] }], { finger: 1 });
    const answers = [];
    // Taps, so that units fire however slow the machine is.
    for (let step = 1; step <= 20; step++) {
      answers.push(await hand.touch([{ at: [11.25, 0, step % 2 ? -17 : -15.8] }], { finger: 1 }));
      await new Promise((done) => setTimeout(done, 5));
    }
    const answer = answers.at(-1);
    glove.feed(answer);
    const spikes = answers.flatMap((a) => Array.from(a.spikes.unit, (unit, i) => ({ unit, beforeUs: a.spikes.timeUs.at(-1) - a.spikes.timeUs[i] })));
    const result = {
      levels: glove.poll().levels.map((/** @type {Float64Array} */ finger) => [...finger]),
      actuators: [...answer.actuators], units: hand.ready.units.length, spikes, total: answer.spikes.total,
      shear: answer.shearPa.length, vertices: hand.ready.vertices,
    };
    hand.close();
    return result;
  });
  assert.deepEqual(found.levels[0], [0]);
  found.levels[1].forEach((/** @type {number} */ level, /** @type {number} */ i) => assert.ok(Math.abs(level - Math.min(1, found.actuators[i])) < 1e-6));
  assert.ok(found.levels[1][1] > 0.05);
  assert.equal(found.total, found.spikes.length, 'no spike is lost on the way');
  assert.ok(found.total > 0 && found.spikes.every(({ unit, beforeUs }) => unit < found.units && beforeUs >= 0 && beforeUs < 65536), String(found.total));
  assert.equal(found.shear, 3 * found.vertices);
  await page.close();
});

test('a session of maps gets its spikes', async () => {
  const page = await openPage(browser);
  const total = await page.evaluate(async () => {
    const { MAP_LEN, Session } = await import(/** @type {any} */ ('/client/papilla.js'));
    let nowUs = 1;
    const session = await Session.connect('', { tier: 'half-space', effects: ['spikes'], map: false, spikes: { spikes_max: 16384 } }, { clockUs: () => nowUs });
    const pressure = new Float32Array(MAP_LEN);
    let seen = 0;
    let last = 0;
    for (let step = 0; step <= 20; step++) {
      nowUs += 5000;
      pressure.fill(0);
      for (let y = 95; y < 115; y++) pressure.fill(500 * step, y * 224 + 105, y * 224 + 130);
      const { spikes } = await session.render(pressure);
      seen += spikes.unit.length;
      last = spikes.total;
    }
    session.close();
    return { seen, last };
  });
  assert.ok(total.seen > 0 && total.seen === total.last, JSON.stringify(total));
  await page.close();
});
