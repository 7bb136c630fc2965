// The atlas of the web client, and the geometry that only a page needs: what lies under a pointer.

import { Atlas as ClientAtlas, vertexNormals } from './atlas.js';

/**
 * Atlas of the finger: both patches share triangles, whose normals point out of the finger; vertex i
 * of one lies over vertex i of the other. x runs along the finger from the tip, the pad faces -z.
 */
export class Atlas extends ClientAtlas {
  constructor(json) {
    super(json);
    /** Normals averaged over a few rings: the direction in which an indenter approaches. */
    this.smoothNormals = smooth(this.triangles, this.normals, this.vertexCount, 12);
  }

  /** Where pixel position (u, v) lies on the skin: writes triangle and weights into `hit`; false outside. */
  locate(u, v, hit) {
    const { uvPx } = this.skin;
    const t = this.triangles;
    for (let k = 0; k < t.length; k += 3) {
      const a = 2 * t[k];
      const b = 2 * t[k + 1];
      const c = 2 * t[k + 2];
      const bu = uvPx[b] - uvPx[a];
      const bv = uvPx[b + 1] - uvPx[a + 1];
      const cu = uvPx[c] - uvPx[a];
      const cv = uvPx[c + 1] - uvPx[a + 1];
      const twiceArea = bu * cv - bv * cu;
      const pu = u - uvPx[a];
      const pv = v - uvPx[a + 1];
      const wb = (pu * cv - pv * cu) / twiceArea;
      const wc = (bu * pv - bv * pu) / twiceArea;
      if (wb >= 0 && wc >= 0 && wb + wc <= 1) {
        hit.triangle = k;
        hit.weightB = wb;
        hit.weightC = wc;
        return true;
      }
    }
    return false;
  }

  /** First skin triangle hit from outside by the ray; writes it into `hit`; false where it misses. */
  intersect(origin, direction, hit) {
    const p = this.skin.positionsMm;
    const t = this.triangles;
    let nearest = Infinity;
    for (let k = 0; k < t.length; k += 3) {
      const distance = rayTriangle(origin, direction, p, 3 * t[k], 3 * t[k + 1], 3 * t[k + 2]);
      if (distance < nearest) {
        nearest = distance;
        hit.triangle = k;
        hit.weightB = rayHit.b;
        hit.weightC = rayHit.c;
      }
    }
    return nearest < Infinity;
  }

  /** Linear interpolation at `hit` of `components` values per vertex, into `out`. */
  interpolate(values, components, hit, out) {
    const t = this.triangles;
    const weightA = 1 - hit.weightB - hit.weightC;
    for (let k = 0; k < components; k++) {
      out[k] = weightA * values[components * t[hit.triangle] + k]
        + hit.weightB * values[components * t[hit.triangle + 1] + k]
        + hit.weightC * values[components * t[hit.triangle + 2] + k];
    }
    return out;
  }
}

/** Unit normals of a mesh that moved, into an array that is there. */
export function computeNormals(triangles, positions, normals) {
  normals.set(vertexNormals(triangles, positions));
}

function normalise(vectors) {
  for (let i = 0; i < vectors.length; i += 3) {
    const length = Math.hypot(vectors[i], vectors[i + 1], vectors[i + 2]) || 1;
    vectors[i] /= length;
    vectors[i + 1] /= length;
    vectors[i + 2] /= length;
  }
}

/** `rounds` times the mean over each vertex's neighbours, kept at unit length. */
function smooth(triangles, normals, vertexCount, rounds) {
  let now = Float32Array.from(normals);
  for (let round = 0; round < rounds; round++) {
    const next = new Float32Array(3 * vertexCount);
    for (let k = 0; k < triangles.length; k += 3) {
      for (let axis = 0; axis < 3; axis++) {
        const sum = now[3 * triangles[k] + axis] + now[3 * triangles[k + 1] + axis] + now[3 * triangles[k + 2] + axis];
        for (let corner = 0; corner < 3; corner++) next[3 * triangles[k + corner] + axis] += sum;
      }
    }
    normalise(next);
    now = next;
  }
  return now;
}

const rayHit = { b: 0, c: 0 };

/** Distance along the ray (Moeller and Trumbore), Infinity for a miss or a hit from inside. */
function rayTriangle(o, d, p, a, b, c) {
  const ux = p[b] - p[a];
  const uy = p[b + 1] - p[a + 1];
  const uz = p[b + 2] - p[a + 2];
  const vx = p[c] - p[a];
  const vy = p[c + 1] - p[a + 1];
  const vz = p[c + 2] - p[a + 2];
  const hx = d[1] * vz - d[2] * vy;
  const hy = d[2] * vx - d[0] * vz;
  const hz = d[0] * vy - d[1] * vx;
  const determinant = ux * hx + uy * hy + uz * hz;
  if (determinant <= 1e-12) return Infinity;
  const sx = o[0] - p[a];
  const sy = o[1] - p[a + 1];
  const sz = o[2] - p[a + 2];
  const weightB = (sx * hx + sy * hy + sz * hz) / determinant;
  if (weightB < 0 || weightB > 1) return Infinity;
  const qx = sy * uz - sz * uy;
  const qy = sz * ux - sx * uz;
  const qz = sx * uy - sy * ux;
  const weightC = (d[0] * qx + d[1] * qy + d[2] * qz) / determinant;
  if (weightC < 0 || weightB + weightC > 1) return Infinity;
  const distance = (vx * qx + vy * qy + vz * qz) / determinant;
  if (distance <= 0) return Infinity;
  rayHit.b = weightB;
  rayHit.c = weightC;
  return distance;
}
