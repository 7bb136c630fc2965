// Round trips of whole maps in headless Chromium, one JSON line.
// From the instant at which a frame was due to the answer in the page's hands. Allocation is sampled in a run of its own, 10 s:
// bytes of the JavaScript heap that functions of this client asked for.

import { parseArgs } from 'node:util';
import { launch, openPage, serverUrl } from './browser.js';

const { values } = parseArgs({ options: {
  'rate-hz': { type: 'string', default: '90' },
  'duration-s': { type: 'string', default: '60' },
  'sample-type': { type: 'string', default: 'u16' },
} });
const rateHz = Number(values['rate-hz']);
const sampleType = values['sample-type'];
const SAMPLED_S = 10;

const browser = await launch();
const page = await openPage(browser);

/** @param {number} durationS */
const run = (durationS) => page.evaluate(async ([url, hz, seconds, type]) => {
  // @ts-ignore: a path of the page
  const { MAP_LEN, Session } = await import('/client/papilla.js');
  const session = await Session.connect(url, { tier: 'half-space', sample_type: type }, { crop: false });
  const maps = Array.from({ length: 16 }, (_, k) => Float32Array.from({ length: MAP_LEN }, (_, i) => {
    const [u, v] = [(i % 224) + 0.5 - 112 - 20 * Math.cos(k * Math.PI / 8), Math.floor(i / 224) + 0.5 - 112 - 20 * Math.sin(k * Math.PI / 8)];
    return 15000 * Math.exp(-(u * u + v * v) / 288);
  }));
  const warm = 50;
  const count = Math.round(hz * seconds) + warm;
  const dueMs = new Float64Array(count + 1);
  const took = new Float64Array(count);
  let [answered, missed] = [0, 0];
  session.onanswer = (/** @type {any} */ answer) => {
    if (answer.status === 'ok') took[answered++] = 1000 * (performance.now() - dueMs[answer.sequence]);
    else missed++;
  };
  // Near its instant a frame is waited for by messages to oneself: browsers put 4 ms between timers.
  const channel = new MessageChannel();
  await new Promise((resolve) => {
    let sent = 0;
    const FAR_MS = 6;
    const again = () => channel.port2.postMessage(null);
    const startMs = performance.now() + 100;
    channel.port1.onmessage = () => {
      const next = startMs + (sent * 1000) / hz;
      if (sent < count && performance.now() >= next) {
        dueMs[sent + 1] = next;
        session.send(maps[sent++ % maps.length]);
      }
      if (answered + missed === count) resolve(undefined);
      else if (sent < count && startMs + (sent * 1000) / hz - performance.now() > FAR_MS) setTimeout(again, 1);
      else again();
    };
    again();
  });
  session.close();
  const sorted = took.slice(warm, answered).sort();
  const at = (/** @type {number} */ part) => Math.round(sorted[Math.min(sorted.length - 1, Math.floor(part * sorted.length))]);
  return { frames: sorted.length, missing: missed, p50_us: at(0.5), p99_us: at(0.99), max_us: at(1) };
}, /** @type {[string, number, number, any]} */ ([serverUrl(), rateHz, durationS, sampleType]));

const measured = await run(Number(values['duration-s']));
const devtools = await page.context().newCDPSession(page);
await devtools.send('HeapProfiler.startSampling', /** @type {any} */ ({ samplingInterval: 1024, includeObjectsCollectedByMajorGC: true, includeObjectsCollectedByMinorGC: true }));
const sampled = await run(SAMPLED_S);
const { profile } = await devtools.send('HeapProfiler.stopSampling');
await browser.close();

/** @param {any} node @returns {number} */
const ofClient = (node) => (node.callFrame.url.includes('/client/src/') ? node.selfSize : 0)
  + node.children.reduce((/** @type {number} */ sum, /** @type {any} */ child) => sum + ofClient(child), 0);
const allocated = ofClient(profile.head) / (sampled.frames + sampled.missing);
console.log(JSON.stringify({ client: sampleType === 'u16' ? 'web' : `web-${sampleType}`, rate_hz: rateHz, ...measured, allocated_bytes_per_frame: Math.round(allocated) }));
