// The page with a contact model: meshes that are dropped on it, and what it records, saves and puts into a link.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { BASE } from './browser.mjs';
import { browser, chooseRadio, felt, keep, nothingWasComplainedAbout, page, PATIENCE_MS, settled, until, usePage } from './contact-page.mjs';
import { dome, glbOf, stlOf } from './meshes.mjs';

usePage();

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

/** A ball of two domes. */
function ball(how) {
  const half = dome({ ...how, isOpen: true });
  return [...half, ...half.map((facet) => facet.map(([x, y, z]) => [x, y, -z]).reverse())];
}

test('a mesh of 100 000 triangles is decimated and presses like one that fits, and how far it is off is said', async () => {
  const fits = await drop(stlOf(ball({ radius: 6, around: 80, up: 45 })), 'fits.stl');
  assert.match(fits.note, /^fits\.stl: 14240 triangles; its own size\. Its side/);
  const many = await drop(stlOf(ball({ radius: 6, around: 400, up: 64 })), 'many.stl');
  const [, triangles, offMm] = many.note.match(/^many\.stl: 101600 triangles became (\d+): at most ([0-9.e-]+) mm off at a size of 12 mm; its own size\. Its side/).map(Number);
  assert.equal(await page.evaluate(() => globalThis.papilla.press.body.hello.triangles.length), triangles);
  assert.ok(triangles > 15000 && offMm > 0 && offMm < 0.02, many.note);
  assert.ok(Math.abs(many.forceN / fits.forceN - 1) < 0.02, `${many.forceN} N, of ${fits.forceN} N`);
  await keep('mesh-of-many-triangles');
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

nothingWasComplainedAbout();
