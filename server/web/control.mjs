// Mouse, touch, wheel, keyboard and sliders: where the indenter stands and how deep it goes.

import { SHAPES } from './shapes.mjs';

const RAMP_MM_PER_S = 5;
const LIFT_MM_PER_S = 14;
const WHEEL_MM_PER_PX = 0.0008;
const KEY_DEPTH_MM = 0.1;
/** A thumb that goes so far to the side does not scroll. */
const SIDEWAYS_PX = 8;
const TURN_RAD_PER_PX = 0.008;
const TURN_RAD_PER_KEY = 0.12;
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** How far to either side an indenter slides, mm. */
const SLIDE_MM = 3;
const rad = (input) => (Number(input.value) * Math.PI) / 180;

const byId = (id) => document.getElementById(id);

/** Owns the depth: it follows the slider while the indenter is down and returns to 0 when it is lifted. */
export class PressControl {
  constructor(atlas, press, pad) {
    this.atlas = atlas;
    this.press = press;
    this.pad = pad;
    this.finger = null;
    /** Present depth, mm; moves towards its goal with finite speed. */
    this.depthMm = 0;
    this.held = false;
    this.touching = false;
    this.down = true;
    this.changed = true;
    this.lastMs = 0;
    this.turning = false;
    this.last = { x: 0, y: 0 };
    this.hit = { triangle: 0, weightB: 0, weightC: 0 };
    this.instant = matchMedia('(prefers-reduced-motion: reduce)');
    this.inputs = Object.fromEntries(['depth', 'size', 'angle', 'tilt', 'roll', 'slide', 'keep'].map((name) => [name, byId(name)]));
    /** Size of each shape as it was last chosen, mm. */
    this.sizes = Object.fromEntries(Object.entries(SHAPES).map(([name, { size }]) => [name, size?.[3] ?? 0]));
    /** The visitor's own mesh, if one was dropped. */
    this.mesh = undefined;
    /** What pressed before that mesh, until the service has taken the mesh; null: it has. */
    this.before = null;
    this.slidS = 0;
    this.#listShapes();
    this.#listenToForm();
    this.#listenToPad(pad.overlay);
    this.#centre();
  }

  /** Presses and turns on the 3-D view too. */
  attachFinger(view) {
    this.finger = view;
    this.#listenToFinger(view.canvas);
  }

  /** Moves the depth on; true when the press differs from the last call's. */
  step(nowMs) {
    const seconds = Math.min(0.1, (nowMs - this.lastMs) / 1000);
    this.lastMs = nowMs;
    const goal = this.held || this.down ? Number(this.inputs.depth.value) : 0;
    if (this.depthMm !== goal) {
      const speed = this.instant.matches ? Infinity : goal > this.depthMm ? RAMP_MM_PER_S : LIFT_MM_PER_S;
      const move = speed * seconds;
      this.depthMm = Math.abs(goal - this.depthMm) <= move ? goal : this.depthMm + Math.sign(goal - this.depthMm) * move;
      this.changed = true;
    }
    this.#slide(seconds);
    const changed = this.changed;
    this.changed = false;
    return changed;
  }

  /** To and fro at a constant speed, from the middle. */
  #slide(seconds) {
    const speed = Number(this.inputs.slide.value);
    if (speed === 0 && this.press.slidMm === 0) return;
    this.slidS = speed > 0 ? this.slidS + seconds * speed : 0;
    const along = this.slidS % (4 * SLIDE_MM);
    this.press.slideTo(along < SLIDE_MM ? along : along < 3 * SLIDE_MM ? 2 * SLIDE_MM - along : along - 4 * SLIDE_MM);
    this.changed = true;
  }

  #centre() {
    const { uvPx } = this.atlas.skin;
    let [u, v] = [0, 0];
    for (let i = 0; i < uvPx.length; i += 2) {
      u += uvPx[i];
      v += uvPx[i + 1];
    }
    this.press.moveToPixel((2 * u) / uvPx.length, (2 * v) / uvPx.length);
  }

  #listShapes() {
    byId('shapes').append(...Object.entries(SHAPES).map(([name, { label }]) => {
      const chip = document.createElement('label');
      const input = Object.assign(document.createElement('input'), { type: 'radio', name: 'shape', value: name, checked: name === this.press.shape });
      const text = document.createElement('span');
      text.textContent = label;
      chip.append(input, text);
      return chip;
    }));
  }

  get shape() {
    return document.querySelector('input[name=shape]:checked').value;
  }

  /** Writes what the sliders say, and gives the press its shape. */
  #reshape() {
    const { shape, inputs, sizes } = this;
    const { size, turns } = SHAPES[shape];
    byId('size-row').hidden = size === null;
    byId('angle-row').hidden = !turns;
    if (size && byId('size').dataset.shape !== shape) {
      inputs.size.dataset.shape = shape;
      [byId('size-name').textContent, inputs.size.min, inputs.size.max] = size;
      inputs.size.value = String(sizes[shape]);
    }
    if (size) sizes[shape] = Number(inputs.size.value);
    this.press.setShape(shape, sizes[shape], turns ? rad(inputs.angle) : 0, [rad(inputs.tilt), rad(inputs.roll)], this.mesh);
    this.changed = true;
    this.#write();
  }

  #write() {
    const { depth, size, angle, tilt, roll, slide } = this.inputs;
    byId('depth-out').textContent = `${Number(depth.value).toFixed(2)} mm`;
    byId('size-out').textContent = `${Number(size.value).toFixed(2)} mm`;
    byId('angle-out').textContent = `${angle.value}°`;
    byId('tilt-out').textContent = `${tilt.value}°`;
    byId('roll-out').textContent = `${roll.value}°`;
    byId('slide-out').textContent = Number(slide.value) > 0 ? `${slide.value} mm/s` : 'off';
  }

  /** Presses with the visitor's own mesh from now on. */
  takeMesh(mesh, sizeMm) {
    this.before ??= { shape: this.shape, mesh: this.mesh, sizeMm: this.sizes.mesh };
    this.#pressWith('mesh', mesh, sizeMm);
  }

  /** Presses again with what pressed before a mesh that the service refuses. */
  takeBack() {
    const { shape, mesh, sizeMm } = this.before;
    this.before = null;
    this.#pressWith(shape, mesh, sizeMm);
  }

  #pressWith(shape, mesh, sizeMm) {
    this.mesh = mesh;
    this.sizes.mesh = sizeMm;
    document.querySelector(`input[name=shape][value=${shape}]`).checked = true;
    delete this.inputs.size.dataset.shape;
    this.#reshape();
  }

  /** What stands in the form, for a link; and the form as a link has it. */
  get state() {
    const { depth, angle, tilt, roll, slide } = this.inputs;
    const [u, v] = this.press.uvPx;
    return { shape: this.shape, size: this.sizes[this.shape], depth: depth.value, angle: angle.value, tilt: tilt.value, roll: roll.value, slide: slide.value, u: u.toFixed(1), v: v.toFixed(1) };
  }

  set state(state) {
    const chip = state.shape in SHAPES ? document.querySelector(`input[name=shape][value=${state.shape}]`) : null;
    if (chip) {
      chip.checked = true;
      const size = Number(state.size);
      if (size > 0) this.sizes[state.shape] = size;
      delete this.inputs.size.dataset.shape;
    }
    for (const name of ['depth', 'angle', 'tilt', 'roll', 'slide']) {
      const value = Number(state[name] ?? NaN);
      if (Number.isFinite(value)) this.inputs[name].value = String(value);
    }
    const [u, v] = [Number(state.u ?? NaN), Number(state.v ?? NaN)];
    if (Number.isFinite(u) && Number.isFinite(v)) this.press.moveToPixel(u, v);
    this.#reshape();
  }

  #listenToForm() {
    const { depth, size, angle, tilt, roll, slide, keep } = this.inputs;
    for (const input of document.querySelectorAll('input[name=shape]')) input.addEventListener('change', () => this.#reshape());
    for (const input of [size, angle, tilt, roll]) input.addEventListener('input', () => this.#reshape());
    slide.addEventListener('input', () => this.#write());
    depth.addEventListener('input', () => {
      this.down = true;
      this.#write();
    });
    keep.addEventListener('change', () => { this.down = keep.checked; });
    this.#reshape();
  }

  #changeDepth(byMm) {
    const { depth } = this.inputs;
    depth.value = String(Number(depth.value) + byMm);
    byId('depth-out').textContent = `${Number(depth.value).toFixed(2)} mm`;
  }

  #begin(element, event) {
    element.setPointerCapture(event.pointerId);
    document.body.dataset.pressed = '';
    this.held = true;
    this.changed = true;
  }

  #end() {
    this.held = this.touching = false;
    this.down = this.inputs.keep.checked;
  }

  /** Whether a thumb that may scroll has gone to the side, and so presses. */
  #isSideways(event) {
    return this.touching && !this.held && Math.abs(event.clientX - this.last.x) > SIDEWAYS_PX;
  }

  #listenToPad(canvas) {
    const move = (event) => {
      const [u, v] = this.pad.pixelAt(event);
      if (this.press.moveToPixel(u, v)) this.changed = true;
    };
    canvas.addEventListener('pointerdown', (event) => {
      if (event.button !== 0 || document.body.dataset.mode !== 'press') return;
      // A thumb may be about to scroll: it presses once it moves to the side, or lifts where it was.
      if (event.pointerType === 'touch') {
        this.touching = true;
        this.last.x = event.clientX;
        return;
      }
      this.#begin(canvas, event);
      move(event);
    });
    canvas.addEventListener('pointermove', (event) => {
      if (this.#isSideways(event)) this.#begin(canvas, event);
      if (this.held) move(event);
    });
    canvas.addEventListener('pointerup', (event) => {
      if (this.touching && !this.held) {
        this.#begin(canvas, event);
        move(event);
      }
      this.#end();
    });
    canvas.addEventListener('pointercancel', () => this.#end());
    canvas.addEventListener('keydown', (event) => this.#padKey(event));
    this.#listenToWheel(canvas, (event) => this.#changeDepth(-event.deltaY * WHEEL_MM_PER_PX));
  }

  #padKey(event) {
    if (document.body.dataset.mode !== 'press') return;
    const step = event.shiftKey ? 8 : 2;
    if (event.key in KEYS) {
      const [u, v] = KEYS[event.key];
      const { uvPx } = this.press;
      if (this.press.moveToPixel(uvPx[0] + u * step, uvPx[1] + v * step)) this.changed = true;
    } else if (event.key === '+' || event.key === '=') {
      this.#changeDepth(KEY_DEPTH_MM);
    } else if (event.key === '-') {
      this.#changeDepth(-KEY_DEPTH_MM);
    } else if (event.key === ' ') {
      this.down = !this.down;
    } else if (event.key === 'Escape') {
      this.down = false;
    } else {
      return;
    }
    event.preventDefault();
  }

  /** The wheel scrolls the page unless the pointer presses, or the canvas was chosen before. */
  #listenToWheel(canvas, act) {
    canvas.addEventListener('wheel', (event) => {
      if (!this.held && document.activeElement !== canvas) return;
      event.preventDefault();
      act(event);
    }, { passive: false });
  }

  #listenToFinger(canvas) {
    canvas.addEventListener('pointerdown', (event) => {
      this.last.x = event.clientX;
      this.last.y = event.clientY;
      const presses = event.button === 0 && document.body.dataset.mode === 'press' && this.finger.pick(event, this.hit);
      if (presses && event.pointerType === 'touch') {
        // As on the map: a thumb may be about to scroll.
        this.touching = true;
      } else if (presses) {
        this.press.moveToHit(this.hit);
        this.#begin(canvas, event);
      } else {
        canvas.setPointerCapture(event.pointerId);
        canvas.classList.add('turning');
        this.turning = true;
      }
    });
    canvas.addEventListener('pointermove', (event) => this.#fingerMove(canvas, event));
    canvas.addEventListener('pointerup', (event) => {
      if (!this.touching || this.held || !this.finger.pick(event, this.hit)) return;
      this.#begin(canvas, event);
      this.press.moveToHit(this.hit);
    });
    for (const end of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(end, () => {
        if (this.held || this.touching) this.#end();
        this.turning = false;
        canvas.classList.remove('turning');
      });
    }
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('keydown', (event) => this.#fingerKey(event));
    this.#listenToWheel(canvas, (event) => {
      if (this.held) this.#changeDepth(-event.deltaY * WHEEL_MM_PER_PX);
      else this.finger.zoomBy(Math.exp(-event.deltaY * 0.001));
    });
  }

  #fingerMove(canvas, event) {
    if (this.#isSideways(event)) this.#begin(canvas, event);
    if (this.turning) {
      this.finger.orbit((event.clientX - this.last.x) * TURN_RAD_PER_PX, (event.clientY - this.last.y) * TURN_RAD_PER_PX);
      this.last.x = event.clientX;
      this.last.y = event.clientY;
    } else if (this.held) {
      if (this.finger.pick(event, this.hit)) {
        this.press.moveToHit(this.hit);
        this.changed = true;
      }
    } else {
      const over = document.body.dataset.mode === 'press' && this.finger.pick(event, this.hit);
      canvas.classList.toggle('turn', !over);
    }
  }

  #fingerKey(event) {
    if (event.key in KEYS) {
      const [x, y] = KEYS[event.key];
      this.finger.orbit(x * TURN_RAD_PER_KEY, y * TURN_RAD_PER_KEY);
    } else if (event.key === '+' || event.key === '=') {
      this.finger.zoomBy(1.15);
    } else if (event.key === '-') {
      this.finger.zoomBy(1 / 1.15);
    } else {
      return;
    }
    event.preventDefault();
  }
}
