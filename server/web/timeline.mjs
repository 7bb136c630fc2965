// The last seconds as curves, and a recording of the press that can be sent again.

import { roundUp } from './colour.mjs';
import { sheetOf } from './sheet.mjs';
import { onTheme } from './theme.mjs';

const SPAN_MS = 10000;
const KEPT = 2048;
const SERIES = [
  { name: 'force', unit: 'N', digits: 2, least: 0.5, id: 'now-force' },
  { name: 'energy', unit: 'J/m³', digits: 0, least: 20, id: 'now-sed' },
  { name: 'rates', unit: 'Hz', digits: 0, least: 10, id: 'now-rate', none: '– (switch on Firing rates)' },
];
/** A recording ends by itself: ten minutes at 60 frames a second. */
const RECORDED_MOST = 36000;

const byId = (id) => document.getElementById(id);

export class Timeline {
  constructor() {
    this.canvas = byId('time-plot');
    this.atMs = new Float64Array(KEPT).fill(-Infinity);
    this.values = SERIES.map(() => new Float32Array(KEPT));
    this.next = 0;
    this.lastMs = -Infinity;
    /** Frames as they were pressed and answered. */
    this.recorded = [];
    this.isRecording = false;
    this.playFromMs = NaN;
    this.#readTheme();
    onTheme(() => this.#readTheme());
    byId('record').addEventListener('click', () => this.record(!this.isRecording));
    byId('play-record').addEventListener('click', () => this.play(!this.isPlaying));
  }

  get isPlaying() {
    return !Number.isNaN(this.playFromMs);
  }

  #readTheme() {
    const style = getComputedStyle(this.canvas);
    const force = style.getPropertyValue('--force').trim().split(/\s+/).join(' ');
    this.colours = [`rgb(${force})`, style.getPropertyValue('--unet'), style.getPropertyValue('--sa1')];
    this.ink = style.getPropertyValue('--muted');
    this.line = style.getPropertyValue('--line');
  }

  record(on) {
    if (on) {
      this.recorded = [];
      this.play(false);
    }
    this.isRecording = on;
    byId('record').setAttribute('aria-pressed', String(on));
    byId('record').textContent = on ? 'Stop' : 'Record';
    byId('play-record').disabled = on || this.recorded.length === 0;
    if (!on && this.recorded.length) byId('record-note').textContent = `${this.recorded.length} frames in ${(this.lengthMs / 1000).toFixed(1)} s are kept; Replay sends them again, CSV saves them.`;
  }

  get lengthMs() {
    return this.recorded.length ? this.recorded.at(-1).ms - this.recorded[0].ms : 0;
  }

  play(on) {
    this.playFromMs = on && this.recorded.length ? performance.now() : NaN;
    byId('play-record').setAttribute('aria-pressed', String(this.isPlaying));
    byId('play-record').textContent = this.isPlaying ? 'Stop' : 'Replay';
  }

  /** The recorded frame that is due; null when none is, and after the last one. */
  due(nowMs) {
    if (!this.isPlaying) return null;
    const at = this.recorded[0].ms + (nowMs - this.playFromMs);
    if (at > this.recorded.at(-1).ms) {
      this.play(false);
      return null;
    }
    let [low, high] = [0, this.recorded.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.recorded[middle].ms <= at) low = middle;
      else high = middle - 1;
    }
    return this.recorded[low];
  }

  /** Takes what an answer brought; `pressed` is what was sent. */
  add(nowMs, forceN, sedPeak, rateHz, pressed, serverMs) {
    this.atMs[this.next] = nowMs;
    [forceN, sedPeak, rateHz].forEach((value, k) => { this.values[k][this.next] = value; });
    this.next = (this.next + 1) % KEPT;
    if (!this.isRecording) return;
    this.recorded.push({ ms: nowMs, ...pressed, forceN, sedPeak, rateHz, serverMs });
    if (this.recorded.length >= RECORDED_MOST) this.record(false);
  }

  /** Draws the curves, some times a second. */
  draw(nowMs) {
    if (nowMs - this.lastMs < 60) return;
    this.lastMs = nowMs;
    const sheet = sheetOf(this.canvas);
    if (!sheet) return;
    const { context, width, height } = sheet;
    const bottom = height - 14;
    context.font = '11px system-ui, sans-serif';
    context.fillStyle = this.line;
    for (let s = 0; s <= 10; s += 2) context.fillRect(Math.min(width - 1, Math.round(width - (s / 10) * width)), 0, 1, bottom);
    context.fillStyle = this.ink;
    for (let s = 0; s <= 10; s += 2) {
      context.textAlign = s === 0 ? 'right' : s === 10 ? 'left' : 'center';
      context.fillText(s === 0 ? 'now' : `−${s} s`, width - (s / 10) * width, height - 2);
    }
    // Each curve has a band of its own: side by side on one scale they would hide each other.
    const shown = SERIES.map((series, k) => ({ ...series, k, ...this.#seen(k, nowMs) })).filter(({ latest, id, none = '–' }) => {
      if (Number.isNaN(latest)) this.#say(id, none);
      return !Number.isNaN(latest);
    });
    const bandPx = bottom / Math.max(1, shown.length);
    shown.forEach((series, n) => {
      const top = Math.max(series.least, roundUp(1.1 * series.most));
      context.fillStyle = this.line;
      context.fillRect(0, Math.round((n + 1) * bandPx), width, 1);
      this.#curve(context, series.k, nowMs, { width, bottom: (n + 1) * bandPx - 2, perUnit: (bandPx - 6) / top });
      context.fillStyle = this.ink;
      context.textAlign = 'left';
      context.fillText(`${Number(top.toPrecision(3))} ${series.unit}`, 3, n * bandPx + 11);
      this.#say(series.id, `${series.latest.toFixed(series.digits)} ${series.unit}`);
    });
  }

  #say(id, text) {
    if (byId(id).textContent !== text) byId(id).textContent = text;
  }

  /** The greatest value of a series within the span, and the latest; NaN where there is none. */
  #seen(k, nowMs) {
    let [most, latest] = [NaN, NaN];
    for (let n = 0; n < KEPT; n++) {
      const at = (this.next + n) % KEPT;
      const value = this.values[k][at];
      if (!(nowMs - this.atMs[at] < SPAN_MS) || Number.isNaN(value)) continue;
      most = most > value ? most : value;
      latest = value;
    }
    return { most, latest };
  }

  #curve(context, k, nowMs, { width, bottom, perUnit }) {
    context.strokeStyle = this.colours[k];
    context.lineWidth = 1.5;
    context.beginPath();
    let pen = false;
    for (let n = 0; n < KEPT; n++) {
      const at = (this.next + n) % KEPT;
      const ago = nowMs - this.atMs[at];
      const value = this.values[k][at];
      if (!(ago < SPAN_MS) || Number.isNaN(value)) {
        pen = false;
        continue;
      }
      const [x, y] = [width - (ago / SPAN_MS) * width, bottom - value * perUnit];
      if (pen) context.lineTo(x, y);
      else context.moveTo(x, y);
      pen = true;
    }
    context.stroke();
  }

  /** The recording, or else the last seconds, as a table. */
  csv() {
    const rows = this.recorded.length ? this.recorded : this.#lately();
    const names = ['ms', 'u_px', 'v_px', 'depth_mm', 'slid_mm', 'force_n', 'sed_max_j_per_m3', 'sa1_max_hz', 'server_ms'];
    const keys = ['ms', 'u', 'v', 'depthMm', 'slidMm', 'forceN', 'sedPeak', 'rateHz', 'serverMs'];
    const from = rows[0]?.ms ?? 0;
    const cell = (row, key) => {
      const value = key === 'ms' ? row.ms - from : row[key];
      return value === undefined || Number.isNaN(value) ? '' : String(Number(value.toPrecision(7)));
    };
    return `${[names.join(','), ...rows.map((row) => keys.map((key) => cell(row, key)).join(','))].join('\n')}\n`;
  }

  #lately() {
    const rows = [];
    for (let n = 0; n < KEPT; n++) {
      const at = (this.next + n) % KEPT;
      if (this.atMs[at] === -Infinity) continue;
      const [forceN, sedPeak, rateHz] = this.values.map((values) => values[at]);
      rows.push({ ms: this.atMs[at], forceN, sedPeak, rateHz });
    }
    return rows;
  }
}
