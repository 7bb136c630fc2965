// Joints in, forces out, in an emulated headset on a server with a contact model: the frame that leaves holds the joints' finger,
// the force that comes back is that of its poses, a controller feels it, and objects go where they are held.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { launch } from './browser.js';
import { PATIENCE_MS, lower, onScreen, openHeadset, openScene, shot, until } from './scene.js';

/** Keeps the last frame of each finger that left, and the motors' pulses. */
const WATCH = `
  globalThis.left = {};
  const send = WebSocket.prototype.send;
  WebSocket.prototype.send = function (message) {
    if (typeof message !== 'string') {
      const bytes = message instanceof ArrayBuffer ? message : message.buffer.slice(message.byteOffset, message.byteOffset + message.byteLength);
      globalThis.left[new Uint8Array(bytes)[47]] = bytes;
    }
    return send.call(this, message);
  };`;

/** @type {import('playwright-core').Browser} */
let browser;

before(async () => { browser = await launch(); });
after(async () => browser?.close());

/** @param {import('playwright-core').Page} page @param {string} name */
const place = (page, name) => page.evaluate((wanted) => {
  const { mesh } = /** @type {any} */ (globalThis).papillaXr.objects.find((/** @type {any} */ one) => one.name === wanted);
  return mesh.position.toArray();
}, name);

/** @param {number[]} a @param {number[]} b */
const apart = (a, b) => Math.hypot(...a.map((x, k) => x - b[k]));

test('the joints of a hand leave as poses in the frame, and what they feel comes back', async () => {
  const { page, complaints } = await openHeadset(browser, WATCH);
  await lower(page, 'hand');
  await page.waitForFunction(() => /** @type {any} */ (globalThis).papillaXr.finger.forceN > 0.01, undefined, { timeout: PATIENCE_MS });
  // All stands still: what left last is what was felt last.
  await page.waitForTimeout(1500);
  const found = await page.evaluate(async () => {
    const { papillaXr, left } = /** @type {any} */ (globalThis);
    const { finger, objects, renderer, touching } = papillaXr;
    const view = new DataView(left[0]);
    const rows = Array.from(new Float32Array(left[0].slice(48)));
    // The finger as its two joints have it, without the client: x back along it, z out of the nail, the pad at the tip's joint.
    const hand = [1, 0].map((n) => renderer.xr.getHand(n)).find(({ joints }) => joints['index-finger-tip']?.visible);
    const [distal, tip] = ['distal', 'tip'].map((end) => hand.joints[end === 'tip' ? 'index-finger-tip' : 'index-finger-phalanx-distal']);
    const at = (/** @type {any} */ of) => of.getWorldPosition(finger.mesh.position.clone());
    const back = at(distal).sub(at(tip)).normalize();
    const up = back.clone().set(0, 1, 0).applyQuaternion(distal.getWorldQuaternion(finger.mesh.quaternion.clone()));
    const nail = up.sub(back.clone().multiplyScalar(back.dot(up))).normalize();
    const scale = finger.mesh.scale.x;
    // The pad, (9, 0, -6.4) mm in the finger's frame, is where the tip's joint is.
    const origin = at(tip).sub(back.clone().multiplyScalar(9 * scale)).add(nail.clone().multiplyScalar(6.4 * scale));
    const right = nail.clone().cross(back);
    const due = objects.map((/** @type {any} */ { mesh }) => {
      const off = mesh.position.clone().sub(origin).divideScalar(scale);
      return [off.dot(back), off.dot(right), off.dot(nail)];
    });
    // The same poses once more, by a hand of its own: another session, the same contact.
    const poses = objects.map((/** @type {any} */ _, /** @type {number} */ k) => ({ at: rows.slice(7 * k, 7 * k + 3), turn: rows.slice(7 * k + 3, 7 * k + 7) }));
    const { Hand } = await import(/** @type {any} */ ('/xr/papilla.js'));
    const own = await Hand.connect('', { tier: touching.session.ready.tier, objects: objects.map((/** @type {any} */ { shape, objectPaPerMm }) => (
      objectPaPerMm === Infinity ? { shape } : { shape, stiffness_mpa_per_mm: 1e-6 * objectPaPerMm })) });
    let once;
    for (let n = 0; n < 5; n++) once = await own.touch(poses);
    own.close();
    return {
      magic: String.fromCharCode(...new Uint8Array(left[0], 0, 4)), version: view.getUint8(4), kind: view.getUint8(5), type: view.getUint8(6),
      width: view.getUint16(12, true), height: view.getUint16(14, true), finger: view.getUint8(47), bytes: left[0].byteLength,
      rows, due, forceN: finger.forceN, againN: Math.hypot(...once.touch.forceN),
    };
  });
  const { rows, due, forceN, againN, ...head } = found;
  const objects = due.length;
  assert.deepEqual(head, { magic: 'PPL1', version: 3, kind: 4, type: 0, width: 7, height: objects, finger: 0, bytes: 48 + 28 * objects });
  due.forEach((/** @type {number[]} */ at, /** @type {number} */ k) => {
    assert.ok(apart(rows.slice(7 * k, 7 * k + 3), at) < 0.05, `object ${k} is at ${rows.slice(7 * k, 7 * k + 3)} mm in the frame, and the joints say ${at}`);
    assert.ok(Math.abs(Math.hypot(...rows.slice(7 * k + 3, 7 * k + 7)) - 1) < 1e-5, `object ${k} has no unit quaternion`);
  });
  assert.ok(forceN > 0.01 && Math.abs(againN - forceN) < 0.02 * forceN, `${forceN} N came back, and ${againN} N of the same poses`);
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a controller feels the force, and its motor ends with it', async () => {
  const { page, complaints } = await openHeadset(browser, WATCH);
  await page.evaluate(() => {
    const { headset } = /** @type {any} */ (globalThis);
    const [motor] = headset.controllers.right.inputSource.gamepad.hapticActuators;
    /** @type {any} */ (globalThis).pulses = [];
    const pulse = motor.pulse.bind(motor);
    motor.pulse = (/** @type {number} */ value, /** @type {number} */ ms) => {
      /** @type {any} */ (globalThis).pulses.push([value, ms]);
      return pulse(value, ms);
    };
    headset.controllers.left.connected = false;
  });
  await lower(page, 'controller');
  await page.waitForFunction(() => /** @type {any} */ (globalThis).pulses.some((/** @type {number[]} */ [value]) => value > 0.01), undefined, { timeout: PATIENCE_MS });
  const felt = await page.evaluate(() => {
    const { papillaXr, pulses } = /** @type {any} */ (globalThis);
    const values = pulses.map((/** @type {number[]} */ [value]) => value);
    const forces = papillaXr.fingers.map((/** @type {any} */ f) => f.forceN);
    return { greatestN: Math.max(...forces), amplitude: Math.max(...values), ms: pulses.map((/** @type {number[]} */ [, ms]) => ms) };
  });
  // It may have faded on the way to the next picture, which takes long without a graphics card; it is never more than the force.
  assert.ok(felt.amplitude > 0.01 && felt.amplitude < 1.02 * felt.greatestN, JSON.stringify(felt));
  assert.ok(felt.ms.every((/** @type {number} */ ms) => ms === 100), JSON.stringify(felt.ms));
  // Up again: one command of 0, and no more.
  await page.evaluate(() => { /** @type {any} */ (globalThis).headset.controllers.right.position.y += 0.4; });
  await page.waitForFunction(() => {
    const { papillaXr, pulses } = /** @type {any} */ (globalThis);
    return papillaXr.fingers.every((/** @type {any} */ f) => f.forceN === 0) && pulses.at(-1)[0] === 0;
  }, undefined, { timeout: PATIENCE_MS });
  const before = await page.evaluate(() => /** @type {any} */ (globalThis).pulses.length);
  await page.waitForTimeout(500);
  assert.equal(await page.evaluate(() => /** @type {any} */ (globalThis).pulses.length), before);
  assert.deepEqual(complaints, []);
  await page.close();
});

test('a controller holds an object, and the object goes along until it is let go', async () => {
  const { page, complaints } = await openHeadset(browser);
  const begun = await place(page, 'hard block');
  /** @param {number[]} at @param {number} trigger */
  const put = (at, trigger) => page.evaluate(async ([x, y, z, value]) => {
    const { headset, papillaXr } = /** @type {any} */ (globalThis);
    headset.controllers.left.position.set(x, y, z);
    headset.controllers.left.updateButtonValue('trigger', value);
    const { frames } = papillaXr;
    while (papillaXr.frames < frames + 4) await new Promise((done) => setTimeout(done, 10));
  }, [...at, trigger]);
  await page.evaluate(() => { /** @type {any} */ (globalThis).headset.position.set(0, 1.5, 0); });
  await put(begun, 0);
  await put(begun, 1);
  await put([begun[0] + 0.2, begun[1] + 0.1, begun[2] + 0.1], 1);
  const moved = await place(page, 'hard block');
  await shot(page, 'xr-held');
  assert.ok(apart(moved, [begun[0] + 0.2, begun[1] + 0.1, begun[2] + 0.1]) < 0.01, `from ${begun} to ${moved}`);
  await put([begun[0], begun[1], begun[2]], 0);
  assert.ok(apart(await place(page, 'hard block'), moved) < 0.25, 'it was let go on the way');
  const still = await place(page, 'hard block');
  await put([begun[0], begun[1] + 0.3, begun[2]], 0);
  assert.deepEqual(await place(page, 'hard block'), still, 'nothing holds it');
  assert.deepEqual(complaints, []);
  await page.close();
});

test('the right mouse button moves an object, and the finger feels it where it is now', async () => {
  const { page, complaints } = await openScene(browser);
  const begun = await place(page, 'thin bar');
  const [x, y] = await onScreen(page, 'thin bar');
  await page.mouse.move(x, y);
  await page.mouse.down({ button: 'right' });
  await page.mouse.move(x - 40, y + 20, { steps: 4 });
  await page.mouse.up({ button: 'right' });
  const moved = await place(page, 'thin bar');
  assert.ok(moved[0] < begun[0] - 0.03 && moved[2] > begun[2] + 0.01 && moved[1] === begun[1], `from ${begun} to ${moved}`);
  const [newX, newY] = await onScreen(page, 'thin bar');
  await page.mouse.move(newX, newY);
  await page.mouse.down();
  await until(page, 'never touched', (wanted) => {
    const { finger } = /** @type {any} */ (globalThis).papillaXr;
    return finger.touched?.name === wanted && finger.forceN > 0.005;
  }, 'thin bar');
  await shot(page, 'xr-moved');
  assert.match((await page.textContent('#most')) ?? '', /^\d+ J\/m3$/);
  assert.deepEqual(complaints, []);
  await page.close();
});
