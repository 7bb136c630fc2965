// A finger: the atlas's skin as a mesh, dented where it touches, painted with the last map of SED, and what pushes back on it.

import {
  BufferAttribute, BufferGeometry, DataTexture, DoubleSide, LinearFilter, Matrix4, Mesh, RedFormat, ShaderMaterial, Vector3,
} from 'three';
import { Foundation, MAP_LEN, SIDE_PX } from '../papilla.js';
import { Arrow } from './arrow.js';

/** Deepest that an object may go; beyond it the finger is held back. */
const DEEPEST_MM = 1.8;
const STEPS_MOST = 4;
const GRADIENT_STEP_MM = 0.01;
/** The brightest colour is never of less than a light touch makes, J/m3. */
const LEAST_SED = 40;

/** Skin is drawn so much above what it touches, or both surfaces would show through each other. */
const LIFT_MM = 0.1;

/** What the brightest colour stands for, the same on all fingers. */
export class Scale {
  sed = LEAST_SED;
  /** @type {Map<Finger, number>} */ #now = new Map();

  /** Grows at once, shrinks slowly. @param {Finger} finger @param {number} sedMax of that finger now, J/m3 */
  follow(finger, sedMax) {
    this.#now.set(finger, sedMax);
    this.sed = Math.max(LEAST_SED, ...this.#now.values(), 0.99 * this.sed);
  }
}

const VERTEX = `
varying vec2 place;
varying vec3 facing;
void main() {
  place = uv;
  facing = normalize(normalMatrix * normal);
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;
const FRAGMENT = `
uniform sampler2D sed;
varying vec2 place;
varying vec3 facing;
// Polynomial fit of matplotlib's inferno (M. Zucker, CC0), in sRGB.
vec3 inferno(float t) {
  vec3 c = vec3(25.13112622, -12.24266895, -23.07032500);
  c = c * t + vec3(-71.31942824, 32.62606426, 73.20951986);
  c = c * t + vec3(77.16293570, -33.40235894, -81.80730926);
  c = c * t + vec3(-41.70399613, 17.43639888, 44.35414520);
  c = c * t + vec3(11.60249308, -3.97285397, -15.94239411);
  c = c * t + vec3(0.10651342, 0.56395644, 3.93271239);
  return c * t + vec3(0.00021894, 0.00165100, -0.01948090);
}
void main() {
  float value = texture2D(sed, place).r;
  vec3 skin = vec3(0.86, 0.66, 0.56);
  vec3 colour = mix(skin, inferno(0.15 + 0.85 * value), smoothstep(0.02, 0.12, value));
  float light = 0.55 + 0.45 * abs(normalize(facing).z);
  gl_FragColor = vec4(pow(clamp(colour * light, 0.0, 1.0), vec3(2.2)), 1.0);
  #include <colorspace_fragment>
}`;

export class Finger {
  /** @param {import('../papilla.js').Atlas} atlas @param {string} name @param {Scale} scale */
  constructor(atlas, name, scale) {
    this.name = name;
    this.scale = scale;
    this.atlas = atlas;
    this.foundation = new Foundation();
    this.restMm = atlas.skin.positionsMm;
    this.penetrationMm = new Float32Array(atlas.vertexCount);
    this.pressuresPa = new Float32Array(atlas.vertexCount);
    this.map = new Float32Array(MAP_LEN);
    /** What is touched, and how deep; null for nothing. @type {import('./objects.js').Touchable | null} */
    this.touched = null;
    this.deepestMm = 0;
    this.sedMax = 0;
    this.forceN = 0;
    this.flags = '';
    this.answers = 0;
    this.#gradient = new Vector3();
    this.#toObject = new Matrix4();
    this.#middle = new Vector3();

    this.geometry = new BufferGeometry();
    this.position = new BufferAttribute(Float32Array.from(this.restMm), 3);
    this.geometry.setAttribute('position', this.position);
    this.geometry.setAttribute('normal', new BufferAttribute(atlas.normals, 3));
    // SED is read where the interface lies under the vertex.
    this.geometry.setAttribute('uv', new BufferAttribute(atlas.interface.uvPx.map((px) => px / SIDE_PX), 2));
    this.geometry.setIndex(new BufferAttribute(atlas.triangles, 1));
    this.geometry.computeBoundingSphere();
    this.texture = new DataTexture(this.#bytes, SIDE_PX, SIDE_PX, RedFormat);
    this.texture.magFilter = this.texture.minFilter = LinearFilter;
    this.texture.needsUpdate = true;
    this.material = new ShaderMaterial({ uniforms: { sed: { value: this.texture } }, vertexShader: VERTEX, fragmentShader: FRAGMENT, side: DoubleSide });
    /** Where it is in the world. */
    this.mesh = this.picture();
    this.arrow = new Arrow();
    this.mesh.add(this.arrow);
  }

  #bytes = new Uint8Array(MAP_LEN);
  #gradient;
  #toObject;
  #middle;
  #point = new Vector3();

  /** Another picture of the same finger. */
  picture() {
    return new Mesh(this.geometry, this.material);
  }

  /**
   * Penetration of every vertex where the mesh stands now; if the finger is deeper in an object than skin gives way, the mesh is moved out.
   * @param {import('./objects.js').Touchable[]} objects
   */
  touch(objects) {
    const { mesh } = this;
    this.#measure(mesh, objects);
    for (let step = 0; this.touched && this.deepestMm > DEEPEST_MM && step < STEPS_MOST; step++) {
      // The way out is that of the deepest vertex; which one that is may change on the way.
      this.#way(this.touched, this.#point);
      const outMm = this.deepestMm - DEEPEST_MM;
      const scale = this.touched.mesh.scale.x;
      this.#gradient.transformDirection(this.touched.mesh.matrixWorld).multiplyScalar(outMm * scale);
      mesh.position.add(this.#gradient);
      mesh.updateMatrixWorld();
      this.#measure(mesh, objects);
    }
  }

  /** @param {Mesh} mesh @param {import('./objects.js').Touchable[]} objects */
  #measure(mesh, objects) {
    this.touched = null;
    this.deepestMm = 0;
    this.penetrationMm.fill(0);
    const sphere = /** @type {import('three').Sphere} */ (this.geometry.boundingSphere);
    for (const object of objects) {
      this.#toObject.copy(object.mesh.matrixWorld).invert().multiply(mesh.matrixWorld);
      this.#middle.copy(sphere.center).applyMatrix4(this.#toObject);
      if (this.#middle.length() > sphere.radius + object.reachMm) continue;
      const e = this.#toObject.elements;
      const p = this.restMm;
      for (let i = 0, k = 0; i < this.penetrationMm.length; i++, k += 3) {
        const x = e[0] * p[k] + e[4] * p[k + 1] + e[8] * p[k + 2] + e[12];
        const y = e[1] * p[k] + e[5] * p[k + 1] + e[9] * p[k + 2] + e[13];
        const z = e[2] * p[k] + e[6] * p[k + 1] + e[10] * p[k + 2] + e[14];
        const depth = -object.distanceMm(x, y, z);
        if (depth > this.penetrationMm[i]) this.penetrationMm[i] = depth;
        if (depth > this.deepestMm) {
          this.deepestMm = depth;
          this.touched = object;
          this.#point.set(x, y, z);
        }
      }
    }
  }

  /** Unit gradient of the distance at a point of the object's frame. @param {import('./objects.js').Touchable} object @param {Vector3} at */
  #way({ distanceMm }, at) {
    const h = GRADIENT_STEP_MM;
    this.#gradient.set(
      distanceMm(at.x + h, at.y, at.z) - distanceMm(at.x - h, at.y, at.z),
      distanceMm(at.x, at.y + h, at.z) - distanceMm(at.x, at.y - h, at.z),
      distanceMm(at.x, at.y, at.z + h) - distanceMm(at.x, at.y, at.z - h),
    ).normalize();
  }

  /** Pressure of springs where it touches, none above `mostPa`. @param {number} mostPa */
  press(mostPa) {
    this.foundation.pressures(this.penetrationMm, this.pressuresPa, this.touched?.objectPaPerMm, mostPa);
  }

  /** The map of that pressure. @param {number} mostPa */
  pressureMap(mostPa) {
    this.press(mostPa);
    return this.atlas.pressureMap(this.pressuresPa, this.map);
  }

  /** How far each vertex has moved, x y z, mm, as the server found it; null: it does not. @type {Float32Array | null} */
  movedMm = null;

  /** Draws the skin as it gives way: as the server found it, or by springs, whose share of the penetration pushes it back along its normal. */
  dent() {
    const { array } = this.position;
    if (this.movedMm) {
      const { movedMm } = this;
      for (let k = 0; k < array.length; k++) array[k] = this.restMm[k] + movedMm[k] + (k % 3 === 2 && movedMm[k] !== 0 ? LIFT_MM : 0);
      this.position.needsUpdate = true;
      return;
    }
    const { normals } = this.atlas;
    for (let i = 0, k = 0; i < this.penetrationMm.length; i++, k += 3) {
      const back = this.penetrationMm[i] * this.foundation.fingerShare;
      for (let axis = k; axis < k + 3; axis++) array[axis] = this.restMm[axis] - back * normals[axis];
    }
    this.position.needsUpdate = true;
  }

  /**
   * What an answer says: SED (J/m3), its greatest, the force, and where it pushes if that is known.
   * @param {Float32Array} sed @param {number} sedMax @param {number} forceN @param {import('../src/types.js').Touch | null} touch @param {string} flags
   */
  feel(sed, sedMax, forceN, touch, flags) {
    this.answers++;
    this.sedMax = sedMax;
    this.forceN = forceN;
    this.flags = flags;
    this.scale.follow(this, sedMax);
    this.#paint(sed, this.scale.sed);
    this.arrow.show(touch);
  }

  /** @param {Float32Array} sed @param {number} most J/m3 of the brightest colour */
  #paint(sed, most) {
    const data = this.#bytes;
    const scale = 255 / most;
    for (let i = 0; i < MAP_LEN; i++) data[i] = Math.min(255, sed[i] * scale);
    this.texture.needsUpdate = true;
  }
}
