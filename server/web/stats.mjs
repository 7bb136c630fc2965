// Live figures of the session: percentiles over the last frames, rates, counts and a strip chart.

import { roundUp } from './colour.mjs';
import { fit } from './sheet.mjs';

const WINDOW = 240;

/** The last `WINDOW` numbers; percentiles are sorted out of a second array made once. */
export class Ring {
  constructor() {
    this.values = new Float64Array(WINDOW);
    this.sorted = new Float64Array(WINDOW);
    this.count = 0;
    this.next = 0;
  }

  push(value) {
    this.values[this.next] = value;
    this.next = (this.next + 1) % WINDOW;
    this.count = Math.min(this.count + 1, WINDOW);
  }

  clear() {
    this.count = 0;
    this.next = 0;
  }

  /** The k-th newest value, 0 the newest. */
  recent(k) {
    return this.values[(this.next - 1 - k + 2 * WINDOW) % WINDOW];
  }

  /** Nearest-rank percentiles p50 and p99 as [p50, p99]; NaN where there is no value. */
  percentiles(out) {
    const view = this.sorted.subarray(0, this.count);
    view.set(this.values.subarray(0, this.count));
    view.sort();
    out[0] = this.count ? view[Math.ceil(0.5 * this.count) - 1] : NaN;
    out[1] = this.count ? view[Math.ceil(0.99 * this.count) - 1] : NaN;
    return out;
  }
}

/** Counts what became of every frame and how long the answered ones took. */
export class Stats {
  constructor() {
    this.roundTripMs = new Ring();
    this.serverMs = new Ring();
    this.answeredAtMs = new Ring();
    this.counts = { ok: 0, superseded: 0, late: 0, error: 0, skipped: 0 };
    this.lateInARow = 0;
  }

  /** Forgets everything: a new tier or budget is a new measurement. */
  clear() {
    this.roundTripMs.clear();
    this.serverMs.clear();
    this.answeredAtMs.clear();
    this.lateInARow = 0;
    for (const key of Object.keys(this.counts)) this.counts[key] = 0;
  }

  answer(status, roundTripMs, serverUs, nowMs) {
    this.counts[status]++;
    this.lateInARow = status === 'late' ? this.lateInARow + 1 : 0;
    if (status !== 'ok') return;
    this.roundTripMs.push(roundTripMs);
    this.serverMs.push(serverUs / 1000);
    this.answeredAtMs.push(nowMs);
  }

  /** SED maps per second over the last second. */
  rate(nowMs) {
    const ring = this.answeredAtMs;
    let n = 0;
    while (n < ring.count && nowMs - ring.recent(n) <= 1000) n++;
    return n;
  }
}

/** Strip chart of the round trips, newest on the right, with the budget as a line; returns its top, ms. */
export function drawStrip(canvas, ring, budgetMs) {
  const ratio = fit(canvas);
  if (ratio === 0) return NaN;
  const { width, height } = canvas;
  const context = canvas.getContext('2d');
  const style = getComputedStyle(canvas);
  const accent = style.getPropertyValue('--accent');
  const warn = style.getPropertyValue('--warn');
  let longest = 0;
  for (let k = 0; k < ring.count; k++) longest = Math.max(longest, ring.recent(k));
  // The budget stays in the picture unless it dwarfs the frames; one hiccup must not dwarf it either.
  const top = Math.min(4 * budgetMs, budgetMs < 3 * longest ? Math.max(1.1 * budgetMs, longest) : roundUp(1.2 * longest));
  const y = (ms) => height - (Math.min(ms, top) / top) * height;
  context.clearRect(0, 0, width, height);
  const step = width / WINDOW;
  for (let k = 0; k < ring.count; k++) {
    const ms = ring.recent(k);
    context.fillStyle = ms > budgetMs ? warn : accent;
    context.fillRect(width - (k + 1) * step, y(ms), Math.max(1, step - 0.5), height);
  }
  context.fillStyle = style.getPropertyValue('--muted');
  if (budgetMs <= top) context.fillRect(0, Math.round(y(budgetMs)), width, ratio);
  return top;
}
