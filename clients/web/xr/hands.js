// What moves the fingers: a tracked hand or a controller in VR, the mouse (or a touch) otherwise.

import { SPACING } from './objects.js';
import { Drag } from './grab.js';
import { Plane, Quaternion, Raycaster, Vector2, Vector3 } from 'three';
import { DRAWN_TURN, JOINTS, fingerOfJoints } from '../papilla.js';

/** @typedef {import('three').Mesh} Mesh */
/** @typedef {import('three').Object3D | undefined} Joint */

/** Where the pad is in the finger's frame, mm: the point that a hand or the mouse moves. */
const PAD_MM = new Vector3(9, 0, -6.4);
const HOVER_MM = 5;
const LOWER_MM_PER_S = 12;
const DRAWN = new Quaternion(...DRAWN_TURN);
/** With the mouse the finger comes down a little steeply. */
const TILT = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), 0.35);

/** Fingers by number, as a tracked hand names their tips. */
export const FINGERS = /** @type {const} */ (['index', 'middle', 'ring', 'little', 'thumb']);
/** With the mouse or a controller there are so many, spread so that each meets an object of its own. */
const SPREAD_COUNT = 2;

/** Where the table is: beside it the finger stays at its edge, and never behind what it is shown on. */
const TABLE = { near: new Vector3(-1.2, 0.9, -1.25), far: new Vector3(1.2, 0.9, -0.25) };

/** At first the finger hovers over the object in the middle. */
const ABOVE = new Vector3(0, 2, -0.75);
const DOWN = new Vector3(0, -1, 0);

/** Puts the pad of the mesh to a place of the world. @param {Mesh} mesh @param {Vector3} place @param {Quaternion} turn */
function place(mesh, place, turn) {
  mesh.quaternion.copy(turn).multiply(DRAWN);
  mesh.position.copy(PAD_MM).multiply(mesh.scale).applyQuaternion(mesh.quaternion).negate().add(place);
  mesh.updateMatrixWorld();
}

const BESIDE = new Vector3();

/** Puts the first finger to a place and the second beside it; the others are not there. @param {Mesh[]} meshes @param {Vector3} at @param {Quaternion} turn */
function spread(meshes, at, turn) {
  meshes.forEach((mesh, n) => {
    mesh.visible = n < SPREAD_COUNT;
    if (mesh.visible) place(mesh, BESIDE.set(n * SPACING, 0, 0).add(at), turn);
  });
}
/** The mouse points at a place of an object or the table; pressed, the finger comes down there. Its right button drags objects. */
export class Pointer {
  /** @param {HTMLCanvasElement} canvas @param {import('three').Camera} camera @param {import('./objects.js').Touchable[]} objects */
  constructor(canvas, camera, objects) {
    this.camera = camera;
    this.meshes = objects.map(({ mesh }) => mesh);
    this.depthMm = 1.2;
    this.#drag = new Drag(objects);
    this.#listen(canvas);
  }

  #ray = new Raycaster();
  /** Where the pointer is; null before it has moved. @type {Vector2 | null} */
  #at = null;
  /** The place that it points at, and where the pad is over it. */
  #aim = new Vector3(0, 0.9, -0.75);
  #place = new Vector3();
  #table = new Plane(new Vector3(0, 1, 0), -0.9);
  #drag;
  #isPressed = false;
  #heightMm = HOVER_MM;

  /** @param {HTMLCanvasElement} canvas */
  #listen(canvas) {
    const move = (/** @type {PointerEvent} */ event) => (this.#at ??= new Vector2()).set((2 * event.clientX) / canvas.clientWidth - 1, 1 - (2 * event.clientY) / canvas.clientHeight);
    canvas.addEventListener('pointermove', move);
    canvas.addEventListener('pointerdown', (event) => {
      move(event);
      canvas.setPointerCapture(event.pointerId);
      this.#isPressed = event.button === 0;
      if (event.button === 2) this.#drag.begin(this.#aimed());
    });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, () => { this.#isPressed = false; this.#drag.end(); });
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.depthMm = Math.min(1.8, Math.max(0.2, this.depthMm - event.deltaY * 0.001));
    }, { passive: false });
  }

  #aimed() {
    if (this.#at) this.#ray.setFromCamera(this.#at, this.camera);
    else this.#ray.set(ABOVE, DOWN);
    return this.#ray;
  }

  /** @param {Mesh[]} meshes of the fingers @param {number} seconds since the last call */
  move(meshes, seconds) {
    this.#drag.move(this.#aimed());
    const [hit] = this.#ray.intersectObjects(this.meshes);
    if (hit) this.#aim.copy(hit.point);
    else this.#ray.ray.intersectPlane(this.#table, this.#aim)?.clamp(TABLE.near, TABLE.far);
    const goal = this.#isPressed ? -this.depthMm : HOVER_MM;
    const step = LOWER_MM_PER_S * seconds;
    this.#heightMm += Math.min(step, Math.max(-step, goal - this.#heightMm));
    this.#place.copy(this.#aim);
    this.#place.y += this.#heightMm * meshes[0].scale.x;
    spread(meshes, this.#place, TILT);
  }
}

/** The first hand whose index finger is tracked, or else the first controller. */
export class Hands {
  /** @param {import('three').WebXRManager} xr @param {import('three').Object3D} scene */
  constructor(xr, scene) {
    this.hands = [1, 0].map((n) => xr.getHand(n));
    this.controllers = [1, 0].map((n) => xr.getController(n));
    for (const one of [...this.hands, ...this.controllers]) scene.add(one);
    for (const one of this.controllers) {
      one.addEventListener('connected', ({ data }) => this.#gamepads.set(one, data.gamepad ?? null));
      one.addEventListener('disconnected', () => this.#gamepads.delete(one));
    }
  }

  /** @type {Map<import('three').Object3D, Gamepad | null>} */ #gamepads = new Map();

  /** That of the controller that moves the fingers; null: it has none, or a hand moves them. */
  get gamepad() {
    const controller = this.controllers.find((one) => one.visible);
    return (controller && this.#gamepads.get(controller)) ?? null;
  }

  #place = new Vector3();
  #turn = new Quaternion();

  #index = new Vector3();

  /** Meshes of what is not tracked are hidden. @param {Mesh[]} meshes */
  move(meshes) {
    const hand = this.hands.find(({ joints }) => joints[JOINTS[FINGERS[0]][1]]?.visible);
    const controller = this.controllers.find((one) => one.visible);
    if (hand) {
      meshes.forEach((mesh, n) => {
        const [distal, tip] = JOINTS[FINGERS[n]];
        this.#follow(mesh, hand.joints[distal], hand.joints[tip], n);
      });
    } else if (controller) {
      this.#look(controller);
      spread(meshes, this.#place, this.#turn);
    } else {
      for (const mesh of meshes) mesh.visible = false;
    }
  }

  /** @param {import('three').Object3D} one */
  #look(one) {
    one.updateMatrixWorld();
    one.getWorldPosition(this.#place);
    one.getWorldQuaternion(this.#turn);
  }

  /** @param {import('three').Object3D} one @returns {import('../src/frames.js').PlaceInWorld} */
  #worldPlace(one) {
    this.#look(one);
    return { at: this.#place.toArray(), turn: this.#turn.toArray() };
  }

  /** The index finger is where its tip is; the others are as far from it as a hand as large as the finger has them. @param {Mesh} mesh @param {Joint} distal @param {Joint} tip @param {number} n */
  #follow(mesh, distal, tip, n) {
    mesh.visible = Boolean(distal?.visible && tip?.visible);
    if (!distal || !tip || !mesh.visible) return;
    const { at, turn } = fingerOfJoints(this.#worldPlace(distal), this.#worldPlace(tip));
    this.#place.fromArray(at);
    this.#turn.fromArray(turn);
    if (n === 0) this.#index.copy(this.#place);
    else this.#place.sub(this.#index).multiplyScalar(1000 * mesh.scale.x).add(this.#index);
    place(mesh, this.#place, this.#turn);
  }
}
