// The page's pictures: the maps with their scales, how wrong they may be, and the finger.

import { relativeL2 } from './compare.mjs';
import { FingerView } from './finger.mjs';
import { MapView } from './map.mjs';
import { byId, put, putParts, showFlags } from './notice.mjs';
import { MAP_LEN } from './protocol.mjs';
import { LOG_DECADES, Scale } from './scale.mjs';
import { SureBar } from './sure.mjs';
import { flagsOf } from './words.mjs';

const SED_UNIT = 'J/m³';

/** Whether two arrays hold the same numbers. */
export function equal(a, b) {
  for (let i = 0; i < a.length; i++) if (a[i] !== b[i]) return false;
  return true;
}

const APART = 'The root of the summed squares of the difference, over that of the second map.';
/** What rubs depends on the frames before: the second way may have got fewer of them. */
const APART_RUBBED = 'With friction an answer depends on the frames before it, and the two got different ones.';
const apartWords = (apart) => (Number.isNaN(apart) ? 'no SED' : `${(100 * apart).toFixed(1)} % apart`);

export class Pictures {
  constructor(atlas) {
    this.atlas = atlas;
    this.scales = {
      pressure: new Scale(byId('pressure-scale'), { table: 'viridis', unit: 'Pa', least: 1000 }),
      sed: new Scale(byId('sed-scale'), { table: 'inferno', unit: SED_UNIT, least: 1 }),
    };
    this.scales.difference = new Scale(byId('difference-scale'), { table: 'diverging', unit: SED_UNIT, least: 1, signed: true, like: this.scales.sed });
    const view = (id, scale) => new MapView(byId(id), this.scales[scale]);
    this.views = { pressure: view('pressure', 'pressure'), sed: view('sed', 'sed'), other: view('other', 'sed'), difference: view('difference', 'difference') };
    this.views.pressure.setPatch(atlas.skin.raster, atlas.mmPerPx);
    for (const name of ['sed', 'other', 'difference']) this.views[name].setPatch(atlas.interface.raster, atlas.mmPerPx);
    this.sure = { sed: new SureBar(byId('sed-sure')), other: new SureBar(byId('other-sure')) };
    /** Two answers to one contact, of which the second was made in the way `of`. */
    this.pair = { of: '', first: new Float32Array(MAP_LEN), second: new Float32Array(MAP_LEN), difference: new Float32Array(MAP_LEN), apart: NaN };
    /** How far each vertex of the skin has moved, as it is drawn. */
    this.movedMm = new Float32Array(3 * atlas.vertexCount);
    this.finger = fingerView(atlas);
    this.scales.sed.onchange = () => this.#paintFinger();
  }

  /** Shows pressure and the SED that was answered. */
  showAnswered({ pressurePa, sedJPerM3 }, nowMs) {
    this.views.pressure.show(pressurePa, nowMs);
    this.views.sed.show(sedJPerM3, nowMs);
    this.#paintFinger();
  }

  #paintFinger() {
    const { scales: { sed }, views } = this;
    this.finger?.setSed(views.sed.values, sed.max, sed.logarithmic ? LOG_DECADES : 0, sed.floor);
  }

  /** Whether a second map of SED, and the difference from it, stand beside the first. */
  showSecond(isShown) {
    for (const name of ['other', 'difference']) this.views[name].isShown = isShown;
  }

  /** Holds the answered SED against that of finite elements, as `replay` has them. */
  showTruth({ truth, difference, figures }, estimate, nowMs) {
    this.views.other.show(truth, nowMs);
    this.views.difference.show(difference, nowMs);
    putParts('other-ms', ['solved before', '']);
    this.sure.sed.show(estimate, figures.relativeL2);
    this.sure.other.show(null);
    showFlags('other-flags', []);
    put('apart', apartWords(figures.relativeL2));
  }

  /** Shows two answers to one contact, `second` in the way `of`, unless they are shown already. */
  showPair(first, second, of, answer, mostPa, rubs) {
    put('apart-about', rubs ? APART_RUBBED : APART);
    const { pair } = this;
    if (pair.of === of && equal(first, pair.first) && equal(second, pair.second)) return;
    const { pixels } = this.atlas.interface.raster;
    pair.of = of;
    pair.first.set(first);
    pair.second.set(second);
    for (let n = 0; n < pixels.length; n++) pair.difference[pixels[n]] = first[pixels[n]] - second[pixels[n]];
    pair.apart = relativeL2(first, second, pixels);
    const nowMs = performance.now();
    this.views.other.show(second, nowMs);
    this.views.difference.show(pair.difference, nowMs);
    showFlags('other-flags', flagsOf(answer, mostPa));
    put('apart', apartWords(pair.apart));
  }

  /** Draws the skin as the service moved it; a press that stands still is not drawn again. */
  moveSkin(movedMm, press) {
    const { finger } = this;
    if (!finger || (movedMm && finger.isMoved && equal(movedMm, this.movedMm))) return;
    if (movedMm) this.movedMm.set(movedMm);
    const was = finger.isMoved;
    const most = finger.setDisplacement(movedMm);
    if (was && !movedMm) finger.setPress(press);
    put('moved', Number.isNaN(most) ? '–' : `${most.toFixed(2)} mm`);
  }

  /** Shows where the indenter stands; null: nothing presses. */
  setPress(press) {
    this.views.pressure.setMarker(press?.uvPx ?? null);
    this.finger?.setPress(press);
    if (!press) this.finger?.setForce(null);
  }

  /** One display frame: scales shrink late, and the finger is drawn if anything changed. */
  fit(nowMs) {
    for (const scale of Object.values(this.scales)) scale.fit(nowMs);
    this.finger?.draw();
  }
}

/** The finger in 3-D; null, with a word on the page, where the browser cannot draw it. */
function fingerView(atlas) {
  try {
    return new FingerView(byId('finger'), atlas);
  } catch (error) {
    byId('no-webgl').hidden = false;
    byId('no-webgl').textContent = `The 3-D finger cannot be drawn: ${error.message}. The maps work without it.`;
    return null;
  }
}
