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

/** The shipped presses, one at a time, with the maps of pressure and truth. */
export class Replay {
  constructor(atlas) {
    this.atlas = atlas;
    /** Each with name, pose, depth_mm, and its maps of pressurePa and sedJPerM3. */
    this.presses = [];
    /** Relative L2 of each press as last answered; NaN before. */
    this.errors = [];
    this.chosen = 0;
    /** The press whose truth `truth` holds: the one last sent. */
    this.sent = -1;
    /** Whether the answer to that press was held against its truth. */
    this.judged = false;
    this.playing = false;
    this.changed = false;
    this.lastStepMs = 0;
    /** FE truth of the frame last sent, J/m3. */
    this.truth = new Float32Array(MAP_LEN);
    this.difference = new Float32Array(MAP_LEN);
    this.figures = { relativeL2: NaN, farFieldL2: NaN, peak: NaN, energy: NaN };
  }

  get loaded() {
    return this.presses.length > 0;
  }

  /** Fetches all shipped presses; they are few. */
  async load() {
    const { presses } = await fetchJson('v1/presses');
    const loaded = [];
    for (const press of presses) {
      const at = `v1/presses/${press.id}`;
      const [pressurePa, sedJPerM3] = [await fetchMap(`${at}/pressure`), await fetchMap(`${at}/sed`)];
      loaded.push({ ...press, pressurePa, sedJPerM3 });
    }
    this.presses = loaded;
    this.forget();
    this.choose(0);
  }

  /** Another tier makes other errors. */
  forget() {
    this.errors = this.presses.map(() => NaN);
    this.sent = -1;
    this.judged = false;
  }

  choose(n) {
    this.chosen = n;
    this.changed = true;
  }

  /** Runs through the presses while playing; true when another one is due to be shown. */
  step(nowMs) {
    if (this.playing && this.presses.length > 1 && nowMs - this.lastStepMs > PLAY_STEP_MS) {
      this.lastStepMs = nowMs;
      this.choose((this.chosen + 1) % this.presses.length);
    }
    const changed = this.changed;
    this.changed = false;
    return changed;
  }

  /** Pressure map of the chosen press, Pa. */
  pressureInto(map) {
    map.set(this.presses[this.chosen].pressurePa);
  }

  /** Remembers the truth of the press that is being sent. */
  rememberTruth() {
    if (this.sent === this.chosen) return;
    this.sent = this.chosen;
    this.judged = false;
    this.truth.set(this.presses[this.sent].sedJPerM3);
  }

  /** Holds an answer against the truth; also fills the map of differences. */
  judge(network) {
    this.judged = true;
    const { pixels } = this.atlas.interface.raster;
    for (let n = 0; n < pixels.length; n++) this.difference[pixels[n]] = network[pixels[n]] - this.truth[pixels[n]];
    errorFigures(network, this.truth, pixels, this.figures);
    this.errors[this.sent] = this.figures.relativeL2;
    return this.figures;
  }
}

/** JSON of a resource; an Error with the server's own message where it is refused. */
export async function fetchJson(path) {
  return (await answered(path, 'application/json')).json();
}

/** A map of 32-bit floats. */
async function fetchMap(path) {
  return new Float32Array(await (await answered(path, 'application/octet-stream')).arrayBuffer());
}

async function answered(path, accept) {
  const response = await fetch(path, { headers: { accept } });
  if (response.ok) return response;
  const said = await response.json().catch(() => null);
  throw Object.assign(new Error(`${path}: ${said?.error?.message ?? `HTTP ${response.status}`}`), { status: response.status });
}
