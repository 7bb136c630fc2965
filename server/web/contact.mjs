// The press as a contact solve of the server's: the indenter is announced once, then its pose goes
// out with every frame, and the pressure that was found and what pushes back come in.

/** Hellos are rare: a slider that moves announces at most so often. */
const ANNOUNCE_MS = 300;
/** A lifted indenter stands so far off: at depth 0 it would still graze the skin. */
const LIFTED_MM = 0.1;

/** Origin (mm) and unit quaternion x y z w of a press so deep in the finger's frame, into seven numbers. */
export function poseOf(press, depthMm, out) {
  const { pointMm, normal: n, tangent: t, bitangent: b, heightMm } = press;
  // Its lowest point stands at `heightMm` over the skin; its z goes into the finger, so its y is -b.
  const reachMm = press.body.faceMm + (depthMm > 0 ? 0 : LIFTED_MM);
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
    /** Coulomb's coefficient; 0: the object has none, and nothing of friction is computed. */
    this.friction = 0;
    /** The contact method asked for; '' leaves it to the server. */
    this.method = '';
    /** Whether the finger is drawn, and so how far its skin moves is asked for. */
    this.draws = false;
    this.announcedAtMs = -Infinity;
    this.announced = null;
  }

  /** Members of the hello that announces the press as it is. */
  hello(nowMs) {
    this.announced = this.press.body;
    this.announcedAtMs = nowMs;
    // Springs move no skin beside them: without its displacement the finger is drawn flattened.
    return { ...this.terms(this.method), ...(this.draws && this.method !== 'springs' && { displacement: true }) };
  }

  /** The same for a session that finds the pressure by another method. */
  terms(method) {
    const object = { shape: this.press.body.hello, ...(this.friction > 0 && { friction: this.friction }) };
    return { input: 'objects', objects: [object], pressure: 'map', ...(method && { method }) };
  }

  /** Whether the indenter is another than the announced one. */
  get isOther() {
    return this.press.body !== this.announced;
  }

  /** Whether it is time to announce it. */
  isDue(nowMs) {
    return this.isOther && nowMs - this.announcedAtMs > ANNOUNCE_MS;
  }
}
