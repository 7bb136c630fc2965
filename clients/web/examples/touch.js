// A ball that goes down on a finger, and what pushes back. Needs a browser or Node 22:
//
//     node clients/web/examples/touch.js [http://127.0.0.1:7224]

import { Hand } from '../papilla.js';

const base = globalThis.process?.argv[2] ?? 'http://127.0.0.1:7224';
const ball = { shape: { shape: 'sphere', radius_mm: 10 } };
const hand = await Hand.connect(base, { objects: [ball] });
for (let step = 0; step <= 10; step++) {
  // The pad's lowest point is at (11.25, 0, -6.53); a ball's origin is its centre.
  try {
    const { touch } = await hand.touch([{ at: [11.25, 0, -16.53 + 0.1 * step] }]);
    console.log(`${(0.1 * step).toFixed(1)} mm: ${touch.forceN[2].toFixed(3)} N on ${touch.areaMm2.toFixed(1)} mm2`);
  } catch (error) {
    // Lost, stale or refused: an actuator goes to zero, and the next frame is tried.
    console.log(`${(0.1 * step).toFixed(1)} mm: no force: ${error.message}`);
  }
}
hand.close();
