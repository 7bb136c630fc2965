// One map over HTTP, for tools that need no session.

import { addressOf, cleanToken } from './address.js';
import { PapillaError } from './error.js';
import { MAP_LEN } from './wire.js';

/** Longest wait for an answer over HTTP: as long as a request may wait for models that are being loaded. */
export const PATIENCE_MS = 30000;

/**
 * The SED map of a pressure map, by `POST /v1/sed`.
 * @param {string} base where the server is: `host:port` or a URL; '' for the server of the page
 * @param {Float32Array} pressurePa 224 x 224, Pa
 * @param {{finger?: string, tier?: string, budgetUs?: number, token?: string}} [options]
 * @returns {Promise<{map: Float32Array, tier: string, totalUs: number}>} rejected with a PapillaError where it is refused
 */
export async function postPressure(base, pressurePa, options = {}) {
  const url = new URL(addressOf(base).http('/v1/sed'));
  if (options.finger) url.searchParams.set('finger', options.finger);
  if (options.tier) url.searchParams.set('tier', options.tier);
  if (options.budgetUs) url.searchParams.set('budget_us', String(options.budgetUs));
  /** @type {Record<string, string>} */
  const headers = { 'content-type': 'application/octet-stream', accept: 'application/octet-stream' };
  const token = cleanToken(options.token);
  if (token) headers.authorization = `Bearer ${token}`;
  const response = await fetch(url, { method: 'POST', body: Float32Array.from(pressurePa), headers, signal: AbortSignal.timeout(PATIENCE_MS) });
  if (!response.ok) {
    const { error } = await response.json();
    throw new PapillaError({ type: 'error', closes: false, ...error });
  }
  const map = new Float32Array(await response.arrayBuffer());
  if (map.length !== MAP_LEN) throw new Error(`${url.href} answered ${map.length} samples, ${MAP_LEN} are due`);
  return { map, tier: response.headers.get('x-papilla-tier') ?? '', totalUs: Number(response.headers.get('x-papilla-total-us')) };
}
