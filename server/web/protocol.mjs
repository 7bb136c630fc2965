// Papilla's session protocol, client side: one WebSocket, a JSON hello, a JSON ready, then binary frames
// of a 48-byte little-endian header and a payload (here always f32): a row-major 224 x 224 map, or an object's pose.

import { SpikeSection } from './spikes.mjs';

export const SIDE_PX = 224;
export const MAP_LEN = SIDE_PX * SIDE_PX;
export const HEADER_BYTES = 48;

const VERSION = 3;

const STATUS = ['ok', 'superseded', 'late', 'error', 'late'];
const MAGIC = 0x314c5050; // the bytes 'P' 'P' 'L' '1'
const KIND = { pressure: 1, sed: 2, objects: 4 };
const POSE_LEN = 7;
const TOUCH_LEN = 16;
const SAMPLE_F32 = 0;
const TWO_POW_32 = 4294967296;
const PASSING = new Set(['overloaded', 'shutting_down', 'timeout', 'internal']);
const BACK_OFF_MS = { first: 250, last: 400 };
/** A server that says nothing for so many of these is given up; counted by a timer, which stands still where the page does. */
const WATCH_MS = 250;
const SILENT_WATCHES = 7;
const FLAG = { outOfRange: 1, unfamiliar: 4, unsettled: 8, cutOff: 16 };
/** Where the sections of an answer begin. */
const BARE_MAP = { map: HEADER_BYTES };

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

/** Reads an answer into `into`; `at` is where its sections begin. Throws an Error that says what is wrong with the frame. */
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
  into.tierNumber = view.getUint16(44, true);
  into.outOfRange = (view.getUint8(46) & FLAG.outOfRange) !== 0;
  into.cutOff = (view.getUint8(46) & FLAG.cutOff) !== 0;
  into.unfamiliar = (view.getUint8(46) & FLAG.unfamiliar) !== 0;
  into.unsettled = (view.getUint8(46) & FLAG.unsettled) !== 0;
  into.timeMs = (view.getUint32(16, true) + view.getUint32(20, true) * TWO_POW_32) / 1000;
  into.sedJPerM3 = into.pressurePa = into.touch = into.spikes = null;
  if (into.status === 'ok') {
    const sampleType = view.getUint8(6);
    if (sampleType !== SAMPLE_F32 || data.byteLength !== at.map + 4 * MAP_LEN) {
      throw new Error(`answer of sample type ${sampleType} and ${data.byteLength} bytes is not an f32 map`);
    }
    into.sedJPerM3 = new Float32Array(data, at.map, MAP_LEN);
    if (at.pressure) into.pressurePa = new Float32Array(data, at.pressure, MAP_LEN);
    if (at.spikes) into.spikes = new SpikeSection(data, at.spikes, at.map - at.spikes);
    if (at.touch) into.touch = new Float32Array(data, at.touch, TOUCH_LEN);
  }
  return into;
}

/**
 * A session that keeps itself connected. At most one frame is in flight: `send` refuses while an
 * answer is due, so the caller's newest map is always the next one sent.
 *
 * Callbacks: `onstate(state, detail)` with state connecting | ready | waiting | refused;
 * `onready(ready)`; `onanswer(answer, roundTripMs)`; `onfault(code, message)`.
 */
export class Session {
  constructor(url, callbacks) {
    this.url = url;
    this.callbacks = callbacks;
    this.mapFrame = RequestFrame.map();
    this.poseFrame = RequestFrame.pose();
    this.answer = {
      status: 'error', sequence: 0, serverUs: 0, timeMs: 0, tierNumber: 0, sedJPerM3: null, pressurePa: null, touch: null,
      spikes: null, outOfRange: false, unfamiliar: false, unsettled: false, cutOff: false,
    };
    this.sections = BARE_MAP;
    this.sequence = 0;
    this.inFlight = false;
    this.sentAtMs = 0;
    this.watched = -1;
    this.silentWatches = 0;
    this.ready = null;
    this.socket = null;
    this.timer = 0;
    this.delayMs = BACK_OFF_MS.first;
    this.wish = { tier: null, budget_us: 50000 };
    this.retryNow = () => this.#connect();
    setInterval(() => this.#watch(), WATCH_MS);
  }

  /** Asks for the wished tier (null: the server's choice) and budget, in the open session if there is one. */
  open(wish) {
    this.wish = { ...wish };
    this.delayMs = BACK_OFF_MS.first;
    if (!this.ready || this.socket.readyState !== WebSocket.OPEN) {
      this.#connect();
      return;
    }
    // A frame on its way is still answered by the old tier: that answer says nothing about the new one.
    this.ready = null;
    this.inFlight = false;
    this.#hello(this.socket);
  }

  #hello(socket) {
    socket.send(JSON.stringify({ type: 'hello', version: VERSION, effects: [], sample_type: 'f32', ...this.wish }));
  }

  /** Sends the frame; false while an answer is due or the session is not ready. */
  send(nowMs, frame) {
    if (!this.ready || this.inFlight) return false;
    this.sequence = (this.sequence + 1) >>> 0;
    frame.stamp(this.sequence, Math.round((performance.timeOrigin + nowMs) * 1000));
    this.sentAtMs = performance.now();
    this.inFlight = true;
    this.socket.send(frame.buffer);
    return true;
  }

  /** Gives up a connection on which an answer, or a session, is due for too long. */
  #watch() {
    const isDue = this.socket !== null && (this.inFlight || !this.ready);
    const due = this.inFlight ? this.sequence : -1;
    this.silentWatches = isDue && due === this.watched ? this.silentWatches + 1 : 0;
    this.watched = due;
    if (this.silentWatches >= SILENT_WATCHES) this.#closed({ reason: 'the server is silent' });
  }

  #connect() {
    clearTimeout(this.timer);
    this.#drop();
    this.callbacks.onstate('connecting', '');
    const socket = new WebSocket(this.url);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    socket.onopen = () => this.#hello(socket);
    socket.onmessage = (event) => {
      if (typeof event.data === 'string') this.#text(event.data);
      else this.#binary(event.data);
    };
    socket.onclose = (event) => this.#closed(event);
  }

  #drop() {
    this.silentWatches = 0;
    const old = this.socket;
    this.socket = null;
    this.ready = null;
    this.inFlight = false;
    if (old) {
      old.onmessage = old.onclose = null;
      // Closing a socket that is still connecting makes the browser complain: let it connect first.
      if (old.readyState === WebSocket.CONNECTING) old.onopen = () => old.close();
      else old.close();
    }
  }

  #text(text) {
    let message;
    try {
      message = JSON.parse(text);
    } catch {
      this.callbacks.onfault('bad_json', 'the server sent a text that is not JSON');
      return;
    }
    if (message.type === 'ready') {
      this.ready = message;
      this.sections = Object.fromEntries(message.sections.map(({ name, offset }) => [name, offset]));
      this.delayMs = BACK_OFF_MS.first;
      this.callbacks.onready(message);
      this.callbacks.onstate('ready', '');
    } else if (message.type === 'error') {
      if (message.sequence === undefined || message.sequence === null || message.sequence === this.sequence) {
        this.inFlight = false;
      }
      this.callbacks.onfault(message.code, message.message);
      // A refused hello would be refused again: wait for the visitor to choose otherwise. What passes
      // by itself is left to the close that follows, and to the back-off.
      const ofFrame = message.sequence !== undefined && message.sequence !== null;
      if (!this.ready && !ofFrame && !PASSING.has(message.code)) {
        this.#drop();
        this.callbacks.onstate('refused', message.message);
      }
    }
  }

  #binary(data) {
    const nowMs = performance.now();
    // A stale sequence is the answer to a frame given up before, on other terms: it says nothing about this one.
    const isWhole = data.byteLength >= HEADER_BYTES;
    if (!this.inFlight || (isWhole && new DataView(data).getUint32(8, true) !== this.sequence)) return;
    try {
      readAnswer(data, this.answer, this.sections);
    } catch (error) {
      this.inFlight = false;
      this.callbacks.onfault('bad_frame', error.message);
      return;
    }
    this.inFlight = false;
    this.callbacks.onanswer(this.answer, nowMs - this.sentAtMs);
  }

  #closed(event) {
    this.#drop();
    const jitter = 0.75 + 0.5 * Math.random();
    const waitMs = this.delayMs * jitter;
    this.delayMs = Math.min(2 * this.delayMs, BACK_OFF_MS.last);
    this.callbacks.onstate('waiting', `${event.reason || 'connection lost'}; trying again in ${(waitMs / 1000).toFixed(1)} s`);
    this.timer = setTimeout(this.retryNow, waitMs);
  }
}
