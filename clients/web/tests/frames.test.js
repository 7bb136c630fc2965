// Places of the world: what no case of the service reaches. The cases of proto/conformance-contact.json do the rest.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { DRAWN_TURN, JOINTS, feltInWorld, fingerOfJoints, placeOf, poseInFinger, vertexDrawn, vertexMm } from '../src/frames.js';

/** @typedef {import('../src/frames.js').PlaceInWorld} PlaceInWorld */
/** @type {[number, number, number, number]} */
const NO_TURN = [0, 0, 0, 1];
const HALF = Math.SQRT1_2;
/** @type {PlaceInWorld} */
const LEVEL = { at: [0, 1, 0], turn: NO_TURN };

/** @param {number[]} found @param {number[]} due */
const near = (found, due, tolerance = 1e-9) => due.forEach((value, k) => assert.ok(Math.abs(found[k] - value) <= tolerance, `${found}, not ${due}`));

test('a level finger and one turned to the right are what the manuals of WebXR say', () => {
  near(poseInFinger(LEVEL, { at: [0.002, 0.992, 0.01125], turn: NO_TURN }).at, [11.25, 2, -8]);
  /** @type {PlaceInWorld} */
  const right = { at: [0, 0, 0], turn: [0, -HALF, 0, HALF] };
  near(poseInFinger(right, { at: [0, 0, -0.01], turn: right.turn }).at, [0, -10, 0]);
});

test('all drawn twelve times as large is the same', () => {
  const pose = poseInFinger({ at: [0, 12, 0], turn: NO_TURN }, { at: [0.024, 11.904, 0.135], turn: NO_TURN }, { scale: 12 });
  near(pose.at, [11.25, 2, -8]);
  const touch = /** @type {any} */ ({ forceN: [0, 0, 1], torqueNMm: [0, 0, 0], centreMm: [10, 0, -6] });
  near(feltInWorld({ at: [0, 12, 0], turn: NO_TURN }, touch, { scale: 12 }).centre, [0, 12 - 0.072, 0.12]);
});

test('places of WebXR and of three.js are read, and joints named', () => {
  const position = { x: 1, y: 2, z: 3 };
  const turn = { x: 0, y: 0, z: 0, w: 1 };
  assert.deepEqual(placeOf({ position, orientation: turn }), placeOf({ position, quaternion: turn }));
  assert.throws(() => placeOf({ position }), /orientation/);
  assert.deepEqual(JOINTS.little, ['pinky-finger-phalanx-distal', 'pinky-finger-tip']);
});

test('what is no place is refused', () => {
  /** @type {[PlaceInWorld, RegExp][]} */
  const wrongs = [[{ at: [0, NaN, 0], turn: NO_TURN }, /not finite/], [{ at: [0, 0, 0], turn: [0, 0, 0, 0] }, /quaternion is zero/]];
  for (const [wrong, why] of wrongs) {
    assert.throws(() => poseInFinger(wrong, LEVEL), why);
    assert.throws(() => poseInFinger(LEVEL, wrong), why);
    assert.throws(() => fingerOfJoints(wrong, LEVEL), why);
    assert.throws(() => feltInWorld(wrong, /** @type {any} */ ({})), why);
  }
  assert.throws(() => poseInFinger(LEVEL, LEVEL, { scale: 0 }), /scale/);
  assert.throws(() => fingerOfJoints(LEVEL, LEVEL), /same place/);
  assert.throws(() => fingerOfJoints({ at: [0, 0.97, 0], turn: NO_TURN }, LEVEL), /along the finger/);
});

test('what is drawn is what is felt', () => {
  near(vertexMm(vertexDrawn([11.25, 2, -6.5])), [11.25, 2, -6.5]);
  near(poseInFinger({ at: [0, 0, 0], turn: NO_TURN }, { at: vertexDrawn([11.25, 2, -6.5]), turn: NO_TURN }).at, [11.25, 2, -6.5]);
  // A mesh in the finger's frame, turned by DRAWN_TURN, lies as its vertices do: x of the frame is back, z is up.
  const [x, y, z, w] = DRAWN_TURN;
  const back = [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)];
  const nail = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)];
  near([...back, ...nail], [0, 0, 1, 0, 1, 0]);
});
