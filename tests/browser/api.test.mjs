// The page that shows openapi.json, in headless Chromium. See README.md.

import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { BASE, launch } from './browser.mjs';

let browser;
let page;
const complaints = [];

before(async () => {
  browser = await launch();
  page = await browser.newPage();
  page.setDefaultTimeout(90000);
  page.on('console', (message) => { if (message.type() === 'error') complaints.push(message.text()); });
  page.on('pageerror', (error) => complaints.push(String(error)));
  await page.goto(`${BASE}api.html`);
  await page.waitForSelector('.operation');
});

after(async () => browser?.close());

test('every operation of the document is shown, and nothing else', async () => {
  const { paths } = await (await fetch(`${BASE}openapi.json`)).json();
  const due = Object.entries(paths).flatMap(([path, methods]) =>
    Object.keys(methods).map((method) => `${method.toUpperCase()}${path}`));
  const shown = await page.locator('.operation > summary').evaluateAll((all) =>
    all.map((summary) => summary.querySelector('.method').textContent + summary.querySelector('code').textContent));
  assert.deepEqual(shown.toSorted(), due.toSorted());
  // References are followed: no answer is without its words.
  const answers = await page.locator('.operation p:has(> b)').allTextContents();
  assert.ok(answers.length > due.length);
  assert.deepEqual(answers.filter((answer) => /^\d+\s*$/.test(answer)), []);
});

test('a word finds its operations', async () => {
  await page.fill('#find', 'infer');
  const visible = await page.locator('.operation:visible > summary').allTextContents();
  assert.ok(visible.length >= 2 && visible.every((text) => text.toLowerCase().includes('infer') || text.includes('/v2')), visible.join());
  await page.fill('#find', 'no such thing');
  assert.equal(await page.locator('.operation:visible').count(), 0);
});

test('nothing went wrong on the way', () => assert.deepEqual(complaints, []));
