// Hard cases: each is sent to this server in a session of its own, and shown with what came back. Beside
// each stands what the finite-element code does with a difficulty of the kind (beside.mjs).

import { HardCasesOfFe } from './beside.mjs';
import { poseOf } from './contact.mjs';
import { TABLES, TABLE_LEN, digits } from './colour.mjs';
import { byId, put } from './notice.mjs';
import { Press } from './press.mjs';
import { MAP_LEN, SIDE_PX, Session, sessionUrl } from './protocol.mjs';
import { fadeInto, groundOf } from './scale.mjs';
import { flagsOf } from './words.mjs';

const PATIENCE_MS = 30000;
const KPA = 1000;
/** What came of the last one, in short. */
const TOLD = { refused: 'refused, with why', flagged: 'answered, flagged', plain: 'answered' };
/** Red, so that one such pixel is seen. */
const NAN_COLOUR = 0xff0000ff;

/** Pressure of a round contact in the middle of the pad, Pa. */
function roundContact(peakPa, radiusPx) {
  const map = new Float32Array(MAP_LEN);
  for (let row = 0; row < SIDE_PX; row++) {
    for (let column = 0; column < SIDE_PX; column++) {
      const d2 = ((row - 105) ** 2 + (column - 112) ** 2) / radiusPx ** 2;
      if (d2 < 1) map[row * SIDE_PX + column] = peakPa * Math.sqrt(1 - d2);
    }
  }
  return map;
}

/** The indenter of a case, and its pose so deep. */
function pressed(atlas, shape, size, depthMm, [u, v] = [112, 105]) {
  const press = new Press(atlas);
  press.setShape(shape, size, 0, [0, 0]);
  press.moveToPixel(u, v);
  press.evaluate(depthMm);
  const pose = new Float32Array(7);
  poseOf(press, depthMm, pose);
  return { objects: [{ shape: press.body.hello }], pose };
}

const objects = (list) => ({ input: 'objects', pressure: 'map', objects: list });

/**
 * The cases. `make(atlas, mostPa)` gives the terms and the frames: maps of pressure or poses, the last of
 * which is the case. `needsContact`: its frames are poses, which only a server with a contact model takes.
 * `beside`: cases of the finite-element code (stability.json) that are hard in the same way, of which variants
 * `like` this come first, and `why`.
 */
export const CASES = [
  { name: 'Checkerboard', sent: '20 kPa on every other pixel: no skin presses like that',
    beside: ['incompressible'], why: 'a pressure that alternates from element to element is how elements fail on tissue that keeps its volume', make: () => ({
    terms: {}, frames: [Float32Array.from({ length: MAP_LEN }, (_, i) => ((Math.floor(i / SIDE_PX) + (i % SIDE_PX)) % 2 ? 20 * KPA : 0))],
  }) },
  { name: 'Not a number', sent: 'a contact of 10 kPa with one pixel that is NaN',
    beside: ['relaxation-times', 'ogden'], like: /NaN|infinite/, why: 'numbers that are not finite, in a material', make: () => {
    const map = roundContact(10 * KPA, 24);
    map[105 * SIDE_PX + 112] = NaN;
    return { terms: {}, frames: [map] };
  } },
  { name: 'Ten times the range', sent: 'ten times the greatest pressure of the training',
    beside: ['volume', 'ogden'], why: 'strains far beyond those that a material was fitted to', make: (_, mostPa) => ({ terms: {}, frames: [roundContact(10 * mostPa, 24)] }) },
  { name: 'Blade', sent: 'a blade of 0.05 mm, 2 mm deep',
    beside: ['sharp-wedge'], why: 'an edge that is finer than the mesh', needsContact: true, make: (atlas) => {
    const { objects: list, pose } = pressed(atlas, 'wedge', 1, 2);
    return { terms: objects(list), frames: [pose] };
  } },
  { name: 'Jump of 10 mm', sent: 'a ball 8.5 mm off the skin, and in the next frame 1.5 mm deep',
    beside: ['one-increment', 'first-gap'], why: 'the whole way in one step, and a start far off', needsContact: true, make: (atlas) => {
    const { objects: list, pose } = pressed(atlas, 'sphere', 5, 1.5);
    const off = pressed(atlas, 'sphere', 5, -8.5).pose;
    return { terms: objects(list), frames: [off, pose] };
  } },
  { name: 'Off the edge', sent: 'a plate 1.5 mm deep where the map of the finger ends',
    beside: ['grazing'], why: 'contact at the last nodes of a surface', needsContact: true, make: (atlas) => {
    const { objects: list, pose } = pressed(atlas, 'plate', 0, 1.5, [112, 200]);
    return { terms: objects(list), frames: [pose] };
  } },
  { name: 'No rotation', sent: 'a pose whose quaternion has length 2',
    beside: ['mesh-files', 'free-modes'], why: 'input that is no body, and bodies that nothing holds', needsContact: true, make: (atlas) => {
    const { objects: list, pose } = pressed(atlas, 'sphere', 5, 1);
    for (let k = 3; k < 7; k++) pose[k] *= 2;
    return { terms: objects(list), frames: [pose] };
  } },
  { name: 'Metres for mm', sent: 'a ball of 0.01 mm: its radius of 10 mm, given in m',
    beside: ['units'], like: /in m$/, why: 'a value in another unit', needsContact: true, make: (atlas) => {
    const { pose } = pressed(atlas, 'sphere', 5, 1);
    return { terms: objects([{ shape: { shape: 'sphere', radius_mm: 0.01 } }]), frames: [pose] };
  } },
];

/** Sends a case; resolves with what came of it: `ready`, `answer` (its maps copied), or `problem`. */
export function sendCase(hardCase, atlas, mostPa, tier) {
  const { terms, frames } = hardCase.make(atlas, mostPa);
  return new Promise((resolve) => {
    let next = 0;
    let patience = 0;
    const end = (outcome) => {
      clearTimeout(patience);
      session.close();
      resolve({ frame: frames.at(-1), isMap: frames[0].length === MAP_LEN, warnings: session.warnings ?? [], ...outcome });
    };
    const send = () => {
      const frame = frames[next].length === MAP_LEN ? session.mapFrame : session.poseFrame;
      frame.values.set(frames[next++]);
      session.send(performance.now(), frame);
    };
    const session = new Session(sessionUrl(), {
      onstate: () => {},
      onready: (ready) => {
        session.warnings = ready.warnings ?? [];
        // On a new connection the case begins anew.
        next = 0;
        send();
      },
      onanswer: (answer) => {
        if (next < frames.length) {
          send();
          return;
        }
        const { sedJPerM3, pressurePa } = answer;
        end({ answer: { ...answer, sedJPerM3: sedJPerM3?.slice() ?? null, pressurePa: pressurePa?.slice() ?? null, touch: answer.touch?.slice() ?? null } });
      },
      onfault: (code, message, problem) => end({ problem: problem ?? { code, message } }),
    }, PATIENCE_MS);
    patience = setTimeout(() => end({ problem: { code: 'lost', message: `no answer within ${PATIENCE_MS / 1000} s` } }), PATIENCE_MS);
    session.open({ tier, ...terms });
  });
}

/** One word for what came of a case, and a sentence. */
export function verdictOf({ answer, problem, warnings }, mostPa) {
  if (problem) return { kind: 'refused', text: `Refused with the error ${problem.code}`, more: problem.message };
  const flags = flagsOf(answer, mostPa);
  const asked = warnings.map(({ question }) => question);
  if (answer.status !== 'ok') return { kind: 'refused', text: answer.status, more: '' };
  if (flags.length) return { kind: 'flagged', text: `Answered with a flag: ${flags.join('; ')}`, more: asked.join(' ') };
  if (asked.length) return { kind: 'flagged', text: 'Answered, with a question back', more: asked.join(' ') };
  if (answer.noContact) return { kind: 'plain', text: 'Nothing touches; all is zero', more: '' };
  return { kind: 'plain', text: 'Answered without a flag: nothing is known to be wrong', more: '' };
}

/** A map as a small picture on the ground of its patch's `mask`, each on a scale of its own. */
function picture(values, table, label, mask) {
  const figure = document.createElement('figure');
  const canvas = Object.assign(document.createElement('canvas'), { width: SIDE_PX, height: SIDE_PX });
  canvas.setAttribute('role', 'img');
  canvas.setAttribute('aria-label', label);
  const context = canvas.getContext('2d');
  const image = context.createImageData(SIDE_PX, SIDE_PX);
  const words = new Uint32Array(image.data.buffer);
  const bytes = new Uint8ClampedArray(4 * TABLE_LEN);
  fadeInto(bytes, TABLES[table], groundOf(document.body), 0);
  const colours = new Uint32Array(bytes.buffer);
  const most = values.reduce((a, b) => (b > a ? b : a), 0) || 1;
  for (let i = 0; i < MAP_LEN; i++) {
    if (Number.isNaN(values[i])) words[i] = NAN_COLOUR;
    else if (mask[i] || values[i] > 0) words[i] = colours[Math.max(0, Math.min(TABLE_LEN - 1, Math.floor((values[i] / most) * TABLE_LEN)))];
  }
  context.putImageData(image, 0, 0);
  const caption = document.createElement('figcaption');
  caption.textContent = label;
  figure.append(canvas, caption);
  return figure;
}

export class HardCases {
  /** `tierFor(given)`: the listed tier that answers now, or its sibling that learnt what is given; or null. */
  constructor(atlas, hasContact, tierFor) {
    this.atlas = atlas;
    this.tierFor = tierFor;
    this.running = null;
    const list = CASES.filter(({ needsContact }) => hasContact || !needsContact);
    this.buttons = list.map((hardCase) => {
      const button = Object.assign(document.createElement('button'), { type: 'button', textContent: hardCase.name });
      button.setAttribute('aria-pressed', 'false');
      button.addEventListener('click', () => this.run(hardCase, button));
      return button;
    });
    byId('hard-cases').append(...this.buttons);
    this.fe = new HardCasesOfFe();
    put('tab-hard', `${list.length} to send`);
  }

  /** Shows the first case without being asked, so that there is something to see. */
  begin() {
    if (this.running === null) this.run(CASES[0], this.buttons[0]);
  }

  async run(hardCase, button) {
    for (const other of this.buttons) other.setAttribute('aria-pressed', String(other === button));
    const box = byId('hard-case');
    const mine = {};
    this.running = mine;
    this.fe.show(hardCase);
    box.dataset.state = 'sent';
    const tier = this.tierFor(hardCase.needsContact ? 'poses' : 'pressure');
    const mostPa = tier?.pressure_max_pa ?? NaN;
    const outcome = await sendCase(hardCase, this.atlas, mostPa, tier?.name ?? null);
    if (this.running === mine) this.#show(box, hardCase, outcome, mostPa);
  }

  #show(box, hardCase, outcome, mostPa) {
    const { answer, frame, isMap } = outcome;
    const verdict = verdictOf(outcome, mostPa);
    const pictures = document.createElement('div');
    pictures.className = 'pictures';
    const pressure = isMap ? frame : answer?.pressurePa;
    if (pressure) pictures.append(picture(pressure, 'viridis', isMap ? 'pressure sent' : 'pressure found', this.atlas.skin.raster.mask));
    if (answer?.sedJPerM3) pictures.append(picture(answer.sedJPerM3, 'inferno', 'SED answered', this.atlas.interface.raster.mask));
    const list = document.createElement('dl');
    const line = (name, text, kind = '') => {
      if (!text) return;
      const [dt, dd] = [document.createElement('dt'), document.createElement('dd')];
      dt.textContent = name;
      dd.textContent = text;
      dd.className = kind;
      list.append(dt, dd);
    };
    line('sent', hardCase.sent);
    line('came back', verdict.text, `verdict ${verdict.kind}`);
    line('', verdict.more);
    if (answer?.status === 'ok') {
      const peak = answer.sedJPerM3.reduce((a, b) => Math.max(a, b), 0);
      const finite = answer.sedJPerM3.every((x) => Number.isFinite(x) && x >= 0);
      line('SED', `up to ${digits(peak)} J/m³; ${finite ? 'every pixel finite and not below 0' : 'NOT finite everywhere'}`);
      if (answer.touch) line('force', `${Math.hypot(answer.touch[0], answer.touch[1], answer.touch[2]).toFixed(2)} N`);
      line('in', `${(answer.serverUs / 1000).toFixed(1)} ms`);
    }
    box.replaceChildren(pictures, list);
    put('tab-hard', TOLD[verdict.kind]);
    box.dataset.state = verdict.kind;
  }
}
