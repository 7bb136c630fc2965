// A raster plot of the finger's touch units: a row a unit, the last two seconds, newest on the right.

const SPAN_MS = 2000;
const REFRESH_MS = 500;
const HEAD_BYTES = 8;
const SPIKE_BYTES = 4;
const CLASSES = ['sa1', 'ra', 'pc'];

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

export class SpikeView {
  constructor() {
    this.canvas = byId('spike-plot');
    this.isOn = false;
    this.rows = new Uint16Array(0);
    this.classes = new Uint8Array(0);
    this.fired = new Float64Array(CLASSES.length);
    this.column = 0;
    this.ratedAtMs = 0;
  }

  /** Shows or hides the plot. */
  toggle(on) {
    this.isOn = on;
    byId('spikes').hidden = !on;
  }

  /** Takes the units of a session: rows are in the order of class. */
  setUnits(units) {
    if (!units) return;
    this.classes = Uint8Array.from(units, (unit) => CLASSES.indexOf(unit.class));
    const order = Array.from(units.keys()).sort((a, b) => this.classes[a] - this.classes[b] || a - b);
    this.rows = new Uint16Array(units.length);
    order.forEach((unit, row) => { this.rows[unit] = row; });
    CLASSES.forEach((name, kind) => {
      byId(`spikes-${name}-units`).textContent = String(this.classes.reduce((n, of) => n + (of === kind), 0));
    });
    this.column = 0;
  }

  /** Draws the spikes of an answer to a frame of this time. */
  show(section, timeMs) {
    const context = this.#scroll(timeMs);
    const { width, height } = this.canvas;
    const style = getComputedStyle(this.canvas);
    const colours = CLASSES.map((name) => style.getPropertyValue(`--${name}`));
    const rowHeight = height / Math.max(1, this.rows.length);
    // Rows are thinner than what an eye finds.
    const mark = Math.max(1.5 * (window.devicePixelRatio || 1), rowHeight);
    for (let n = 0; n < section.count; n++) {
      const unit = section.unit(n);
      const kind = this.classes[unit];
      const x = width - 1 - Math.floor((section.beforeMs(n) / SPAN_MS) * width);
      context.fillStyle = colours[kind];
      context.fillRect(x, Math.floor(this.rows[unit] * rowHeight), mark, mark);
      this.fired[kind]++;
    }
    this.#rate(timeMs);
  }

  /** Moves what is drawn to the left by the time that passed. */
  #scroll(timeMs) {
    const { canvas } = this;
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((px) => Math.round(px * ratio));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const context = canvas.getContext('2d');
    const column = Math.floor((timeMs / SPAN_MS) * width);
    const shift = column - this.column;
    this.column = column;
    if (shift < 0 || shift >= width) {
      context.clearRect(0, 0, width, height);
    } else if (shift > 0) {
      context.globalCompositeOperation = 'copy';
      context.drawImage(canvas, -shift, 0);
      context.globalCompositeOperation = 'source-over';
    }
    return context;
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
