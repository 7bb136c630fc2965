// The press as a contact solve of the server's: the indenter is announced once, then its pose goes
// out with every frame, and the pressure that was found and what pushes back come in.

const PLATE_MM = { size: 20, edge: 0.5, halfHeight: 2.5 };
const BAR_MM = { length: 20, end: 0.5 };
/** Hellos are rare: a slider that moves announces at most so often. */
const ANNOUNCE_MS = 300;
/** A lifted indenter stands so far off: at depth 0 it would still graze the skin. */
const LIFTED_MM = 0.1;

/** The shape of a press as a scene file has it; it presses towards +z of its own frame. */
export function shapeOf({ shape, radiusMm }) {
  if (shape === 'plate') return { shape: 'plate', size_mm: [PLATE_MM.size, PLATE_MM.size], edge_radius_mm: PLATE_MM.edge };
  if (shape === 'sphere') return { shape: 'sphere', radius_mm: radiusMm };
  return { shape: 'cylinder', radius_mm: radiusMm, length_mm: BAR_MM.length, end_radius_mm: BAR_MM.end };
}

/** Origin (mm) and unit quaternion x y z w of a press so deep in the finger's frame, into seven numbers. */
export function poseOf(press, depthMm, out) {
  const { pointMm, normal: n, tangent: t, bitangent: b, heightMm } = press;
  // Its lowest point stands at `heightMm` over the skin; its z goes into the finger, so its y is -b.
  const reachMm = (press.shape === 'plate' ? PLATE_MM.halfHeight : press.radiusMm) + (depthMm > 0 ? 0 : LIFTED_MM);
  for (let k = 0; k < 3; k++) out[k] = pointMm[k] + (heightMm + reachMm) * n[k];
  quaternionOf(t, b, n, out);
}

/** Of the rotation with columns t, -b, -n (Shepperd's method: never divides by a small number). */
function quaternionOf(t, b, n, out) {
  const [xx, yy, zz] = [t[0], -b[1], -n[2]];
  const squares = [1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz];
  const most = squares.indexOf(Math.max(...squares));
  const [xy, yx, xz, zx, yz, zy] = [-b[0], t[1], -n[0], t[2], -n[1], -b[2]];
  const rows = [
    [squares[0], xy + yx, xz + zx, zy - yz],
    [xy + yx, squares[1], yz + zy, xz - zx],
    [xz + zx, yz + zy, squares[2], yx - xy],
    [zy - yz, xz - zx, yx - xy, squares[3]],
  ];
  const half = 0.5 / Math.sqrt(squares[most]);
  for (let k = 0; k < 4; k++) out[3 + k] = half * rows[most][k];
}

/** What pushes back, of a section of 16 floats. */
export function readTouch(v) {
  return { forceN: Math.hypot(v[0], v[1], v[2]), force: [v[0], v[1], v[2]], areaMm2: v[6], centreMm: [v[7], v[8], v[9]] };
}

/** Which indenter the server knows of. */
export class Contact {
  constructor(press) {
    this.press = press;
    this.announcedAtMs = -Infinity;
    this.announced = '';
  }

  /** Members of the hello that announces the press as it is. */
  hello(nowMs) {
    const shape = shapeOf(this.press);
    this.announced = JSON.stringify(shape);
    this.announcedAtMs = nowMs;
    return { input: 'objects', objects: [{ shape }], pressure: 'map' };
  }

  /** Whether the indenter is another than the announced one. */
  get isOther() {
    return JSON.stringify(shapeOf(this.press)) !== this.announced;
  }

  /** Whether it is time to announce it. */
  isDue(nowMs) {
    return this.isOther && nowMs - this.announcedAtMs > ANNOUNCE_MS;
  }
}
