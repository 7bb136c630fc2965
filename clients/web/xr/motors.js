// The motor of the controller that moves the fingers: as strong as the greatest force on one of them.

import { Device, force, vibrate } from '../papilla.js';

/** The motor is full from this force on, N. */
const FULL_N = 1;

export class Motors {
  /** @param {number} fingers */
  constructor(fingers) {
    this.device = new Device(force(FULL_N), { fingers });
    /** The last amplitude that a motor got. */
    this.amplitude = 0;
  }

  /** @param {import('../src/devices.js').Felt} answer */
  feed(answer) {
    this.device.feed(answer);
  }

  /** Each frame of the scene, whether answers come or not. @param {Gamepad | null} gamepad */
  step(gamepad) {
    const command = this.device.poll();
    if (command && vibrate(gamepad, command)) this.amplitude = command.amplitude;
  }
}
