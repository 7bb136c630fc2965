// What clients/conformance/run starts: the cases in a page of headless Chromium.

import { readFileSync } from 'node:fs';
import { launch, openPage, serverUrl } from './browser.js';

const browser = await launch();
try {
  const page = await openPage(browser);
  await page.exposeFunction('report', (/** @type {string} */ line) => console.log(line));
  page.on('pageerror', (error) => console.error(error));
  const failed = await page.evaluate(async (given) => {
    // @ts-ignore: a path of the page
    const { run } = await import('/client/tests/conformance.js');
    return run({ ...given, report: /** @type {any} */ (globalThis).report });
  }, { url: serverUrl(), control: process.env.PAPILLA_CONTROL ?? '', file: JSON.parse(readFileSync(process.env.PAPILLA_CONFORMANCE ?? '', 'utf8')) });
  process.exitCode = failed ? 1 : 0;
} finally {
  await browser.close();
}
