// Numbers of frames without an answer, in the order in which they went out; without allocating.

export class Sequences {
  #list;

  /** @param {number} most */
  constructor(most) {
    this.#list = new Uint32Array(most);
    this.count = 0;
  }

  first() {
    return this.#list[0];
  }

  /** There must be room. @param {number} sequence */
  add(sequence) {
    this.#list[this.count++] = sequence;
  }

  /** Takes a number out; false if it is not there. @param {number} sequence */
  take(sequence) {
    for (let k = 0; k < this.count; k++) {
      if (this.#list[k] !== sequence) continue;
      this.#list.copyWithin(k, k + 1, this.count--);
      return true;
    }
    return false;
  }
}
