// Plain names for what files and protocol call otherwise, each with a sentence that explains it.

import { suits } from './tiers.mjs';

/** Sets of simulations that models are judged on (models/ladder.json). */
const SETS = {
  reference: ['finest mesh', 'the only set that finite elements on coarser meshes were held against'],
  'reference-anew': ['finest mesh again', 'other poses, solved when everything was decided'],
  'reference-shapes': ['fresh shapes', 'on the finest mesh: shapes that no other set has, solved when everything was decided'],
  'heldout-presses': ['new presses', 'of shapes that were trained on; for maps of pressure the service chooses by these'],
  'heldout-shapes': ['new shapes', 'never trained on'],
  pressed: ['hard presses', 'a plate to 7 N, a key, gratings, Braille'],
  s1: ['a flat plate', 'as in the paper of the published U-Net'],
  poses: ['from poses', 'for poses the service chooses by these; what contact takes comes on top of the times shown'],
  cards: ['the models’ own cards', ''],
};

/** Name of a set for people; an unknown one keeps its own. */
export const nameOfSet = (set) => SETS[set]?.[0] ?? set;

/** A sentence about a set of the ladder. */
export function aboutSet(sets, name) {
  const set = sets?.find((one) => one.name === name);
  const more = SETS[name]?.[1];
  // Other sets are named there as files call them.
  const about = set?.about.replace(/`([^`]+)`/g, (_, other) => `“${nameOfSet(other)}”`);
  const count = set ? `${set.samples} simulations: ${about}` : '';
  return [count, more].filter(Boolean).join('; ');
}

const TIERS = {
  's1-base16': ['published U-Net', 'The network of the paper, trained on a flat plate alone; for comparison.'],
  's1-base16-relative': ['U-Net, scaled', 'The network of the paper on relative pressure; for comparison.'],
  'half-space': ['half-space', 'A closed form for a flat elastic block: no network, and rough on a finger.'],
  'nano-maps': ['nano for maps', 'For sessions that give maps of pressure.'],
  'small-maps': ['small for maps', 'For sessions that give maps of pressure.'],
  'large-maps': ['large for maps', 'For sessions that give maps of pressure.'],
};

/** What a tier says that did not learn what is given. */
const NOT_LEARNT = {
  poses: 'it learnt the pressure of finite elements; here contact finds the pressure from poses',
  pressure: 'it learnt the pressure that contact finds from poses; here maps of pressure are given',
};
/** Heads of the choices that did not learn it. */
const OTHERS = { poses: 'learnt maps of pressure', pressure: 'learnt the pressure of contact' };

export const nameOfTier = (tier) => TIERS[tier]?.[0] ?? tier;
const sentence = (words) => `${words[0].toUpperCase()}${words.slice(1)}.`;

/** A sentence about a tier of the listing; with what is `given`, also that the tier did not learn it. */
export function aboutTier(name, tier, given) {
  const own = TIERS[name]?.[1] ?? '';
  return tier && !suits(tier, given) ? `${own} ${sentence(NOT_LEARNT[given])}`.trim() : own;
}

export const notLearnt = (given) => NOT_LEARNT[given];
export const nameOfOthers = (given) => OTHERS[given];

/** Contact methods (docs/concepts/contact.md). */
const METHODS = {
  pixels: ['pixels', 'Pressure is solved at every pixel: the most accurate.'],
  coarse_pixels: ['half the pixels', 'Pressure is solved at every second pixel.'],
  second_order: ['vertices', 'Pressure is solved at the vertices of the mesh, with large motions.'],
  small_strain: ['small strain', 'As with vertices, for small motions alone.'],
  springs: ['springs', 'The skin as springs side by side: fastest, and rough.'],
};

export const nameOfMethod = (method) => METHODS[method]?.[0] ?? method;
export const aboutMethod = (method) => METHODS[method]?.[1] ?? '';

/** Flags of an answer, as the page says them; `mostPa` is the greatest pressure of the training. */
export function flagsOf({ outOfRange, unfamiliar, unsettled, cutOff, coarseClock }, mostPa) {
  const words = [];
  if (outOfRange) words.push(mostPa ? `harder than it learnt (${(mostPa / 1000).toFixed(0)} kPa)` : 'harder than it learnt');
  if (unfamiliar) words.push('unlike anything it learnt');
  if (unsettled) words.push('contact not settled: rough');
  if (cutOff) words.push('cut off at the map’s edge');
  if (coarseClock) words.push('coarse clock: rates may be off');
  return words;
}

/** Effects of a session: name and what it does, for people. */
export const EFFECTS = {
  shear_energy: ['Shear from friction', 'Adds to SED what friction along the skin changes. It needs an object with friction.'],
  relaxation: ['Creep', 'The tissue yields slowly under constant pressure.'],
  afferents: ['Firing rates', 'How fast slowly adapting (SA1) fibres fire, at every pixel.'],
  spikes: ['Spikes', 'When each touch fibre of the finger fires.'],
  summary: ['Summary', 'Force, area, peak and moments in sixteen numbers.'],
  points: ['SED at points', 'Values at listed places, here at the point that is pressed.'],
  actuators: ['Actuators', 'One intensity for each actuator of a display, here 4 x 4 electrodes.'],
  contact_window: ['Only the contact', 'Cuts the map of the answer to the contact and a margin.'],
};
