// Papilla's client for browsers: sessions, fingers that touch, the atlas, pressure from penetration.

export { PapillaError } from './src/error.js';
export { postPressure } from './src/http.js';
export { Atlas } from './src/atlas.js';
export { Device, actuators, force, spikeRate, vibrate } from './src/devices.js';
export { Foundation } from './src/foundation.js';
export { DRAWN_TURN, JOINTS, feltInWorld, fingerOfJoints, placeOf, poseInFinger, vertexDrawn, vertexMm } from './src/frames.js';
export { Hand } from './src/hand.js';
export { Session } from './src/session.js';
export { Answer, ERROR_ESTIMATE, MAP_LEN, NotCarriedError, SIDE_PX, SUMMARY } from './src/wire.js';
