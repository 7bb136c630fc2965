// What comes in and goes out as a file or a text: a mesh of the visitor's own, and what is taken along.

import { byId } from './notice.mjs';
import { save } from './share.mjs';
import { MESH_SIDE_MAX_MM, mostBytesOf } from './shapes.mjs';

const MM_PER_M = 1000;
const PLAUSIBLE_MM = { least: 3, most: MESH_SIDE_MAX_MM };
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

/**
 * The mesh in a file as the web client reads it: its vertices in mm about the middle of their box, and what was done to it.
 * Throws an Error that says what is wrong with it.
 */
export async function meshOf(bytes, name) {
  // Its readers are those of three.js, which a page without a file does not load.
  const { readMesh } = await import('./meshes.js');
  // A unit is said, so that no size is asked about: the page fits it to the finger.
  const read = await readMesh(bytes, name, { unit: /\.glb$/i.test(name) ? 'm' : 'mm', bytesOf: mostBytesOf });
  const { shape: { vertices_mm: found, triangles }, decimatedMm, trianglesRead } = read;
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  for (const vertex of found) {
    vertex.forEach((x, axis) => {
      low[axis] = Math.min(low[axis], x);
      high[axis] = Math.max(high[axis], x);
    });
  }
  const vertices = found.map((vertex) => vertex.map((x, axis) => x - (low[axis] + high[axis]) / 2));
  return { name, vertices_mm: vertices, triangles, sideMm: Math.max(...high.map((x, axis) => x - low[axis])), decimatedMm, trianglesRead };
}

/** How many triangles a mesh has; of one that was decimated, how far its surface may be off when it is `sizeMm` large. */
export function trianglesOf({ triangles, trianglesRead, decimatedMm, sideMm }, sizeMm) {
  if (decimatedMm === 0) return `${triangles.length} triangles`;
  const offMm = Number(((decimatedMm * sizeMm) / sideMm).toPrecision(3));
  return `${trianglesRead} triangles became ${triangles.length}: at most ${offMm} mm off at a size of ${sizeMm} mm`;
}

/**
 * Takes files that are dropped on the page or opened: `take(mesh, sizeMm)` gets their mesh, `complain` what is wrong with them.
 * Returns `note(mesh, questions)`, which says what presses, and what the service asks about it; undefined: no mesh of a file.
 */
export function listenToMeshes(take, complain, hasMesh) {
  const { textContent: invitation } = byId('mesh-note');
  const note = (mesh, questions = []) => {
    const asked = questions.map((question) => ` The service asks: ${question}`).join('');
    byId('mesh-note').textContent = mesh ? `${mesh.words}.${asked} Its side towards +z presses.` : invitation;
  };
  const read = async (file) => {
    const before = byId('mesh-note').textContent;
    // One that has to be decimated takes seconds.
    byId('mesh-note').textContent = `Reading ${file.name} ...`;
    try {
      const mesh = await meshOf(await file.arrayBuffer(), file.name);
      const [size, why] = sizeFor(mesh.sideMm);
      const told = { ...mesh, words: `${file.name}: ${trianglesOf(mesh, size)}; ${why}` };
      take(told, size);
      note(told);
    } catch (error) {
      byId('mesh-note').textContent = before;
      complain(error.problem?.message ?? error.message);
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
  return note;
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
