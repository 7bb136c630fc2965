// The page's hard cases of the finite-element code, from their report and its table. `node stability.mjs`
// writes the file that the page loads; modules.test.mjs checks that it is what these two say.

import { readFile, writeFile } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';

const REPORT = new URL('../../docs/reports/stability.md', import.meta.url);
const TABLE = new URL('../../docs/reports/stability.csv', import.meta.url);
const FILE = new URL('../../server/web/stability.json', import.meta.url);

/** Rows of a table of comma-separated values, by the names of its columns. */
function rowsOf(csv) {
  const rows = csv.trim().split('\n').map((line) => Array.from(line.matchAll(/(?:^|,)(?:"((?:[^"]|"")*)"|([^,]*))/g), ([, quoted, plain]) => quoted?.replaceAll('""', '"') ?? plain));
  const [names, ...rest] = rows;
  return rest.map((cells) => Object.fromEntries(names.map((name, k) => [name, cells[k]])));
}

/** Cases: name, what is promised, and each variant with how it ended and why. */
export function casesOf(report, csv) {
  const cases = Array.from(report.matchAll(/^\| `(.+?)` \| (.+?) \|/gm), ([, name, about]) => ({ name, about, variants: [] }));
  for (const row of rowsOf(csv)) {
    const one = cases.find(({ name }) => name === row.case);
    if (!one) throw new Error(`${row.case} of the table is no case of the report`);
    one.variants.push([row.variant, row.end, row.error || row['nearest to its tolerance']]);
  }
  const [summary] = report.match(/^\d+ variants of \d+ cases: [^;]*/m);
  return { summary: `${summary}.`, cases };
}

export const fileOf = async () => `${JSON.stringify(casesOf(...await Promise.all([REPORT, TABLE].map((file) => readFile(file, 'utf8')))))}\n`;

if (process.argv[1] === fileURLToPath(import.meta.url)) await writeFile(FILE, await fileOf());
