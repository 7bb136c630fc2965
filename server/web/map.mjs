// A 224 x 224 map as a picture: pixels through a colour table, mask outline and rulers on a second
// canvas above it, a scale bar below, and the value under the pointer.

import { MAP_LEN, SIDE_PX } from './protocol.mjs';
import { AutoRange, TABLE_LEN, TABLES, digits, prefixOf } from './colour.mjs';

/** Decades that the logarithmic scale spans. */
export const LOG_DECADES = 3;
const BAR_LENGTHS_MM = [10, 5, 2, 1];
const TIP = 'tip \u2191';

/** Picture of one quantity; `element` is the <figure> that holds its parts by data-part. */
export class MapView {
  /**
   * `options`: table, unit, least (smallest scale end), signed (scale symmetric about 0), like (a view
   * whose unit prefix this one shares).
   */
  constructor(element, options) {
    const part = (name) => element.querySelector(`[data-part=${name}]`);
    this.element = element;
    this.options = options;
    this.canvas = part('pixels');
    this.overlay = part('overlay');
    this.bar = part('bar');
    this.ticks = part('ticks');
    this.peakText = part('peak');
    this.probeText = part('probe');
    this.ruler = part('ruler');
    this.unitText = part('unit');
    this.overlayContext = this.overlay.getContext('2d');
    this.theme = { outline: '', muted: '', panel: '' };
    this.context = this.canvas.getContext('2d', { willReadFrequently: true });
    this.image = this.context.createImageData(SIDE_PX, SIDE_PX);
    this.words = new Uint32Array(this.image.data.buffer);
    this.colours = new Uint32Array(TABLES[options.table].buffer);
    this.values = new Float32Array(MAP_LEN);
    this.range = new AutoRange(options.least);
    this.logarithmic = false;
    this.pixels = null;
    this.outline = null;
    this.mmPerPx = 0;
    this.peak = 0;
    this.peakShown = -1;
    this.probe = -1;
    this.marker = null;
    this.#drawBar();
    this.#listen();
    this.#readTheme();
    new ResizeObserver(() => this.#fit()).observe(this.overlay);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.#readTheme());
  }

  /** Binds the view to a patch: only its pixels are painted. */
  setPatch(raster, mmPerPx) {
    this.pixels = raster.pixels;
    this.outline = outlineOf(raster.mask);
    this.mmPerPx = mmPerPx;
    this.words.fill(0);
    this.#fit();
  }

  setLogarithmic(on, nowMs) {
    this.logarithmic = on;
    this.#drawTicks();
    this.show(this.values, nowMs, this.range);
  }

  /** Paints `values`; `range` lets another view's scale be used. Returns the largest magnitude. */
  show(values, nowMs, range = null) {
    if (!this.pixels) return 0;
    if (values !== this.values) this.values.set(values);
    this.peak = peakOf(values, this.pixels);
    if (range) {
      if (range.max !== this.range.max) {
        this.range.max = range.max;
        this.#drawTicks();
      }
    } else if (this.range.update(this.peak, nowMs)) {
      this.#drawTicks();
    } else if (this.prefixShown !== this.#prefix()[1]) {
      this.#drawTicks();
    }
    this.#paint();
    this.context.putImageData(this.image, 0, 0);
    this.#showNumbers();
    return this.peak;
  }

  /** Lets the scale shrink after a peak has passed; true when it did. To be called while nothing new comes. */
  settle(nowMs) {
    if (!this.pixels || !this.range.update(this.peak, nowMs)) return false;
    this.#drawTicks();
    this.show(this.values, nowMs, this.range);
    return true;
  }

  #paint() {
    const { pixels, values, words, colours, options } = this;
    const max = this.range.max;
    if (options.signed) {
      const half = (TABLE_LEN - 1) / 2;
      for (let n = 0; n < pixels.length; n++) words[pixels[n]] = colours[index(half + (half * values[pixels[n]]) / max)];
    } else if (this.logarithmic) {
      const slope = (TABLE_LEN - 1) / LOG_DECADES;
      for (let n = 0; n < pixels.length; n++) {
        const v = values[pixels[n]];
        words[pixels[n]] = colours[v > 0 ? index((Math.log10(v / max) + LOG_DECADES) * slope) : 0];
      }
    } else {
      const slope = (TABLE_LEN - 1) / max;
      for (let n = 0; n < pixels.length; n++) words[pixels[n]] = colours[index(slope * values[pixels[n]])];
    }
  }

  #showNumbers() {
    // Text is laid out afresh whenever it changes: only when the shown digits would differ.
    if (Math.abs(this.peak - this.peakShown) > 1e-3 * this.peak || (this.peak === 0 && this.peakShown !== 0)) {
      this.peakText.textContent = this.#quantity(this.peak);
      this.peakShown = this.peak;
    }
    this.#showProbe();
  }

  #showProbe() {
    const text = this.probe < 0 ? '' : this.#quantity(this.values[this.probe]);
    if (this.probeText.textContent !== text) this.probeText.textContent = text;
  }

  /** Value in the unit of the scale. */
  #quantity(value) {
    const [size, prefix] = this.#prefix();
    return `${digits(value / size)} ${prefix}${this.options.unit}`;
  }

  #prefix() {
    return prefixOf((this.options.like ?? this).range.max, this.options.unit);
  }

  #listen() {
    this.overlay.addEventListener('pointermove', (event) => {
      const [u, v] = this.pixelAt(event);
      const inside = u >= 0 && v >= 0 && u < SIDE_PX && v < SIDE_PX;
      this.probe = inside ? Math.floor(v) * SIDE_PX + Math.floor(u) : -1;
      this.#showProbe();
    });
    this.overlay.addEventListener('pointerleave', () => {
      this.probe = -1;
      this.#showProbe();
    });
  }

  /** Continuous pixel coordinates [u, v] of a pointer event. */
  pixelAt(event) {
    const box = this.overlay.getBoundingClientRect();
    return [((event.clientX - box.left) / box.width) * SIDE_PX, ((event.clientY - box.top) / box.height) * SIDE_PX];
  }

  #drawBar() {
    const context = this.bar.getContext('2d');
    const image = context.createImageData(TABLE_LEN, 1);
    image.data.set(TABLES[this.options.table]);
    this.bar.width = TABLE_LEN;
    this.bar.height = 1;
    context.putImageData(image, 0, 0);
    this.#drawTicks();
  }

  #drawTicks() {
    const { max } = this.range;
    const { signed, unit } = this.options;
    this.peakShown = -1;
    const labels = [];
    if (this.logarithmic) {
      for (let k = 0; k <= LOG_DECADES; k++) labels.push(max * 10 ** (k - LOG_DECADES));
    } else {
      for (let k = 0; k <= 4; k++) labels.push(signed ? (max * (k - 2)) / 2 : (max * k) / 4);
    }
    const [size, prefix] = this.#prefix();
    this.prefixShown = prefix;
    this.ticks.replaceChildren(...labels.map((value) => {
      const tick = document.createElement('span');
      tick.textContent = trim(value / size);
      return tick;
    }));
    this.unitText.textContent = `${prefix}${unit}`;
  }

  /** Marks the press: `marker` = [u, v] in pixels, or null. */
  setMarker(marker) {
    this.marker = marker;
    this.drawOverlay();
  }

  #readTheme() {
    const style = getComputedStyle(this.overlay);
    for (const name of ['outline', 'muted', 'panel']) this.theme[name] = style.getPropertyValue(`--${name}`);
    this.drawOverlay();
  }

  /** The picture changed its size: overlay and ruler follow. */
  #fit() {
    const lengthMm = BAR_LENGTHS_MM.find((mm) => mm / this.mmPerPx < SIDE_PX / 4) ?? 1;
    const bar = document.createElement('i');
    bar.style.width = `${(lengthMm / this.mmPerPx) * (this.overlay.clientWidth / SIDE_PX)}px`;
    this.ruler.replaceChildren(bar, `${lengthMm} mm`);
    this.drawOverlay();
  }

  drawOverlay() {
    const { overlay, theme } = this;
    const size = Math.round(overlay.clientWidth * Math.min(2, window.devicePixelRatio || 1));
    if (!this.outline || size === 0) return;
    if (overlay.width !== size || overlay.height !== size) {
      overlay.width = size;
      overlay.height = size;
    }
    const context = this.overlayContext;
    const scale = size / SIDE_PX;
    // Size of a CSS pixel in map pixels.
    const px = SIDE_PX / overlay.clientWidth;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, size, size);
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.lineWidth = 1.25 * px;
    context.strokeStyle = theme.outline;
    context.stroke(this.outline);
    context.font = `${11 * px}px system-ui, sans-serif`;
    context.textAlign = 'right';
    context.lineWidth = 3 * px;
    context.strokeStyle = theme.panel;
    context.strokeText(TIP, SIDE_PX - 2 * px, 11 * px);
    context.fillStyle = theme.muted;
    context.fillText(TIP, SIDE_PX - 2 * px, 11 * px);
    if (this.marker) {
      drawMarker(context, this.marker, px, 'rgb(0 0 0 / 0.55)', 3.5);
      drawMarker(context, this.marker, px, 'rgb(255 255 255 / 0.95)', 1.5);
    }
  }
}

const index = (x) => (x <= 0 ? 0 : x >= TABLE_LEN - 1 ? TABLE_LEN - 1 : (x + 0.5) | 0);

const trim = (value) => String(Number(value.toPrecision(3)));

function peakOf(values, pixels) {
  let peak = 0;
  for (let n = 0; n < pixels.length; n++) {
    const v = Math.abs(values[pixels[n]]);
    if (v > peak) peak = v;
  }
  return peak;
}

/** Border between inside and outside pixels as a path in pixel coordinates. */
function outlineOf(mask) {
  const path = new Path2D();
  const inside = (r, c) => r >= 0 && c >= 0 && r < SIDE_PX && c < SIDE_PX && mask[r * SIDE_PX + c] === 1;
  for (let r = 0; r <= SIDE_PX; r++) {
    for (let c = 0; c <= SIDE_PX; c++) {
      if (inside(r, c) !== inside(r - 1, c)) {
        path.moveTo(c, r);
        path.lineTo(c + 1, r);
      }
      if (inside(r, c) !== inside(r, c - 1)) {
        path.moveTo(c, r);
        path.lineTo(c, r + 1);
      }
    }
  }
  return path;
}

/** A cross-hair; drawn dark below and light above it reads on any colour. */
function drawMarker(context, marker, px, colour, width) {
  const [u, v] = marker;
  const inner = 5 * px;
  const outer = 10 * px;
  context.strokeStyle = colour;
  context.lineWidth = width * px;
  context.beginPath();
  context.arc(u, v, inner, 0, 2 * Math.PI);
  context.moveTo(u + inner, v);
  context.lineTo(u + outer, v);
  context.moveTo(u - inner, v);
  context.lineTo(u - outer, v);
  context.moveTo(u, v + inner);
  context.lineTo(u, v + outer);
  context.moveTo(u, v - inner);
  context.lineTo(u, v - outer);
  context.stroke();
}
