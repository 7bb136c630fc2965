// A 224 x 224 map as a picture: pixels through the colours of its scale, mask outline and ruler on a
// second canvas above it, and the value under the pointer.

import { MAP_LEN, SIDE_PX } from './protocol.mjs';
import { TABLE_LEN, digits, percentile } from './colour.mjs';
import { LOG_DECADES } from './scale.mjs';
import { onTheme } from './theme.mjs';

const BAR_LENGTHS_MM = [10, 5, 2, 1];
const TIP = 'tip \u2191';
/** A smaller map stands beside one that says it. */
const TIP_FROM_PX = 130;
/** A scale has to hold this share of the pixels that hold anything: one bright line does not take it. */
const PART = 0.98;

/** Picture of one quantity; `element` is the <figure> that holds its parts by data-part. */
export class MapView {
  constructor(element, scale) {
    const part = (name) => element.querySelector(`[data-part=${name}]`);
    this.element = element;
    this.scale = scale;
    scale.views.push(this);
    this.canvas = part('pixels');
    this.overlay = part('overlay');
    this.peakText = part('peak');
    this.probeText = part('probe');
    this.ruler = part('ruler');
    this.overlayContext = this.overlay.getContext('2d');
    this.theme = { outline: '', muted: '', panel: '' };
    this.context = this.canvas.getContext('2d', { willReadFrequently: true });
    this.image = this.context.createImageData(SIDE_PX, SIDE_PX);
    this.words = new Uint32Array(this.image.data.buffer);
    this.values = new Float32Array(MAP_LEN);
    this.pixels = null;
    this.outline = null;
    this.mmPerPx = 0;
    this.peak = 0;
    /** What the scale has to hold. */
    this.most = 0;
    this.shown = '';
    /** Whether its scale has to hold what it shows. */
    this.isShown = true;
    this.probe = -1;
    this.marker = null;
    this.#listen();
    this.#readTheme();
    new ResizeObserver(() => this.#fit()).observe(this.overlay);
    onTheme(() => this.#readTheme());
  }

  /** Binds the view to a patch: only its pixels are painted. */
  setPatch(raster, mmPerPx) {
    this.pixels = raster.pixels;
    this.outline = outlineOf(raster.mask);
    this.mmPerPx = mmPerPx;
    this.words.fill(0);
    this.#fit();
  }

  /** Takes values and paints them, after the scale has been fitted to them. */
  show(values, nowMs) {
    if (!this.pixels) return;
    this.values.set(values);
    this.peak = peakOf(values, this.pixels);
    this.most = percentile(values, this.pixels, this.peak, PART);
    if (!this.scale.fit(nowMs)) this.paint();
  }

  paint() {
    if (!this.pixels) return;
    const { pixels, values, words, scale } = this;
    const { max, colours, floor, bare } = scale;
    if (scale.options.signed) {
      const half = (TABLE_LEN - 1) / 2;
      for (let n = 0; n < pixels.length; n++) words[pixels[n]] = colours[index(half + (half * values[pixels[n]]) / max)];
    } else if (scale.logarithmic) {
      const slope = (TABLE_LEN - 1) / LOG_DECADES;
      for (let n = 0; n < pixels.length; n++) {
        const v = values[pixels[n]];
        words[pixels[n]] = v > floor ? colours[index((Math.log10(v / max) + LOG_DECADES) * slope)] : bare;
      }
    } else {
      const slope = (TABLE_LEN - 1) / max;
      for (let n = 0; n < pixels.length; n++) {
        const v = values[pixels[n]];
        words[pixels[n]] = v > floor ? colours[index(slope * v)] : bare;
      }
    }
    this.context.putImageData(this.image, 0, 0);
    // Text is laid out afresh whenever it changes: only when the shown digits would differ.
    const text = this.#quantity(this.peak);
    if (text !== this.shown) this.peakText.textContent = this.shown = text;
    this.#showProbe();
  }

  #showProbe() {
    const text = this.probe < 0 ? '' : this.#quantity(this.values[this.probe]);
    if (this.probeText.textContent !== text) this.probeText.textContent = text;
  }

  /** Value in the unit of the scale. */
  #quantity(value) {
    const [size, prefix] = this.scale.prefix();
    return `${digits(value / size)} ${prefix}${this.scale.options.unit}`;
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

  /** Shows where the indenter stands, in pixel coordinates; null hides it. */
  setMarker(uvPx) {
    const same = uvPx === null ? this.marker === null : this.marker && this.marker[0] === uvPx[0] && this.marker[1] === uvPx[1];
    if (same) return;
    this.marker = uvPx ? [uvPx[0], uvPx[1]] : null;
    this.drawOverlay();
  }

  #readTheme() {
    const style = getComputedStyle(this.overlay);
    for (const name of ['outline', 'muted', 'panel']) this.theme[name] = style.getPropertyValue(`--${name}`);
    this.drawOverlay();
  }

  /** The picture changed its size: overlay and ruler follow. */
  #fit() {
    if (this.ruler && this.mmPerPx > 0) {
      const lengthMm = BAR_LENGTHS_MM.find((mm) => mm / this.mmPerPx < SIDE_PX / 4) ?? 1;
      const bar = document.createElement('i');
      bar.style.width = `${(lengthMm / this.mmPerPx) * (this.overlay.clientWidth / SIDE_PX)}px`;
      this.ruler.replaceChildren(bar, `${lengthMm} mm`);
    }
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
    if (overlay.clientWidth >= TIP_FROM_PX) {
      context.font = `${11 * px}px system-ui, sans-serif`;
      context.textAlign = 'right';
      context.lineWidth = 3 * px;
      context.strokeStyle = theme.panel;
      context.strokeText(TIP, SIDE_PX - 2 * px, 11 * px);
      context.fillStyle = theme.muted;
      context.fillText(TIP, SIDE_PX - 2 * px, 11 * px);
    }
    if (this.marker) {
      drawMarker(context, this.marker, px, 'rgb(0 0 0 / 0.55)', 3.5);
      drawMarker(context, this.marker, px, 'rgb(255 255 255 / 0.95)', 1.5);
    }
  }
}

const index = (x) => (x <= 0 ? 0 : x >= TABLE_LEN - 1 ? TABLE_LEN - 1 : (x + 0.5) | 0);

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
