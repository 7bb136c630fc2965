// The visitor's press: a rigid indenter on the skin mesh of the atlas. This is an ESTIMATE of the
// pressure a finger would meet, good enough to play with; the FE presses are the reference.
//
// The indenter approaches along the inward skin normal at the chosen point and goes `depthMm` beyond
// its first touch. A vertex that lies `gap` behind the first touch carries Hertz's pressure
//   p = p0 sqrt(1 - gap / (share depth)),   p0 = (2 E / pi) sqrt(depth / R) (1 + (a / layer)^3),
// where R is the effective radius of the two surfaces, measured on the mesh from the volume of the
// overlap, a^2 = 2 R share depth is the contact radius and the last factor the stiffening by the bone.

import { SHAPES } from './shapes.mjs';

/**
 * E (plane-strain modulus, Pa), share (1/2 for a half-space) and layer (mm), fitted to the presses of
 * the campaign s1 (plate, 0.25 to 2 mm, all angles): relative L2 over the mesh 16 %, force 12 %.
 */
export const HERTZ = { modulusPa: 62000, share: 0.6, layerMm: 7.5 };

/** Least cosine between the skin's normal and the indenter's axis: skin that looks away is not touched. */
const FACING = 0.05;

/** Evaluates presses on one atlas without allocating. */
export class Press {
  constructor(atlas) {
    this.atlas = atlas;
    this.shape = 'plate';
    this.sizeMm = 4;
    this.body = SHAPES.plate.make();
    this.angleRad = 0;
    /** How far the indenter leans along the finger and across it. */
    this.tiltRad = [0, 0];
    /** How far it has slid along its first tangent, mm. */
    this.slidMm = 0;
    this.hit = { triangle: 0, weightB: 0, weightC: 0 };
    this.pointMm = new Float32Array(3);
    this.uvPx = new Float32Array(2);
    /** Right-handed frame of the indenter: two tangents and the outward normal. */
    this.tangent = new Float32Array(3);
    this.bitangent = new Float32Array(3);
    this.normal = new Float32Array(3);
    this.pressurePa = new Float32Array(atlas.vertexCount);
    /** Overlap of each vertex with the indenter, mm: what the drawing flattens. */
    this.overlapMm = new Float32Array(atlas.vertexCount);
    this.gapMm = new Float32Array(atlas.vertexCount);
    this.isEstimate = true;
    this.forceN = 0;
    this.areaMm2 = 0;
    this.peakPa = 0;
    /** Signed height of the indenter's lowest point over the chosen skin point, mm. */
    this.heightMm = 0;
    this.touchMm = 0;
    this.#aim();
  }

  /** Moves to a pixel position of the skin map; false outside the patch. */
  moveToPixel(u, v) {
    if (!this.atlas.locate(u, v, this.hit)) return false;
    this.#aim();
    return true;
  }

  /** Moves to a point of the skin found by `Atlas.intersect`. */
  moveToHit(hit) {
    this.hit.triangle = hit.triangle;
    this.hit.weightB = hit.weightB;
    this.hit.weightC = hit.weightC;
    this.#aim();
  }

  /** Changes shape (a name of `SHAPES`), its size, its direction and its lean; `mesh` is one's own. */
  setShape(shape, sizeMm, angleRad, tiltRad = this.tiltRad, mesh = undefined) {
    // Two files may have one name.
    if (shape !== this.shape || sizeMm !== this.sizeMm || mesh !== this.mesh) this.body = SHAPES[shape].make(sizeMm, mesh);
    this.mesh = mesh;
    this.shape = shape;
    this.sizeMm = sizeMm;
    this.angleRad = angleRad;
    this.tiltRad = tiltRad;
    this.#aim();
  }

  /** Slides so far from where it was put, along its first tangent. */
  slideTo(mm) {
    const by = mm - this.slidMm;
    this.slidMm = mm;
    for (let k = 0; k < 3; k++) this.pointMm[k] += by * this.tangent[k];
    this.#measureGaps(this.touchMm);
  }

  /** Pressure of every vertex at this depth; also force, area and peak. */
  evaluate(depthMm) {
    const { pressurePa, overlapMm, gapMm } = this;
    const { areasMm2 } = this.atlas;
    this.heightMm = this.touchMm - depthMm;
    this.forceN = 0;
    this.areaMm2 = 0;
    this.peakPa = 0;
    const centrePa = this.#centrePressure(depthMm);
    for (let i = 0; i < pressurePa.length; i++) {
      overlapMm[i] = Math.max(0, depthMm - gapMm[i]);
      const closeness = 1 - gapMm[i] / (HERTZ.share * depthMm);
      const p = closeness > 0 ? centrePa * Math.sqrt(closeness) : 0;
      pressurePa[i] = p;
      if (p > 0) {
        this.forceN += 1e-6 * p * areasMm2[i];
        this.areaMm2 += areasMm2[i];
        if (p > this.peakPa) this.peakPa = p;
      }
    }
  }

  /** Pressure where the gap is zero, Pa. */
  #centrePressure(depthMm) {
    const { gapMm } = this;
    const { areasMm2 } = this.atlas;
    if (depthMm <= 0) return 0;
    const felt = HERTZ.share * depthMm;
    // Over a paraboloid of radius R the integral of 1 - gap / felt is pi R felt.
    let integral = 0;
    for (let i = 0; i < gapMm.length; i++) {
      if (gapMm[i] < felt) integral += (1 - gapMm[i] / felt) * areasMm2[i];
    }
    if (integral === 0) return 0;
    const radiusMm = integral / (Math.PI * felt);
    const contactMm = Math.sqrt(2 * radiusMm * felt);
    const bone = 1 + (contactMm / HERTZ.layerMm) ** 3;
    return ((2 * HERTZ.modulusPa) / Math.PI) * Math.sqrt(depthMm / radiusMm) * bone;
  }

  /** Frame and gaps for the present point and shape. */
  #aim() {
    const { atlas, normal, tangent, bitangent, pointMm } = this;
    atlas.interpolate(atlas.skin.positionsMm, 3, this.hit, pointMm);
    atlas.interpolate(atlas.skin.uvPx, 2, this.hit, this.uvPx);
    atlas.interpolate(atlas.smoothNormals, 3, this.hit, normal);
    const length = Math.hypot(normal[0], normal[1], normal[2]) || 1;
    for (let k = 0; k < 3; k++) normal[k] /= length;
    // The finger's own axis (x), made perpendicular to the normal; at the very tip take y.
    const axis = Math.abs(normal[0]) < 0.95 ? 0 : 1;
    let size = 0;
    for (let k = 0; k < 3; k++) {
      tangent[k] = (k === axis ? 1 : 0) - normal[axis] * normal[k];
      size += tangent[k] ** 2;
    }
    for (let k = 0; k < 3; k++) tangent[k] /= Math.sqrt(size);
    cross(normal, tangent, bitangent);
    const cos = Math.cos(this.angleRad);
    const sin = Math.sin(this.angleRad);
    for (let k = 0; k < 3; k++) {
      const t = tangent[k];
      tangent[k] = cos * t + sin * bitangent[k];
      bitangent[k] = cos * bitangent[k] - sin * t;
    }
    // It leans about its own two tangents, over the point that it presses.
    turn(normal, tangent, this.tiltRad[0]);
    turn(normal, bitangent, this.tiltRad[1]);
    for (let k = 0; k < 3; k++) pointMm[k] += this.slidMm * tangent[k];
    this.#measureGaps(null);
  }

  /**
   * Gap of each vertex to the indenter when it first touches; Infinity beside or behind it. What slides
   * keeps the height `touchMm` at which it touched first.
   */
  #measureGaps(touchMm) {
    const { gapMm, normal: n, tangent: t, bitangent: b, pointMm: o } = this;
    const { positionsMm: p } = this.atlas.skin;
    const { normals } = this.atlas;
    const { profile } = this.body;
    let first = -Infinity;
    for (let i = 0, k = 0; i < gapMm.length; i++, k += 3) {
      const x = p[k] - o[0];
      const y = p[k + 1] - o[1];
      const z = p[k + 2] - o[2];
      const facing = normals[k] * n[0] + normals[k + 1] * n[1] + normals[k + 2] * n[2];
      const along = x * t[0] + y * t[1] + z * t[2];
      const across = x * b[0] + y * b[1] + z * b[2];
      const height = x * n[0] + y * n[1] + z * n[2];
      // Rounded as it is stored, so that the first to touch has a gap of exactly 0.
      const reach = facing > FACING ? Math.fround(height - profile(along, -across)) : -Infinity;
      gapMm[i] = reach;
      if (reach > first) first = reach;
    }
    // A narrow indenter may fall between the vertices of a coarse mesh: the point that it is put on is skin too.
    const at = Math.fround(-profile(0, 0));
    if (at > first) first = at;
    if (first === -Infinity) first = 0;
    if (touchMm !== null) first = touchMm;
    this.touchMm = first;
    for (let i = 0; i < gapMm.length; i++) gapMm[i] = first - gapMm[i];
  }
}

/** Turns two perpendicular unit vectors in their plane: `a` towards `b`. */
function turn(a, b, rad) {
  const [cos, sin] = [Math.cos(rad), Math.sin(rad)];
  for (let k = 0; k < 3; k++) {
    const x = a[k];
    a[k] = cos * x + sin * b[k];
    b[k] = cos * b[k] - sin * x;
  }
}

function cross(a, b, out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}
