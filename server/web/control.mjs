// Mouse, touch, wheel, keyboard and sliders: where the indenter stands and how deep it goes.

const RAMP_MM_PER_S = 5;
const LIFT_MM_PER_S = 14;
const WHEEL_MM_PER_PX = 0.0008;
const KEY_DEPTH_MM = 0.1;
/** A thumb that goes so far to the side does not scroll. */
const SIDEWAYS_PX = 8;
const TURN_RAD_PER_PX = 0.008;
const TURN_RAD_PER_KEY = 0.12;
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

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
    this.inputs = { depth: byId('depth'), radius: byId('radius'), angle: byId('angle'), keep: byId('keep') };
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
    const changed = this.changed;
    this.changed = false;
    return changed;
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

  #listenToForm() {
    const { depth, radius, angle, keep } = this.inputs;
    const show = () => {
      byId('depth-out').textContent = `${Number(depth.value).toFixed(2)} mm`;
      byId('radius-out').textContent = `${Number(radius.value).toFixed(1)} mm`;
      byId('angle-out').textContent = `${angle.value}°`;
    };
    const reshape = () => {
      const shape = document.querySelector('input[name=shape]:checked').value;
      byId('radius-row').hidden = shape === 'plate';
      byId('angle-row').hidden = shape !== 'edge';
      this.press.setShape(shape, Number(radius.value), shape === 'edge' ? (Number(angle.value) * Math.PI) / 180 : 0);
      this.changed = true;
      show();
    };
    for (const input of document.querySelectorAll('input[name=shape]')) input.addEventListener('change', reshape);
    radius.addEventListener('input', reshape);
    angle.addEventListener('input', reshape);
    depth.addEventListener('input', () => {
      this.down = true;
      show();
    });
    keep.addEventListener('change', () => { this.down = keep.checked; });
    reshape();
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
      if (this.touching && !this.held && Math.abs(event.clientX - this.last.x) > SIDEWAYS_PX) this.#begin(canvas, event);
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
      if (presses) {
        this.press.moveToHit(this.hit);
        this.#begin(canvas, event);
      } else {
        canvas.setPointerCapture(event.pointerId);
        canvas.classList.add('turning');
        this.turning = true;
      }
    });
    canvas.addEventListener('pointermove', (event) => this.#fingerMove(canvas, event));
    for (const end of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(end, () => {
        if (this.held) this.#end();
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
