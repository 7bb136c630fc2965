// Draws the page's pictures of the documents anew, of the service at PAPILLA_URL: docs/reports/pictures/page*.webp.
// Times on the page are those of the machine: run it with a release build, where nothing else runs.

import { writeFile } from 'node:fs/promises';
import { BASE, launch } from './browser.mjs';

const PATIENCE_MS = 90000;
/** Answers after which times are medians of many. */
const ANSWERS = 60;
const FOLDER = new URL('../../docs/reports/pictures/', import.meta.url);
const TERMS = 'tier=small&with=tier:nano&budget=500000';
const PICTURES = [
  { name: 'page', hash: `#shape=sphere&size=8&${TERMS}`, viewport: { width: 1440, height: 900 }, scale: 1.5 },
  { name: 'page-hand', hash: `#mode=hand&shape=plate&depth=1.2&${TERMS}`, viewport: { width: 1440, height: 900 }, scale: 1.25, of: '.hand' },
  { name: 'page-phone', hash: `#shape=sphere&size=8&${TERMS}`, viewport: { width: 390, height: 844 }, scale: 2, isDark: true },
];

const browser = await launch();
for (const { name, hash, viewport, scale, of, isDark } of PICTURES) {
  const context = await browser.newContext({ viewport, deviceScaleFactor: scale, colorScheme: isDark ? 'dark' : 'light' });
  const page = await context.newPage();
  await page.goto(`${BASE}${hash}`, { timeout: PATIENCE_MS });
  await page.waitForFunction((count) => {
    const { mode, hand, answered, pictures } = globalThis.papilla ?? {};
    return mode === 'hand' ? hand.count > count / 5 : answered?.sequence > count && pictures.pair.apart > 0;
  }, ANSWERS, { timeout: PATIENCE_MS });
  // The hint to drag has done its duty.
  await page.evaluate(() => { document.body.dataset.pressed = ''; });
  await page.waitForTimeout(1500);
  const box = of ? await page.locator(of).boundingBox() : { x: 0, y: 0, ...viewport };
  const devtools = await context.newCDPSession(page);
  const { data } = await devtools.send('Page.captureScreenshot', { format: 'webp', quality: 84, clip: { ...box, scale: 1 } });
  const bytes = Buffer.from(data, 'base64');
  await writeFile(new URL(`${name}.webp`, FOLDER), bytes);
  console.log(`${name}.webp: ${Math.round(bytes.length / 1024)} KiB`);
  await context.close();
}
await browser.close();
