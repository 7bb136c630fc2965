// The hard cases of the finite-element code, as its report has them (docs/reports/stability.md): those that are
// hard in the same way beside a case that was sent, and all of them in a list.

import { byId, notify } from './notice.mjs';
import { fetchJson } from './replay.mjs';

/** So many variants of each end stand beside a case; the others are in the list. */
const SHOWN = 2;
/** Errors that begin alike are one kind. */
const ALIKE = 24;

const make = (tag, members, ...children) => {
  const element = Object.assign(document.createElement(tag), members);
  element.append(...children);
  return element;
};

const titleOf = (name) => `${name[0].toUpperCase()}${name.slice(1).replaceAll('-', ' ')}`;
const isRefused = ([, end]) => end === 'refused';

/** How many variants came to which end, in words. */
export function countsOf(variants) {
  const count = (word) => variants.filter(([, end]) => end === word).length;
  const words = [['converged', 'converge'], ['evaluated', 'are evaluated'], ['refused', 'stop with an error']];
  return words.map(([end, word]) => [count(end), word]).filter(([n]) => n > 0).map(([n, word]) => `${n} ${n === 1 ? word.replace(/^are/, 'is').replace(/^(converge|stop)/, '$1s') : word}`).join(', ');
}

/** Some variants of a case, those `like` that first: of the refused each kind of error once, then some that have a result. */
export function examplesOf(all, like = /^/) {
  const variants = [...all.filter(([name]) => like.test(name)), ...all.filter(([name]) => !like.test(name))];
  const kinds = new Map();
  for (const variant of variants.filter(isRefused)) {
    const kind = variant[2].slice(0, ALIKE);
    if (!kinds.has(kind)) kinds.set(kind, variant);
  }
  return [...[...kinds.values()].slice(0, SHOWN), ...variants.filter((variant) => !isRefused(variant)).slice(0, SHOWN - Math.min(1, kinds.size))];
}

function tableOf(variants) {
  const table = make('table', {});
  const heads = table.createTHead().insertRow();
  for (const word of ['variant', 'outcome', 'its error, or what was checked: found, and allowed']) heads.append(make('th', { scope: 'col', textContent: word }));
  table.createTBody();
  for (const variant of variants) {
    const row = table.tBodies[0].insertRow();
    row.className = isRefused(variant) ? 'refused' : 'plain';
    for (const words of variant) row.insertCell().textContent = words;
  }
  return table;
}

/** A few variants where there is little room: which, how it ended, and why. */
function listOf(variants) {
  return make('dl', {}, ...variants.flatMap((variant) => {
    const [name, end, more] = variant;
    return [make('dt', {}, `${name}: `, make('b', { className: isRefused(variant) ? 'verdict refused' : 'verdict plain', textContent: end })), make('dd', { textContent: more })];
  }));
}

const inFull = ({ name, about, variants }) => make('details', {}, make('summary', {}, make('b', { textContent: `${titleOf(name)}: ` }), countsOf(variants)), make('p', { textContent: about }), tableOf(variants));

export class HardCasesOfFe {
  constructor() {
    this.loading = null;
    byId('hard-all').addEventListener('toggle', () => { if (byId('hard-all').open) this.#showAll().catch((error) => notify(error.message)); });
  }

  #load() {
    this.loading ??= fetchJson('stability.json').catch((error) => {
      this.loading = null;
      throw error;
    });
    return this.loading;
  }

  /** Shows what the solver does with difficulties of the same kind. */
  async show({ beside, why, like }) {
    const mine = {};
    this.shown = mine;
    try {
      const { cases } = await this.#load();
      if (this.shown !== mine) return;
      const found = cases.filter(({ name }) => beside.includes(name));
      byId('hard-beside').replaceChildren(
        make('h3', { textContent: 'Finite elements, hard in the same way' }),
        make('p', { className: 'hint', textContent: `${why[0].toUpperCase()}${why.slice(1)}.` }),
        ...found.map(({ name, variants }) => make('div', { className: 'fe-case' }, make('p', {}, make('b', { textContent: `${titleOf(name)}: ` }), `${countsOf(variants)}.`), listOf(examplesOf(variants, like)))),
      );
    } catch (error) {
      notify(error.message);
    }
  }

  async #showAll() {
    const { summary, cases } = await this.#load();
    if (byId('hard-fe').childElementCount > 0) return;
    const about = `${summary} Converged: the solver found an equilibrium, which was then checked. Evaluated: a formula was computed and checked; nothing is solved. Refused: an error names the cause, and no answer is given.`;
    byId('hard-fe').append(make('p', { className: 'hint', textContent: about }), ...cases.map(inFull));
  }
}
