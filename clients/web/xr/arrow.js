// A force as an arrow, seen through what it pushes on.

import { ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, Vector3 } from 'three';

/** So long a newton, at most so long, and none below so much; of that length the head takes a share. */
const LENGTH = { mmPerN: 25, mostMm: 40, leastN: 0.005, head: 0.4 };
const SHAFT_MM = 0.5;
const HEAD_MM = 1.4;
const ALONG = new Vector3(0, 1, 0);

export class Arrow extends Group {
  constructor() {
    super();
    // Drawn last and over all: finger and object would hide it.
    const material = new MeshBasicMaterial({ color: 0x35c6da, depthTest: false, transparent: true });
    const shaft = 1 - LENGTH.head;
    const parts = [
      new CylinderGeometry(SHAFT_MM, SHAFT_MM, shaft, 16).translate(0, 0.5 * shaft - 1, 0),
      new ConeGeometry(HEAD_MM, LENGTH.head, 16).translate(0, -0.5 * LENGTH.head, 0),
    ];
    for (const geometry of parts) {
      const mesh = new Mesh(geometry, material);
      mesh.renderOrder = 1;
      this.add(mesh);
    }
    this.visible = false;
  }

  #direction = new Vector3();

  /** Ends where the pressure's centre is, on the side that the force comes from; null: no force. @param {import('../src/types.js').Touch | null} touch */
  show(touch) {
    const forceN = touch ? Math.hypot(...touch.forceN) : 0;
    this.visible = forceN > LENGTH.leastN;
    if (!touch || !this.visible) return;
    this.position.fromArray(touch.centreMm);
    this.quaternion.setFromUnitVectors(ALONG, this.#direction.fromArray(touch.forceN).normalize());
    this.scale.set(1, Math.min(LENGTH.mostMm, LENGTH.mmPerN * forceN), 1);
  }
}
