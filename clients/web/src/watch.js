// What ends frames whose time is over, and what people are told.

/** After so long a frame without an answer is lost, ms. */
export const TIMEOUT_MS = 5000;
/** A session has to be there by then, ms; programs that wait for longer keep a session and its `onready`. */
export const OPEN_MS = 10000;

/** Looks, while frames are without an outcome, whether the time of one is over. */
export class Watch {
  /** @type {ReturnType<typeof setInterval> | undefined} */ #timer;
  #look;

  /** @param {number} timeoutMs @param {(bornMs: number) => boolean} look ends what was handed over by then; false: nothing is left */
  constructor(timeoutMs, look) {
    if (!(timeoutMs > 0)) throw new RangeError(`timeoutMs is ${timeoutMs}; a time above 0 is due, Infinity for any`);
    this.timeoutMs = timeoutMs;
    this.#look = look;
  }

  start() {
    if (this.#timer !== undefined) return;
    this.#timer = setInterval(() => {
      if (!this.#look(performance.now() - this.timeoutMs)) this.stop();
    }, Math.min(100, Math.max(5, this.timeoutMs / 20)));
  }

  stop() {
    clearInterval(this.#timer);
    this.#timer = undefined;
  }
}

/** What people are told, each thing once. */
export class Warnings {
  /** @type {string[]} */ list = [];
  /** @type {Set<string>} */ #told = new Set();

  /** @param {string} code @param {() => string} words */
  tell(code, words) {
    if (this.#told.has(code) || this.#told.size >= 100) return;
    this.#told.add(code);
    this.list.push(words());
    console.warn(`papilla: ${words()}`);
  }

  /** Why a session that was asked to move stays. @param {string} why */
  stays(why) {
    const words = `the service asked the session to move, and did not say what it remembers (${why}): it goes on over its old connection, and starts anew when that ends`;
    this.tell(words, () => words);
  }

  /** What the service asks, and a budget that it cannot meet. @param {import('./types.js').Ready} ready */
  question(ready) {
    for (const { member, question } of ready.warnings ?? []) {
      const words = `${member}: ${question}`;
      this.tell(words, () => words);
    }
    const { budget_us: budget, tier, predicted_latency_us: needs } = ready;
    if (ready.meets_budget !== false || budget === null) return;
    const meant = budget < 100 ? `; it counts microseconds: were ${budget} ms meant?` : '';
    this.tell(`budget ${tier} ${budget}`, () => `a frame of tier ${tier} takes some ${needs} us, and budget_us is ${budget}, so that frames may be late${meant}`);
  }
}
