// The atlas: which point of the finger each pixel of a map is, and how to fill a map.

import { addressOf, cleanToken } from './address.js';
import { PATIENCE_MS } from './http.js';
import { Patch } from './raster.js';
import { MAP_LEN, SIDE_PX } from './wire.js';

/**
 * The atlas as the server sends it (`GET /v1/atlas`).
 * @typedef {import('./raster.js').PatchJson} PatchJson
 * @typedef {{hash: string, mm_per_px: number, triangles: number[][], skin: PatchJson, interface: PatchJson}} AtlasJson
 */

/**
 * Both patches share triangles, wound counter-clockwise from outside; vertex i of the skin lies over vertex i of
 * the interface. The finger's frame, mm: x from the tip towards the base, z towards the nail, so the pad is at z < 0.
 */
export class Atlas {
  /** @param {AtlasJson} json */
  constructor(json) {
    this.hash = json.hash;
    this.mmPerPx = json.mm_per_px;
    this.triangles = Uint32Array.from(json.triangles.flat());
    this.vertexCount = json.skin.positions_mm.length;
    /** Where pressure acts. */
    this.skin = new Patch(this.triangles, json.skin);
    /** Where SED is read. */
    this.interface = new Patch(this.triangles, json.interface);
    /** Unit outward normals of the skin. */
    this.normals = vertexNormals(this.triangles, this.skin.positionsMm);
    /** Area of the undeformed skin that belongs to each vertex, mm2. */
    this.areasMm2 = vertexAreas(this.triangles, this.skin.positionsMm);
    this.#taps = interfaceTaps(this.interface);
  }

  #taps;
  /** @type {ReturnType<typeof pixelPlaces> | null} */ #pixelPlaces = null;

  /**
   * @param {string} [base] where the server is: `host:port` or a URL; '' for the server of the page
   * @param {string} [token]
   * @param {string} [finger] by its name; left out: the server's default finger
   */
  static async load(base = '', token, finger) {
    const query = finger === undefined ? '' : `?finger=${encodeURIComponent(finger)}`;
    const url = addressOf(base).http(`/v1/atlas${query}`);
    const clean = cleanToken(token);
    const headers = clean ? { authorization: `Bearer ${clean}` } : undefined;
    const response = await fetch(url, { headers, signal: AbortSignal.timeout(PATIENCE_MS) });
    if (!response.ok) throw new Error(`${url}: HTTP ${response.status} ${await response.text()}`);
    return new Atlas(await response.json());
  }

  /**
   * Pressures at the skin's vertices to a map, linear in each triangle, exactly as the server does it.
   * @param {ArrayLike<number>} pressuresPa one a vertex
   * @param {Float32Array} map 224 x 224, overwritten
   */
  pressureMap(pressuresPa, map) {
    this.skin.raster.rasterise(pressuresPa, map);
    return map;
  }

  /**
   * Contact points of a physics engine to a map, each as the pressure of Hertz's contact of that force and radius around the
   * nearest point of the skin (docs/reference/atlas.md, 'Helpers of the clients'). A point more than 5 mm off the skin adds nothing.
   * @param {ArrayLike<number>} positionsMm x, y, z of each point, in the finger's frame
   * @param {ArrayLike<number>} forcesN normal force of each
   * @param {ArrayLike<number> | null} radiiMm radius of each contact; null: the finger's own on a flat object
   * @param {Float32Array} map 224 x 224, overwritten
   */
  contactMap(positionsMm, forcesN, radiiMm, map) {
    this.#pixelPlaces ??= pixelPlaces(this.triangles, this.skin);
    const { xyzMm, areasMm2 } = this.#pixelPlaces;
    const { pixels } = this.skin.raster;
    map.fill(0);
    for (let c = 0; c < forcesN.length; c++) {
      const nearest = nearestPlace(xyzMm, positionsMm[3 * c], positionsMm[3 * c + 1], positionsMm[3 * c + 2]);
      if (nearest < 0) continue;
      const radiusMm = radiiMm ? radiiMm[c] : RADIUS_AT_1_N_MM * Math.cbrt(forcesN[c]);
      const weight = (/** @type {number} */ n) => {
        if (n === nearest) return 1;
        const d2 = (xyzMm[3 * n] - xyzMm[3 * nearest]) ** 2 + (xyzMm[3 * n + 1] - xyzMm[3 * nearest + 1]) ** 2
          + (xyzMm[3 * n + 2] - xyzMm[3 * nearest + 2]) ** 2;
        return Math.sqrt(Math.max(0, 1 - d2 / radiusMm ** 2));
      };
      let total = 0;
      for (let n = 0; n < pixels.length; n++) total += weight(n) * areasMm2[n];
      for (let n = 0; n < pixels.length; n++) map[pixels[n]] += (1e6 * forcesN[c] * weight(n)) / total;
    }
    return map;
  }

  /** Force of a pressure map over the undeformed skin, N. @param {Float32Array} map */
  forceN(map) {
    this.#pixelPlaces ??= pixelPlaces(this.triangles, this.skin);
    const { areasMm2 } = this.#pixelPlaces;
    return this.skin.raster.pixels.reduce((sum, pixel, n) => sum + 1e-6 * map[pixel] * areasMm2[n], 0);
  }

  /**
   * A map of SED at the vertices, to paint it on the finger: bilinear between the pixels of the patch.
   * @param {Float32Array} map 224 x 224
   * @param {Float32Array} values one a vertex, overwritten
   */
  atVertices(map, values) {
    const { pixels, weights } = this.#taps;
    for (let i = 0, k = 0; i < values.length; i++, k += 4) {
      values[i] = weights[k] * map[pixels[k]] + weights[k + 1] * map[pixels[k + 1]]
        + weights[k + 2] * map[pixels[k + 2]] + weights[k + 3] * map[pixels[k + 3]];
    }
    return values;
  }
}

/** Area-weighted unit normals. @param {Uint32Array} triangles @param {Float32Array} p */
export function vertexNormals(triangles, p) {
  const normals = new Float32Array(p.length);
  eachTriangle(triangles, p, (corners, nx, ny, nz) => {
    for (const corner of corners) {
      normals[3 * corner] += nx;
      normals[3 * corner + 1] += ny;
      normals[3 * corner + 2] += nz;
    }
  });
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
    for (let k = i; k < i + 3; k++) normals[k] /= length;
  }
  return normals;
}

/** @param {Uint32Array} triangles @param {Float32Array} p */
function vertexAreas(triangles, p) {
  const areas = new Float32Array(p.length / 3);
  eachTriangle(triangles, p, (corners, nx, ny, nz) => {
    for (const corner of corners) areas[corner] += Math.hypot(nx, ny, nz) / 6;
  });
  return areas;
}

/**
 * Corners and twice the area times the normal of every triangle.
 * @param {Uint32Array} triangles @param {Float32Array} p
 * @param {(corners: Uint32Array, nx: number, ny: number, nz: number) => void} visit
 */
function eachTriangle(triangles, p, visit) {
  for (let k = 0; k < triangles.length; k += 3) {
    const corners = triangles.subarray(k, k + 3);
    const [a, b, c] = [3 * corners[0], 3 * corners[1], 3 * corners[2]];
    const [ux, uy, uz] = [p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]];
    const [vx, vy, vz] = [p[c] - p[a], p[c + 1] - p[a + 1], p[c + 2] - p[a + 2]];
    visit(corners, uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
  }
}

/**
 * Where each pixel of a patch lies on the finger, mm, and how much of it the pixel shows, mm2.
 * @param {Uint32Array} triangles @param {Patch} patch
 */
function pixelPlaces(triangles, { raster, positionsMm, uvPx }) {
  const { corners, weights, pixels, owners } = raster;
  const xyzMm = new Float64Array(3 * pixels.length);
  const areasMm2 = new Float64Array(pixels.length);
  const ratios = new Float64Array(triangles.length / 3);
  let triangle = 0;
  eachTriangle(triangles, positionsMm, ([a, b, c], nx, ny, nz) => {
    const [ux, uy] = [uvPx[2 * b] - uvPx[2 * a], uvPx[2 * b + 1] - uvPx[2 * a + 1]];
    const [vx, vy] = [uvPx[2 * c] - uvPx[2 * a], uvPx[2 * c + 1] - uvPx[2 * a + 1]];
    ratios[triangle++] = Math.hypot(nx, ny, nz) / Math.abs(ux * vy - uy * vx);
  });
  for (let n = 0; n < pixels.length; n++) {
    areasMm2[n] = ratios[owners[n]];
    for (let k = 0; k < 3; k++) {
      for (let axis = 0; axis < 3; axis++) xyzMm[3 * n + axis] += weights[3 * n + k] * positionsMm[3 * corners[3 * n + k] + axis];
    }
  }
  return { xyzMm, areasMm2 };
}

const REACH_MM = 5;
const RADIUS_AT_1_N_MM = 5.1;

/** The place nearest to (x, y, z); -1 beyond REACH_MM. @param {Float64Array} xyzMm @param {number} x @param {number} y @param {number} z */
function nearestPlace(xyzMm, x, y, z) {
  let nearest = -1;
  let least = REACH_MM ** 2;
  for (let n = 0; n < xyzMm.length / 3; n++) {
    const d2 = (xyzMm[3 * n] - x) ** 2 + (xyzMm[3 * n + 1] - y) ** 2 + (xyzMm[3 * n + 2] - z) ** 2;
    if (d2 <= least && (d2 < least || nearest < 0)) { least = d2; nearest = n; }
  }
  return nearest;
}

/**
 * Four pixels and weights for each vertex: those around it, without those outside the patch (they hold
 * 0 and would darken the rim); with none inside the nearest of the patch.
 * @param {Patch} patch
 */
function interfaceTaps({ uvPx, raster }) {
  const pixels = new Uint32Array(2 * uvPx.length);
  const weights = new Float32Array(2 * uvPx.length);
  for (let i = 0; i < uvPx.length / 2; i++) {
    const [u, v] = [uvPx[2 * i] - 0.5, uvPx[2 * i + 1] - 0.5];
    const [left, top] = [Math.floor(u), Math.floor(v)];
    let total = 0;
    for (let corner = 0; corner < 4; corner++) {
      const [column, row] = [left + (corner & 1), top + (corner >> 1)];
      const pixel = row * SIDE_PX + column;
      if (column < 0 || row < 0 || column >= SIDE_PX || row >= SIDE_PX || !raster.mask[pixel]) continue;
      const share = (corner & 1 ? u - left : 1 - u + left) * (corner >> 1 ? v - top : 1 - v + top);
      pixels[4 * i + corner] = pixel;
      weights[4 * i + corner] = share;
      total += share;
    }
    if (total > 0) {
      for (let k = 4 * i; k < 4 * i + 4; k++) weights[k] /= total;
    } else {
      pixels[4 * i] = nearestPixel(raster.mask, u, v);
      weights[4 * i] = 1;
    }
  }
  return { pixels, weights };
}

/** @param {Uint8Array} mask @param {number} u @param {number} v */
function nearestPixel(mask, u, v) {
  let nearest = 0;
  let least = Infinity;
  for (let pixel = 0; pixel < MAP_LEN; pixel++) {
    if (!mask[pixel]) continue;
    const d2 = ((pixel % SIDE_PX) - u) ** 2 + (Math.floor(pixel / SIDE_PX) - v) ** 2;
    if (d2 < least) { least = d2; nearest = pixel; }
  }
  return nearest;
}
