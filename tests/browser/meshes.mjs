// Files of meshes for the tests, byte by byte as other programs write them.

/** Triangles of a dome on a round base at z 0, pole at +z; without its base it is open. */
export function dome({ radius, isOpen = false, around = 24, up = 8 }) {
  const at = (j, i) => {
    const [lift, turn] = [(Math.PI / 2) * (j / up), (2 * Math.PI * i) / around];
    return [radius * Math.cos(lift) * Math.cos(turn), radius * Math.cos(lift) * Math.sin(turn), radius * Math.sin(lift)];
  };
  const pole = [0, 0, radius];
  const facets = [];
  for (let i = 0; i < around; i++) {
    const next = (i + 1) % around;
    for (let j = 0; j < up - 1; j++) facets.push([at(j, i), at(j, next), at(j + 1, next)], [at(j, i), at(j + 1, next), at(j + 1, i)]);
    facets.push([at(up - 1, i), at(up - 1, next), pole]);
    if (!isOpen) facets.push([at(0, next), at(0, i), [0, 0, 0]]);
  }
  return facets;
}

/** A binary STL. */
export function stlOf(facets) {
  const data = new ArrayBuffer(84 + 50 * facets.length);
  const view = new DataView(data);
  view.setUint32(80, facets.length, true);
  facets.forEach((facet, n) => facet.flat().forEach((x, k) => view.setFloat32(84 + 50 * n + 12 + 4 * k, x, true)));
  return data;
}

/** Least and greatest of each coordinate, as the format wants them. */
function rangeOf(values) {
  const of = (pick) => [0, 1, 2].map((axis) => values.filter((_, k) => k % 3 === axis).reduce(pick));
  return { min: of((a, b) => Math.min(a, b)), max: of((a, b) => Math.max(a, b)) };
}

/** A GLB of the triangles, each with corners of its own, in metres as the format has it. */
export function glbOf(facetsMm) {
  const values = Float32Array.from(facetsMm.flat(2), (mm) => mm / 1000);
  const text = JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }], meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    accessors: [{ bufferView: 0, componentType: 5126, count: values.length / 3, type: 'VEC3', ...rangeOf(values) }],
    bufferViews: [{ buffer: 0, byteLength: values.byteLength }], buffers: [{ byteLength: values.byteLength }],
  });
  const json = new TextEncoder().encode(text.padEnd(4 * Math.ceil(text.length / 4)));
  const glb = new ArrayBuffer(12 + 8 + json.length + 8 + values.byteLength);
  const view = new DataView(glb);
  [0x46546c67, 2, glb.byteLength, json.length, 0x4e4f534a].forEach((word, k) => view.setUint32(4 * k, word, true));
  new Uint8Array(glb, 20).set(json);
  view.setUint32(20 + json.length, values.byteLength, true);
  view.setUint32(24 + json.length, 0x004e4942, true);
  new Uint8Array(glb, 28 + json.length).set(new Uint8Array(values.buffer));
  return glb;
}
