// A session that keeps itself connected: docs/reference/protocol.md.

import { PapillaError, missed, refusal, unreachable } from './error.js';
import { Link, sessionUrl } from './link.js';
import { Move } from './move.js';
import { Outbox } from './outbox.js';
import { OPEN_MS, TIMEOUT_MS, Warnings, Watch } from './watch.js';
import { crop } from './window.js';
import { Answer, MAP_LEN, SIDE_PX, VERSION } from './wire.js';

/** @typedef {import('./types.js').Hello} Hello */
/** @typedef {import('./types.js').Ready} Ready */
/** @typedef {import('./types.js').Problem} Problem */
/** @typedef {import('./types.js').State} State */
/** @typedef {import('./types.js').Options} Options */

/** What a hello asks for where it does not say: half the bytes of f32, SED within .02 %. */
const DEFAULTS = Object.freeze(/** @type {Hello} */ ({ sample_type: 'u16' }));
/** Refusals of a hello that pass by themselves. */
const PASSING = new Set(['overloaded', 'shutting_down', 'timeout', 'internal', 'rate_limited']);

const nowUs = () => Math.round((performance.timeOrigin + performance.now()) * 1000);

/**
 * A session. Frames are pressure maps (Pa); answers are maps of strain energy density (J/m3).
 *
 * The newest frame wins on this side too: while an earlier frame has not left the socket a frame waits, and
 * a newer one takes its place (`supersededByClient` counts). A lost connection is made anew by itself, with the terms of
 * the last hello; a frame that waits then goes out first. Where the service asks for it, the session goes on over another
 * connection without a lost frame, and `onready` is called again.
 *
 * `onanswer(answer)` is called exactly once for every frame, with `answer.status`: `ok`, `superseded` (by this client or the
 * server), `late`, `stale`, `error` (then `answer.problem`), `lost` (the connection broke, or no answer came within
 * `timeoutMs`; a connection that owes an answer for so long is given up and another made). `onready(ready)`,
 * `onrefused(problem)` for refused hellos and faults of the session, `onstate(state, why)`.
 */
export class Session {
  /** @type {(ready: Ready) => void} */ onready = () => {};
  /** @type {(answer: Answer) => void} */ onanswer = () => {};
  /** By default the console says so. @type {(problem: Problem) => void} */ onrefused = (problem) => console.warn(`papilla: ${problem.message}`);
  /** @type {(state: State, why: string) => void} */ onstate = () => {};

  /** The terms as the server confirmed them; null while there is no session. @type {Ready | null} */
  ready = null;
  /** @type {State} */
  state = 'closed';
  /** Deadline of the frames to come, us; 0: the session's budget. */
  deadlineUs = 0;
  /** The last answer of the server; overwritten by the next. */
  answer = new Answer();

  // Of frames without an answer: the last answer must not change while it is being looked at.
  #brief = new Answer();
  #rectangle = { column: 0, row: 0, width: 0, height: 0 };
  #options;
  #link;
  #move;
  /** @type {Hello} */ #hello;
  // Terms to go back to if a renewal is refused.
  /** @type {{hello: Hello, ready: Ready, termsFrom: number} | null} */ #before = null;
  /** @type {Watch} */ #watch;
  /** @type {Outbox} */ #outbox;
  // Answers up to the hello of a renewal have the sections of before.
  #termsFrom = 0;
  /** @type {ReturnType<Answer['views']> | null} */ #views = null;
  /** @type {ReturnType<Answer['views']> | null} */ #viewsBefore = null;
  /** @type {Map<number, {resolve: (answer: Answer) => void, reject: (error: Error) => void}>} */ #promised = new Map();
  #opened = false;
  // New terms that wait for the session to have moved, or to stay.
  #unsaid = false;
  #warnings = new Warnings();

  /**
   * @param {string} base where the server is: `host:port` or a URL; '' for the server of the page
   * @param {Hello} [hello] what to ask for; see docs/reference/protocol-hello.md
   * @param {Options} [options]
   */
  constructor(base = '', hello = {}, options = {}) {
    this.#link = new Link(sessionUrl(base, options.token), {
      connecting: () => this.#enter('connecting', ''),
      opened: () => this.#greet(false),
      prepared: () => this.#move.prepared(),
      text: (text) => this.#text(text),
      binary: (data) => this.#binary(data),
      lost: (why) => this.#lost(why),
    });
    this.#move = new Move(this.#link, () => this.#moved(), (why) => this.#goOn(why));
    this.#watch = new Watch(options.timeoutMs ?? TIMEOUT_MS, (bornMs) => this.#expire(bornMs));
    this.#outbox = new Outbox(() => this.#flush(), (sequence, status) => this.#settle(sequence, status, null), this.#watch);
    this.#hello = { ...DEFAULTS, ...hello };
    this.#options = { crop: options.crop ?? true, clockUs: options.clockUs ?? nowUs };
  }

  /**
   * A session that is ready.
   * @param {string} [base] @param {Hello} [hello] @param {Options} [options]
   * @returns {Promise<Session>} rejected with a PapillaError where the hello is refused, or `unreachable` where no
   *   session is there within 10 s
   */
  static async connect(base, hello, options) {
    const session = new Session(base, hello, options);
    return new Promise((resolve, reject) => {
      let last = 'no answer';
      const patience = setTimeout(() => {
        session.close();
        reject(refusal('unreachable', unreachable(base ?? '', last)));
      }, OPEN_MS);
      session.onstate = (_state, why) => { last = why || last; };
      session.onready = () => {
        clearTimeout(patience);
        session.onready = session.onrefused = session.onstate = () => {};
        resolve(session);
      };
      session.onrefused = (problem) => {
        if (PASSING.has(problem.code)) return;
        clearTimeout(patience);
        session.close();
        reject(new PapillaError(problem));
      };
      session.open();
    });
  }

  /** Frames that went out. */
  get sent() {
    return this.#outbox.sent;
  }

  /** Frames whose place a newer one took before they could go out. */
  get supersededByClient() {
    return this.#outbox.superseded;
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

  /** Connects, and again whenever the connection is lost, until `close`. */
  open() {
    this.#opened = true;
    if (!this.#link.isBusy) this.#link.connect();
  }

  /** Ends the session. */
  close() {
    this.#end('closed', '');
  }

  /**
   * New terms, in the open session: answered by `onready`, or by `onrefused` and the terms stay.
   * @param {Hello} hello
   */
  renew(hello) {
    // A frame that waits was encoded by the terms of before.
    this.#outbox.supersede();
    if (this.ready) this.#before = { hello: this.#hello, ready: this.ready, termsFrom: this.#termsFrom };
    this.#hello = { ...DEFAULTS, ...hello };
    this.#termsFrom = (this.#outbox.sequence + 1) >>> 0;
    this.ready = null;
    // A session that moves says it where it goes on.
    this.#unsaid = this.#move.holds;
    if (this.#unsaid) return;
    if (this.#link.isOpen) this.#greet(false);
    else if (this.#opened && !this.#link.isBusy) this.#link.connect();
  }

  /**
   * Sends a whole map (224 x 224, Pa, row-major); it may be overwritten afterwards.
   * @param {Float32Array} pressurePa
   * @returns {number} the frame's sequence, which its answer repeats
   * @throws {PapillaError} `wrong_length`; as u16 or u8 also `not_finite` and `negative_pressure`, which the server tells of f32 and f16
   */
  send(pressurePa) {
    if (pressurePa.length !== MAP_LEN) throw refusal('wrong_length', `a map has ${MAP_LEN} samples, this one ${pressurePa.length}`);
    if (!this.#options.crop) return this.#put(pressurePa, 0, SIDE_PX, 0, 0, SIDE_PX, SIDE_PX);
    const { column, row, width, height } = crop(pressurePa, this.#rectangle);
    return this.#put(pressurePa, row * SIDE_PX + column, SIDE_PX, column, row, width, height);
  }

  /**
   * Sends a rectangle of the map; all other pixels are 0.
   * @param {Float32Array} samplesPa width x height samples, Pa, row-major
   * @param {number} column @param {number} row @param {number} width @param {number} height
   * @returns {number} the frame's sequence
   */
  sendWindow(samplesPa, column, row, width, height) {
    if (width * height > samplesPa.length || column + width > SIDE_PX || row + height > SIDE_PX || Math.min(column, row, width, height) < 0) {
      throw refusal('wrong_shape', `${width} x ${height} samples at (${column}, ${row}) do not fit the map or the ${samplesPa.length} samples given`);
    }
    return this.#put(samplesPa, 0, width, column, row, width, height);
  }

  /**
   * Sends that tracking is lost: the answer is zero, no unit fires, and nothing bursts when tracking comes back.
   * @returns {number} the frame's sequence
   */
  sendNotTracked() {
    this.#outbox.putNotTracked(this.#options.clockUs(), this.deadlineUs);
    this.#flush();
    return this.#outbox.sequence;
  }

  /**
   * Sends a map and waits for its answer. For one map after the other; frames of a running scene go
   * by `send` and `onanswer`.
   * @param {Float32Array} pressurePa
   * @returns {Promise<Answer>} rejected with a PapillaError where the server refuses the frame, or does
   *   not render it (code `superseded`, `late`, `stale`, `lost`)
   */
  render(pressurePa) {
    return new Promise((resolve, reject) => this.#promised.set(this.send(pressurePa), { resolve, reject }));
  }

  /**
   * @param {Float32Array} values @param {number} first @param {number} stride
   * @param {number} column @param {number} row @param {number} width @param {number} height
   */
  #put(values, first, stride, column, row, width, height) {
    const timeUs = this.#options.clockUs();
    this.#outbox.put(values, first, stride, column, row, width, height, this.#hello, timeUs, this.deadlineUs);
    this.#flush();
    return this.#outbox.sequence;
  }

  /** The outcome of a frame of which the server sent no binary answer. @param {number} sequence @param {Answer['status']} status @param {Problem | null} problem */
  #settle(sequence, status, problem) {
    this.#brief.sequence = sequence;
    this.#brief.status = status;
    this.#brief.problem = problem;
    this.#tell(this.#brief);
  }

  /** Says once what a program that looks at maps alone would not see. @param {Answer} answer */
  #warn(answer) {
    if (answer.status === 'error') this.#warnings.tell('error', () => `a frame was refused: ${answer.problem?.message}`);
    if (answer.status !== 'ok') return;
    if (answer.outOfRange) {
      this.#warnings.tell('out_of_range', () => 'pressure is beyond what the tier knows; such answers are flagged');
    }
    if (answer.coarseClock) {
      this.#warnings.tell('coarse_clock', () => 'the times of the frames have steps above 20 ms, stand still, or are in ms or ns '
        + 'in place of us; rates, spikes and creep in such answers are wrong, and flagged coarse_clock');
    }
  }

  /** Ends frames whose time is over; false: none is left. @param {number} bornMs */
  #expire(bornMs) {
    const { waiting, left } = this.#outbox.expire(bornMs);
    const why = `no answer within ${this.timeoutMs} ms`;
    if (waiting || left) this.#warnings.tell('timeout', () => `${why}; such frames are lost`);
    if (left) this.#link.giveUp(why);
    return this.#outbox.isBusy;
  }

  /** @param {Answer} answer */
  #tell(answer) {
    this.#warn(answer);
    this.onanswer(answer);
    const promised = this.#promised.size > 0 ? this.#promised.get(answer.sequence) : undefined;
    if (!promised) return;
    this.#promised.delete(answer.sequence);
    if (answer.status === 'ok') promised.resolve(answer);
    else promised.reject(new PapillaError(answer.problem ?? missed(answer.status, answer.sequence)));
  }

  #flush() {
    if (this.ready && !this.#move.holds) this.#outbox.flush(this.#link);
  }

  /** @param {boolean} resume */
  #greet(resume) {
    this.#unsaid = false;
    const state = resume ? { resume } : {};
    this.#link.send(JSON.stringify({ ...this.#hello, ...state, type: 'hello', version: VERSION, reconnect: true }));
  }

  /** The session goes on over another connection; what went out was answered. */
  #moved() {
    this.ready = null;
    this.#before = null;
    this.#outbox.lose(false);
    this.#greet(true);
  }

  /** The session that was to move goes on over its old connection. @param {string} why it stays there, '' if it tries again */
  #goOn(why) {
    if (why) this.#warnings.stays(why);
    if (this.#unsaid) this.#greet(false);
    this.#flush();
  }

  /** @param {string} why */
  #lost(why) {
    this.#move.end();
    this.ready = null;
    this.#before = null;
    this.#outbox.lose(false);
    this.#enter('waiting', why);
  }

  /** Ends the connection for good: no frame will be answered. @param {State} state @param {string} why */
  #end(state, why) {
    this.#opened = false;
    this.#watch.stop();
    this.#link.drop();
    this.#move.end();
    this.ready = null;
    this.#before = null;
    this.#outbox.lose(true);
    this.#enter(state, why);
  }

  /** @param {State} state @param {string} why */
  #enter(state, why) {
    this.state = state;
    this.onstate(state, why);
  }

  /** @param {string} text */
  #text(text) {
    const message = JSON.parse(text);
    if (message.type === 'ready') this.#welcome(message);
    else if (message.type === 'error') this.#problem(message);
    else if (message.type === 'reconnect') this.#link.prepare();
  }

  /** @param {Ready} ready */
  #welcome(ready) {
    this.#link.succeeded();
    this.#viewsBefore = this.#views;
    this.#views = this.answer.views(ready.sections);
    this.#before = null;
    this.#move.ready();
    this.ready = ready;
    this.#warnings.question(ready);
    this.#enter('ready', '');
    this.onready(ready);
    this.#flush();
  }

  /** @param {Problem} problem */
  #problem(problem) {
    const { sequence } = problem;
    if (typeof sequence === 'number') {
      if (this.#outbox.take(sequence)) this.#settle(sequence, 'error', problem);
      return;
    }
    // The service answers in turn: a hello that was said comes before a state.
    if ((this.ready || this.#unsaid) && !problem.closes && this.#move.refuses(problem)) return;
    if (!this.ready && !problem.closes && !PASSING.has(problem.code)) this.#refused(problem);
    this.onrefused(problem);
  }

  /** A hello was refused: of a renewal the terms of before stand, at the start nothing does. @param {Problem} problem */
  #refused(problem) {
    if (this.#before) {
      ({ hello: this.#hello, ready: this.ready, termsFrom: this.#termsFrom } = this.#before);
      this.#before = null;
      return;
    }
    this.#end('refused', problem.message);
  }

  /** @param {ArrayBuffer} data */
  #binary(data) {
    if (this.#move.takes(data)) return;
    const { answer } = this;
    try {
      answer.readHeader(data);
      const older = this.#viewsBefore !== null && ((answer.sequence - this.#termsFrom) | 0) < 0;
      const views = older ? this.#viewsBefore : this.#views;
      if (!older) this.#viewsBefore = null;
      if (answer.status === 'ok' && views) answer.readBody(views, data.byteLength);
    } catch (error) {
      this.onrefused({ type: 'error', code: 'bad_frame', message: String(error), sequence: null, closes: false });
      return;
    }
    if (!this.#outbox.take(answer.sequence)) return;
    answer.roundTripUs = this.#options.clockUs() - answer.clientTimeUs;
    answer.problem = null;
    this.#flush();
    this.#tell(answer);
  }
}
