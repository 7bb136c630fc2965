// What haptic devices take of a session: intensities from 0 to 1 at the device's own rate, and 0 when frames stop.
// docs/guides/devices.md.

import { NotCarriedError, SUMMARY } from './wire.js';

/**
 * What a device reads of an answer of a `Hand` or of a `Session`; the answers of a session are of finger 0.
 * @typedef {object} Felt
 * @property {number} [finger]
 * @property {string} [status] of a session's answer
 * @property {number} clientTimeUs
 * @property {boolean} noContact
 * @property {boolean} notTracked
 * @property {import('./types.js').Touch | null} [touch]
 * @property {ArrayLike<number> | null} summary
 * @property {ArrayLike<number> | null} actuators
 * @property {Pick<import('./wire.js').Spikes, 'unit'> | null} spikes
 */
/** Intensities of an answer, from 0 to 1; null: it says nothing. @typedef {(answer: Felt) => ArrayLike<number> | null} Read */
/** @typedef {{levels: Float64Array[], amplitude: number, durationMs: number}} Command */

const FORCE_N = SUMMARY.indexOf('force_n');
/** After a longer pause the service computes its last 50 ms. */
const SPIKES_MOST_US = 50000;

/** @param {string} name @param {number} value @param {number} least */
function above(name, value, least) {
  if (!(Number.isFinite(value) && value > least)) throw new RangeError(`${name} is ${value}; it has to be above ${least}`);
  return value - least;
}

/**
 * One intensity: the size of the force on the finger, 0 at `thresholdN` and 1 from `fullN` on. Of pressure maps the effect
 * `summary` has the force.
 * @param {number} fullN @param {number} [thresholdN]
 * @returns {Read}
 */
export function force(fullN, thresholdN = 0) {
  const spanN = above('fullN', fullN, thresholdN);
  return ({ touch, summary, noContact }) => {
    if (!touch && !summary && !noContact) throw new NotCarriedError('force', "send objects or gaps, or name the effect 'summary' in the hello");
    const foundN = touch ? Math.hypot(...touch.forceN) : summary ? summary[FORCE_N] : 0;
    return [(foundN - thresholdN) / spanN];
  };
}

/**
 * An intensity for each actuator of the effect `actuators`; `full` is its `max`.
 * @param {number} [full]
 * @returns {Read}
 */
export function actuators(full = 1) {
  above('full', full, 0);
  return (answer) => {
    if (!answer.actuators) throw new NotCarriedError('actuators', "name the effect 'actuators' in the hello");
    return Array.from(answer.actuators, (value) => value / full);
  };
}

/**
 * One intensity of the effect `spikes`: the mean firing rate of the units of some classes, 1 from `fullHz` on. Most units
 * lie outside of a contact: a few Hz are much. It remembers the frame before: make one for each finger.
 * @param {Pick<import('./types.js').Ready, 'units'>} ready @param {number} fullHz @param {string[]} [classes]
 * @returns {Read}
 */
export function spikeRate({ units }, fullHz, classes = ['ra', 'pc']) {
  if (!units) throw new NotCarriedError('spikes', "name the effect 'spikes' in the hello");
  above('fullHz', fullHz, 0);
  const mine = units.map((unit) => classes.includes(unit.class));
  const count = mine.filter(Boolean).length;
  if (count === 0) throw new RangeError(`no unit of the session is of ${classes.join(', ')}`);
  /** @type {number | null} */
  let lastUs = null;
  return ({ spikes, clientTimeUs }) => {
    if (!spikes) throw new NotCarriedError('spikes', "name the effect 'spikes' in the hello");
    const passedUs = lastUs === null ? 0 : clientTimeUs - lastUs;
    lastUs = clientTimeUs;
    if (passedUs <= 0) return null;
    const fired = Array.from(spikes.unit).filter((unit) => mine[unit]).length;
    return [fired / (count * 1e-6 * Math.min(passedUs, SPIKES_MOST_US) * fullHz)];
  };
}

/**
 * A device with one or more fingers. It holds what the last answer of each finger said for `holdMs`, and then fades it to 0
 * within `fadeMs`: so it falls silent when frames stop, whatever the reason.
 */
export class Device {
  /** @type {Read[]} */ #read;
  /** @type {Float64Array[]} */ #values;
  /** @type {number[]} */ #atMs;
  #nextMs = -Infinity;
  #silent = true;

  /**
   * @param {Read | Read[]} read `force`, `actuators`, `spikeRate` or your own; an array has one for each finger
   * @param {{fingers?: number, maxHz?: number, holdMs?: number, fadeMs?: number, clockMs?: () => number}} [options]
   *   `maxHz`: how many commands a second the device takes; `clockMs` only rises (default: performance.now)
   */
  constructor(read, { fingers = 1, maxHz = 90, holdMs = 50, fadeMs = 50, clockMs = () => performance.now() } = {}) {
    this.#read = Array.isArray(read) ? read : Array(fingers).fill(read);
    if (this.#read.length !== fingers) throw new RangeError(`${this.#read.length} readers for ${fingers} fingers: give one for each, or one for all`);
    this.maxHz = above('maxHz', maxHz, 0);
    this.holdMs = above('holdMs', holdMs, 0);
    this.fadeMs = above('fadeMs', fadeMs, 0);
    this.clockMs = clockMs;
    this.#values = Array.from({ length: fingers }, () => new Float64Array(1));
    this.#atMs = this.#values.map(() => -Infinity);
  }

  /** Takes the answer of a finger; one of a session that has no value counts as none. @param {Felt} answer */
  feed(answer) {
    const { finger = 0, status = 'ok' } = answer;
    if (!(finger in this.#values)) throw new RangeError(`finger ${finger} is none of the device's ${this.#values.length}`);
    if (status !== 'ok') return;
    if (answer.notTracked) return this.#silence(finger);
    const found = this.#read[finger](answer);
    if (!found) return;
    const levels = Float64Array.from(found);
    // What is no number drives no motor: the finger fades as without an answer.
    if (!levels.every(Number.isFinite)) return;
    this.#values[finger] = levels.map((level) => Math.min(1, Math.max(0, level)));
    this.#atMs[finger] = this.clockMs();
  }

  /** The intensities now, of each finger. */
  get levels() {
    const nowMs = this.clockMs();
    return this.#values.map((values, finger) => {
      const left = Math.min(1, Math.max(0, 1 - (nowMs - this.#atMs[finger] - this.holdMs) / this.fadeMs));
      return values.map((value) => value * left);
    });
  }

  /** What is due; null before the device takes another command, or as long as it is silent anyway. @returns {Command | null} */
  poll() {
    const nowMs = this.clockMs();
    if (nowMs < this.#nextMs) return null;
    const { levels } = this;
    const amplitude = greatest(levels);
    if (amplitude === 0 && this.#silent) return null;
    this.#silent = amplitude === 0;
    this.#nextMs = nowMs + 1000 / this.maxHz;
    return { levels, amplitude, durationMs: this.holdMs + this.fadeMs };
  }

  /** All at 0 from now on, whatever the rate. @returns {Command} */
  stop() {
    this.#values.forEach((_, finger) => this.#silence(finger));
    this.#silent = true;
    return { levels: this.levels, amplitude: 0, durationMs: 0 };
  }

  /** @param {number} finger */
  #silence(finger) {
    this.#atMs[finger] = -Infinity;
  }
}

/** @param {Float64Array[]} levels */
function greatest(levels) {
  return levels.reduce((most, finger) => Math.max(most, ...finger), 0);
}

/**
 * Sends a command to the motor of a gamepad, or of the controller of a WebXR input source (`source.gamepad`); nothing where
 * it has none. A command of 0 stops it.
 * @param {Gamepad | null | undefined} gamepad @param {Command | null} command
 * @returns {boolean} whether a motor got it
 */
export function vibrate(gamepad, command) {
  if (!gamepad || !command) return false;
  // WebXR controllers have `hapticActuators` with `pulse`, gamepads `vibrationActuator` with `playEffect`.
  const [pulser] = /** @type {any} */ (gamepad).hapticActuators ?? [];
  const { amplitude, durationMs } = command;
  if (typeof pulser?.pulse === 'function') {
    pulser.pulse(amplitude, durationMs);
    return true;
  }
  const motor = /** @type {any} */ (gamepad).vibrationActuator;
  if (typeof motor?.playEffect !== 'function') return false;
  if (amplitude === 0) motor.reset();
  else motor.playEffect('dual-rumble', { duration: durationMs, strongMagnitude: amplitude, weakMagnitude: amplitude });
  return true;
}
