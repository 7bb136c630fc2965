// Going on over another connection when the service asks for it, without a lost frame.

/** @typedef {import('./link.js').Link} Link */

/** What a sealed state begins with, as opposed to a frame: `PPS`. */
const SEALED = [0x50, 0x50, 0x53];
/** Longest wait for what the service remembers; after it the session stays. */
const SEAL_MS = 5000;

/**
 * Frames go on over the old connection until the new one is there; then they wait for what was sent to be
 * answered, and for ready. If the service does not say what it remembers, the session stays until it is asked again.
 */
export class Move {
  /** Whether frames wait. */
  holds = false;

  // Whether hello was said on the other connection.
  #greeted = false;
  // States that were asked for and have not come: a late one is not that of the last move.
  #due = 0;
  #link;
  #greet;
  #goOn;
  /** @type {ReturnType<typeof setTimeout> | undefined} */ #timer;

  /**
   * @param {Link} link
   * @param {() => void} greet says hello on the other connection; a state follows
   * @param {(why: string) => void} goOn sends what waits, over the old connection; `why` it stays there, '' if it tries again
   */
  constructor(link, greet, goOn) {
    this.#link = link;
    this.#greet = greet;
    this.#goOn = goOn;
  }

  /** The other connection is there. */
  prepared() {
    this.holds = true;
    this.#due += 1;
    this.#link.send('{"type":"seal"}');
    this.#timer = setTimeout(() => this.#stay(`nothing came within ${SEAL_MS / 1000} s`), SEAL_MS);
  }

  /** Whether the message is a sealed state; it is dealt with then. @param {ArrayBuffer} data */
  takes(data) {
    const head = new Uint8Array(data, 0, Math.min(SEALED.length, data.byteLength));
    if (SEALED.some((byte, i) => head[i] !== byte)) return false;
    if (this.#isAwaited()) this.#go(data);
    return true;
  }

  /** Whether the problem, which is of no frame, is in place of a state; it is dealt with then. @param {import('./types.js').Problem} problem */
  refuses(problem) {
    if (this.#due === 0) return false;
    if (this.#isAwaited()) this.#stay(problem.message);
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
    this.#due = 0;
  }

  /** Whether what came, as a state or in place of one, is what is waited for. */
  #isAwaited() {
    this.#due = Math.max(0, this.#due - 1);
    return this.#due === 0 && this.holds && !this.#greeted;
  }

  /** The old connection goes on. @param {string} why */
  #stay(why) {
    clearTimeout(this.#timer);
    this.holds = false;
    this.#link.stay();
    this.#goOn(why);
  }

  /** @param {ArrayBuffer} state */
  #go(state) {
    clearTimeout(this.#timer);
    if (!this.#link.move()) {
      // The old connection goes on for as long as it is there.
      this.holds = false;
      this.#goOn('');
      this.#link.prepare();
      return;
    }
    this.#greeted = true;
    this.#greet();
    this.#link.send(state);
  }
}
