// What haptic devices take of a session: intensities from 0 to 1 at the device's own rate, and 0 when frames stop.
// docs/guides/devices.md.

import { NotCarriedError } from './wire.js';

/** @typedef {import('./hand.js').HandAnswer} HandAnswer */
/** Intensities of an answer, from 0 to 1; null: it says nothing. @typedef {(answer: HandAnswer) => ArrayLike<number> | null} Read */
/** @typedef {{levels: Float64Array[], amplitude: number, durationMs: number}} Command */

/** @param {string} name @param {number} value @param {number} least */
function above(name, value, least) {
  if (!(Number.isFinite(value) && value > least)) throw new RangeError(`${name} is ${value}; it has to be above ${least}`);
  return value - least;
}

/**
 * One intensity: the size of the force on the finger, 0 at `thresholdN` and 1 from `fullN` on.
 * @param {number} fullN @param {number} [thresholdN]
 * @returns {Read}
 */
export function force(fullN, thresholdN = 0) {
  const spanN = above('fullN', fullN, thresholdN);
  return ({ touch }) => [(Math.hypot(...touch.forceN) - thresholdN) / spanN];
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
 * A device with one or more fingers. It holds what the last answer of each finger said for `holdMs`, and then fades it to 0
 * within `fadeMs`: so it falls silent when frames stop, whatever the reason.
 */
export class Device {
  #read;
  /** @type {Float64Array[]} */ #values;
  /** @type {number[]} */ #atMs;
  #nextMs = -Infinity;
  #silent = true;

  /**
   * @param {Read} read `force`, `actuators` or your own
   * @param {{fingers?: number, maxHz?: number, holdMs?: number, fadeMs?: number, clockMs?: () => number}} [options]
   *   `maxHz`: how many commands a second the device takes; `clockMs` only rises (default: performance.now)
   */
  constructor(read, { fingers = 1, maxHz = 60, holdMs = 50, fadeMs = 50, clockMs = () => performance.now() } = {}) {
    this.#read = read;
    this.maxHz = above('maxHz', maxHz, 0);
    this.holdMs = above('holdMs', holdMs, 0);
    this.fadeMs = above('fadeMs', fadeMs, 0);
    this.clockMs = clockMs;
    this.#values = Array.from({ length: fingers }, () => new Float64Array(1));
    this.#atMs = this.#values.map(() => -Infinity);
  }

  /** Takes the answer of a finger. @param {HandAnswer} answer */
  feed(answer) {
    const { finger } = answer;
    if (!(finger in this.#values)) throw new RangeError(`finger ${finger} is none of the device's ${this.#values.length}`);
    if (answer.notTracked) return this.#silence(finger);
    const found = this.#read(answer);
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
