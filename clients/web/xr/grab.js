// Objects that move: dragged over the table with the right mouse button, or held by a controller's trigger or a pinch.

import { Matrix4, Plane, Vector3 } from 'three';

/** @typedef {import('./objects.js').Touchable} Touchable */
/** @typedef {import('three').Object3D} Object3D */

/** An object can be held from so far outside of it, in the world's units. */
const MARGIN = 0.06;
/** The middle of an object stays within this part of the world. */
const ROOM = { least: new Vector3(-1.2, 0.94, -1.25), most: new Vector3(1.2, 1.7, -0.25) };
const UP = new Vector3(0, 1, 0);

/** @param {Touchable} object */
function keepInRoom({ mesh }) {
  mesh.position.clamp(ROOM.least, ROOM.most);
  mesh.updateMatrixWorld();
}

/** By the mouse: along the table, at the height where it was taken. */
export class Drag {
  /** @type {Touchable | null} */ #object = null;
  #plane = new Plane();
  #from = new Vector3();
  #to = new Vector3();
  #objects;

  /** @param {Touchable[]} objects */
  constructor(objects) {
    this.#objects = objects;
  }

  /** Takes what the ray meets first. @param {import('three').Raycaster} ray */
  begin(ray) {
    const [hit] = ray.intersectObjects(this.#objects.map(({ mesh }) => mesh));
    this.#object = this.#objects.find(({ mesh }) => mesh === hit?.object) ?? null;
    if (!hit) return;
    this.#plane.setFromNormalAndCoplanarPoint(UP, hit.point);
    this.#from.copy(hit.point);
  }

  /** @param {import('three').Raycaster} ray @returns {boolean} whether an object is dragged */
  move(ray) {
    if (!this.#object) return false;
    if (!ray.ray.intersectPlane(this.#plane, this.#to)) return true;
    this.#object.mesh.position.add(this.#to).sub(this.#from);
    this.#from.copy(this.#to);
    keepInRoom(this.#object);
    return true;
  }

  end() {
    this.#object = null;
  }
}

/** In VR: each controller, or each hand by its pinch, holds what it was near when it closed. */
export class Hold {
  /** What each way in holds, and where that is from it. @type {Map<number, {object: Touchable, from: Matrix4}>} */ #held = new Map();
  #at = new Vector3();
  #objects;
  #places;

  /** @param {import('three').WebXRManager} xr @param {Touchable[]} objects */
  constructor(xr, objects) {
    this.#objects = objects;
    this.#places = [0, 1].map((n) => () => {
      const tip = xr.getHand(n).joints['index-finger-tip'];
      return tip?.visible ? tip : xr.getController(n);
    });
    this.#places.forEach((place, n) => {
      const controller = xr.getController(n);
      controller.addEventListener('selectstart', () => this.#take(n, place()));
      controller.addEventListener('selectend', () => this.#held.delete(n));
      controller.addEventListener('disconnected', () => this.#held.delete(n));
    });
  }

  /** @param {number} n @param {Object3D} place */
  #take(n, place) {
    place.updateMatrixWorld();
    place.getWorldPosition(this.#at);
    const far = (/** @type {Touchable} */ { mesh, reachMm }) => mesh.position.distanceTo(this.#at) - reachMm * mesh.scale.x;
    const [object] = this.#objects.filter((one) => far(one) < MARGIN).sort((a, b) => far(a) - far(b));
    if (object) this.#held.set(n, { object, from: place.matrixWorld.clone().invert().multiply(object.mesh.matrixWorld) });
  }

  #moved = new Matrix4();

  /** Objects go where what holds them went. */
  move() {
    for (const [n, { object, from }] of this.#held) {
      const place = this.#places[n]();
      place.updateMatrixWorld();
      const { mesh } = object;
      this.#moved.multiplyMatrices(place.matrixWorld, from).decompose(mesh.position, mesh.quaternion, mesh.scale);
      keepInRoom(object);
    }
  }
}
