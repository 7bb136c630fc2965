// `npm run build`, in dist/: the scene and the reader of meshes for the service's page, three.js beside them for both;
// and the client alone as one module.

import { copyFile, mkdir } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const here = (/** @type {string} */ path) => fileURLToPath(new URL(path, import.meta.url));

/** @type {import('esbuild').BuildOptions} */
const how = { outdir: here('../dist'), bundle: true, minify: true, format: 'esm', target: 'es2022', legalComments: 'linked' };

await mkdir(here('../dist'), { recursive: true });
await build({ ...how, entryPoints: { papilla: here('../papilla.js') } });
// What both need goes into one file, and that is three.js and some modules of the client.
await build({ ...how, entryPoints: { scene: here('scene.js'), meshes: here('../src/meshes.js') }, splitting: true, chunkNames: 'three' });
await copyFile(here('index.html'), here('../dist/index.html'));
