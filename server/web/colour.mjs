// Colour maps, value scales and their wording. Viridis (pressure) and inferno (SED) are perceptually
// uniform maps of matplotlib, computed here from the published degree-6 polynomial fits (M. Zucker,
// CC0). The diverging map for differences is a straight path through OKLab, uniform by construction.

export const TABLE_LEN = 256;

const VIRIDIS = [
  [0.2777273272234177, 0.005407344544966578, 0.3340998053353061],
  [0.1050930431085774, 1.404613529898575, 1.384590162594685],
  [-0.3308618287255563, 0.214847559468213, 0.09509516302823659],
  [-4.634230498983486, -5.799100973351585, -19.33244095627987],
  [6.228269936347081, 14.17993336680509, 56.69055260068105],
  [4.776384997670288, -13.74514537774601, -65.35303263337234],
  [-5.435455855934631, 4.645852612178535, 26.3124352495832],
];
const INFERNO = [
  [0.0002189403691192265, 0.001651004631001012, -0.01948089843709184],
  [0.1065134194856116, 0.5639564367884091, 3.932712388889277],
  [11.60249308247187, -3.972853965665698, -15.9423941062914],
  [-41.70399613139459, 17.43639888205313, 44.35414519872813],
  [77.162935699427, -33.40235894210092, -81.80730925738993],
  [-71.31942824499214, 32.62606426397723, 73.20951985803202],
  [25.13112622477341, -12.24266895238567, -23.07032500287172],
];

const byte = (x) => Math.round(255 * Math.min(1, Math.max(0, x)));

function fromPolynomial(fit) {
  const table = new Uint8ClampedArray(4 * TABLE_LEN);
  for (let i = 0; i < TABLE_LEN; i++) {
    const t = i / (TABLE_LEN - 1);
    for (let channel = 0; channel < 3; channel++) {
      let value = 0;
      for (let k = fit.length - 1; k >= 0; k--) value = value * t + fit[k][channel];
      table[4 * i + channel] = byte(value);
    }
    table[4 * i + 3] = 255;
  }
  return table;
}

/** sRGB bytes of an OKLab colour (B. Ottosson's matrices). */
function okLab(lightness, a, b) {
  const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
  const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
  const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
  const gamma = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
  return [
    byte(gamma(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s)),
    byte(gamma(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s)),
    byte(gamma(-0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s)),
  ];
}

/** Blue (negative) through grey to red (positive); the lightness goes from that of nothing to that of the ends. */
function diverging(nothing, ends) {
  const table = new Uint8ClampedArray(4 * TABLE_LEN);
  const low = { a: -0.045, b: -0.15 };
  const high = { a: 0.17, b: 0.095 };
  for (let i = 0; i < TABLE_LEN; i++) {
    const t = (2 * i) / (TABLE_LEN - 1) - 1;
    const end = t < 0 ? low : high;
    const strength = Math.abs(t);
    const rgb = okLab(nothing + (ends - nothing) * strength, end.a * strength, end.b * strength);
    table.set([...rgb, 255], 4 * i);
  }
  return table;
}

/** RGBA bytes, 256 entries each. */
export const TABLES = {
  viridis: fromPolynomial(VIRIDIS),
  inferno: fromPolynomial(INFERNO),
  diverging: diverging(0.95, 0.52),
  divergingDark: diverging(0.3, 0.72),
};

const ROUND_STEPS = [1, 1.5, 2, 3, 4, 5, 6, 8];

/** The next 'round' number at or above `value`: 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten. */
export function roundUp(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  for (const step of ROUND_STEPS) {
    if (step * power >= value * (1 - 1e-9)) return step * power;
  }
  return 10 * power;
}

const HOLD_MS = 2500;
const STEP_MS = 600;

/**
 * Upper end of a colour scale: grows at once, and shrinks one round step at a time after everything
 * stayed low for a while, so that it does not jump from frame to frame. `locked` it stays.
 */
export class AutoRange {
  constructor(least, holdMs = HOLD_MS, stepMs = STEP_MS) {
    this.least = least;
    this.holdMs = holdMs;
    this.stepMs = stepMs;
    this.max = least;
    this.locked = false;
    this.shrinksAtMs = Infinity;
  }

  /** Takes what is to be shown; true when the scale changed. */
  update(most, nowMs) {
    if (this.locked) return false;
    const wanted = Math.max(this.least, roundUp(most));
    if (wanted > this.max) {
      this.max = wanted;
      this.shrinksAtMs = Infinity;
      return true;
    }
    if (wanted === this.max) {
      this.shrinksAtMs = Infinity;
      return false;
    }
    if (this.shrinksAtMs === Infinity) this.shrinksAtMs = nowMs + this.holdMs;
    if (nowMs < this.shrinksAtMs) return false;
    this.max = Math.max(wanted, roundDown(this.max));
    this.shrinksAtMs = nowMs + this.stepMs;
    return true;
  }
}

/** The greatest 'round' number below `value`. */
export function roundDown(value) {
  const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
  for (const step of [...ROUND_STEPS].reverse()) if (step * power < value * (1 - 1e-9)) return step * power;
  return 0.8 * power;
}

const BINS = 1024;
const bins = new Uint32Array(BINS);
/** What is not even this share of the peak counts as nothing. */
const TRACE = 0.02;

/**
 * Value (of magnitude) that the share `part` of the pixels with any value does not exceed, to 1/1024
 * of the peak; 0 where all are 0. One bright line at the edge of a map does not move it.
 */
export function percentile(values, pixels, peak, part) {
  if (!(peak > 0)) return 0;
  bins.fill(0);
  let count = 0;
  for (let n = 0; n < pixels.length; n++) {
    const v = Math.abs(values[pixels[n]]);
    if (!(v > TRACE * peak)) continue;
    bins[Math.min(BINS - 1, Math.floor((v / peak) * BINS))]++;
    count++;
  }
  let left = Math.floor((1 - part) * count);
  for (let bin = BINS - 1; bin >= 0; bin--) {
    left -= bins[bin];
    if (left < 0) return (peak * (bin + 1)) / BINS;
  }
  return peak;
}

/** Root of the mean square over the pixels. */
export function rms(values, pixels) {
  let sum = 0;
  for (let n = 0; n < pixels.length; n++) {
    const value = values[pixels[n]];
    sum += value * value;
  }
  return Math.sqrt(sum / Math.max(1, pixels.length));
}

const PLAIN = [1, ''];
const PREFIXES = [[1e6, 'M'], [1e3, 'k'], PLAIN, [1e-3, 'm']];

/** Divisor and prefix in which `value` reads best, e.g. 24 000 -> [1000, 'k']. */
function prefixFor(value) {
  return PREFIXES.find(([size]) => Math.abs(value) >= size) ?? PLAIN;
}

/** Up to three significant digits, without exponent for the sizes met here. */
export function digits(value) {
  if (value === 0) return '0';
  const decimals = Math.max(0, 2 - Math.floor(Math.log10(Math.abs(value)) + 1e-9));
  return value.toFixed(Math.min(decimals, 6));
}

/** Divisor and prefix for a scale that ends at `max`: Pa are wanted as kPa, J/m3 only from 10^4 on as kJ/m3. */
export function prefixOf(max, unit) {
  return unit === 'Pa' || max >= 1e4 ? prefixFor(max) : PLAIN;
}
