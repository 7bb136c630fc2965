// One colour scale for all maps of one quantity, and its legend: bar, ticks, what is not drawn, a lock.

import { AutoRange, TABLES, TABLE_LEN, prefixOf } from './colour.mjs';
import { isDark, onTheme } from './theme.mjs';

/** Decades that the logarithmic scale spans. */
export const LOG_DECADES = 3;

/** Share of the scale over which its colours fade in. */
const FADE = 0.12;

const trim = (value) => String(Number(value.toPrecision(3)));

/** Fades the colours of `table` in over a ground, from the place `from` of the scale on. */
export function fadeInto(bytes, table, ground, from) {
  for (let i = 0; i < TABLE_LEN; i++) {
    const part = Math.min(1, Math.max(0, (i / (TABLE_LEN - 1) - from) / FADE));
    for (let k = 0; k < 3; k++) bytes[4 * i + k] = ground[k] + (table[4 * i + k] - ground[k]) * part;
    bytes[4 * i + 3] = 255;
  }
}

/** Red, green and blue of the ground on which maps are drawn. */
export const groundOf = (element) => getComputedStyle(element).getPropertyValue('--bare').trim().split(/\s+/).map(Number);

export class Scale {
  /** `options`: table, unit, least (smallest end), signed (symmetric about 0), like (a scale whose unit prefix this one shares). */
  constructor(element, options) {
    const part = (name) => element.querySelector(`[data-part=${name}]`);
    this.options = options;
    /** Colours of the scale over bare skin. */
    this.bytes = new Uint8ClampedArray(TABLES[options.table]);
    this.colours = new Uint32Array(this.bytes.buffer);
    this.range = new AutoRange(options.least);
    this.logarithmic = false;
    /** Magnitude below which nothing is drawn; 0: all is. */
    this.floor = 0;
    /** In words, whose it is. */
    this.floorOf = '';
    this.bare = 0;
    this.baked = '';
    this.views = [];
    this.bar = part('bar');
    this.ticks = part('ticks');
    this.unitText = part('unit');
    this.floorText = part('floor');
    this.element = element;
    /** Called when the scale has changed; the pictures have followed. */
    this.onchange = () => {};
    part('lock')?.addEventListener('click', (event) => this.#lock(event.currentTarget));
    part('log')?.addEventListener('change', (event) => {
      this.logarithmic = event.currentTarget.checked;
      this.#redraw();
    });
    this.#readTheme();
    onTheme(() => this.#readTheme());
  }

  get max() {
    return this.range.max;
  }

  /** Below `floor` nothing is drawn from now on; `of` says in words why. */
  setFloor(floor, of) {
    // Two digits: a legend that changes with every frame cannot be read.
    this.floor = floor > 0 ? Number(floor.toPrecision(2)) : 0;
    this.floorOf = of;
    this.#writeFloor();
    this.#bake();
  }

  /** Fits the scale to what its visible views show. To be called while nothing new comes, too: it shrinks late. */
  fit(nowMs) {
    let most = 0;
    for (const view of this.views) if (view.isShown && view.most > most) most = view.most;
    if (!this.range.update(most, nowMs)) return false;
    this.#redraw();
    return true;
  }

  #redraw() {
    this.#bake();
    this.#drawTicks();
    this.#writeFloor();
    for (const view of this.views) view.paint();
    this.onchange();
  }

  #lock(button) {
    this.range.locked = !this.range.locked;
    button.setAttribute('aria-pressed', String(this.range.locked));
    button.textContent = this.range.locked ? 'locked' : 'lock';
  }

  #readTheme() {
    const rgb = groundOf(this.element);
    this.bare = (255 << 24 | rgb[2] << 16 | rgb[1] << 8 | rgb[0]) >>> 0;
    this.bareRgb = rgb;
    this.baked = '';
    this.#redraw();
  }

  /** Where a value lies on the scale, 0 to 1 and below. */
  #place(value) {
    if (this.logarithmic) return value > 0 ? 1 + Math.log10(value / this.max) / LOG_DECADES : -Infinity;
    return value / this.max;
  }

  /** Colours over bare skin: from the floor on they fade in, so that what is all but nothing does not stand out and has no ragged edge. */
  #bake() {
    const from = Math.max(0, this.#place(this.floor));
    const wanted = `${from.toFixed(3)} ${isDark()}`;
    if (this.baked === wanted) return;
    this.baked = wanted;
    const { signed, table: name } = this.options;
    const table = TABLES[signed && isDark() ? `${name}Dark` : name];
    if (signed) this.bytes.set(table);
    else fadeInto(this.bytes, table, this.bareRgb, from);
    this.#drawBar();
  }

  #drawBar() {
    const context = this.bar.getContext('2d');
    const image = context.createImageData(TABLE_LEN, 1);
    image.data.set(this.bytes);
    context.putImageData(image, 0, 0);
  }

  #writeFloor() {
    if (!this.floorText) return;
    const [size, prefix] = this.prefix();
    const text = this.floor > 0 ? `below ${trim(this.floor / size)} ${prefix}${this.options.unit}, ${this.floorOf}, nothing is drawn` : '';
    if (this.floorText.textContent !== text) this.floorText.textContent = text;
  }

  /** The ends of the scale, in words. */
  get ends() {
    const [size, prefix] = this.prefix();
    const most = `${trim(this.max / size)} ${prefix}${this.options.unit}`;
    const least = this.options.signed ? `−${most}` : this.logarithmic ? `${trim(this.max / size / 10 ** LOG_DECADES)} ${prefix}${this.options.unit}` : '0';
    return [least, this.options.signed ? most : `≥ ${most}`];
  }

  prefix() {
    return prefixOf((this.options.like ?? this).range.max, this.options.unit);
  }

  #drawTicks() {
    const { ticks, range, options } = this;
    const [size, prefix] = this.prefix();
    const max = range.max / size;
    this.unitText.textContent = `${prefix}${options.unit}`;
    const values = options.signed ? [-max, -max / 2, 0, max / 2, max]
      : this.logarithmic ? [max / 1000, max / 100, max / 10, max]
        : [0, 1, 2, 3, 4].map((k) => (k * max) / 4);
    ticks.replaceChildren(...values.map((value, k) => {
      const tick = document.createElement('span');
      const last = k === values.length - 1 && !options.signed;
      tick.textContent = `${last ? '≥ ' : ''}${trim(value).replace('-', '−')}`;
      return tick;
    }));
  }
}
