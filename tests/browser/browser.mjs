// Starts Chromium and speaks to the server beside it.

import { chromium } from 'playwright-core';

export const MAP_LEN = 224 * 224;
export const BASE = process.env.PAPILLA_URL?.replace(/\/?$/, '/');

const FLAGS = [
  '--headless=new', '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
  '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
];

export function launch() {
  if (!BASE) throw new Error('set PAPILLA_URL to the address of a running server, as http://127.0.0.1:7224');
  const executablePath = process.env.PAPILLA_CHROMIUM ?? '/usr/bin/chromium';
  return chromium.launch({ executablePath, args: FLAGS });
}

/** Bytes of a map from the server, f32 little-endian. */
export async function fetchMap(path, init = {}) {
  const headers = { accept: 'application/octet-stream', ...init.headers };
  const response = await fetch(new URL(path, BASE), { ...init, headers });
  if (!response.ok) throw new Error(`${path}: HTTP ${response.status} ${await response.text()}`);
  return new Float32Array(await response.arrayBuffer());
}

/** The SED that the server answers to a posted pressure map. */
export function postPressure(pressurePa, tier) {
  const body = new Uint8Array(Float32Array.from(pressurePa).buffer);
  const headers = { 'content-type': 'application/octet-stream' };
  return fetchMap(`v1/sed?tier=${encodeURIComponent(tier)}`, { method: 'POST', body, headers });
}

export const largest = (values) => values.reduce((a, b) => Math.max(a, Math.abs(b)), 0);

/** Row and column of the greatest value. */
export function placeOfPeak(values) {
  let best = 0;
  for (let i = 1; i < values.length; i++) if (values[i] > values[best]) best = i;
  return { row: Math.floor(best / 224), column: best % 224 };
}

/** Keeps every WebSocket that the page opens in `sockets`, so that a test can end them. */
export const watchSockets = (page) => page.addInitScript(() => {
  const Real = globalThis.WebSocket;
  globalThis.sockets = [];
  globalThis.WebSocket = class extends Real {
    constructor(...terms) {
      super(...terms);
      globalThis.sockets.push(this);
    }
  };
});
