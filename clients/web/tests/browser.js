// Headless Chromium with this client in a page of the server's.

import { readFile } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const ROOT = fileURLToPath(new URL('..', import.meta.url));
const FLAGS = [
  '--headless=new', '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
  '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  '--enable-precise-memory-info', '--js-flags=--expose-gc',
];

export const serverUrl = () => {
  const url = process.env.PAPILLA_URL;
  if (!url) throw new Error('set PAPILLA_URL to the address of a running server, as http://127.0.0.1:7224');
  return url;
};

export const launch = () => chromium.launch({ executablePath: process.env.PAPILLA_CHROMIUM ?? '/usr/bin/chromium', args: FLAGS });

/**
 * A page of the server's with this folder at /client/. The document is the server's own: to one that Chromium did not get from
 * this machine it refuses connections to this machine.
 * @param {import('playwright-core').Browser} browser
 */
export async function openPage(browser) {
  const page = await browser.newPage();
  const base = serverUrl();
  await page.route(`${new URL(base).origin}/client/**`, async (route) => {
    const path = new URL(route.request().url()).pathname.replace('/client/', '');
    return route.fulfill({ contentType: 'text/javascript', body: await readFile(ROOT + path) });
  });
  await page.goto(`${base}/healthz`);
  return page;
}
