// What fingers feel: by the server's contact solve, or, without a contact model there, by springs in this page.

import { Quaternion } from 'three';
import { DRAWN_TURN, Hand, MAP_LEN, poseInFinger, Session, SUMMARY } from '../papilla.js';
import { BASE } from './base.js';

/**
 * @typedef {import('./finger.js').Finger} Finger
 * @typedef {import('./objects.js').Touchable} Touchable
 * @typedef {import('../src/types.js').Hello} Hello
 */

const MM_PER_M = 1000;
/** From the axes of the drawn mesh, those of the finger's frame, to the finger's in the world. */
const UNDRAWN = new Quaternion(...DRAWN_TURN).invert();
/** So many late maps in a row, and the budget is doubled. */
const LATE_MOST = 30;
/** What becomes of a frame that was not refused. */
const MISSED = ['superseded', 'stale', 'late', 'lost'];

/** The flags of an answer in words. @param {{outOfRange: boolean, unfamiliar?: boolean, unsettled?: boolean, cutOff?: boolean}} answer */
const inWords = ({ outOfRange, unfamiliar, unsettled, cutOff }) => [
  outOfRange && 'harder than learnt', unfamiliar && 'unlike anything learnt', unsettled && 'not settled', cutOff && 'cut off at the edge',
].filter(Boolean).join(', ');

/** One finger, its pressure by springs. */
export class Springs {
  static words = 'pressure of springs, one finger: the server has no contact model (--contact)';
  #late = 0;
  #finger;

  /** @param {Finger[]} fingers @param {Hello} hello @param {(words: string) => void} onstate @param {import('./motors.js').Motors} motors */
  constructor([finger], hello, onstate, motors) {
    this.#finger = finger;
    this.session = new Session(BASE, hello);
    this.session.onstate = (now, why) => onstate(why ? `${now}: ${why}` : now);
    this.session.onready = (ready) => onstate(`ready: ${ready.tier}, some ${(ready.predicted_latency_us / 1000).toFixed(1)} ms a map`);
    this.session.onanswer = (answer) => {
      this.#late = answer.status === 'late' ? this.#late + 1 : answer.status === 'ok' ? 0 : this.#late;
      if (this.#late >= LATE_MOST && this.session.ready) {
        this.#late = 0;
        hello = { ...hello, budget_us: 2 * (hello.budget_us ?? 0) };
        this.session.renew(hello);
      }
      motors.feed(answer);
      if (answer.status !== 'ok' || !answer.summary) return;
      const of = (/** @type {typeof SUMMARY[number]} */ name) => /** @type {Float32Array} */ (answer.summary)[SUMMARY.indexOf(name)];
      finger.feel(answer.map, of('sed_max_j_per_m3'), of('force_n'), null, inWords(answer));
    };
    this.session.open();
  }

  /** Sends what touches the finger now. */
  step() {
    if (this.session.ready) this.session.send(this.#finger.pressureMap(Infinity));
  }
}

/** Several fingers, each with the contact that the server finds for the objects as they lie. */
export class Solved {
  static words = 'contact solved by the server';
  /** @type {Hand | null} */ session = null;
  #fingers;
  #objects;
  #motors;
  #busy;
  #isTracked;
  #onstate;
  /** @type {import('../src/types.js').Ready | null} */ #told = null;
  #map = new Float32Array(MAP_LEN);
  #turn = new Quaternion();

  /** @param {Finger[]} fingers @param {Touchable[]} objects @param {Hello} hello @param {(words: string) => void} onstate @param {import('./motors.js').Motors} motors */
  constructor(fingers, objects, { tier, atlas_hash }, onstate, motors) {
    this.#motors = motors;
    this.#fingers = fingers;
    this.#objects = objects;
    this.#busy = fingers.map(() => false);
    this.#isTracked = fingers.map(() => false);
    Hand.connect(BASE, {
      tier,
      atlas_hash,
      objects: objects.map(({ shape, objectPaPerMm }) => (
        objectPaPerMm === Infinity ? { shape } : { shape, stiffness_mpa_per_mm: 1e-6 * objectPaPerMm }
      )),
      fingers: fingers.map(() => ({})),
      answer_layout: 'vertices',
      displacement: true,
      map: true,
    }).then((hand) => { this.session = hand; }, (error) => onstate(`refused: ${error.message}`));
    this.#onstate = onstate;
  }

  /** Says when the connection comes and goes. @param {import('../src/types.js').Ready | null} ready */
  #tell(ready) {
    if (ready === this.#told) return;
    this.#told = ready;
    this.#onstate(ready ? `ready: ${ready.tier}, some ${(ready.predicted_latency_us / 1000).toFixed(1)} ms a finger` : 'connection lost; trying again');
  }

  /** Sends where the objects are, of every finger that is shown. */
  step() {
    const hand = this.session;
    if (hand) this.#tell(hand.ready);
    if (!hand?.ready) return;
    this.#fingers.forEach((finger, number) => {
      if (!finger.mesh.visible) {
        // The hand has left the cameras' view: told once, so that nothing bursts when it comes back.
        if (!this.#isTracked[number] || this.#busy[number]) return;
        this.#isTracked[number] = false;
        hand.notTracked({ finger: number }).then((answer) => this.#motors.feed(answer), () => {});
        return;
      }
      this.#isTracked[number] = true;
      if (this.#busy[number]) return;
      this.#busy[number] = true;
      hand.touch(this.#objects.map((object) => this.#poseOf(object, finger)), { finger: number })
        .then((answer) => {
          this.#motors.feed(answer);
          this.#feel(finger, answer);
        }, ({ code, message }) => {
          // Such a frame is followed by the next.
          if (!MISSED.includes(code)) this.#onstate(`refused: ${message}`);
        })
        .finally(() => { this.#busy[number] = false; });
    });
  }

  /** @param {Finger} finger @param {import('../src/hand.js').HandAnswer} answer */
  #feel(finger, { touch, vertices, displacementMm, outOfRange, unsettled }) {
    finger.movedMm = displacementMm;
    const values = /** @type {Float32Array} */ (vertices);
    finger.atlas.interface.raster.rasterise(values, this.#map);
    finger.feel(this.#map, values.reduce((a, b) => Math.max(a, b), 0), Math.hypot(...touch.forceN), touch, inWords({ outOfRange, unsettled }));
  }

  /** An object in the finger's frame; both are drawn at one scale. @param {Touchable} object @param {Finger} finger @returns {import('../src/types.js').Pose} */
  #poseOf({ mesh }, finger) {
    const { position, quaternion, scale } = finger.mesh;
    const turn = this.#turn.copy(quaternion).multiply(UNDRAWN).toArray();
    const object = { at: mesh.position.toArray(), turn: mesh.quaternion.toArray() };
    return poseInFinger({ at: position.toArray(), turn }, object, { scale: MM_PER_M * scale.x });
  }
}
