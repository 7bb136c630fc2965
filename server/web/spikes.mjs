// A raster plot of the finger's touch fibres: a row a fibre, a band a class, the last two seconds.

import { sheetOf } from './sheet.mjs';
import { onTheme } from './theme.mjs';

const SPAN_MS = 2000;
const REFRESH_MS = 500;
const HEAD_BYTES = 8;
const SPIKE_BYTES = 4;
const CLASSES = ['sa1', 'ra', 'pc'];
const NAMES = ['SA1: held skin', 'RA: moving skin', 'Pacinian: vibration'];
/** Fibres shown of each class: so many rows can be told apart. */
const SHOWN = [16, 20, 8];
const BAND_PX = 16;
const AXIS_PX = 16;
const KEPT = 16384;

const byId = (id) => document.getElementById(id);

/** The effect's section: a view whose spikes are read in place. */
export class SpikeSection {
  constructor(data, offset, bytes) {
    this.view = new DataView(data, offset, bytes);
  }

  get count() {
    return this.view.getUint32(4, true);
  }

  unit(n) {
    return this.view.getUint16(HEAD_BYTES + SPIKE_BYTES * n, true);
  }

  /** How long before the frame's time, ms. */
  beforeMs(n) {
    return this.view.getUint16(HEAD_BYTES + SPIKE_BYTES * n + 2, true) / 1000;
  }
}

/** Rows of the fibres that are shown: of each class those nearest to a place, in that order; -1: not shown. */
export function rowsNear(units, [u, v]) {
  const rows = new Int32Array(units.length).fill(-1);
  CLASSES.forEach((name, kind) => {
    const near = Array.from(units.keys()).filter((unit) => units[unit].class === name);
    const distance = (unit) => Math.hypot(units[unit].px[0] - u, units[unit].px[1] - v);
    near.sort((a, b) => distance(a) - distance(b) || a - b);
    near.slice(0, SHOWN[kind]).forEach((unit, row) => { rows[unit] = row; });
  });
  return rows;
}

export class SpikeView {
  constructor() {
    this.canvas = byId('spike-plot');
    this.isOn = false;
    this.units = [];
    this.rows = new Int32Array(0);
    this.classes = new Uint8Array(0);
    this.counts = [0, 0, 0];
    /** The last spikes, oldest overwritten first: unit and time. */
    this.unitOf = new Uint16Array(KEPT);
    this.atMs = new Float64Array(KEPT).fill(-Infinity);
    this.next = 0;
    this.fired = new Float64Array(CLASSES.length);
    this.ratedAtMs = 0;
    this.place = [NaN, NaN];
    this.#readTheme();
    onTheme(() => this.#readTheme());
  }

  #readTheme() {
    const style = getComputedStyle(this.canvas);
    this.colours = CLASSES.map((name) => style.getPropertyValue(`--${name}`));
    this.ink = style.getPropertyValue('--muted');
    this.line = style.getPropertyValue('--line');
  }

  /** Shows or hides the plot. */
  toggle(on) {
    this.isOn = on;
    byId('spikes').hidden = !on;
  }

  /** Takes the fibres of a session. */
  setUnits(units) {
    if (!units) return;
    this.units = units;
    this.classes = Uint8Array.from(units, (unit) => CLASSES.indexOf(unit.class));
    this.counts = CLASSES.map((_, kind) => this.classes.reduce((n, of) => n + (of === kind), 0));
    CLASSES.forEach((name, kind) => { byId(`spikes-${name}-units`).textContent = String(this.counts[kind]); });
    this.atMs.fill(-Infinity);
    this.place = [NaN, NaN];
  }

  /** Rows go to the fibres nearest to the point that is pressed. */
  #follow([u, v]) {
    if (Math.hypot(u - this.place[0], v - this.place[1]) < 1) return;
    this.place = [u, v];
    this.rows = rowsNear(this.units, this.place);
  }

  /** Draws the spikes of an answer to a frame of this time; `uvPx` is where the press is. */
  show(section, timeMs, uvPx) {
    this.#follow(uvPx);
    for (let n = 0; n < section.count; n++) {
      const unit = section.unit(n);
      this.unitOf[this.next] = unit;
      this.atMs[this.next] = timeMs - section.beforeMs(n);
      this.next = (this.next + 1) % KEPT;
      this.fired[this.classes[unit]]++;
    }
    this.#draw(timeMs);
    this.#rate(timeMs);
  }

  #draw(nowMs) {
    const sheet = sheetOf(this.canvas);
    if (!sheet) return;
    const { context, width, height } = sheet;
    context.font = '11px system-ui, sans-serif';
    const total = SHOWN.reduce((sum, n) => sum + n, 0);
    const rowPx = (height - AXIS_PX - BAND_PX * CLASSES.length) / total;
    const tops = [];
    let top = 0;
    CLASSES.forEach((_, kind) => {
      context.fillStyle = this.colours[kind];
      context.fillText(`${NAMES[kind]} (${Math.min(SHOWN[kind], this.counts[kind])} of ${this.counts[kind]} fibres, the nearest on top)`, 2, top + 12);
      top += BAND_PX;
      tops.push(top);
      context.fillStyle = this.line;
      for (let row = 0; row <= SHOWN[kind]; row += SHOWN[kind]) context.fillRect(0, Math.round(top + row * rowPx), width, 1);
      top += SHOWN[kind] * rowPx;
    });
    for (let n = 0; n < KEPT; n++) {
      const ago = nowMs - this.atMs[n];
      const row = ago < SPAN_MS ? this.rows[this.unitOf[n]] : -1;
      if (row < 0) continue;
      const kind = this.classes[this.unitOf[n]];
      context.fillStyle = this.colours[kind];
      context.fillRect(width - (ago / SPAN_MS) * width - 1, tops[kind] + row * rowPx + 0.5, 2.5, Math.max(2, rowPx - 1));
    }
    context.fillStyle = this.ink;
    for (let s = 0; s <= 2; s += 0.5) {
      const x = width - (s * 1000 / SPAN_MS) * width;
      context.textAlign = s === 0 ? 'right' : s === 2 ? 'left' : 'center';
      context.fillText(s === 0 ? 'now' : `−${s} s`, x, height - 3);
    }
    context.textAlign = 'left';
  }

  #rate(timeMs) {
    const passedMs = timeMs - this.ratedAtMs;
    if (passedMs >= 0 && passedMs < REFRESH_MS) return;
    this.ratedAtMs = timeMs;
    CLASSES.forEach((name, kind) => {
      const rate = passedMs > 0 && passedMs < SPAN_MS ? (1000 * this.fired[kind]) / passedMs : 0;
      byId(`spikes-${name}-rate`).textContent = rate.toFixed(0);
    });
    this.fired.fill(0);
  }
}
