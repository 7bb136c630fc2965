// Fits the foundation to the training indentations of data/s1 and data/broad and prints its error on indentations that took no part
// in the fit: `npm run foundation`. With --json one object.

import { fileURLToPath } from 'node:url';
import { FITTED, Foundation, WINKLER } from '../src/foundation.js';
import { readStates } from './states.js';

/** @typedef {import('./states.js').State} State */
/** @typedef {import('../src/foundation.js').Law} Law */

const DATA = fileURLToPath(new URL('../../../data/', import.meta.url));
const SETS = ['s1', 'broad', 'heldout', 'deep'];

const quantile = (/** @type {number[]} */ values, /** @type {number} */ q) => values.sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(q * values.length))];

/** The stiffness of least mean square of the relative errors, for the law's exponent and relief. @param {State[]} states @param {Law} law */
function fit(states, law) {
  const foundation = new Foundation({ ...law, stiffness: 1 });
  const unit = new Float32Array(states[0].pressurePa.length);
  let [dot, square] = [0, 0];
  for (const { penetrationMm, pressurePa } of states) {
    foundation.pressures(penetrationMm, unit);
    let [cross, own, truth] = [0, 0, 0];
    for (let i = 0; i < unit.length; i++) {
      cross += unit[i] * pressurePa[i];
      own += unit[i] ** 2;
      truth += pressurePa[i] ** 2;
    }
    dot += cross / truth;
    square += own / truth;
  }
  return dot / square;
}

/** Relative L2 over the vertices, and of the sum of pressures, of each state. @param {State[]} states @param {Law} law */
function errors(states, law) {
  const foundation = new Foundation(law);
  const estimate = new Float32Array(states[0].pressurePa.length);
  const l2 = [];
  const sum = [];
  for (const { penetrationMm, pressurePa } of states) {
    foundation.pressures(penetrationMm, estimate);
    let [off, truth, total, due] = [0, 0, 0, 0];
    for (let i = 0; i < estimate.length; i++) {
      off += (estimate[i] - pressurePa[i]) ** 2;
      truth += pressurePa[i] ** 2;
      total += estimate[i];
      due += pressurePa[i];
    }
    l2.push(Math.sqrt(off / truth));
    sum.push(Math.abs(total / due - 1));
  }
  return { states: states.length, l2_median: quantile(l2, 0.5), l2_p95: quantile(l2, 0.95), sum_median: quantile(sum, 0.5) };
}

/** What is measured: for each law the stiffness that fits, and the errors by set and by indenter. */
export function measure() {
  const states = SETS.flatMap((set) => readStates(`${DATA}${set}`, set));
  const training = states.filter((s) => s.split === 'train' && (s.set === 's1' || s.set === 'broad'));
  const judged = states.filter((s) => s.split === 'test' || s.set === 'heldout' || s.set === 'deep');
  const groups = [...new Set(judged.map((s) => `${s.set}: ${s.indenter}`))];
  return [['fitted', FITTED], ['winkler', WINKLER]].map((entry) => {
    const [name, law] = /** @type {[string, Law]} */ (entry);
    const rows = [...SETS.map((set) => ({ of: set, ...errors(judged.filter((s) => s.set === set), law) })),
      ...groups.map((of) => ({ of, ...errors(judged.filter((s) => `${s.set}: ${s.indenter}` === of), law) }))];
    return { name, law, stiffness: fit(training, law), rows };
  });
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const laws = measure();
  if (process.argv.includes('--json')) {
    console.log(JSON.stringify(laws));
  } else {
    const [fitted, winkler] = laws;
    const percent = (/** @type {number} */ value) => `${(100 * value).toFixed(1)} %`;
    for (const { name, law, stiffness } of laws) console.log(`${name}: ${JSON.stringify(law)}; the fit gives ${stiffness.toFixed(0)} Pa/mm^n`);
    console.log('\n| indentations | states | L2, median | L2, p95 | sum, median | Winkler: L2, median | sum, median |\n|---|---|---|---|---|---|---|');
    fitted.rows.forEach((row, n) => {
      const other = winkler.rows[n];
      console.log(`| ${row.of} | ${row.states} | ${[row.l2_median, row.l2_p95, row.sum_median, other.l2_median, other.sum_median].map(percent).join(' | ')} |`);
    });
  }
}
