// How wrong an answer is likely to be, by its own estimate: a bar whose dark part ends at the error that
// half of such answers stay below, and its light part where nine in ten do.

/** Relative error at the end of the bar. */
const END = 0.5;
const WARN = 0.3;
const UNKNOWN = 'unknown for such a press';

const part = (error) => `${(100 * Math.min(1, error / END)).toFixed(1)}%`;
const percent = (error) => `${(100 * error).toFixed(error < 0.0995 ? 1 : 0)} %`;

/** In words; '' where the answer carries no estimate. `unknown`: what is said where the service states no error. */
export function sureWords(estimate, unknown = UNKNOWN) {
  if (!estimate) return '';
  const [typical, bound] = estimate;
  if (!Number.isFinite(typical)) return `expected error: ${unknown}`;
  const most = Number.isFinite(bound) ? `; 9 in 10 such answers below ${percent(bound)}` : '';
  return `expected error ${percent(typical)}${most}`;
}

/** The same where there is little room. */
function sureWord(estimate, found) {
  if (!Number.isFinite(estimate[0])) return 'error unknown';
  return `error ${percent(found > 0 ? found : estimate[0])}`;
}

export class SureBar {
  /** `element` gets the bar and its words. */
  constructor(element) {
    this.element = element;
    this.bar = document.createElement('span');
    this.bar.className = 'sure-bar';
    this.bound = document.createElement('i');
    this.typical = document.createElement('b');
    this.found = document.createElement('u');
    this.bar.append(this.bound, this.typical, this.found);
    this.text = Object.assign(document.createElement('span'), { className: 'wide' });
    this.word = Object.assign(document.createElement('span'), { className: 'narrow' });
    element.replaceChildren(this.bar, this.text, this.word);
    element.title = 'Relative L2 error of SED against finite elements, as the service expects it of this answer. The bar ends at 50 %.';
  }

  /** `estimate`: typical error and bound, of SED then of force; null: none came. `found`: the true error, NaN where nobody knows it. */
  show(estimate, found = NaN, unknown = UNKNOWN) {
    const words = sureWords(estimate, unknown);
    const shown = found > 0 && words ? `${words}; found ${percent(found)}` : words;
    if (this.text.textContent === shown) return;
    this.text.textContent = shown;
    this.element.hidden = shown === '';
    if (!estimate) return;
    this.word.textContent = sureWord(estimate, found);
    const [typical, bound] = estimate;
    this.bar.hidden = !Number.isFinite(typical);
    this.typical.style.width = part(typical);
    this.bound.style.width = part(bound);
    this.found.hidden = !(found > 0);
    this.found.style.left = part(found);
    this.element.classList.toggle('wide', !(bound < WARN));
  }
}
