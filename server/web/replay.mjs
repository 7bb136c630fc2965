// Replay of shipped FE presses: their pressure goes to the server like any other frame, and the
// answer is held against the FE solution's own SED.

import { MAP_LEN } from './protocol.mjs';

const PLAY_STEP_MS = 350;
/** Far field: where the true SED is below this share of its peak. */
const FAR_SHARE = 0.1;

/**
 * Errors of `network` against `truth` over the pixels of the interface's mask. All relative; peak and
 * energy are signed. NaN where the truth is zero.
 */
export function errorFigures(network, truth, pixels, out) {
  let truthPeak = 0;
  let networkPeak = 0;
  for (let n = 0; n < pixels.length; n++) {
    truthPeak = Math.max(truthPeak, truth[pixels[n]]);
    networkPeak = Math.max(networkPeak, network[pixels[n]]);
  }
  let [squares, errorSquares, farSquares, farErrorSquares, sum, networkSum] = [0, 0, 0, 0, 0, 0];
  for (let n = 0; n < pixels.length; n++) {
    const t = truth[pixels[n]];
    const p = network[pixels[n]];
    const error = (p - t) * (p - t);
    squares += t * t;
    errorSquares += error;
    sum += t;
    networkSum += p;
    if (t < FAR_SHARE * truthPeak) {
      farSquares += t * t;
      farErrorSquares += error;
    }
  }
  out.relativeL2 = squares > 0 ? Math.sqrt(errorSquares / squares) : NaN;
  out.farFieldL2 = farSquares > 0 ? Math.sqrt(farErrorSquares / farSquares) : NaN;
  out.peak = truthPeak > 0 ? networkPeak / truthPeak - 1 : NaN;
  out.energy = sum > 0 ? networkSum / sum - 1 : NaN;
  return out;
}

/** The chosen press and sample; rasterises pressure and truth. */
export class Replay {
  constructor(atlas) {
    this.atlas = atlas;
    this.presses = [];
    this.press = null;
    this.sample = 0;
    this.playing = false;
    this.changed = false;
    this.lastStepMs = 0;
    this.loads = 0;
    /** FE truth of the frame last sent, J/m3. */
    this.truth = new Float32Array(MAP_LEN);
    this.difference = new Float32Array(MAP_LEN);
    this.figures = { relativeL2: NaN, farFieldL2: NaN, peak: NaN, energy: NaN };
  }

  /** Fetches the list of shipped presses. */
  async loadList() {
    const list = await fetchJson('v1/presses');
    this.presses = list.presses ?? list;
    return this.presses;
  }

  /** Fetches press `id`; a later call overtakes an earlier one that is still loading. */
  async load(id) {
    const load = ++this.loads;
    const press = await fetchJson(`v1/presses/${id}`);
    if (load !== this.loads) return false;
    this.press = press;
    this.choose(this.sampleCount - 1);
    return true;
  }

  get sampleCount() {
    return this.press ? this.press.pressure_pa.length : 0;
  }

  choose(sample) {
    this.sample = sample;
    this.changed = true;
  }

  /** Runs through the depths while playing; true when another sample is due to be shown. */
  step(nowMs) {
    if (this.playing && this.sampleCount > 1 && nowMs - this.lastStepMs > PLAY_STEP_MS) {
      this.lastStepMs = nowMs;
      this.choose((this.sample + 1) % this.sampleCount);
    }
    const changed = this.changed;
    this.changed = false;
    return changed;
  }

  /** Pressure map of the sample, Pa. */
  pressureInto(map) {
    this.atlas.skin.raster.rasterise(this.press.pressure_pa[this.sample], map);
  }

  /** Remembers the truth of the sample that is being sent. */
  rememberTruth() {
    this.atlas.interface.raster.rasterise(this.press.sed_j_per_m3[this.sample], this.truth);
  }

  /** Holds an answer against the truth; also fills the map of differences. */
  judge(network) {
    const { pixels } = this.atlas.interface.raster;
    for (let n = 0; n < pixels.length; n++) this.difference[pixels[n]] = network[pixels[n]] - this.truth[pixels[n]];
    return errorFigures(network, this.truth, pixels, this.figures);
  }
}

/** JSON of a resource; an Error with the server's own message where it is refused. */
export async function fetchJson(path) {
  const response = await fetch(path);
  if (!response.ok) {
    const said = await response.json().catch(() => null);
    throw new Error(`${path}: ${said?.error?.message ?? `HTTP ${response.status}`}`);
  }
  return response.json();
}
