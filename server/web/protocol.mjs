// The page's session: one frame in flight, so that the newest press is always the next one sent. Bytes
// and connection are those of the web client (clients/web); here is what only the page does.

import { Link } from './link.js';
import { FLAG, HEADER_BYTES, MAGIC, MAP_LEN, SIDE_PX, STATUS, VERSION } from './wire.js';
import { SpikeSection } from './spikes.mjs';

export { HEADER_BYTES, MAP_LEN, SIDE_PX };

const KIND = { pressure: 1, sed: 2, objects: 4 };
const POSE_LEN = 7;
const TOUCH_LEN = 16;
const SUMMARY_LEN = 16;
const RATES_HEAD = 4;
const SAMPLE_F32 = 0;
const TWO_POW_32 = 4294967296;
const PASSING = new Set(['overloaded', 'shutting_down', 'timeout', 'internal', 'rate_limited']);
/** A server that says nothing for so long is given up; counted by a timer, which stands still where the page does. */
const WATCH_MS = 250;
const SILENT_MS = 3000;
/** Where the sections of an answer begin. */
const BARE_MAP = { map: { offset: HEADER_BYTES, bytes: 4 * MAP_LEN } };

/** A request frame whose buffer is made once and refilled for every frame. */
export class RequestFrame {
  constructor(kind, width, height) {
    this.buffer = new ArrayBuffer(HEADER_BYTES + 4 * width * height);
    this.header = new DataView(this.buffer, 0, HEADER_BYTES);
    /** What is sent: write it here. */
    this.values = new Float32Array(this.buffer, HEADER_BYTES, width * height);
    this.header.setUint32(0, MAGIC, true);
    this.header.setUint8(4, VERSION);
    this.header.setUint8(5, kind);
    this.header.setUint8(6, SAMPLE_F32);
    this.header.setUint16(12, width, true);
    this.header.setUint16(14, height, true);
    this.header.setFloat32(28, 1, true);
  }

  /** Of pressure on the skin, Pa, row-major. */
  static map() {
    return new RequestFrame(KIND.pressure, SIDE_PX, SIDE_PX);
  }

  /** Of where an object is: origin, mm, and quaternion. */
  static pose() {
    return new RequestFrame(KIND.objects, POSE_LEN, 1);
  }

  /** Stamps the frame; the time is split by hand because a BigInt would be an allocation. */
  stamp(sequence, timeUs) {
    this.header.setUint32(8, sequence, true);
    this.header.setUint32(16, timeUs % TWO_POW_32, true);
    this.header.setUint32(20, timeUs / TWO_POW_32, true);
  }
}

/** What an answer holds; made once, and filled anew by `readAnswer`. */
export function emptyAnswer() {
  return {
    status: 'error', sequence: 0, serverUs: 0, queueUs: 0, networkUs: 0, solveUs: 0, bytes: 0, timeMs: 0, tierNumber: 0,
    sedJPerM3: null, pressurePa: null, displacementMm: null, errorEstimate: null, touch: null, spikes: null, ratesHz: null, summary: null, points: null, actuators: null,
    outOfRange: false, noContact: false, unfamiliar: false, unsettled: false, cutOff: false, coarseClock: false,
  };
}

const CARRIED = ['sedJPerM3', 'pressurePa', 'displacementMm', 'errorEstimate', 'touch', 'spikes', 'ratesHz', 'summary', 'points', 'actuators'];

/** Reads an answer into `into`; `at` is where its sections are. Throws an Error that says what is wrong with the frame. */
export function readAnswer(data, into, at = BARE_MAP) {
  if (data.byteLength < HEADER_BYTES) {
    throw new Error(`answer of ${data.byteLength} bytes is shorter than its ${HEADER_BYTES}-byte header`);
  }
  const view = new DataView(data);
  if (view.getUint32(0, true) !== MAGIC) throw new Error('answer does not start with PPL1');
  if (view.getUint8(4) !== VERSION) throw new Error(`answer has protocol version ${view.getUint8(4)}`);
  if (view.getUint8(5) !== KIND.sed) throw new Error(`answer is of kind ${view.getUint8(5)}, not SED`);
  into.status = STATUS[view.getUint8(7)] ?? 'error';
  into.sequence = view.getUint32(8, true);
  into.serverUs = view.getUint32(24, true);
  into.queueUs = view.getUint32(36, true);
  into.networkUs = view.getUint32(40, true);
  into.solveUs = 0;
  into.bytes = data.byteLength;
  into.tierNumber = view.getUint16(44, true);
  const flags = view.getUint8(46);
  for (const name of ['outOfRange', 'noContact', 'unfamiliar', 'unsettled', 'cutOff', 'coarseClock']) into[name] = (flags & FLAG[name]) !== 0;
  into.timeMs = (view.getUint32(16, true) + view.getUint32(20, true) * TWO_POW_32) / 1000;
  for (const name of CARRIED) into[name] = null;
  if (into.status === 'ok') readSections(data, view, into, at);
  return into;
}

function readSections(data, view, into, at) {
  const floats = (section, length) => (section ? new Float32Array(data, section.offset, length ?? section.bytes / 4) : null);
  if (at.map) into.sedJPerM3 = readMap(data, view, at.map.offset);
  into.pressurePa = floats(at.pressure, MAP_LEN);
  into.displacementMm = floats(at.displacement);
  into.errorEstimate = floats(at.error_estimate);
  into.touch = floats(at.touch, TOUCH_LEN);
  if (into.touch) [into.solveUs] = [into.touch[15]];
  into.summary = floats(at.summary, SUMMARY_LEN);
  into.points = floats(at.points);
  into.actuators = floats(at.actuators);
  into.ratesHz = at.rates ? floats(at.rates).subarray(RATES_HEAD) : null;
  if (at.spikes) into.spikes = new SpikeSection(data, at.spikes.offset, at.spikes.bytes);
}

/** The map of an answer: a view of the message, or a whole map made of its window. */
function readMap(data, view, offset) {
  const [width, height, column, row] = [12, 14, 32, 34].map((place) => view.getUint16(place, true));
  const sampleType = view.getUint8(6);
  const fits = column + width <= SIDE_PX && row + height <= SIDE_PX;
  if (sampleType !== SAMPLE_F32 || data.byteLength !== offset + 4 * width * height || !fits) {
    throw new Error(`answer of sample type ${sampleType}, ${width} x ${height} and ${data.byteLength} bytes is not an f32 map`);
  }
  const samples = new Float32Array(data, offset, width * height);
  if (samples.length === MAP_LEN) return samples;
  const map = new Float32Array(MAP_LEN);
  for (let y = 0; y < height; y++) map.set(samples.subarray(y * width, (y + 1) * width), (row + y) * SIDE_PX + column);
  return map;
}

/**
 * A session that keeps itself connected. At most one frame is in flight: `send` refuses while an
 * answer is due, so the caller's newest map is always the next one sent.
 *
 * Callbacks: `onstate(state, detail)` with state connecting | ready | waiting | refused;
 * `onready(ready)`; `onanswer(answer, roundTripMs)`; `onfault(code, message, problem)`.
 */
export class Session {
  constructor(url, callbacks, silentMs = SILENT_MS) {
    this.callbacks = callbacks;
    this.silentMs = silentMs;
    this.mapFrame = RequestFrame.map();
    this.poseFrame = RequestFrame.pose();
    this.answer = emptyAnswer();
    this.sections = BARE_MAP;
    this.sequence = 0;
    this.inFlight = false;
    this.sentAtMs = 0;
    this.watched = -1;
    this.silentWatches = 0;
    this.ready = null;
    this.wish = { tier: null, budget_us: 50000 };
    this.link = new Link(url, {
      connecting: () => this.callbacks.onstate('connecting', ''),
      opened: () => this.#hello(),
      prepared: () => {},
      text: (text) => this.#text(text),
      binary: (data) => this.#binary(data),
      lost: (why) => this.#lost(why),
    });
    this.timer = setInterval(() => this.#watch(), WATCH_MS);
  }

  /** Asks for the wished tier (null: the server's choice) and budget, in the open session if there is one. */
  open(wish) {
    this.wish = { ...wish };
    // A frame on its way is still answered by the old tier: that answer says nothing about the new one.
    this.ready = null;
    this.inFlight = false;
    if (this.link.isOpen) this.#hello();
    else if (!this.link.isBusy) this.link.connect();
  }

  /** Ends the session for good. */
  close() {
    clearInterval(this.timer);
    this.#forget();
    this.link.drop();
  }

  #hello() {
    this.link.send(JSON.stringify({ type: 'hello', version: VERSION, effects: [], sample_type: 'f32', ...this.wish }));
  }

  /** Sends the frame; false while an answer is due or the session is not ready. */
  send(nowMs, frame) {
    if (!this.ready || this.inFlight) return false;
    this.sequence = (this.sequence + 1) >>> 0;
    frame.stamp(this.sequence, Math.round((performance.timeOrigin + nowMs) * 1000));
    this.sentAtMs = performance.now();
    this.inFlight = true;
    this.link.send(frame.buffer);
    return true;
  }

  /** Gives up a connection on which an answer, or a session, is due for too long. */
  #watch() {
    const isDue = this.link.isBusy && (this.inFlight || !this.ready);
    const due = this.inFlight ? this.sequence : -1;
    this.silentWatches = isDue && due === this.watched ? this.silentWatches + 1 : 0;
    this.watched = due;
    if (this.silentWatches * WATCH_MS >= this.silentMs) this.link.giveUp('the server is silent');
  }

  #forget() {
    this.silentWatches = 0;
    this.ready = null;
    this.inFlight = false;
  }

  #lost(why) {
    this.#forget();
    this.callbacks.onstate('waiting', `${why}; trying again`);
  }

  #text(text) {
    let message;
    try {
      message = JSON.parse(text);
    } catch {
      this.callbacks.onfault('bad_json', 'the server sent a text that is not JSON', null);
      return;
    }
    if (message.type === 'ready') {
      this.link.succeeded();
      this.ready = message;
      this.sections = Object.fromEntries(message.sections.map((section) => [section.name, section]));
      this.callbacks.onready(message);
      this.callbacks.onstate('ready', '');
    } else if (message.type === 'error') {
      this.#refused(message);
    }
  }

  #refused(message) {
    const ofFrame = message.sequence !== undefined && message.sequence !== null;
    if (!ofFrame || message.sequence === this.sequence) this.inFlight = false;
    this.callbacks.onfault(message.code, message.message, message);
    // A refused hello would be refused again: wait for the visitor to choose otherwise. What passes
    // by itself is left to the close that follows, and to the next attempt.
    if (this.ready || ofFrame || PASSING.has(message.code)) return;
    this.#forget();
    this.link.drop();
    this.callbacks.onstate('refused', message.message);
  }

  #binary(data) {
    const nowMs = performance.now();
    // A stale sequence is the answer to a frame given up before, on other terms: it says nothing about this one.
    const isWhole = data.byteLength >= HEADER_BYTES;
    if (!this.inFlight || (isWhole && new DataView(data).getUint32(8, true) !== this.sequence)) return;
    this.inFlight = false;
    try {
      readAnswer(data, this.answer, this.sections);
    } catch (error) {
      this.callbacks.onfault('bad_frame', error.message, null);
      return;
    }
    if (this.answer.status === 'stale') this.answer.status = 'late';
    this.callbacks.onanswer(this.answer, nowMs - this.sentAtMs);
  }
}

/** Where this page's service takes sessions. */
export function sessionUrl() {
  const url = new URL('v1/session', document.baseURI);
  url.protocol = url.protocol === 'https:' ? 'wss:' : 'ws:';
  return url.href;
}
