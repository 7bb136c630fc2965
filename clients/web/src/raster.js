// The finger's surfaces, and vertex values as 224 x 224 maps: the pixel -> (triangle, weights)
// table, built once from the atlas by the server's own rule, so that both paint the same pixels: a
// pixel belongs to the patch if its centre lies in a triangle, borders included, and to the lowest
// such triangle. The server's page imports this file too: server/build.rs puts it beside the page's
// own.

const SIDE_PX = 224;
const MAP_LEN = SIDE_PX * SIDE_PX;
const STEPS_PER_PX = 2 ** 40;

/** @typedef {{positions_mm: number[][], uv_px: number[][]}} PatchJson a surface as `GET /v1/atlas` sends it */

/** One surface of the finger unwrapped into the map. */
export class Patch {
  /** @param {Uint32Array} triangles @param {PatchJson} json */
  constructor(triangles, json) {
    /** x, y, z of each vertex, mm, in the finger's frame. */
    this.positionsMm = Float32Array.from(json.positions_mm.flat());
    /** u, v of each vertex, pixels. */
    this.uvPx = Float32Array.from(json.uv_px.flat());
    this.raster = new Raster(triangles, this.uvPx);
  }
}

/** Linear interpolation of vertex values at pixel centres; pixels outside every triangle stay 0. */
export class Raster {
  /**
   * @param {Uint32Array} triangles flat vertex indices
   * @param {Float32Array} uvPx flat (u, v) per vertex, in pixels
   */
  constructor(triangles, uvPx) {
    const owner = new Int32Array(MAP_LEN).fill(-1);
    const weight = new Float32Array(3 * MAP_LEN);
    for (let t = 0; t < triangles.length; t += 3) {
      claim(t, triangles, uvPx, owner, weight);
    }
    let count = 0;
    for (let i = 0; i < MAP_LEN; i++) if (owner[i] >= 0) count++;
    /** Flat index of every pixel inside the mask, ascending. */
    this.pixels = new Uint32Array(count);
    this.corners = new Uint32Array(3 * count);
    this.weights = new Float32Array(3 * count);
    /** Triangle of each of these pixels. */
    this.owners = new Uint32Array(count);
    /** 1 inside, 0 outside. */
    this.mask = new Uint8Array(MAP_LEN);
    for (let i = 0, n = 0; i < MAP_LEN; i++) {
      if (owner[i] < 0) continue;
      this.mask[i] = 1;
      this.pixels[n] = i;
      this.owners[n] = owner[i] / 3;
      for (let k = 0; k < 3; k++) {
        this.corners[3 * n + k] = triangles[owner[i] + k];
        this.weights[3 * n + k] = weight[3 * i + k];
      }
      n++;
    }
  }

  /**
   * Writes the map of `values` (one per vertex) into `out` (224 x 224, row-major).
   * @param {ArrayLike<number>} values @param {Float32Array} out
   */
  rasterise(values, out) {
    const { pixels, corners, weights } = this;
    out.fill(0);
    for (let n = 0, k = 0; n < pixels.length; n++, k += 3) {
      out[pixels[n]] = weights[k] * values[corners[k]]
        + weights[k + 1] * values[corners[k + 1]]
        + weights[k + 2] * values[corners[k + 2]];
    }
  }
}

/**
 * Gives triangle `t` every pixel without an owner whose centre lies in it, edges and corners included.
 * @param {number} t @param {Uint32Array} triangles @param {Float32Array} uvPx
 * @param {Int32Array} owner @param {Float32Array} weight
 */
function claim(t, triangles, uvPx, owner, weight) {
  const [a, b, c] = [2 * triangles[t], 2 * triangles[t + 1], 2 * triangles[t + 2]];
  const [au, av, bu, bv, cu, cv] = [uvPx[a], uvPx[a + 1], uvPx[b], uvPx[b + 1], uvPx[c], uvPx[c + 1]];
  const total = doubledArea(au, av, bu, bv, cu, cv);
  const firstColumn = Math.max(0, Math.floor(Math.min(au, bu, cu) - 0.5));
  const endColumn = Math.min(SIDE_PX, Math.ceil(Math.max(au, bu, cu) + 0.5));
  const firstRow = Math.max(0, Math.floor(Math.min(av, bv, cv) - 0.5));
  const endRow = Math.min(SIDE_PX, Math.ceil(Math.max(av, bv, cv) + 0.5));
  for (let row = firstRow; row < endRow; row++) {
    for (let column = firstColumn; column < endColumn; column++) {
      const i = row * SIDE_PX + column;
      if (owner[i] >= 0) continue;
      const u = column + 0.5;
      const v = row + 0.5;
      const areaC = doubledArea(au, av, bu, bv, u, v);
      const areaA = doubledArea(bu, bv, cu, cv, u, v);
      const areaB = doubledArea(cu, cv, au, av, u, v);
      if (areaA < 0 || areaB < 0 || areaC < 0) continue;
      owner[i] = t;
      weight[3 * i] = areaA / total;
      weight[3 * i + 1] = areaB / total;
      weight[3 * i + 2] = areaC / total;
    }
  }
}

/**
 * Twice the area of a triangle, positive where the image (v runs down) shows it counter-clockwise.
 * The sign is exact: f32 pixel coordinates are multiples of 2^-40 px, their differences fit a double,
 * and where rounding of the two products could decide, the sum is done on integers.
 * @param {number} au @param {number} av @param {number} bu @param {number} bv @param {number} cu @param {number} cv
 */
function doubledArea(au, av, bu, bv, cu, cv) {
  const left = (bv - av) * (cu - au);
  const right = (bu - au) * (cv - av);
  const area = left - right;
  if (Math.abs(area) > 4 * Number.EPSILON * (Math.abs(left) + Math.abs(right))) return area;
  const [au2, av2, bu2, bv2, cu2, cv2] = [au, av, bu, bv, cu, cv].map((px) => BigInt(Math.round(px * STEPS_PER_PX)));
  return Number((bv2 - av2) * (cu2 - au2) - (bu2 - au2) * (cv2 - av2)) / STEPS_PER_PX ** 2;
}
