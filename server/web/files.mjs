// What comes in and goes out as a file or a text: a mesh of the visitor's own, and what is taken along.

import { meshOf, MM_PER_M } from './mesh.mjs';
import { byId } from './notice.mjs';
import { save } from './share.mjs';

const PLAUSIBLE_MM = { least: 3, most: 30 };
const OTHERWISE_MM = 10;

const isPlausible = (mm) => mm >= PLAUSIBLE_MM.least && mm <= PLAUSIBLE_MM.most;

/**
 * The greatest side that a mesh is given, mm, and why, in words. A file whose size could be a thing's on a finger keeps it; one
 * that has such a size in metres is taken in metres.
 */
export function sizeFor(sideMm) {
  const own = Number(sideMm.toFixed(2));
  if (isPlausible(sideMm)) return [own, 'its own size'];
  const inMetres = Number((sideMm * MM_PER_M).toFixed(2));
  if (isPlausible(inMetres)) return [inMetres, `${sideMm.toPrecision(3)} long in the file: taken as metres, ${inMetres} mm`];
  return [OTHERWISE_MM, `${sideMm.toPrecision(3)} mm in the file, made ${OTHERWISE_MM} mm`];
}

/** Takes files that are dropped on the page or opened: `take(mesh, sizeMm)` gets their mesh, `complain` what is wrong with them. */
export function listenToMeshes(take, complain, hasMesh) {
  const read = async (file) => {
    try {
      const mesh = meshOf(await file.arrayBuffer(), file.name);
      const [size, why] = sizeFor(mesh.sideMm);
      take(mesh, size);
      byId('mesh-note').textContent = `${[`${file.name}: ${mesh.given} triangles`, why, ...mesh.said].join('; ')}. Its side towards +z presses.`;
    } catch (error) {
      complain(error.message);
    }
  };
  const end = () => { delete document.body.dataset.dragging; };
  document.addEventListener('dragover', (event) => {
    event.preventDefault();
    document.body.dataset.dragging = '';
  });
  document.addEventListener('dragleave', (event) => { if (!event.relatedTarget) end(); });
  document.addEventListener('drop', (event) => {
    event.preventDefault();
    end();
    if (event.dataTransfer.files.length) read(event.dataTransfer.files[0]);
  });
  byId('mesh-file').addEventListener('change', () => { if (byId('mesh-file').files.length) read(byId('mesh-file').files[0]); });
  byId('mesh-open').addEventListener('click', () => byId('mesh-file').click());
  // The chip of one's own mesh asks for a file, unless there is one already; whoever walks over the chips by keyboard is not asked.
  document.querySelector('input[name=shape][value=mesh]').addEventListener('click', ({ detail }) => { if (!hasMesh() && detail > 0) byId('mesh-file').click(); });
}

const say = (text) => { byId('share-note').textContent = text; };

async function copy(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    say(`${what} copied.`);
  } catch {
    // Without a secure origin a page may not write the clipboard: what it would hold is shown instead.
    window.prompt(`${what}:`, text);
  }
}

/** The buttons of what is taken along; each gets what its function gives when it is pressed. `python` may give null. */
export function listenToShare({ link, python, csv, npy, png }) {
  byId('copy-link').addEventListener('click', () => copy(link(), 'Link'));
  byId('copy-python').addEventListener('click', () => {
    const program = python();
    if (program === null) say('This server has no contact model: there is no pose to send.');
    else copy(program, 'Program');
  });
  byId('save-csv').addEventListener('click', () => save('papilla.csv', 'text/csv', csv()));
  byId('save-npy').addEventListener('click', () => {
    save('papilla.npy', 'application/octet-stream', npy());
    say('papilla.npy: pressure (Pa) and SED (J/m³), 2 x 224 x 224.');
  });
  byId('save-png').addEventListener('click', () => png().toBlob((blob) => save('papilla.png', 'image/png', blob)));
}
