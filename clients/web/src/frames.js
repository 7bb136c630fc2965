// Places in a world of WebXR or three.js to poses in the finger's frame, and forces back
// (docs/reference/frames-and-units.md).
//
// The world is right-handed, metres: x right, y up, -z ahead. A finger's -z points to its tip, its y out of the
// nail; its origin is the foremost point of the skin. The finger's frame: x back along the finger, y right, z out
// of the nail, mm. So (x, y, z) of the frame are (z, x, y) of the world's axes, of a finger and of an object alike.

import { refusal } from './error.js';

/** @typedef {[number, number, number]} Three */
/** @typedef {[number, number, number, number]} Quaternion */
/** Where a body is in the world: metres, and a quaternion x y z w. @typedef {{at: Three, turn: Quaternion}} PlaceInWorld */
/** @typedef {import('./types.js').Pose} Pose */
/** @typedef {import('./types.js').Touch} Touch */

const MM_PER_M = 1000;
/** What turns a thing drawn in the finger's frame (as `Atlas.skin.positionsMm`) to the finger's axes in the world. @type {Readonly<Quaternion>} */
export const DRAWN_TURN = [-0.5, -0.5, -0.5, 0.5];

/** The joints of WebXR that `fingerOfJoints` wants, those of the distal phalanx and of the tip. */
export const JOINTS = /** @type {const} */ ({
  thumb: ['thumb-phalanx-distal', 'thumb-tip'],
  index: ['index-finger-phalanx-distal', 'index-finger-tip'],
  middle: ['middle-finger-phalanx-distal', 'middle-finger-tip'],
  ring: ['ring-finger-phalanx-distal', 'ring-finger-tip'],
  little: ['pinky-finger-phalanx-distal', 'pinky-finger-tip'],
});

/**
 * The place of an XRPose's or XRJointPose's `transform`, or of an Object3D of three.js that lies in the scene itself.
 * @param {{position: {x: number, y: number, z: number}, orientation?: {x: number, y: number, z: number, w: number}, quaternion?: {x: number, y: number, z: number, w: number}}} of
 * @returns {PlaceInWorld}
 */
export function placeOf({ position, orientation, quaternion }) {
  const turn = orientation ?? quaternion;
  if (!turn) throw refusal('bad_contact', 'a place has a position and an orientation (WebXR) or a quaternion (three.js)');
  return { at: [position.x, position.y, position.z], turn: [turn.x, turn.y, turn.z, turn.w] };
}

/** With a quaternion of length one. @param {string} what @param {PlaceInWorld} place @returns {PlaceInWorld} */
function checked(what, { at, turn }) {
  const size = Math.hypot(...turn);
  if (!Number.isFinite(at[0] + at[1] + at[2]) || !Number.isFinite(size)) {
    throw refusal('bad_contact', `${what}: a number is not finite; while the hand is not tracked call notTracked()`);
  }
  if (size < 1e-6) throw refusal('bad_contact', `${what}: the quaternion is zero; while the hand is not tracked call notTracked()`);
  const [x, y, z, w] = turn;
  return { at, turn: [x / size, y / size, z / size, w / size] };
}

/** @param {number} scale */
function checkScale(scale) {
  if (!(scale > 0 && scale < Infinity)) throw refusal('bad_contact', `scale says how many times as large as life all is drawn; it is ${scale}`);
}

/** @param {Three} a @param {Three} b @returns {Three} */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** @param {Three} a @param {Three} b */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Hamilton's product: turns by b, then by a. @param {Quaternion} a @param {Quaternion} b @returns {Quaternion} */
function times(a, b) {
  const [x, y, z, w] = a;
  const [p, q, r, s] = b;
  return [w * p + s * x + y * r - z * q, w * q + s * y + z * p - x * r, w * r + s * z + x * q - y * p, w * s - x * p - y * q - z * r];
}

/** @param {Quaternion} turn @returns {Quaternion} */
const inverse = ([x, y, z, w]) => [-x, -y, -z, w];

/** @param {Quaternion} turn of length one @param {Three} v @returns {Three} */
function turned([a, b, c, w], [x, y, z]) {
  const [p, q, r] = [2 * (b * z - c * y), 2 * (c * x - a * z), 2 * (a * y - b * x)];
  return [x + w * p + b * r - c * q, y + w * q + c * p - a * r, z + w * r + a * q - b * p];
}

/**
 * Where an object is in the finger's frame, for `Hand.touch`. Both places are of the same world.
 * @param {PlaceInWorld} finger
 * @param {PlaceInWorld} object
 * @param {{scale?: number}} [how] `scale`: how many times as large as life all is drawn
 * @returns {Pose}
 */
export function poseInFinger(finger, object, { scale = 1 } = {}) {
  checkScale(scale);
  const of = checked('finger', finger);
  const body = checked('object', object);
  const back = inverse(of.turn);
  const mm = MM_PER_M / scale;
  const [x, y, z] = turned(back, [body.at[0] - of.at[0], body.at[1] - of.at[1], body.at[2] - of.at[2]]);
  const [a, b, c, w] = times(back, body.turn);
  return { at: [mm * z, mm * x, mm * y], turn: [c, a, b, w] };
}

/**
 * The finger's place, of two joints of OpenXR or WebXR: that of the distal phalanx and the tip (`JOINTS`). It points from
 * the one to the other, its nail the way of the distal joint's y. The tip's joint is the frame's origin, or lies `insideMm`
 * behind it. Left and right hands are the same: the joints of both have the same axes, and the model's finger is symmetric.
 * @param {PlaceInWorld} distal
 * @param {PlaceInWorld} tip
 * @param {{insideMm?: number}} [how]
 * @returns {PlaceInWorld}
 */
export function fingerOfJoints(distal, tip, { insideMm = 0 } = {}) {
  const behind = checked('distal', distal);
  const ahead = checked('tip', tip);
  /** @type {Three} */
  const back = [behind.at[0] - ahead.at[0], behind.at[1] - ahead.at[1], behind.at[2] - ahead.at[2]];
  const length = Math.hypot(...back);
  if (!(length * MM_PER_M >= 1)) throw refusal('bad_contact', 'distal and tip are the same place');
  /** @type {Three} */
  const z = [back[0] / length, back[1] / length, back[2] / length];
  const up = turned(behind.turn, [0, 1, 0]);
  const along = dot(up, z);
  /** @type {Three} */
  const nail = [up[0] - along * z[0], up[1] - along * z[1], up[2] - along * z[2]];
  const size = Math.hypot(...nail);
  if (!(size >= 1e-3)) throw refusal('bad_contact', "the distal joint's y points along the finger");
  /** @type {Three} */
  const y = [nail[0] / size, nail[1] / size, nail[2] / size];
  const inside = insideMm / MM_PER_M;
  return {
    at: [ahead.at[0] - inside * z[0], ahead.at[1] - inside * z[1], ahead.at[2] - inside * z[2]],
    turn: ofColumns(cross(y, z), y, z),
  };
}

/** The quaternion of the rotation whose matrix has these columns. @param {Three} x @param {Three} y @param {Three} z @returns {Quaternion} */
function ofColumns(x, y, z) {
  const trace = x[0] + y[1] + z[2];
  /** @type {Quaternion} */
  let turn;
  if (trace > 0) turn = [y[2] - z[1], z[0] - x[2], x[1] - y[0], 1 + trace];
  else if (x[0] >= y[1] && x[0] >= z[2]) turn = [1 + x[0] - y[1] - z[2], x[1] + y[0], x[2] + z[0], y[2] - z[1]];
  else if (y[1] >= z[2]) turn = [x[1] + y[0], 1 - x[0] + y[1] - z[2], y[2] + z[1], z[0] - x[2]];
  else turn = [x[2] + z[0], y[2] + z[1], 1 - x[0] - y[1] + z[2], x[1] - y[0]];
  return checked('joints', { at: [0, 0, 0], turn }).turn;
}

/**
 * What pushes back on the finger, in the world; an object feels the opposite.
 * @param {PlaceInWorld} finger
 * @param {Touch} touch
 * @param {{scale?: number}} [how] as of `poseInFinger`
 * @returns {{forceN: Three, torqueNM: Three, centre: Three}} N; N m about the finger's origin; the pressure's centre, m
 */
export function feltInWorld(finger, touch, { scale = 1 } = {}) {
  checkScale(scale);
  const of = checked('finger', finger);
  const out = (/** @type {Three} */ [x, y, z], factor = 1) => turned(of.turn, [factor * y, factor * z, factor * x]);
  const [x, y, z] = out(touch.centreMm, scale / MM_PER_M);
  return { forceN: out(touch.forceN), torqueNM: out(touch.torqueNMm, 1e-3), centre: [of.at[0] + x, of.at[1] + y, of.at[2] + z] };
}

/** A vertex of an object's mesh, in its own axes in the world, m, for the `vertices_mm` of a hello; triangles stay as they are. @param {Three} point @returns {Three} */
export const vertexMm = ([x, y, z]) => [MM_PER_M * z, MM_PER_M * x, MM_PER_M * y];

/** A place of the finger's frame, as of the atlas, in the drawn finger's own axes, m. @param {Three} pointMm @returns {Three} */
export const vertexDrawn = ([x, y, z]) => [y / MM_PER_M, z / MM_PER_M, x / MM_PER_M];
