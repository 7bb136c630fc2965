// Where the time of the last answers went: medians, and the work without what a frame waited.

const WINDOW = 40;

/** Median of the values; NaN of none. */
export function median(values) {
  const sorted = Float64Array.from(values).sort();
  return sorted.length ? sorted[Math.floor(sorted.length / 2)] : NaN;
}

/** Keeps the last values of a list. */
export function keep(list, value, most = WINDOW) {
  if (list.push(value) > most) list.shift();
}

/** Microseconds as milliseconds, so that small parts do not read as nothing. */
export const msOf = (us) => (us > 0 && us < 10 ? '< 0.01' : (us / 1000).toFixed(us < 9995 ? 2 : 1));

/** Times of the last answers under the same terms. */
export class Times {
  constructor() {
    this.clear();
  }

  clear() {
    this.parts = { wait: [], solve: [], infer: [], rest: [] };
  }

  push({ serverUs, queueUs, networkUs, solveUs }) {
    const rest = Math.max(0, serverUs - queueUs - networkUs - solveUs);
    for (const [name, value] of Object.entries({ wait: queueUs, solve: solveUs, infer: networkUs, rest })) keep(this.parts[name], value);
  }

  of(part) {
    return median(this.parts[part]);
  }

  /** Time without waiting, us: what the work costs. */
  get workUs() {
    return this.of('solve') + this.of('infer') + this.of('rest');
  }

  /** The work, and its two great parts. */
  get words() {
    if (this.parts.infer.length === 0) return ['–', ''];
    const contact = this.of('solve') > 0 ? `contact ${msOf(this.of('solve'))}, ` : '';
    return [`${msOf(this.workUs)} ms`, `${contact}network ${msOf(this.of('infer'))}`];
  }
}
