// Frames on their way to the server: one that waits, and those that have no answer yet.

import { Sequences } from './sequences.js';
import { RequestFrame, SAMPLE_TYPES } from './wire.js';
import { greatest } from './window.js';

/** @typedef {import('./link.js').Link} Link */
/** @typedef {import('./watch.js').Watch} Watch */
/** @typedef {import('./types.js').Hello} Hello */

/** Frames that may be without an answer at once; the next one waits. */
const OUTSTANDING_MAX = 1024;
/** Frames whose time is kept: a frame that is older than so many others was answered or lost. */
const BORN = 65536;
/** How long a frame waits before the socket is looked at again, ms. */
const DRAIN_MS = 1;

/**
 * The newest frame wins: while an earlier one has not left the socket a frame waits, and a newer one takes its place.
 */
export class Outbox {
  /** Of the last frame. */
  sequence = 0;
  /** Frames that went out, and frames whose place a newer one took before they could. */
  sent = 0;
  superseded = 0;

  #frame = new RequestFrame();
  #waits = false;
  #outstanding = new Sequences(OUTSTANDING_MAX);
  #bornMs = new Float64Array(BORN);
  #drainTimer = false;
  #watch;
  #flush;
  #settle;
  #drained = () => { this.#drainTimer = false; this.#flush(); };

  /**
   * @param {() => void} flush calls `flush` below, if there is a session
   * @param {(sequence: number, status: 'superseded' | 'lost') => void} settle the outcome of a frame that gets no answer
   * @param {Watch} watch told of frames that wait for their outcome
   */
  constructor(flush, settle, watch) {
    this.#flush = flush;
    this.#settle = settle;
    this.#watch = watch;
  }

  /** Whether a frame waits or is without an answer. */
  get isBusy() {
    return this.#waits || this.#outstanding.count > 0;
  }

  /**
   * Ends the frames that were handed over before: they are lost.
   * @param {number} bornMs
   * @returns {{waiting: boolean, left: boolean}} whether there was one that waited, and one that had left
   */
  expire(bornMs) {
    const waiting = this.#waits && this.#bornMs[this.sequence % BORN] <= bornMs;
    if (waiting) {
      this.#waits = false;
      this.#settle(this.sequence, 'lost');
    }
    let left = false;
    while (this.#outstanding.count > 0 && this.#bornMs[this.#outstanding.first() % BORN] <= bornMs) {
      const sequence = this.#outstanding.first();
      this.#outstanding.take(sequence);
      left = true;
      this.#settle(sequence, 'lost');
    }
    return { waiting, left };
  }

  /**
   * Makes a window of the map the frame that waits. A PapillaError where u16 or u8 cannot carry a sample.
   * @param {Float32Array} values @param {number} first @param {number} stride
   * @param {number} column @param {number} row @param {number} width @param {number} height
   * @param {Hello} hello @param {number} timeUs @param {number} deadlineUs
   */
  put(values, first, stride, column, row, width, height, hello, timeUs, deadlineUs) {
    const type = SAMPLE_TYPES.indexOf(hello.sample_type ?? 'f32');
    let scale = 0;
    if (type >= 2) {
      const most = greatest(values, first, stride, width, height);
      scale = hello.pressure_scale_pa ?? most / (type === 2 ? 65535 : 255);
      if (!(scale > 0)) scale = 1;
    }
    this.supersede();
    this.sequence = (this.sequence + 1) >>> 0;
    this.#frame.encode(values, first, stride, column, row, width, height, type, scale);
    this.#frame.stamp(this.sequence, timeUs, deadlineUs);
    this.#bornMs[this.sequence % BORN] = performance.now();
    this.#waits = true;
    this.#watch.start();
  }

  /** Makes the frame that waits one that tells that tracking is lost. @param {number} timeUs @param {number} deadlineUs */
  putNotTracked(timeUs, deadlineUs) {
    this.supersede();
    this.sequence = (this.sequence + 1) >>> 0;
    this.#frame.encodeNotTracked();
    this.#frame.stamp(this.sequence, timeUs, deadlineUs);
    this.#bornMs[this.sequence % BORN] = performance.now();
    this.#waits = true;
    this.#watch.start();
  }

  /** The frame that waits, if one does, is never sent. */
  supersede() {
    if (!this.#waits) return;
    this.#waits = false;
    this.superseded++;
    this.#settle(this.sequence, 'superseded');
  }

  /** Sends the frame that waits as soon as the socket is empty. @param {Link} link */
  flush(link) {
    if (!this.#waits || !link.isOpen || this.#outstanding.count === OUTSTANDING_MAX) return;
    if (link.bufferedBytes > 0) {
      if (!this.#drainTimer) {
        this.#drainTimer = true;
        setTimeout(this.#drained, DRAIN_MS);
      }
      return;
    }
    this.#waits = false;
    this.sent++;
    this.#outstanding.add(this.sequence);
    const { buffer, bytes } = this.#frame;
    // A view of the whole buffer is not needed, and a part of it is the one view a frame costs.
    link.send(bytes === buffer.byteLength ? buffer : new Uint8Array(buffer, 0, bytes));
  }

  /** Whether a frame went out and had no outcome yet; now it has. @param {number} sequence */
  take(sequence) {
    return this.#outstanding.take(sequence);
  }

  /** What went out on a lost connection is never answered. @param {boolean} alsoWaiting */
  lose(alsoWaiting) {
    while (this.#outstanding.count > 0) {
      const sequence = this.#outstanding.first();
      this.#outstanding.take(sequence);
      this.#settle(sequence, 'lost');
    }
    if (!alsoWaiting || !this.#waits) return;
    this.#waits = false;
    this.#settle(this.sequence, 'lost');
  }
}
