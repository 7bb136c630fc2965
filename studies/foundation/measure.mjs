// How near the web client's pressure from penetration comes to finite elements, and which stiffness fits them best.
//
//     for set in broad-graded heldout-graded deep-graded; do
//       cargo run --release -p papilla-fe-datagen -- dataset maps data/$set --out out/maps/$set
//     done
//     node studies/foundation/measure.mjs out/maps          with --json one object
//
// The stiffness is fitted to the training simulations of broad-graded; errors are those of simulations that took no part.

import { fileURLToPath } from 'node:url';
import { FITTED, Foundation, WINKLER } from '../../clients/web/src/foundation.js';
import { readStates } from './states.mjs';

/** @typedef {import('./states.mjs').State} State */
/** @typedef {import('../../clients/web/src/foundation.js').Law} Law */

const DATA = fileURLToPath(new URL('../../data/', import.meta.url));
/** Sets, and whether the stiffness is fitted to their training simulations. All others are judged. */
const SETS = { 'broad-graded': true, 'heldout-graded': false, 'deep-graded': false };

const quantile = (/** @type {number[]} */ values, /** @type {number} */ q) => values.sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(q * values.length))];

/** The map that a client would send. @param {import('../../clients/web/papilla.js').Atlas} atlas @param {Law} law */
function mapper(atlas, law) {
  const foundation = new Foundation(law);
  const [pressures, map] = [new Float32Array(atlas.vertexCount), new Float32Array(224 * 224)];
  return (/** @type {State} */ state) => atlas.pressureMap(foundation.pressures(state.penetrationMm, pressures), map);
}

/** @typedef {{dot: number, square: number}} Sums */

/** Adds to the normal equation of the relative errors: the stiffness of least mean square is dot over square. @param {Sums} sums @param {Float32Array} unit @param {Float32Array} truth */
function add(sums, unit, truth) {
  let [cross, own, due] = [0, 0, 0];
  for (let i = 0; i < unit.length; i++) {
    cross += unit[i] * truth[i];
    own += unit[i] ** 2;
    due += truth[i] ** 2;
  }
  sums.dot += cross / due;
  sums.square += own / due;
}

/** Relative L2 over the pixels, and of the sum of pressures. @param {Float32Array} estimate @param {Float32Array} truth */
function error(estimate, truth) {
  let [off, square, total, due] = [0, 0, 0, 0];
  for (let i = 0; i < estimate.length; i++) {
    off += (estimate[i] - truth[i]) ** 2;
    square += truth[i] ** 2;
    total += estimate[i];
    due += truth[i];
  }
  return { l2: Math.sqrt(off / square), sum: Math.abs(total / due - 1) };
}

/** @param {{l2: number, sum: number}[]} found */
function row(found) {
  const [l2, sum] = [found.map((f) => f.l2), found.map((f) => f.sum)];
  return { states: found.length, l2_median: quantile(l2, 0.5), l2_p95: quantile(l2, 0.95), sum_median: quantile(sum, 0.5) };
}

/** What is measured: for each law the stiffness that fits, and the errors by set and by indenter. @param {string} maps */
export function measure(maps) {
  const laws = [['fitted', FITTED], ['winkler', WINKLER]].map((entry) => {
    const [name, law] = /** @type {[string, Law]} */ (entry);
    return { name, law, sums: { dot: 0, square: 0 }, found: /** @type {Map<string, {l2: number, sum: number}[]>} */ (new Map()) };
  });
  for (const [set, fits] of Object.entries(SETS)) {
    const { atlas, states } = readStates(`${DATA}${set}`, `${maps}/${set}`, set, () => true);
    for (const { law, sums, found } of laws) {
      const [unit, estimate] = [mapper(atlas, { ...law, stiffness: 1 }), mapper(atlas, law)];
      for (const state of states) {
        if (fits && state.split === 'train') {
          add(sums, unit(state), state.pressurePa);
          continue;
        }
        for (const of of [set, `${set}: ${state.indenter}`]) {
          if (!found.has(of)) found.set(of, []);
          found.get(of)?.push(error(estimate(state), state.pressurePa));
        }
      }
    }
  }
  return laws.map(({ name, law, sums, found }) => {
    const rows = [...found].map(([of, errors]) => ({ of, ...row(errors) }));
    return { name, law, stiffness: sums.dot / sums.square, rows };
  });
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const folder = process.argv.slice(2).find((word) => !word.startsWith('--'));
  if (!folder) {
    console.error('usage: node studies/foundation/measure.mjs MAPS [--json]; MAPS holds what fe-datagen dataset maps made of each set');
    process.exit(2);
  }
  const laws = measure(folder);
  if (process.argv.includes('--json')) {
    console.log(JSON.stringify(laws));
  } else {
    const [fitted, winkler] = laws;
    const percent = (/** @type {number} */ value) => `${(100 * value).toFixed(1)} %`;
    for (const { name, law, stiffness } of laws) console.log(`${name}: ${JSON.stringify(law)}; the fit gives ${stiffness.toFixed(0)} Pa/mm^n`);
    console.log('\n| simulations | states | L2, median | L2, 95th percentile | sum, median | Winkler: L2, median | Winkler: sum, median |\n|---|---|---|---|---|---|---|');
    fitted.rows.forEach((row, n) => {
      const other = winkler.rows[n];
      console.log(`| ${row.of} | ${row.states} | ${[row.l2_median, row.l2_p95, row.sum_median, other.l2_median, other.sum_median].map(percent).join(' | ')} |`);
    });
  }
}
