// The page's hard cases of the finite-element code, from their report. `node stability.mjs` writes the
// file that the page loads; modules.test.mjs checks that it is the report's.

import { readFile, writeFile } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';

const REPORT = new URL('../../docs/reports/stability.md', import.meta.url);
const FILE = new URL('../../server/web/stability.json', import.meta.url);

/** Cases of the report: name, what they promise, and each variant with how it ended. */
export function casesOf(report) {
  const cases = [];
  for (const line of report.split('\n')) {
    const title = line.match(/^## `(.+)`$/);
    const row = line.match(/^\| (.+?) \| (converged|evaluated|refused)(?:: \*(.*)\*)? \|/);
    if (title) cases.push({ name: title[1], about: '', variants: [] });
    else if (cases.length === 0) continue;
    else if (row) {
      const tightest = line.split('|')[8]?.trim() ?? '';
      cases.at(-1).variants.push([row[1], row[2], row[3] ?? tightest]);
    } else if (line && !line.startsWith('|') && cases.at(-1).about === '') cases.at(-1).about = line.replace(/ \([\d.]+ s\)$/, '');
  }
  const [summary] = report.match(/^\d+ variants of \d+ cases: [^;]*/m);
  return { summary: `${summary}.`, cases };
}

export const fileOf = async () => `${JSON.stringify(casesOf(await readFile(REPORT, 'utf8')))}\n`;

if (process.argv[1] === fileURLToPath(import.meta.url)) await writeFile(FILE, await fileOf());
