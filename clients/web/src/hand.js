// Fingers that touch things: objects or gaps in, forces out. docs/reference/protocol.md.

import { PapillaError, missed, refusal, unreachable } from './error.js';
import { Link, sessionUrl } from './link.js';
import { Move } from './move.js';
import { OPEN_MS, TIMEOUT_MS, Warnings, Watch } from './watch.js';
import { FLAG, HEADER_BYTES, MAGIC, STATUS, NotCarriedError, RATES_HEAD_BYTES, VERSION, readSpikes } from './wire.js';

/** @typedef {import('./types.js').HandHello} HandHello */
/** @typedef {import('./types.js').Ready} Ready */
/** @typedef {import('./types.js').Problem} Problem */
/** @typedef {import('./types.js').Pose} Pose */
/** @typedef {import('./types.js').NetForce} NetForce */
/** @typedef {import('./types.js').Touch} Touch */

/**
 * What came of a frame of a finger. Arrays are views of the message and stay as they are.
 * @typedef {object} HandAnswer
 * @property {number} sequence
 * @property {number} finger
 * @property {number} clientTimeUs when the frame was sent, by the browser's clock
 * @property {Touch} touch
 * @property {Float32Array} errorEstimate how wrong this answer is likely to be (ERROR_ESTIMATE); infinite: not stated
 * @property {Float32Array | null} pressurePa as a map or at the vertices, if asked for
 * @property {Float32Array | null} shearPa traction along the skin, x y z a vertex in the finger's frame, if asked for
 * @property {Float32Array | null} displacementMm how far each vertex has moved, x y z, mm, in the finger's frame, if asked for
 * @property {Float32Array | null} vertices what the map shows at the vertices, if asked for in its place
 * @property {Float32Array | null} map 224 x 224, 0 outside the answer's window, if asked for
 * @property {Float32Array | null} summary
 * @property {Float32Array | null} rates firing rates, Hz, where SED is: the effect `afferents`
 * @property {Float32Array | null} points SED, J/m3
 * @property {Float32Array | null} pointRatesHz
 * @property {Float32Array | null} actuators
 * @property {import('./wire.js').Spikes | null} spikes who fired since the answer before: the effect `spikes`
 * @property {Float32Array} sed the map, or the values at the vertices; throws NotCarriedError where there is neither
 * @property {Float32Array} ratesHz throws NotCarriedError where the session has none
 * @property {boolean} notTracked to `notTracked()`: all is zero
 * @property {boolean} coarseClock the browser's clock ticks so coarsely that rates and spikes may be far off
 * @property {boolean} noContact
 * @property {boolean} outOfRange
 * @property {boolean} unsettled
 * @property {boolean} unfamiliar rougher or heavier than any map the tier was trained on: it may mean nothing
 * @property {boolean} cutOff the contact reaches the edge of the atlas
 * @property {number} totalUs receipt to sending, in the server
 */

const KIND = { pressure: 1, objects: 4, gaps: 5 };
const ROW = 7;
const FINGERS_MAX = 10;
const MAP_SIDE_PX = 224;
const TWO_POW_32 = 4294967296;
const DRAIN_MS = 1;

/** A finger's newest frame that has not left, and who waits for it. */
class Waiting {
  /** @param {number} sequence @param {ArrayBuffer} message @param {(answer: HandAnswer) => void} resolve @param {(error: Error) => void} reject */
  constructor(sequence, message, resolve, reject) {
    this.sequence = sequence;
    this.message = message;
    this.resolve = resolve;
    this.reject = reject;
    this.bornMs = performance.now();
  }
}

/**
 * One to ten fingers in one session. The newest frame of each finger wins, here and in the service; the connection is
 * made anew by itself. A frame without an answer after `timeoutMs` is rejected as `lost`, whether it waits for a connection
 * or for the service; in the second case the connection is given up and another made.
 */
export class Hand {
  /** @type {Ready | null} */ ready = null;
  /** @type {(problem: Problem) => void} */ onrefused = () => {};
  #hello;
  #link;
  #sequence = 0;
  #drainTimer = false;
  /** @type {Map<number, Waiting>} */ #waiting = new Map();
  /** @type {Map<number, Waiting>} */ #sent = new Map();
  /** @type {(() => void) | null} */ #opened = null;
  #move;
  #warnings = new Warnings();
  #watch;
  #why = 'no answer';

  /** @param {string} base @param {HandHello} hello @param {string} [token] @param {{timeoutMs?: number}} [options] */
  constructor(base, hello, token, options = {}) {
    for (const name of ['sample_type', 'answer_sample_type']) {
      const type = /** @type {any} */ (hello)[name] ?? 'f32';
      if (type !== 'f32') throw refusal('wrong_type', `${name} is ${type}; a hand's samples are f32`);
    }
    this.#watch = new Watch(options.timeoutMs ?? TIMEOUT_MS, (bornMs) => this.#expire(bornMs));
    this.#hello = { input: hello.objects ? 'objects' : 'gaps', map: false, ...hello, type: 'hello', version: VERSION, reconnect: true };
    this.#link = new Link(sessionUrl(base, token), {
      connecting: () => {},
      opened: () => this.#greet(false),
      prepared: () => this.#move.prepared(),
      text: (text) => this.#text(JSON.parse(text)),
      binary: (data) => this.#binary(data),
      lost: (why) => { this.#why = why; this.#lost(); },
    });
    this.#move = new Move(this.#link, () => this.#greet(true), (why) => {
      if (why) this.#warnings.stays(why);
      this.#flush();
    });
  }

  /**
   * A hand that is ready to touch.
   * @param {string} base where the server is: `host:port` or a URL; '' for the server of the page
   * @param {HandHello} hello
   * @param {string} [token]
   * @param {{timeoutMs?: number}} [options] `timeoutMs`: a frame without an answer for so long is lost (default 5000)
   * @returns {Promise<Hand>} rejected with a PapillaError where the hello is refused, or `unreachable` where no session
   *   is there within 10 s
   */
  static async connect(base, hello, token, options) {
    const hand = new Hand(base, hello, token, options);
    return new Promise((resolve, reject) => {
      const patience = setTimeout(() => {
        hand.close();
        reject(refusal('unreachable', unreachable(base, hand.#why)));
      }, OPEN_MS);
      hand.#opened = () => {
        clearTimeout(patience);
        resolve(hand);
      };
      hand.onrefused = (problem) => {
        clearTimeout(patience);
        hand.close();
        reject(new PapillaError(problem));
      };
      hand.#link.connect();
    });
  }

  /** What people were told so far, each thing once. */
  get warnings() {
    return this.#warnings.list;
  }

  /** Time within which a frame has an outcome, ms; may be changed. */
  get timeoutMs() {
    return this.#watch.timeoutMs;
  }

  set timeoutMs(timeoutMs) {
    this.#watch.timeoutMs = timeoutMs;
  }

  /** Ends frames whose time is over; false: none is left. @param {number} bornMs */
  #expire(bornMs) {
    const why = `no answer within ${this.timeoutMs} ms`;
    let [late, left] = [false, false];
    for (const frames of [this.#waiting, this.#sent]) {
      for (const [key, frame] of frames) {
        if (frame.bornMs > bornMs) continue;
        frames.delete(key);
        frame.reject(new PapillaError(missed('lost', frame.sequence)));
        late = true;
        left ||= frames === this.#sent;
      }
    }
    if (late) this.#warnings.tell('timeout', () => `${why}; such frames are lost`);
    if (left) this.#link.giveUp(why);
    return this.#waiting.size + this.#sent.size > 0;
  }

  /** Ends the session; frames without an answer are lost. */
  close() {
    this.#watch.stop();
    this.#link.drop();
    this.#lost();
    for (const waiting of this.#waiting.values()) waiting.reject(new PapillaError(missed('lost', waiting.sequence)));
    this.#waiting.clear();
  }

  /**
   * Sends where the objects of the hello are in a finger's frame, and waits for what pushes back.
   * @param {Pose[] | null} poses null: tracking is lost, as `notTracked`
   * @param {{finger?: number, net?: NetForce}} [more]
   * @returns {Promise<HandAnswer>} rejected with a PapillaError where there is none (`superseded`, `stale`, `lost`, or refused)
   */
  touch(poses, { finger = 0, net } = {}) {
    if (poses === null) return this.notTracked({ finger });
    const rows = new Float32Array(ROW * (poses.length + (net ? 1 : 0)));
    poses.forEach(({ at, turn = [0, 0, 0, 1] }, i) => rows.set([...at, ...turn], ROW * i));
    if (net) rows.set([...net.direction, net.forceN], ROW * poses.length);
    return this.#put(KIND.objects, finger, ROW, rows.length / ROW, rows);
  }

  /**
   * Sends that tracking of a finger is lost. Better than an old pose, or one of zeros: the answer is zero, no unit fires, and
   * nothing bursts when tracking comes back.
   * @param {{finger?: number}} [more]
   * @returns {Promise<HandAnswer>}
   */
  notTracked({ finger = 0 } = {}) {
    return this.#put(KIND.pressure, finger, 0, 0, new Float32Array(0), FLAG.notTracked);
  }

  /**
   * Sends how deep the undeformed skin lies in things, mm, negative in air.
   * @param {Float32Array} depthMm at the vertices, or 224 x 224, as the hello says; with its
   *   `velocity`, x y z mm/s of each vertex behind them
   * @param {{finger?: number, net?: NetForce}} [more]
   * @returns {Promise<HandAnswer>}
   */
  touchGaps(depthMm, { finger = 0, net } = {}) {
    const samples = new Float32Array(depthMm.length + (net ? ROW : 0));
    samples.set(depthMm);
    if (net) samples.set([...net.direction, net.forceN], depthMm.length);
    const isMap = depthMm.length === MAP_SIDE_PX * MAP_SIDE_PX;
    const [width, height] = isMap ? [MAP_SIDE_PX, MAP_SIDE_PX] : [depthMm.length, 1];
    return this.#put(KIND.gaps, finger, width, height, samples);
  }

  /** @param {number} kind @param {number} finger @param {number} width @param {number} height @param {Float32Array} samples @param {number} [flags] */
  #put(kind, finger, width, height, samples, flags = 0) {
    if (!(Number.isInteger(finger) && finger >= 0 && finger < FINGERS_MAX)) {
      return Promise.reject(refusal('bad_contact', `finger ${finger} is none; a session has ${FINGERS_MAX} at most, numbered from 0`));
    }
    const sequence = (this.#sequence = (this.#sequence + 1) >>> 0);
    const message = new ArrayBuffer(HEADER_BYTES + samples.byteLength);
    const view = new DataView(message);
    const timeUs = Math.round((performance.timeOrigin + performance.now()) * 1000);
    view.setUint32(0, MAGIC, true);
    view.setUint8(4, VERSION);
    view.setUint8(5, kind);
    view.setUint32(8, sequence, true);
    view.setUint16(12, width, true);
    view.setUint16(14, height, true);
    view.setUint32(16, timeUs % TWO_POW_32, true);
    view.setUint32(20, timeUs / TWO_POW_32, true);
    view.setFloat32(28, 1, true);
    view.setUint8(46, flags);
    view.setUint8(47, finger);
    new Float32Array(message, HEADER_BYTES).set(samples);
    return new Promise((resolve, reject) => {
      const old = this.#waiting.get(finger);
      if (old) old.reject(new PapillaError(missed('superseded', old.sequence)));
      this.#waiting.set(finger, new Waiting(sequence, message, resolve, reject));
      this.#watch.start();
      this.#flush();
    });
  }

  #flush() {
    if (!this.ready || this.#move.holds || !this.#link.isOpen) return;
    for (const [finger, waiting] of this.#waiting) {
      if (this.#link.bufferedBytes > 0) {
        if (!this.#drainTimer) setTimeout(() => { this.#drainTimer = false; this.#flush(); }, DRAIN_MS);
        this.#drainTimer = true;
        return;
      }
      this.#waiting.delete(finger);
      this.#sent.set(waiting.sequence, waiting);
      this.#link.send(waiting.message);
    }
  }

  /** @param {boolean} resume */
  #greet(resume) {
    this.ready = null;
    this.#link.send(JSON.stringify(resume ? { ...this.#hello, resume } : this.#hello));
  }

  #lost() {
    this.#move.end();
    this.ready = null;
    for (const sent of this.#sent.values()) sent.reject(new PapillaError(missed('lost', sent.sequence)));
    this.#sent.clear();
  }

  /** @param {Ready | Problem | {type: 'reconnect'}} message */
  #text(message) {
    if (message.type === 'reconnect') return this.#link.prepare();
    if (message.type === 'ready') {
      this.#link.succeeded();
      this.#move.ready();
      this.ready = message;
      this.#warnings.question(message);
      this.#opened?.();
      this.#opened = null;
      this.#flush();
      return;
    }
    const sent = this.#take(message.sequence ?? -1);
    if (sent) {
      this.#warnings.tell('error', () => `a frame was refused: ${message.message}`);
      sent.reject(new PapillaError(message));
    } else if (typeof message.sequence === 'number' || !this.ready || message.closes || !this.#move.refuses(message)) {
      this.onrefused(message);
    }
  }

  /** @param {number} sequence */
  #take(sequence) {
    const sent = this.#sent.get(sequence);
    this.#sent.delete(sequence);
    return sent;
  }

  /** @param {ArrayBuffer} data */
  #binary(data) {
    if (this.#move.takes(data)) return;
    const view = new DataView(data);
    if (data.byteLength < HEADER_BYTES || view.getUint32(0, true) !== MAGIC || !this.ready) return;
    const sequence = view.getUint32(8, true);
    const sent = this.#take(sequence);
    if (!sent) return;
    const status = STATUS[view.getUint8(7)] ?? 'error';
    if (status !== 'ok') {
      sent.reject(new PapillaError(missed(status, sequence)));
      return;
    }
    sent.resolve(read(data, view, this.ready));
  }
}

/** @param {ArrayBuffer} data @param {DataView} view @param {Ready} ready @returns {HandAnswer} */
function read(data, view, ready) {
  const of = (/** @type {string} */ name) => {
    const section = ready.sections.find((s) => s.name === name);
    return section ? new Float32Array(data, section.offset, section.bytes / 4) : null;
  };
  const flags = view.getUint8(46);
  const spikes = ready.sections.find((s) => s.name === 'spikes');
  const clientTimeUs = view.getUint32(16, true) + TWO_POW_32 * view.getUint32(20, true);
  // Answers of a hand are f32: the scale before the rates is 1.
  const rates = of('rates');
  return {
    sequence: view.getUint32(8, true),
    finger: view.getUint8(47),
    clientTimeUs,
    touch: touchOf(of('touch') ?? new Float32Array(16)),
    errorEstimate: of('error_estimate') ?? new Float32Array(4).fill(Infinity),
    pressurePa: of('pressure'),
    shearPa: of('shear'),
    displacementMm: of('displacement'),
    vertices: of('vertices'),
    map: mapOf(data, view, ready),
    summary: of('summary'),
    rates: rates ? rates.subarray(RATES_HEAD_BYTES / 4) : null,
    points: of('points'),
    pointRatesHz: of('point_rates'),
    actuators: of('actuators'),
    spikes: spikes ? readSpikes(view, spikes.offset, spikes.bytes, clientTimeUs) : null,
    notTracked: (flags & FLAG.notTracked) !== 0,
    coarseClock: (flags & FLAG.coarseClock) !== 0,
    get sed() {
      if (this.map ?? this.vertices) return /** @type {Float32Array} */ (this.map ?? this.vertices);
      throw new NotCarriedError('sed', "say 'map': true in the hello");
    },
    get ratesHz() {
      if (this.rates) return this.rates;
      throw new NotCarriedError('ratesHz', "name the effect 'afferents' in the hello, and say 'map': true");
    },
    noContact: (flags & FLAG.noContact) !== 0,
    outOfRange: (flags & FLAG.outOfRange) !== 0,
    unsettled: (flags & FLAG.unsettled) !== 0,
    unfamiliar: (flags & FLAG.unfamiliar) !== 0,
    cutOff: (flags & FLAG.cutOff) !== 0,
    totalUs: view.getUint32(24, true),
  };
}

/** The whole map: a view of the message, or drawn anew of a window. @param {ArrayBuffer} data @param {DataView} view @param {Ready} ready */
function mapOf(data, view, ready) {
  const section = ready.sections.find(({ name }) => name === 'map');
  if (!section) return null;
  const [width, height, column, row] = [12, 14, 32, 34].map((at) => view.getUint16(at, true));
  const samples = new Float32Array(data, section.offset, width * height);
  if (samples.length === MAP_SIDE_PX * MAP_SIDE_PX) return samples;
  const map = new Float32Array(MAP_SIDE_PX * MAP_SIDE_PX);
  for (let y = 0; y < height; y++) map.set(samples.subarray(y * width, (y + 1) * width), (row + y) * MAP_SIDE_PX + column);
  return map;
}

/** @param {Float32Array} v @returns {Touch} */
function touchOf(v) {
  return {
    forceN: [v[0], v[1], v[2]],
    torqueNMm: [v[3], v[4], v[5]],
    areaMm2: v[6],
    centreMm: [v[7], v[8], v[9]],
    penetrationMm: v[10],
    stiffnessNPerMm: v[11],
    travelMm: v[12],
    pressureMaxPa: v[13],
    share: v[14],
    solveUs: v[15],
  };
}
