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
  const promises = new Map(Array.from(report.matchAll(/^\| `(.+?)` \| ([^|]+) \| \d+ \|$/gm), ([, name, about]) => [name, about]));
  const cases = new Map();
  for (const { case: name, variant, end, error, 'nearest to its tolerance': nearest } of rowsOf(csv)) {
    if (!promises.has(name)) throw new Error(`${name} of the table is no case of the report`);
    if (!cases.has(name)) cases.set(name, { name, about: promises.get(name), variants: [] });
    cases.get(name).variants.push([variant, end, error || nearest]);
  }
  const [summary] = report.match(/^\d+ variants of \d+ cases: [^;]*/m);
  return { summary: `${summary}.`, cases: [...cases.values()] };
}

export const fileOf = async () => `${JSON.stringify(casesOf(...await Promise.all([REPORT, TABLE].map((file) => readFile(file, 'utf8')))))}\n`;

if (process.argv[1] === fileURLToPath(import.meta.url)) await writeFile(FILE, await fileOf());
