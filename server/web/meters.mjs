// The numbers beside the maps: latency, rate, counts, force, errors. Text changes four times a
// second, so that it can be read and layout stays cheap.

import { Stats, drawStrip } from './stats.mjs';
import { nameOfSet, nameOfTier } from './words.mjs';

const REFRESH_MS = 250;
const LATE_TO_TELL = 5;

const byId = (id) => document.getElementById(id);
const put = (id, text) => {
  const element = byId(id);
  if (element.textContent !== text) element.textContent = text;
};
const ms = (value) => (Number.isNaN(value) ? '–' : value < 100 ? value.toFixed(1) : value.toFixed(0));
const percent = (value) => {
  if (Number.isNaN(value)) return '–';
  const size = 100 * value;
  return `${Math.abs(size) < 10 ? size.toFixed(2) : size.toFixed(1)} %`;
};
const signed = (value) => (value > 0 ? `+${percent(value)}` : percent(value).replace('-', '−'));

/** Scrolls the list, and only the list, to the row. */
function showRow(row) {
  const list = row.closest('.press-errors');
  const top = row.offsetTop - list.offsetTop;
  if (top < list.scrollTop) list.scrollTop = top;
  else if (top + row.offsetHeight > list.scrollTop + list.clientHeight) list.scrollTop = top + row.offsetHeight - list.clientHeight;
}

export class Meters {
  /** `advise(tier, budgetMs)`: in words, what to do where the budget is missed. */
  constructor(advise) {
    this.advise = advise;
    this.stats = new Stats();
    this.pair = [NaN, NaN];
    /** Median time in the server of the last answers, ms. */
    this.serverMs = NaN;
    this.budgetMs = 0;
    this.shownAtMs = 0;
    this.errorsNow = null;
    this.errorsShown = true;
    this.pressNow = null;
    this.pressErrors = [];
    this.pressRows = [];
    this.current = -1;
    this.tier = '–';
  }

  /** A new tier or budget: a new measurement. */
  restart(budgetMs) {
    this.stats.clear();
    this.budgetMs = budgetMs;
    this.tier = '–';
  }

  /** `medians`: name and median relative L2 of each set that the tier was measured on. */
  ready(ready, medians) {
    this.tier = ready.tier;
    byId('error-context').replaceChildren(...medians.flatMap(([set, median]) => [['dt', nameOfSet(set)], ['dd', percent(median)]])
      .map(([tag, textContent]) => Object.assign(document.createElement(tag), { textContent })));
    byId('error-usual').hidden = medians.length === 0;
  }

  /** One row for each shipped press. */
  listPresses(names) {
    this.pressRows = names.map((name) => {
      const row = document.createElement('tr');
      const head = document.createElement('th');
      head.scope = 'row';
      head.textContent = name;
      const bar = document.createElement('i');
      const value = document.createElement('td');
      const barCell = document.createElement('td');
      barCell.append(bar);
      row.append(head, barCell, value);
      return { row, bar, value };
    });
    byId('press-errors').tBodies[0].replaceChildren(...this.pressRows.map(({ row }) => row));
  }

  answer(answer, roundTripMs, nowMs) {
    this.stats.answer(answer.status, roundTripMs, answer.serverUs, nowMs);
  }

  fault() {
    this.stats.counts.error++;
  }

  skip() {
    this.stats.counts.skipped++;
  }

  press(press) {
    this.pressNow = press;
  }

  /** Errors of the press `current`, and the relative L2 of each press as far as it is known. */
  errors(figures, pressErrors, current) {
    this.errorsNow = figures;
    this.pressErrors = pressErrors;
    this.current = current;
    this.errorsShown = false;
  }

  /** Writes what changed; `sending` tells a pause from a stall, `connected` whether answers can come. False: not yet. */
  refresh(nowMs, sending, connected) {
    if (nowMs - this.shownAtMs < REFRESH_MS) return false;
    this.shownAtMs = nowMs;
    const { stats, pair } = this;
    put('tier-name', nameOfTier(this.tier));
    byId('tier-name').dataset.tier = this.tier;
    put('sed-of', nameOfTier(this.tier));
    put('rate', sending ? `${stats.rate(nowMs)} frames/s` : 'idle');
    for (const [name, ring] of [['trip', stats.roundTripMs], ['server', stats.serverMs]]) {
      ring.percentiles(pair);
      if (name === 'server') [this.serverMs] = pair;
      put(`${name}-p50`, ms(pair[0]));
      put(`${name}-p99`, ms(pair[1]));
    }
    for (const [name, count] of Object.entries(stats.counts)) put(`count-${name}`, String(count));
    const late = stats.lateInARow >= LATE_TO_TELL;
    // An old answer must not pass for the answer to this press.
    byId('sed').classList.toggle('stale', late || (!connected && this.stats.counts.ok > 0));
    put('stale', connected ? `${nameOfTier(this.tier)} needs more than ${this.budgetMs} ms here: ${this.advise(this.tier, this.budgetMs)}` : 'no connection');
    const top = drawStrip(byId('strip'), stats.roundTripMs, this.budgetMs);
    const budget = `budget ${this.budgetMs} ms`;
    put('strip-top', top >= this.budgetMs ? `line: ${budget}` : `top: ${ms(top)} ms, ${budget}`);
    this.#showPress();
    this.#showErrors();
    return true;
  }

  #showPress() {
    if (!this.pressNow) return;
    const { forceN, areaMm2, isEstimate } = this.pressNow;
    // Of the page's own estimate it is only about so much.
    const about = isEstimate ? '≈ ' : '';
    put('force', `${about}${forceN.toFixed(2)} N`);
    put('area', `${about}${areaMm2.toFixed(0)} mm²`);
  }

  #showErrors() {
    if (this.errorsShown || !this.errorsNow) return;
    this.errorsShown = true;
    const figures = this.errorsNow;
    put('error-l2', percent(figures.relativeL2));
    put('error-far', percent(figures.farFieldL2));
    put('error-peak', signed(figures.peak));
    put('error-energy', signed(figures.energy));
    let largest = 0;
    for (const error of this.pressErrors) if (error > largest) largest = error;
    this.pressRows.forEach(({ row, bar, value }, n) => {
      const error = this.pressErrors[n];
      row.setAttribute('aria-current', String(n === this.current));
      if (n === this.current) showRow(row);
      bar.style.width = error > 0 ? `${(100 * error) / largest}%` : '0';
      value.textContent = percent(error);
    });
  }
}
