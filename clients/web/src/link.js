// A WebSocket that is made anew whenever it is lost.

import { addressOf, cleanToken } from './address.js';

/** Attempts to connect are this far apart, with some chance in it. */
const RETRY_MS = { least: 100, most: 250 };
/** An attempt that has not come to a session by then is given up. */
const ATTEMPT_MS = 5000;

/**
 * Address of the sessions of a server.
 * @param {string} base see `addressOf`
 * @param {string} [token]
 */
export function sessionUrl(base, token) {
  const { session } = addressOf(base);
  const clean = cleanToken(token);
  return clean ? `${session}?access_token=${encodeURIComponent(clean)}` : session;
}

const retryMs = () => RETRY_MS.least + (RETRY_MS.most - RETRY_MS.least) * Math.random();

/** @param {WebSocket} socket */
function end(socket) {
  socket.onmessage = socket.onclose = null;
  // Browsers complain of a socket that is closed while it connects.
  if (socket.readyState === WebSocket.CONNECTING) socket.onopen = () => socket.close();
  else socket.close();
}

/**
 * What happens to a link. `connecting` and `lost` may be told many times.
 * @typedef {object} Ends
 * @property {() => void} connecting
 * @property {() => void} opened
 * @property {() => void} prepared the connection that `prepare` asked for is there
 * @property {(text: string) => void} text
 * @property {(data: ArrayBuffer) => void} binary
 * @property {(why: string) => void} lost
 */

export class Link {
  /** @param {string} url @param {Ends} ends */
  constructor(url, ends) {
    this.#url = url;
    this.#ends = ends;
  }

  #url;
  #ends;
  /** @type {WebSocket | null} */ #socket = null;
  // The one to go on over.
  /** @type {WebSocket | null} */ #next = null;
  /** @type {ReturnType<typeof setTimeout> | undefined} */ #retry;
  /** @type {ReturnType<typeof setTimeout> | undefined} */ #attempt;

  get isOpen() {
    return this.#socket !== null && this.#socket.readyState === WebSocket.OPEN;
  }

  /** Whether there is a connection, or an attempt at one. */
  get isBusy() {
    return this.#socket !== null;
  }

  /** Bytes that have not left yet. */
  get bufferedBytes() {
    return this.#socket?.bufferedAmount ?? 0;
  }

  /** @param {string | ArrayBuffer | Uint8Array<ArrayBuffer>} message */
  send(message) {
    this.#socket?.send(message);
  }

  /** The attempt has come to a session. */
  succeeded() {
    clearTimeout(this.#attempt);
  }

  connect() {
    this.drop();
    this.#ends.connecting();
    const socket = new WebSocket(this.#url);
    this.#take(socket);
    socket.onopen = () => this.#ends.opened();
  }

  /** Opens another connection while this one goes on, again and again until it is there. */
  prepare() {
    if (this.#next || !this.isOpen) return;
    const socket = new WebSocket(this.#url);
    this.#next = socket;
    socket.onopen = () => this.#ends.prepared();
    socket.onerror = () => {};
    socket.onclose = () => {
      if (socket !== this.#next) return;
      this.#next = null;
      this.#retry = setTimeout(() => this.prepare(), retryMs());
    };
  }

  /** Gives the other connection up: this one goes on until `prepare` is called again. */
  stay() {
    clearTimeout(this.#retry);
    if (this.#next) end(this.#next);
    this.#next = null;
  }

  /** Goes on over that connection, and closes this one; false: it is not there any more. */
  move() {
    const [old, next] = [this.#socket, this.#next];
    if (!next || next.readyState !== WebSocket.OPEN) return false;
    this.#next = null;
    if (old) {
      old.onmessage = old.onclose = null;
      old.close();
    }
    clearTimeout(this.#attempt);
    this.#take(next);
    return true;
  }

  /** Hears this connection from now on. @param {WebSocket} socket */
  #take(socket) {
    socket.binaryType = 'arraybuffer';
    this.#socket = socket;
    this.#attempt = setTimeout(() => this.#lose(socket, `no session within ${ATTEMPT_MS} ms`), ATTEMPT_MS);
    socket.onmessage = (event) => {
      if (typeof event.data === 'string') this.#ends.text(event.data);
      else this.#ends.binary(event.data);
    };
    socket.onclose = (event) => this.#lose(socket, event.reason || 'the connection was lost');
    // The reason is in the close event that follows.
    socket.onerror = () => {};
  }

  /** Gives the connection up, and makes another. @param {string} why */
  giveUp(why) {
    if (this.#socket) this.#lose(this.#socket, why);
  }

  /** Ends the connection, and tries no other. */
  drop() {
    clearTimeout(this.#retry);
    clearTimeout(this.#attempt);
    for (const socket of [this.#socket, this.#next]) if (socket) end(socket);
    this.#socket = this.#next = null;
  }

  /** @param {WebSocket} socket @param {string} why */
  #lose(socket, why) {
    if (socket !== this.#socket) return;
    this.drop();
    // Before the owner is told: it may drop the link for good.
    this.#retry = setTimeout(() => this.connect(), retryMs());
    this.#ends.lost(why);
  }
}
