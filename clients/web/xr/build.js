// `npm run build`: the scene, the client alone as one module, and its reader of meshes with three.js for the service's page, in dist/.

import { copyFile, mkdir } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const here = (/** @type {string} */ path) => fileURLToPath(new URL(path, import.meta.url));

await mkdir(here('../dist'), { recursive: true });
await build({
  entryPoints: { scene: here('scene.js'), papilla: here('../papilla.js'), meshes: here('../src/meshes.js') },
  outdir: here('../dist'),
  bundle: true,
  minify: true,
  format: 'esm',
  target: 'es2022',
  legalComments: 'linked',
});
await copyFile(here('index.html'), here('../dist/index.html'));
