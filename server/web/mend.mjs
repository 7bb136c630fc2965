// Makes a body of a visitor's mesh, as the service asks for one: triangles once, turned outward, without
// holes. What was done is told, so that nobody takes the mended mesh for the file's.

/** Less than this share of the cube of the greatest side is no inside. */
const HOLLOW = 1e-7;

const keyOf = (a, b) => (a < b ? `${a} ${b}` : `${b} ${a}`);

/** For each edge the triangles that have it. */
function edgesOf(triangles) {
  const edges = new Map();
  triangles.forEach(([a, b, c], triangle) => {
    for (const [from, to] of [[a, b], [b, c], [c, a]]) {
      const key = keyOf(from, to);
      if (!edges.has(key)) edges.set(key, []);
      edges.get(key).push({ triangle, from, to });
    }
  });
  return edges;
}

/** Turns triangles so that neighbours run along their edge in opposite directions; the number that were turned. */
function turnAlike(triangles) {
  const edges = edgesOf(triangles);
  const seen = new Uint8Array(triangles.length);
  const turned = new Uint8Array(triangles.length);
  for (let first = 0; first < triangles.length; first++) {
    if (seen[first]) continue;
    seen[first] = 1;
    const open = [first];
    while (open.length) {
      const triangle = open.pop();
      const [a, b, c] = triangles[triangle];
      for (const [from, to] of [[a, b], [b, c], [c, a]]) {
        const both = edges.get(keyOf(from, to));
        if (both.length !== 2) continue;
        const other = both.find((one) => one.triangle !== triangle);
        if (!other || seen[other.triangle]) continue;
        const [p, q, r] = triangles[other.triangle];
        const alike = [[p, q], [q, r], [r, p]].some(([u, v]) => u === from && v === to);
        if (alike) {
          triangles[other.triangle] = [p, r, q];
          turned[other.triangle] = 1;
        }
        seen[other.triangle] = 1;
        open.push(other.triangle);
      }
    }
  }
  return turned.reduce((sum, one) => sum + one, 0);
}

/** Closed rows of corners along the edges that only one triangle has. */
function rimsOf(triangles) {
  const next = new Map();
  for (const of of edgesOf(triangles).values()) {
    if (of.length !== 1) continue;
    const [{ from, to }] = of;
    if (!next.has(from)) next.set(from, []);
    next.get(from).push(to);
  }
  const rims = [];
  for (const [start, ways] of next) {
    while (ways.length) {
      const rim = [start];
      let at = ways.pop();
      while (at !== start && next.get(at)?.length) {
        rim.push(at);
        at = next.get(at).pop();
      }
      if (at === start) rims.push(rim);
    }
  }
  return rims;
}

/** Closes a hole by a fan about the middle of its rim. */
function close(rim, vertices, triangles) {
  if (rim.length === 3) {
    triangles.push([rim[2], rim[1], rim[0]]);
    return;
  }
  const middle = [0, 1, 2].map((axis) => rim.reduce((sum, k) => sum + vertices[k][axis], 0) / rim.length);
  vertices.push(middle);
  rim.forEach((from, k) => triangles.push([rim[(k + 1) % rim.length], from, vertices.length - 1]));
}

/** Volume inside, mm³; below 0 where the surface is inside out. */
export function volumeOf(vertices, triangles) {
  let six = 0;
  for (const corners of triangles) {
    const [a, b, c] = corners.map((k) => vertices[k]);
    six += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return six / 6;
}

const count = (n, one, more = `${one}s`) => `${n} ${n === 1 ? one : more}`;

/** The mesh as a body, and in words what was mended. Throws where no body can be made of it. */
export function mended({ name, vertices_mm: found, triangles: given, sideMm }) {
  const vertices = found.map((vertex) => [...vertex]);
  const once = new Map(given.map((corners) => [[...corners].sort((a, b) => a - b).join(' '), [...corners]]));
  const triangles = [...once.values()];
  const said = [];
  const doubles = given.length - triangles.length;
  if (doubles) said.push(`${count(doubles, 'triangle')} that ${doubles === 1 ? 'was' : 'were'} there twice left out`);
  const turned = turnAlike(triangles);
  const rims = rimsOf(triangles);
  for (const rim of rims) close(rim, vertices, triangles);
  if (rims.length) said.push(`open: ${count(rims.length, 'hole')} closed with ${count(triangles.length - once.size, 'triangle')}`);
  const volume = volumeOf(vertices, triangles);
  if (!(Math.abs(volume) > HOLLOW * sideMm ** 3)) throw new Error(`${name} is a surface without an inside: give it a thickness`);
  if (volume < 0) {
    for (const corners of triangles) corners.reverse();
    said.push('it was inside out: turned');
  } else if (turned) {
    said.push(`${count(turned, 'triangle')} turned outward`);
  }
  return { name, vertices_mm: vertices, triangles, given: given.length, sideMm, said };
}
