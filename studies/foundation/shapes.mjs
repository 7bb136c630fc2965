// Signed distances of the indenters of the committed datasets, in their own frames, mm; negative inside. They press towards
// +z. Dimensions and names are those of docs/reference/indenters.md.

const THICKNESS_MM = 4;

/** @param {number[]} half @param {number} radius @param {number} x @param {number} y @param {number} z */
function roundedBox(half, radius, x, y, z) {
  const [qx, qy, qz] = [Math.abs(x) - half[0] + radius, Math.abs(y) - half[1] + radius, Math.abs(z) - half[2] + radius];
  const outside = Math.hypot(Math.max(qx, 0), Math.max(qy, 0), Math.max(qz, 0));
  return outside + Math.min(0, Math.max(qx, qy, qz)) - radius;
}

/** @param {number} halfX @param {number} halfY @param {number} radius @param {number} x @param {number} y */
function roundedRectangle(halfX, halfY, radius, x, y) {
  const [qx, qy] = [Math.abs(x) - halfX + radius, Math.abs(y) - halfY + radius];
  return Math.hypot(Math.max(qx, 0), Math.max(qy, 0)) + Math.min(0, Math.max(qx, qy)) - radius;
}

/** Distance from the nearest of `count` places `pitch` apart, centred at 0. @param {number} x @param {number} pitch @param {number} count */
function fromNearest(x, pitch, count) {
  const last = (count - 1) / 2;
  return Math.abs(x) - (Math.min(Math.round(Math.abs(x) / pitch + last), count - 1) - last) * pitch;
}

/** Half a trapezoid's section with its edges rounded; x across, z up to the tip at 0. @param {any} s @param {number} x @param {number} z */
function wedge(s, x, z) {
  const r = s.tip_radius_mm;
  const tip = s.tip_width_mm / 2;
  const run = (s.base_width_mm - s.tip_width_mm) / 2;
  const side = Math.hypot(run, s.height_mm);
  const [nx, nz] = [s.height_mm / side, run / side];
  const at = (/** @type {number} */ h) => tip - (r + nz * h) / nx;
  const corners = [[0, -r], [at(-r), -r], [at(r - s.height_mm), r - s.height_mm], [0, r - s.height_mm]];
  // Distance to the convex polygon of the inner section, mirrored at x = 0.
  let outside = Infinity;
  let inside = -Infinity;
  for (let k = 0; k < 3; k++) {
    const [a, b] = [corners[k], corners[k + 1]];
    const [ex, ez] = [b[0] - a[0], b[1] - a[1]];
    const share = Math.min(1, Math.max(0, ((x - a[0]) * ex + (z - a[1]) * ez) / (ex * ex + ez * ez)));
    outside = Math.min(outside, Math.hypot(x - a[0] - share * ex, z - a[1] - share * ez));
    inside = Math.max(inside, ((x - a[0]) * -ez + (z - a[1]) * ex) / Math.hypot(ex, ez));
  }
  return (inside <= 0 ? inside : outside) - r;
}

/**
 * Signed distance of (x, y, z) from an indenter.
 * @param {any} s the `indenter` of a campaign @param {number} x @param {number} y @param {number} z
 * @returns {number}
 */
export function distanceMm(s, x, y, z) {
  switch (s.shape) {
    case 'plate': return roundedBox([s.size_mm[0] / 2, s.size_mm[1] / 2, THICKNESS_MM / 2 + s.edge_radius_mm], s.edge_radius_mm, x, y, z);
    case 'sphere': return Math.hypot(x, y, z) - s.radius_mm;
    case 'cylinder': return roundedRectangle(s.radius_mm, s.length_mm / 2, s.end_radius_mm, Math.hypot(x, z), y);
    case 'punch': return roundedRectangle(s.radius_mm, s.height_mm / 2, s.rim_radius_mm, Math.hypot(x, y), z + s.height_mm / 2);
    case 'ring': {
      const middle = (s.outer_radius_mm + s.inner_radius_mm) / 2;
      const half = (s.outer_radius_mm - s.inner_radius_mm) / 2;
      return roundedRectangle(half, s.height_mm / 2, s.rim_radius_mm, Math.hypot(x, y) - middle, z + s.height_mm / 2);
    }
    case 'wedge': {
      const r = s.tip_radius_mm;
      const across = wedge(s, Math.abs(x), z) + r;
      const along = Math.abs(y) - s.length_mm / 2 + r;
      return Math.hypot(Math.max(across, 0), Math.max(along, 0)) + Math.min(0, Math.max(across, along)) - r;
    }
    case 'grating': {
      const pitch = s.ridge_mm + s.groove_mm;
      const ridgeHalf = [s.ridge_mm / 2, s.length_mm / 2, (s.height_mm + THICKNESS_MM) / 2];
      const ridge = roundedBox(ridgeHalf, s.edge_radius_mm, fromNearest(x, pitch, s.ridges), y, z + ridgeHalf[2]);
      const baseHalf = [((s.ridges - 1) * pitch + s.ridge_mm) / 2, s.length_mm / 2, THICKNESS_MM / 2];
      return Math.min(ridge, roundedBox(baseHalf, s.edge_radius_mm, x, y, z + s.height_mm + THICKNESS_MM / 2));
    }
    case 'dots': {
      const radius = (s.base_mm ** 2 / 4 + s.height_mm ** 2) / (2 * s.height_mm);
      const [u, v] = [fromNearest(x, s.pitch_mm, s.count[0]), fromNearest(y, s.pitch_mm, s.count[1])];
      const cap = Math.hypot(u, v, z + radius) - radius;
      const plate = roundedBox([s.plate_mm[0] / 2, s.plate_mm[1] / 2, THICKNESS_MM / 2], 0, x, y, z + s.height_mm + THICKNESS_MM / 2);
      return Math.min(cap, plate);
    }
    default: throw new Error(`no distance for the shape '${s.shape}'`);
  }
}

/** Height of an indenter's top over its origin. @param {any} s */
export function topMm(s) {
  if (s.shape === 'plate') return THICKNESS_MM / 2 + s.edge_radius_mm;
  return s.shape === 'sphere' || s.shape === 'cylinder' ? s.radius_mm : 0;
}
