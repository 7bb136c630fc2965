// Pressure from penetration: an elastic foundation on the skin of the atlas.
//
// An engine knows how deep each vertex of the undeformed finger lies in an object, not what the skin makes of it. The foundation
// gives every vertex a spring of its own: p = k max(0, d - relief d_max)^n, where d is the penetration of the vertex and
// d_max that of the deepest one. `relief` is the skin that sinks beside the contact without touching. With n = 1 and no relief it
// is Winkler's foundation. How far it is off finite elements: docs/reference/clients/web.md.

/**
 * @typedef {object} Law
 * @property {number} stiffness Pa per mm^exponent
 * @property {number} exponent
 * @property {number} relief share of the greatest penetration that meets no object
 */

/** @type {Law} */
export const FITTED = Object.freeze({ stiffness: 20090, exponent: 0.6, relief: 0.35 });
/** @type {Law} */
export const WINKLER = Object.freeze({ stiffness: 14650, exponent: 1, relief: 0 });

export class Foundation {
  /** @param {Law} [law] */
  constructor(law = FITTED) {
    this.law = law;
    /** Greatest pressure of the last call, Pa. */
    this.peakPa = 0;
    /** Share of the penetration that the finger took in the last call; the object took the rest. */
    this.fingerShare = 1;
  }

  /**
   * @param {ArrayLike<number>} penetrationMm one a vertex of the skin; 0 or less where it touches nothing
   * @param {Float32Array} pressuresPa one a vertex, overwritten: for `Atlas.pressureMap`
   * @param {number} [objectPaPerMm] stiffness of a soft object, a foundation of its own behind the finger's; Infinity: rigid
   * @param {number} [mostPa] greatest pressure, as `pressure_max_pa` of ready: what goes beyond it would be refused
   */
  pressures(penetrationMm, pressuresPa, objectPaPerMm = Infinity, mostPa = Infinity) {
    let deepest = 0;
    for (let i = 0; i < penetrationMm.length; i++) if (penetrationMm[i] > deepest) deepest = penetrationMm[i];
    const { stiffness, exponent, relief } = this.law;
    this.fingerShare = this.#share(deepest, objectPaPerMm);
    this.peakPa = 0;
    for (let i = 0; i < pressuresPa.length; i++) {
      const d = this.fingerShare * (penetrationMm[i] - relief * deepest);
      const p = d > 0 ? Math.min(mostPa, stiffness * d ** exponent) : 0;
      pressuresPa[i] = p;
      if (p > this.peakPa) this.peakPa = p;
    }
    return pressuresPa;
  }

  /** At the deepest point finger and object press on each other alike. @param {number} deepest @param {number} objectPaPerMm */
  #share(deepest, objectPaPerMm) {
    if (!(deepest > 0) || objectPaPerMm === Infinity) return 1;
    const { stiffness, exponent, relief } = this.law;
    let [low, high] = [0, 1];
    for (let step = 0; step < 40; step++) {
      const share = (low + high) / 2;
      const excess = stiffness * (share * (1 - relief) * deepest) ** exponent - objectPaPerMm * (1 - share) * deepest;
      if (excess > 0) high = share;
      else low = share;
    }
    return (low + high) / 2;
  }
}
