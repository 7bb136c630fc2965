// The rest of the finger, which no map shows: the skin patch of the atlas ends at the nail side and at
// the base. The finger is an ellipsoid before an elliptic cylinder (docs/concepts/physics.md), so its
// other half is known: here it is closed, and gets a nail.

/** Half axes of the finger, mm: along it (of the tip), across, and thick. */
const TIP_MM = 11.25;
const HALF_MM = { across: 8.72, thick: 6.53 };
const RINGS = 14;
/** The rest of the finger follows the patch's edge over so far. */
const FOLLOWS_MM = 3;
const END = { lengthMm: 12, steps: 4, narrows: 0.12 };
/** Height of the nail's free edge, as a share of the finger's greatest. */
const FREE_EDGE = 0.58;
const NAIL = { fromMm: 0.9, toMm: 11.2, spanRad: 0.98, liftMm: 0.3, across: 22, along: 18, rounding: 3.2 };

/** How much narrower the finger is at x than at its widest. */
const narrowing = (x) => (x >= TIP_MM ? 1 : Math.sqrt(Math.max(0, 1 - ((TIP_MM - x) / TIP_MM) ** 2)));

/** Point of the nail side at x, so far round (0: the side y > 0, pi / 2: the ridge). */
function dorsal(x, round, out) {
  const s = narrowing(x);
  out[0] = x;
  out[1] = HALF_MM.across * s * Math.cos(round);
  out[2] = HALF_MM.thick * s * Math.sin(round);
  return out;
}

/** Vertices along the patch's border, in order. */
export function borderOf(triangles) {
  const edges = new Map();
  const key = (a, b) => `${a} ${b}`;
  for (let k = 0; k < triangles.length; k += 3) {
    for (let corner = 0; corner < 3; corner++) {
      const [a, b] = [triangles[k + corner], triangles[k + ((corner + 1) % 3)]];
      if (!edges.delete(key(b, a))) edges.set(key(a, b), [a, b]);
    }
  }
  const next = new Map(edges.values());
  const border = [];
  for (let at = next.keys().next().value; next.has(at);) {
    border.push(at);
    const then = next.get(at);
    next.delete(at);
    at = then;
  }
  return border;
}

/** Adds two triangles whose normals are those of the corners. */
function quad(out, corners, normals) {
  for (const k of [0, 1, 2, 0, 2, 3]) out.push(...corners[k], ...normals[k]);
}

/** Outward normal of the ellipsoid or cylinder. */
function outwardAt([x, y, z]) {
  const n = [x < TIP_MM ? (x - TIP_MM) / TIP_MM ** 2 : 0, y / HALF_MM.across ** 2, z / HALF_MM.thick ** 2];
  const length = Math.hypot(...n) || 1;
  return n.map((c) => c / length);
}

/** What closes the finger, as plain triangles with normals, 6 floats a vertex. */
export function bodyMesh(atlas) {
  const p = atlas.skin.positionsMm;
  const border = borderOf(atlas.triangles).map((k) => [p[3 * k], p[3 * k + 1], p[3 * k + 2]]);
  const baseMm = Math.max(...border.map(([x]) => x));
  const isBase = ([x]) => x > baseMm - 1e-3;
  const out = [];
  // From each point of the side edges up to the ridge.
  const ribs = border.map((from) => {
    const round = Math.atan2(from[2] / HALF_MM.thick, Math.abs(from[1]) / HALF_MM.across);
    const rib = [from];
    for (let k = 1; k <= RINGS; k++) {
      const point = dorsal(from[0], round + (k / RINGS) * (Math.PI / 2 - round), [0, 0, 0]);
      rib.push([point[0], from[1] < 0 ? -point[1] : point[1], point[2]]);
    }
    return rib;
  });
  for (let i = 0; i < border.length; i++) {
    const [a, b] = [ribs[i], ribs[(i + 1) % border.length]];
    if (isBase(border[i]) && isBase(border[(i + 1) % border.length])) continue;
    for (let k = 0; k < RINGS; k++) {
      const corners = [a[k], b[k], b[k + 1], a[k + 1]];
      quad(out, corners, corners.map(outwardAt));
    }
  }
  closeBase(out, border, isBase, baseMm);
  return Float32Array.from(out);
}

/** The vertex of the patch's border nearest to each vertex of a mesh (6 floats each), and how much of its motion that follows. */
export function followingOf(atlas, mesh) {
  const p = atlas.skin.positionsMm;
  const border = borderOf(atlas.triangles);
  const vertex = new Uint32Array(mesh.length / 6);
  const weight = new Float32Array(mesh.length / 6);
  for (let n = 0; n < vertex.length; n++) {
    let nearest = Infinity;
    for (const at of border) {
      const d2 = (mesh[6 * n] - p[3 * at]) ** 2 + (mesh[6 * n + 1] - p[3 * at + 1]) ** 2 + (mesh[6 * n + 2] - p[3 * at + 2]) ** 2;
      if (d2 < nearest) [nearest, vertex[n]] = [d2, at];
    }
    weight[n] = Math.exp(-nearest / FOLLOWS_MM ** 2);
  }
  return { vertex, weight };
}

/** Goes on from the base for a little, ever narrower, and ends in a cap. */
function closeBase(out, border, isBase, baseMm) {
  const pad = border.filter(isBase);
  const ring = [...pad];
  // The nail side's half of the cut.
  const start = Math.asin(Math.max(...pad.map(([, , z]) => z)) / HALF_MM.thick);
  for (let k = 1; k < 24; k++) ring.push(dorsal(baseMm, start + (k / 24) * (Math.PI - 2 * start), [0, 0, 0]));
  const middle = [baseMm, 0, (HALF_MM.thick + Math.min(...pad.map(([, , z]) => z))) / 2];
  ring.sort((a, b) => Math.atan2(a[2] - middle[2], a[1]) - Math.atan2(b[2] - middle[2], b[1]));
  const rings = [ring];
  for (let step = 1; step <= END.steps; step++) {
    const part = step / END.steps;
    const factor = 1 - END.narrows * part ** 3;
    rings.push(ring.map(([, y, z]) => [baseMm + END.lengthMm * part, y * factor, middle[2] + (z - middle[2]) * factor]));
  }
  // Outward, square to the ring: the patch's own normals at its edge are that too, so that no seam is seen.
  const outward = ring.map((_, k) => {
    const [before, after] = [ring.at(k - 1), ring[(k + 1) % ring.length]];
    const [y, z] = [after[1] - before[1], after[2] - before[2]];
    const length = Math.hypot(y, z) || 1;
    return [0, z / length, -y / length];
  });
  for (let step = 0; step < END.steps; step++) {
    for (let k = 0; k < ring.length; k++) {
      const l = (k + 1) % ring.length;
      const corners = [rings[step][k], rings[step][l], rings[step + 1][l], rings[step + 1][k]];
      quad(out, corners, [outward[k], outward[l], outward[l], outward[k]]);
    }
  }
  const last = rings.at(-1);
  const centre = [last[0][0], 0, middle[2]];
  for (let k = 0; k < last.length; k++) for (const corner of [last[k], last[(k + 1) % last.length], centre]) out.push(...corner, 1, 0, 0);
}

/** The nail: a plate that follows the back of the finger, with round corners and a free edge. */
export function nailMesh() {
  const out = [];
  const { fromMm, toMm, spanRad, liftMm, across, along, rounding } = NAIL;
  const point = (i, j) => {
    const [u, v] = [(2 * i) / across - 1, (2 * j) / along - 1];
    // A square drawn into a rounded one.
    const size = (Math.abs(u) ** rounding + Math.abs(v) ** rounding) ** (1 / rounding);
    const shrink = size > 0 ? Math.max(Math.abs(u), Math.abs(v)) / size : 0;
    const x = fromMm + ((v * shrink + 1) / 2) * (toMm - fromMm);
    // Towards the tip the finger falls away, and the nail does not.
    const s = Math.max(narrowing(Math.max(0, x)), FREE_EDGE + (0.96 - FREE_EDGE) * (x / toMm));
    const round = Math.PI / 2 + u * shrink * spanRad;
    const y = HALF_MM.across * s * Math.cos(round);
    const z = HALF_MM.thick * s * Math.sin(round) + liftMm;
    return [x, y, z];
  };
  const normal = (i, j) => {
    const [left, right, low, high] = [point(Math.max(0, i - 1), j), point(Math.min(across, i + 1), j), point(i, Math.max(0, j - 1)), point(i, Math.min(along, j + 1))];
    const [d, e] = [[right, left], [high, low]].map(([to, from]) => to.map((c, axis) => c - from[axis]));
    const n = [d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2], d[0] * e[1] - d[1] * e[0]];
    const length = Math.hypot(...n);
    return length > 1e-9 ? n.map((c) => (n[2] < 0 ? -c : c) / length) : [0, 0, 1];
  };
  for (let j = 0; j < along; j++) {
    for (let i = 0; i < across; i++) {
      const places = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
      quad(out, places.map((place) => point(...place)), places.map((place) => normal(...place)));
    }
  }
  return Float32Array.from(out);
}
