// A hand: five fingertips in one session of the web client's, each pressed where and while the visitor
// wants. All five go out together, and the next round begins when all have been answered.

import { Hand } from './hand.js';
import { poseOf } from './contact.mjs';
import { MapView } from './map.mjs';
import { Press } from './press.mjs';
import { Scale } from './scale.mjs';
import { keep, median } from './times.mjs';
import { flagsOf } from './words.mjs';

/** As one sees the palm of one's own right hand. `share`: of the slider's depth, so that they differ. */
const DIGITS = [
  { id: 'little', name: 'Little', share: 0.6 },
  { id: 'ring', name: 'Ring', share: 0.8 },
  { id: 'middle', name: 'Middle', share: 1 },
  { id: 'index', name: 'Index', share: 1 },
  { id: 'thumb', name: 'Thumb', share: 1 },
];
const RAMP_MM_PER_S = 5;
const LIFT_MM_PER_S = 14;
const KEY_PX = 4;
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** Other terms make another session, at most so often. */
const REOPEN_MS = 300;
const RETRY_MS = 1500;
const KEPT = 30;

const byId = (id) => document.getElementById(id);
const put = (element, text) => { if (element.textContent !== text) element.textContent = text; };

function element(tag, properties, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in made) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

/** One fingertip: its map, its press, and how deep that is. */
class Digit {
  constructor({ id, name, share }, number, atlas, scale) {
    this.id = id;
    this.number = number;
    this.share = share;
    this.press = new Press(atlas);
    this.press.moveToPixel(112, 105);
    this.depthMm = 0;
    this.forceN = 0;
    this.held = false;
    this.changed = true;
    this.pose = new Float32Array(7);
    this.pad = element('canvas', { className: 'pad', tabIndex: 0, role: 'application', 'aria-roledescription': 'press pad', 'data-part': 'overlay',
      'aria-label': `${name} fingertip, tip up. Drag to press. Arrow keys move the press, space presses or lifts.` });
    this.box = element('input', { type: 'checkbox', checked: true, autocomplete: 'off' });
    this.force = element('output', {});
    this.force.setAttribute('aria-live', 'off');
    this.flags = element('span', { className: 'flags', hidden: true, role: 'status' });
    const stack = element('div', { className: 'stack' },
      element('canvas', { width: 224, height: 224, 'aria-hidden': 'true', 'data-part': 'pixels' }), this.pad, this.flags, element('span', { className: 'probe', 'data-part': 'probe' }));
    this.figure = element('figure', { className: 'digit', 'data-digit': id }, stack,
      element('figcaption', {}, element('label', { className: 'check' }, this.box, name), this.force),
      element('span', { className: 'sr', 'data-part': 'peak' }));
    byId('palm').append(this.figure);
    this.view = new MapView(this.figure, scale);
    this.view.setPatch(atlas.interface.raster, atlas.mmPerPx);
    this.#listen();
  }

  #listen() {
    const { pad } = this;
    const move = (event) => { if (this.press.moveToPixel(...this.view.pixelAt(event))) this.changed = true; };
    pad.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      pad.setPointerCapture(event.pointerId);
      this.held = true;
      move(event);
    });
    pad.addEventListener('pointermove', (event) => { if (this.held) move(event); });
    for (const end of ['pointerup', 'pointercancel']) pad.addEventListener(end, () => { this.held = false; });
    pad.addEventListener('keydown', (event) => {
      if (event.key === ' ') {
        this.box.checked = !this.box.checked;
      } else if (event.key in KEYS) {
        const [u, v] = KEYS[event.key];
        const { uvPx } = this.press;
        if (this.press.moveToPixel(uvPx[0] + KEY_PX * u, uvPx[1] + KEY_PX * v)) this.changed = true;
      } else {
        return;
      }
      event.preventDefault();
    });
  }

  /** Goes on towards its depth; writes the pose. */
  step(seconds, depthMm) {
    const goal = this.held || this.box.checked ? this.share * depthMm : 0;
    if (this.depthMm !== goal) {
      const move = seconds * (goal > this.depthMm ? RAMP_MM_PER_S : LIFT_MM_PER_S);
      this.depthMm = Math.abs(goal - this.depthMm) <= move ? goal : this.depthMm + Math.sign(goal - this.depthMm) * move;
      this.changed = true;
    }
    if (!this.changed) return;
    this.press.evaluate(this.depthMm);
    this.view.setMarker(this.press.uvPx);
    poseOf(this.press, this.depthMm, this.pose);
  }

  show(answer, mostPa, nowMs) {
    this.forceN = Math.hypot(...answer.touch.forceN);
    put(this.force, `${this.forceN.toFixed(2)} N`);
    const words = flagsOf(answer, mostPa);
    this.flags.hidden = words.length === 0;
    put(this.flags, words.join('; '));
    this.view.show(answer.map, nowMs);
  }
}

export class HandView {
  /** `terms()`: tier and budget of the hello; `press`: whose shape all fingers meet; `told(ready)`, `notify(message)`, `refused(message, problem)`. */
  constructor(atlas, press, { terms, told, notify, refused, answered }) {
    this.press = press;
    this.terms = terms;
    this.told = told;
    this.notify = notify;
    this.refused = refused;
    this.answered = answered;
    this.scale = new Scale(byId('hand-scale'), { table: 'inferno', unit: 'J/m³', least: 1 });
    this.digits = DIGITS.map((digit, number) => new Digit(digit, number, atlas, this.scale));
    this.hand = null;
    this.isOn = false;
    this.opening = false;
    this.openAtMs = Infinity;
    /** What is announced: another body is another session. */
    this.body = null;
    this.aim = '';
    this.inFlight = false;
    this.rounds = [];
    this.serverMs = [];
    this.late = 0;
    /** Rounds that were answered. */
    this.count = 0;
    this.lastMs = 0;
  }

  /** Begins, or ends its session. */
  toggle(on) {
    this.isOn = on;
    if (on) this.reopen(0);
    else this.#close();
  }

  /** Other terms: a new session. */
  reopen(afterMs = REOPEN_MS) {
    if (this.isOn) this.openAtMs = performance.now() + afterMs;
  }

  #close() {
    this.hand?.close();
    this.hand = null;
    this.inFlight = false;
  }

  async #open() {
    this.openAtMs = Infinity;
    this.#close();
    this.opening = true;
    this.rounds = [];
    this.serverMs = [];
    this.late = 0;
    this.body = this.press.body;
    put(byId('hand-time'), 'connecting');
    const hello = { ...this.terms(), map: true, objects: [{ shape: this.body.hello }], fingers: this.digits.map(() => ({})) };
    try {
      const hand = await Hand.connect('', hello);
      if (this.isOn) this.hand = hand;
      else hand.close();
      this.told(hand.ready);
      for (const digit of this.digits) digit.changed = true;
    } catch (error) {
      this.refused(error.problem?.message ?? error.message, error.problem);
      this.reopen(RETRY_MS);
    }
    this.opening = false;
  }

  /** One display frame. `depthMm` is what the slider says; `stream`: send what has not changed, too. */
  step(nowMs, depthMm, stream) {
    const seconds = Math.min(0.1, (nowMs - this.lastMs) / 1000);
    this.lastMs = nowMs;
    this.#follow();
    for (const digit of this.digits) digit.step(seconds, depthMm);
    this.scale.fit(nowMs);
    if (nowMs >= this.openAtMs && !this.opening) this.#open();
    const isDue = stream || this.digits.some((digit) => digit.changed);
    if (this.hand?.ready && !this.inFlight && isDue && this.body === this.press.body) this.#round();
  }

  /** All fingers meet the shape that is chosen, turned and leaning as it is. */
  #follow() {
    const { shape, sizeMm, angleRad, tiltRad, body } = this.press;
    const aim = `${angleRad} ${tiltRad}`;
    if (body === this.followed && aim === this.aim) return;
    this.followed = body;
    this.aim = aim;
    for (const digit of this.digits) {
      digit.press.setShape(shape, sizeMm, angleRad, tiltRad);
      // A shape of one's own is made once.
      digit.press.body = body;
      digit.press.slideTo(0);
      digit.changed = true;
    }
    if (body !== this.body) this.reopen();
  }

  /** Sends all fingers; shows what came back when all have an outcome. */
  async #round() {
    const { hand, digits } = this;
    this.inFlight = true;
    const beganMs = performance.now();
    const sent = digits.map(({ pose, number }) => hand.touch([{ at: Array.from(pose.subarray(0, 3)), turn: Array.from(pose.subarray(3)) }], { finger: number }));
    for (const digit of digits) digit.changed = false;
    const outcomes = await Promise.allSettled(sent);
    if (this.hand !== hand) return;
    const nowMs = performance.now();
    this.inFlight = false;
    let last = null;
    outcomes.forEach(({ value, reason }, k) => {
      if (value) digits[k].show(value, hand.ready?.pressure_max_pa, nowMs);
      else if (reason.code === 'late') this.late++;
      else if (reason.code !== 'lost' && reason.code !== 'superseded') this.notify(reason.message);
      if (value) last = value;
    });
    if (!last) return;
    keep(this.rounds, nowMs - beganMs, KEPT);
    for (const { value } of outcomes) if (value) keep(this.serverMs, value.totalUs / 1000, KEPT);
    this.count++;
    this.#say();
    this.answered(digits.reduce((sum, digit) => sum + digit.forceN, 0), Math.max(...digits.map((digit) => digit.view.peak)), median(this.serverMs));
  }

  #say() {
    const force = this.digits.reduce((sum, digit) => sum + digit.forceN, 0);
    const late = this.late > 0 ? `; ${this.late} answers came too late for the budget` : '';
    put(byId('hand-time'), `five answers in ${median(this.rounds).toFixed(1)} ms, there and back; each ${median(this.serverMs).toFixed(1)} ms in the server; ${force.toFixed(2)} N in all${late}`);
  }
}
