// What a visitor takes along: a link that holds the state, the same press as Python, pictures and arrays.

const MAGIC = '\x93NUMPY';

/** A file of NumPy: maps of f32, stacked. */
export function npyOf(maps, sidePx) {
  const shape = `(${maps.length}, ${sidePx}, ${sidePx})`;
  let head = `{'descr': '<f4', 'fortran_order': False, 'shape': ${shape}, }`;
  head = `${head.padEnd(64 * Math.ceil((10 + head.length + 1) / 64) - 11, ' ')}\n`;
  const out = new Uint8Array(10 + head.length + 4 * maps.length * sidePx * sidePx);
  [...MAGIC].forEach((letter, k) => { out[k] = letter.charCodeAt(0); });
  out[6] = 1;
  new DataView(out.buffer).setUint16(8, head.length, true);
  out.set(new TextEncoder().encode(head), 10);
  maps.forEach((map, k) => out.set(new Uint8Array(Float32Array.from(map).buffer), 10 + head.length + 4 * k * sidePx * sidePx));
  return out;
}

/** The part of a link behind `#` that holds `state`; what is empty stays away. */
export function hashOf(state) {
  const filled = Object.entries(state).filter(([, value]) => value !== '' && value !== undefined && value !== null);
  return `#${new URLSearchParams(filled.map(([name, value]) => [name, String(value)]))}`;
}

export const stateOf = (hash) => Object.fromEntries(new URLSearchParams(hash.replace(/^#/, '')));

const round = (x) => Number(x.toFixed(5));

/** What is not JSON in Python. */
const python = (value) => JSON.stringify(value).replace(/\btrue\b/g, 'True').replace(/\bfalse\b/g, 'False').replace(/\bnull\b/g, 'None')
  .replace(/":/g, '": ').replace(/,(?=["[{\d-])/g, ', ');

/** The press as a program with the Python client. */
export function pythonOf({ origin, terms, pose }) {
  const names = Object.entries(terms).filter(([name, value]) => !['atlas_hash', 'sample_type', 'error_estimate'].includes(name) && value !== null && !(Array.isArray(value) && value.length === 0));
  const lines = names.map(([name, value]) => `    ${name}=${python(value)},`);
  return `import papilla

with papilla.Session(
    "${origin}",
${lines.join('\n')}
) as session:
    answer = session.touch(${JSON.stringify(Array.from(pose, round))})
    if answer.status == "ok":
        print(f"{answer.touch.force_n} N, SED up to {answer.sed.max():.0f} J/m3, {answer.total_us / 1000:.1f} ms")
`;
}

/** Offers bytes as a download. */
export function save(name, type, content) {
  const link = Object.assign(document.createElement('a'), { href: URL.createObjectURL(new Blob([content], { type })), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/** Words of an element; of a choice in it only what is chosen. */
function wordsOf(element) {
  if (element.tagName === 'SELECT') return element.selectedOptions[0]?.textContent ?? '';
  const parts = [...element.childNodes].map((node) => (node.nodeType === Node.TEXT_NODE ? node.textContent : node.checkVisibility?.() ? wordsOf(node) : ''));
  return parts.join('').replace(/\s+/g, ' ').trim();
}

const PICTURE = { side: 336, head: 48, foot: 40, gap: 16 };

/** The maps that are shown side by side, each with its title, peak and scale, and the finger, as a canvas. */
export function pictureOf(views, finger) {
  const { side, head, foot, gap } = PICTURE;
  const canvas = document.createElement('canvas');
  const shown = views.filter(({ canvas: map }) => map.checkVisibility());
  canvas.width = (shown.length + (finger ? 1 : 0)) * (side + gap) + gap;
  canvas.height = side + head + foot + 2 * gap;
  const context = canvas.getContext('2d');
  const style = getComputedStyle(document.body);
  context.fillStyle = style.getPropertyValue('--panel');
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.fillStyle = style.getPropertyValue('--ink');
  const write = (font, text, x, y, align = 'left') => {
    context.font = `${font} system-ui, sans-serif`;
    context.textAlign = align;
    context.fillText(text, x, y);
  };
  shown.forEach((view, k) => {
    const [x, below] = [gap + k * (side + gap), gap + head + side];
    write('600 16px', wordsOf(view.element.querySelector('h2')), x, gap + 14);
    write('14px', wordsOf(view.element.querySelector('.peak')), x, gap + 34);
    context.imageSmoothingEnabled = false;
    context.drawImage(view.canvas, x, gap + head, side, side);
    context.drawImage(view.scale.bar, x, below + 10, side, 10);
    const [least, most] = view.scale.ends;
    write('13px', least, x, below + 36);
    write('13px', most, x + side, below + 36, 'right');
  });
  if (finger) {
    const x = gap + shown.length * (side + gap);
    write('600 16px', 'Finger', x, gap + 14);
    const scale = Math.min(side / finger.width, side / finger.height);
    context.imageSmoothingEnabled = true;
    context.drawImage(finger, x, gap + head, finger.width * scale, finger.height * scale);
  }
  return canvas;
}
