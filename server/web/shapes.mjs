// What can press: each shape as the hello names it, where its pressing face lies, and how far its
// surface lies behind that face, as a function of the place beside its axis. docs/reference/indenters.md.

const PLATE_MM = { size: 20, edge: 0.5 };
const BAR_MM = { length: 20, end: 0.5 };
const WAVES = { columns: 64, side: 12, depth: 0.3 };
const BOX_EDGE_MM = 0.5;
const UNION = { size: 12, edge: 1, lift: 1 };
/** Surface farther behind the face than this is not felt. */
export const REACH_MM = 6;

const square = (x) => x * x;

/** How far a rounded convex edge of radius `r` lies behind, so far `over` the flat part. */
function rounded(over, r) {
  if (over <= 0) return 0;
  return over >= r ? Infinity : r - Math.sqrt(r * r - over * over);
}

const ball = (r, d2) => (d2 >= r * r ? Infinity : r - Math.sqrt(r * r - d2));
const plate = (x, y, size, edge) => rounded(Math.abs(x) - size / 2 + edge, edge) + rounded(Math.abs(y) - size / 2 + edge, edge);

/** Heights of the waves, mm, row by row from the lowest y. */
function waves(size) {
  const heights = [];
  for (let row = 0; row < WAVES.columns; row++) {
    for (let column = 0; column < WAVES.columns; column++) {
      const [x, y] = [column, row].map((k) => (k / (WAVES.columns - 1) - 0.5) * WAVES.side);
      heights.push(WAVES.depth * (0.5 + 0.25 * (Math.cos((2 * Math.PI * x) / size) + Math.cos((2 * Math.PI * y) / size))));
    }
  }
  return heights;
}

/** A surface of heights over a rectangle about the origin, as a profile. */
function profileOfHeights(heights, columns, widthMm, depthMm) {
  const rows = heights.length / columns;
  let most = -Infinity;
  for (const height of heights) if (height > most) most = height;
  return (x, y) => {
    const u = (x / widthMm + 0.5) * (columns - 1);
    const v = (y / depthMm + 0.5) * (rows - 1);
    if (!(u >= 0 && v >= 0 && u <= columns - 1 && v <= rows - 1)) return Infinity;
    const [c, r] = [Math.min(columns - 2, Math.floor(u)), Math.min(rows - 2, Math.floor(v))];
    const [s, t] = [u - c, v - r];
    const at = r * columns + c;
    const height = (1 - t) * ((1 - s) * heights[at] + s * heights[at + 1]) + t * ((1 - s) * heights[at + columns] + s * heights[at + columns + 1]);
    return height > -Infinity ? most - height : Infinity;
  };
}

const RASTER = 97;

/** Greatest z of a triangle mesh over a grid: what the skin meets. */
export function heightsOfMesh({ vertices_mm: vertices, triangles }) {
  let half = 0;
  for (const [x, y] of vertices) half = Math.max(half, Math.abs(x), Math.abs(y));
  const heights = new Float64Array(RASTER * RASTER).fill(-Infinity);
  const grid = (x) => (x / (2 * half) + 0.5) * (RASTER - 1);
  for (const corners of triangles) {
    const [a, b, c] = corners.map((k) => [grid(vertices[k][0]), grid(vertices[k][1]), vertices[k][2]]);
    const twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if (Math.abs(twice) < 1e-9) continue;
    const [left, right] = [Math.floor(Math.min(a[0], b[0], c[0])), Math.ceil(Math.max(a[0], b[0], c[0]))];
    const [low, high] = [Math.floor(Math.min(a[1], b[1], c[1])), Math.ceil(Math.max(a[1], b[1], c[1]))];
    for (let row = Math.max(0, low); row <= Math.min(RASTER - 1, high); row++) {
      for (let column = Math.max(0, left); column <= Math.min(RASTER - 1, right); column++) {
        const wb = ((column - a[0]) * (c[1] - a[1]) - (row - a[1]) * (c[0] - a[0])) / twice;
        const wc = ((b[0] - a[0]) * (row - a[1]) - (b[1] - a[1]) * (column - a[0])) / twice;
        if (wb < -1e-6 || wc < -1e-6 || wb + wc > 1 + 1e-6) continue;
        const z = a[2] + wb * (b[2] - a[2]) + wc * (c[2] - a[2]);
        const at = row * RASTER + column;
        if (z > heights[at]) heights[at] = z;
      }
    }
  }
  return { heights, columns: RASTER, sideMm: 2 * half };
}

/** An octahedron: the mesh that stands for one's own until a file is dropped. */
export const OCTAHEDRON = {
  name: 'octahedron',
  vertices_mm: [[4, 0, 0], [-4, 0, 0], [0, 4, 0], [0, -4, 0], [0, 0, 4], [0, 0, -4]],
  triangles: [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
};

const MESH_DECIMALS = 4;
/** The greatest side that a mesh can be given, mm. */
export const MESH_SIDE_MAX_MM = 30;

const bytesOfJson = (value) => JSON.stringify(value).length;

/** Most bytes that a mesh takes in the hello, however large it is made: each coordinate as long as one of the greatest can be. */
export function mostBytesOf({ vertices_mm: vertices, triangles }) {
  const longest = Number((10 ** -MESH_DECIMALS - MESH_SIDE_MAX_MM / 2).toFixed(MESH_DECIMALS));
  const vertex = [longest, longest, longest];
  return bytesOfJson({ shape: 'mesh', vertices_mm: [], triangles }) + vertices.length * (bytesOfJson(vertex) + 1);
}

/** A mesh made so large that its greatest side is `size` mm. */
export function scaled(mesh, size) {
  let most = 0;
  for (let axis = 0; axis < 3; axis++) {
    let [low, high] = [Infinity, -Infinity];
    for (const vertex of mesh.vertices_mm) [low, high] = [Math.min(low, vertex[axis]), Math.max(high, vertex[axis])];
    most = Math.max(most, high - low);
  }
  const factor = size / most;
  return { ...mesh, vertices_mm: mesh.vertices_mm.map((vertex) => vertex.map((x) => Number((x * factor).toFixed(MESH_DECIMALS)))) };
}

/**
 * Every shape: its name for people; `size`: what its slider means, its range and start, mm; `turns`:
 * whether a turn about its axis changes it; `make(size, mesh)`: `hello`, `faceMm` (z of the pressing
 * face in its own frame), `profile(x, y)` and `halfMm`, how far it extends.
 */
export const SHAPES = {
  plate: { label: 'Plate', size: null, turns: true, make: () => ({
    hello: { shape: 'plate', size_mm: [PLATE_MM.size, PLATE_MM.size], edge_radius_mm: PLATE_MM.edge },
    faceMm: 2 + PLATE_MM.edge, halfMm: PLATE_MM.size / 2, profile: (x, y) => plate(x, y, PLATE_MM.size, PLATE_MM.edge),
  }) },
  sphere: { label: 'Ball', size: ['Radius', 1.5, 10, 4], turns: false, make: (r) => ({
    hello: { shape: 'sphere', radius_mm: r }, faceMm: r, halfMm: r, profile: (x, y) => ball(r, x * x + y * y),
  }) },
  cylinder: { label: 'Bar', size: ['Radius', 1.5, 10, 3], turns: true, make: (r) => ({
    hello: { shape: 'cylinder', radius_mm: r, length_mm: BAR_MM.length, end_radius_mm: BAR_MM.end }, faceMm: r, halfMm: BAR_MM.length / 2,
    profile: (x, y) => (Math.abs(y) > BAR_MM.length / 2 ? Infinity : ball(r, x * x)),
  }) },
  wedge: { label: 'Blade', size: ['Width of its back', 0.4, 6, 1], turns: true, make: (base) => ({
    hello: { shape: 'wedge', base_width_mm: base, length_mm: 20 }, faceMm: 0, halfMm: 10,
    profile: (x, y) => {
      const over = Math.abs(x) - 0.025;
      return Math.abs(y) > 10 || Math.abs(x) > base / 2 ? Infinity : over <= 0 ? 0 : (2 * over) / Math.max(0.05, base / 2 - 0.025);
    },
  }) },
  punch: { label: 'Punch', size: ['Radius', 1, 6, 2.5], turns: false, make: (r) => ({
    hello: { shape: 'punch', radius_mm: r }, faceMm: 0, halfMm: r, profile: (x, y) => rounded(Math.hypot(x, y) - r + 0.25, 0.25),
  }) },
  ring: { label: 'Ring', size: ['Outer radius', 2, 8, 4], turns: false, make: (r) => ({
    hello: { shape: 'ring', outer_radius_mm: r, inner_radius_mm: 0.7 * r }, faceMm: 0, halfMm: r,
    profile: (x, y) => {
      const d = Math.hypot(x, y);
      return Math.max(rounded(d - r + 0.25, 0.25), rounded(0.7 * r + 0.25 - d, 0.25));
    },
  }) },
  box: { label: 'Box', size: ['Side', 2, 12, 6], turns: true, make: (side) => ({
    hello: { shape: 'box', size_mm: [side, side, side], edge_radius_mm: BOX_EDGE_MM }, faceMm: side / 2, halfMm: side / 2,
    profile: (x, y) => plate(x, y, side, BOX_EDGE_MM),
  }) },
  capsule: { label: 'Capsule', size: ['Radius', 1, 6, 2.5], turns: true, make: (r) => ({
    hello: { shape: 'capsule', radius_mm: r, length_mm: 4 * r }, faceMm: r, halfMm: 2 * r,
    profile: (x, y) => ball(r, x * x + square(Math.max(0, Math.abs(y) - r))),
  }) },
  torus: { label: 'Torus', size: ['Radius', 2, 8, 4], turns: false, make: (r) => ({
    hello: { shape: 'torus', radius_mm: r, tube_radius_mm: 0.25 * r }, faceMm: 0.25 * r, halfMm: 1.25 * r,
    profile: (x, y) => ball(0.25 * r, square(Math.hypot(x, y) - r)),
  }) },
  grating: { label: 'Ridges', size: ['Width of ridge and groove', 0.5, 3, 1.5], turns: true, make: (w) => ({
    hello: { shape: 'grating', ridges: 5, ridge_mm: w, groove_mm: w, edge_radius_mm: Math.min(0.25, w / 4) }, faceMm: 0, halfMm: Math.max(10, 4.5 * w),
    profile: (x, y) => {
      if (Math.abs(y) > 10 || Math.abs(x) > 4.5 * w) return Infinity;
      const nearest = Math.max(-2, Math.min(2, Math.round(x / (2 * w))));
      const edge = Math.min(0.25, w / 4);
      return Math.min(1.5, rounded(Math.abs(x - 2 * w * nearest) - w / 2 + edge, edge));
    },
  }) },
  dots: { label: 'Braille', size: ['Distance of dots', 1.6, 5, 2.34], turns: true, make: (pitch) => {
    const [base, height] = [1.44 / 2.34 * pitch, 0.48 / 2.34 * pitch].map((x) => Number(x.toFixed(4)));
    const r = (square(base / 2) + square(height)) / (2 * height);
    const places = [-1, 0, 1].flatMap((i) => [-0.5, 0.5].map((j) => [i * pitch, j * pitch]));
    return {
      hello: { shape: 'dots', count: [3, 2], pitch_mm: pitch, base_mm: base, height_mm: height }, faceMm: 0, halfMm: 10,
      profile: (x, y) => {
        if (Math.max(Math.abs(x), Math.abs(y)) > 10) return Infinity;
        const d2 = Math.min(...places.map(([u, v]) => square(x - u) + square(y - v)));
        return d2 < square(base / 2) ? ball(r, d2) : height;
      },
    };
  } },
  heightmap: { label: 'Waves', size: ['Wavelength', 1.5, 6, 3], turns: true, make: (size) => {
    const heights = waves(size);
    const pixel = WAVES.side / (WAVES.columns - 1);
    return {
      hello: { shape: 'heightmap', columns: WAVES.columns, pixel_mm: [pixel, pixel], heights_mm: heights.map((h) => Number(h.toFixed(4))) },
      faceMm: Math.max(...heights.map((h) => Number(h.toFixed(4)))), halfMm: WAVES.side / 2,
      profile: profileOfHeights(heights, WAVES.columns, WAVES.side, WAVES.side),
    };
  } },
  union: { label: 'Plate with a ball', size: ['Radius of the ball', 0.6, 3, 1.5], turns: true, make: (r) => ({
    hello: { shape: 'union', parts: [
      { part: { shape: 'plate', size_mm: [UNION.size, UNION.size], edge_radius_mm: UNION.edge }, at_mm: [0, 0, -2 - UNION.edge - UNION.lift] },
      { part: { shape: 'sphere', radius_mm: r }, at_mm: [0, 0, -r] },
    ] },
    faceMm: 0, halfMm: UNION.size / 2,
    profile: (x, y) => Math.min(ball(r, x * x + y * y), UNION.lift + plate(x, y, UNION.size, UNION.edge)),
  }) },
  mesh: { label: 'Your own', size: ['Greatest side', 3, MESH_SIDE_MAX_MM, 8], turns: true, make: (size, mesh = OCTAHEDRON) => {
    const { vertices_mm, triangles } = scaled(mesh, size);
    const { heights, columns, sideMm } = heightsOfMesh({ vertices_mm, triangles });
    let faceMm = -Infinity;
    for (const vertex of vertices_mm) faceMm = Math.max(faceMm, vertex[2]);
    const above = profileOfHeights(heights, columns, sideMm, sideMm);
    let seen = -Infinity;
    for (const height of heights) seen = Math.max(seen, height);
    return {
      hello: { shape: 'mesh', vertices_mm, triangles }, faceMm, halfMm: sideMm / 2,
      profile: (x, y) => above(x, y) + (faceMm - seen),
    };
  } },
};

const COARSE = 56;

/** The pressing surface as triangles, for drawing: x, y beside the axis, z out of the finger, the face at 0; 6 floats a vertex. */
export function surfaceMesh({ profile, halfMm }) {
  const side = 2 * COARSE;
  const half = Math.min(halfMm, 12);
  const step = (2 * half) / side;
  const height = (x, y) => Math.min(REACH_MM, profile(x, -y));
  const at = (i, j) => {
    const [x, y] = [-half + i * step, -half + j * step];
    return [x, y, height(x * 0.9999, y * 0.9999)];
  };
  const points = [];
  for (let j = 0; j <= side; j++) for (let i = 0; i <= side; i++) points.push(at(i, j));
  const vertices = [];
  for (let j = 0; j < side; j++) {
    for (let i = 0; i < side; i++) {
      const corners = [j * (side + 1) + i, j * (side + 1) + i + 1, (j + 1) * (side + 1) + i + 1, (j + 1) * (side + 1) + i].map((k) => points[k]);
      if (corners.some(([, , z]) => z >= REACH_MM)) continue;
      const [u, v] = [corners[1], corners[3]].map((p) => p.map((x, k) => x - corners[0][k]));
      const normal = [u[2] * v[1] - u[1] * v[2], u[0] * v[2] - u[2] * v[0], u[1] * v[0] - u[0] * v[1]];
      const length = Math.hypot(...normal) || 1;
      for (const k of [0, 1, 2, 0, 2, 3]) vertices.push(...corners[k], ...normal.map((x) => x / length));
    }
  }
  return Float32Array.from(vertices);
}
