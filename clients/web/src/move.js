// Going on over another connection when the service asks for it, without a lost frame.

/** @typedef {import('./link.js').Link} Link */

/** What a sealed state begins with, as opposed to a frame: `PPS`. */
const SEALED = [0x50, 0x50, 0x53];
/** Longest wait for what the service remembers; after it the session starts anew. */
const SEAL_MS = 5000;

/**
 * Frames go on over the old connection until the new one is there; then they wait for what was sent to be
 * answered, and for ready.
 */
export class Move {
  /** Whether frames wait. */
  holds = false;

  // Whether hello was said on the other connection.
  #greeted = false;
  #link;
  #greet;
  #flush;
  /** @type {ReturnType<typeof setTimeout> | undefined} */ #timer;

  /**
   * @param {Link} link
   * @param {(resume: boolean) => void} greet says hello; with `resume` a state follows
   * @param {() => void} flush sends what waits
   */
  constructor(link, greet, flush) {
    this.#link = link;
    this.#greet = greet;
    this.#flush = flush;
  }

  /** The other connection is there. */
  prepared() {
    this.holds = true;
    this.#link.send('{"type":"seal"}');
    this.#timer = setTimeout(() => this.#go(null), SEAL_MS);
  }

  /** Whether the message is a sealed state; it is dealt with then. @param {ArrayBuffer} data */
  takes(data) {
    const head = new Uint8Array(data, 0, Math.min(SEALED.length, data.byteLength));
    if (SEALED.some((byte, i) => head[i] !== byte)) return false;
    if (this.holds) this.#go(data);
    return true;
  }

  /** A ready came: of the other connection, or of new terms on this one. */
  ready() {
    if (this.#greeted) this.end();
  }

  /** The session goes on, or its connection is lost. */
  end() {
    clearTimeout(this.#timer);
    this.holds = this.#greeted = false;
  }

  /** @param {ArrayBuffer | null} state */
  #go(state) {
    clearTimeout(this.#timer);
    if (!this.#link.move()) {
      // The old connection goes on for as long as it is there.
      this.holds = false;
      this.#flush();
      this.#link.prepare();
      return;
    }
    this.#greeted = true;
    this.#greet(state !== null);
    if (state) this.#link.send(state);
  }
}
