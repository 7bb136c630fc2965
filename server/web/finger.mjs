// The 3-D finger: the atlas's skin patch, painted with the SED beneath it and moved as the service found
// (without a contact model: flattened where the indenter stands), on a closed body with a nail; turned by
// dragging. Drawn only when something changed.

import { MAP_LEN, SIDE_PX } from './protocol.mjs';
import { TABLES, TABLE_LEN } from './colour.mjs';
import { computeNormals } from './atlas.mjs';
import { bodyMesh, followingOf, nailMesh } from './body.mjs';
import { fringeOf } from './mask.mjs';
import { arrowMesh, indenterMesh } from './indenter.mjs';
import { fit } from './sheet.mjs';
import { onTheme } from './theme.mjs';
import { ARROW_FRAGMENT, BODY_FRAGMENT, BODY_VERTEX, GLASS_FRAGMENT, GLASS_VERTEX, SKIN_FRAGMENT, SKIN_VERTEX, program, texture } from './gl.mjs';

const FIELD_OF_VIEW_RAD = 0.5;
const PITCH_LIMIT_RAD = 1.5;
/** The picture is centred so far behind the middle of the patch, since the finger goes on there. */
const TOWARDS_BASE_MM = 2;
// The glass stands this far off the skin: coplanar faces would flicker.
const GLASS_OFFSET_MM = 0.06;
const NAIL_GLOSS = 0.35;
const UNIT = { sed: 0, table: 1 };
/** A force's arrow: so long a newton, at most so long, and none below so much. */
const ARROW = { mmPerN: 12, mostMm: 30, leastN: 0.005 };
/** The texture holds 16-bit floats, which a filter can read everywhere; this is below their greatest. */
const TEXTURE_MAX = 60000;

export class FingerView {
  /** Throws where the browser has no WebGL2. */
  constructor(canvas, atlas) {
    this.canvas = canvas;
    this.atlas = atlas;
    // Without a graphics processor smooth edges cost more than they are worth.
    this.gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true, failIfMajorPerformanceCaveat: true })
      ?? canvas.getContext('webgl2', { antialias: false, preserveDrawingBuffer: true });
    if (!this.gl) throw new Error('this browser offers no WebGL2');
    this.positions = Float32Array.from(atlas.skin.positionsMm);
    this.normals = Float32Array.from(atlas.normals);
    this.sed = new Float32Array(MAP_LEN);
    this.sedMax = 1;
    this.decades = 0;
    this.floor = 0;
    this.press = null;
    /** Whether the skin is where the service found it. */
    this.isMoved = false;
    /** What pushes back; null: nothing is drawn. */
    this.force = null;
    this.forceText = document.getElementById('finger-force');
    this.yaw = 0.5;
    this.pitch = 0.35;
    this.zoom = 1.15;
    this.view = new Float32Array(16);
    this.projection = new Float32Array(16);
    this.model = new Float32Array(16);
    this.origin = new Float32Array(3);
    this.direction = new Float32Array(3);
    this.fringe = fringeOf(atlas.interface.raster.mask);
    this.dirty = true;
    this.bodyRest = bodyMesh(atlas);
    this.bodyNow = Float32Array.from(this.bodyRest);
    this.following = followingOf(atlas, this.bodyRest);
    this.#measure();
    this.#build();
    canvas.addEventListener('webglcontextlost', (event) => event.preventDefault());
    canvas.addEventListener('webglcontextrestored', () => this.#build());
    new ResizeObserver(() => { this.dirty = true; }).observe(canvas);
    onTheme(() => this.#readTheme());
  }

  /** Shows this map (J/m3) on a scale that ends at `max`; `decades` > 0 makes it logarithmic; below `floor` skin stays bare. */
  setSed(values, max, decades, floor) {
    const { gl, sed, fringe } = this;
    const { pixels } = this.atlas.interface.raster;
    for (let n = 0; n < pixels.length; n++) sed[pixels[n]] = Math.min(TEXTURE_MAX, values[pixels[n]]);
    for (let n = 0; n < fringe.length; n += 2) sed[fringe[n]] = sed[fringe[n + 1]];
    this.sedMax = max;
    this.decades = decades;
    this.floor = floor;
    gl.activeTexture(gl.TEXTURE0 + UNIT.sed);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, SIDE_PX, SIDE_PX, gl.RED, gl.FLOAT, sed);
    this.dirty = true;
  }

  /** Shows the indenter of `press`; null takes it away, and the skin goes back to rest. Skin that no service moves is flattened against it. */
  setPress(press) {
    const { positions, atlas } = this;
    const rest = atlas.skin.positionsMm;
    this.press = press;
    this.dirty = true;
    if (press) this.#updateIndenter(press);
    if (press && this.isMoved) return;
    this.isMoved = false;
    positions.set(rest);
    for (let i = 0; press && i < press.overlapMm.length; i++) {
      const w = press.overlapMm[i];
      if (w <= 0) continue;
      for (let k = 0; k < 3; k++) positions[3 * i + k] = rest[3 * i + k] - w * press.normal[k];
    }
    this.#moveSkin();
  }

  /** Moves the skin by what the service found, x y z a vertex, mm; null: it does not tell. Returns how far the farthest vertex moves. */
  setDisplacement(movedMm) {
    this.isMoved = movedMm !== null;
    if (!movedMm) return NaN;
    const { positions, atlas } = this;
    const rest = atlas.skin.positionsMm;
    let most = 0;
    for (let i = 0; i < positions.length; i += 3) {
      for (let k = 0; k < 3; k++) positions[i + k] = rest[i + k] + movedMm[i + k];
      most = Math.max(most, Math.hypot(movedMm[i], movedMm[i + 1], movedMm[i + 2]));
    }
    this.#moveSkin();
    return most;
  }

  #moveSkin() {
    const { positions, atlas, gl } = this;
    computeNormals(atlas.triangles, positions, this.normals);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.position);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, positions);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.normal);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.normals);
    this.#moveBody();
    this.dirty = true;
  }

  /** The closed rest of the finger follows the patch's edge, so that no seam opens there. */
  #moveBody() {
    const { gl, body, positions, bodyRest, bodyNow, following } = this;
    const rest = this.atlas.skin.positionsMm;
    for (let n = 0; n < following.vertex.length; n++) {
      const [at, weight] = [3 * following.vertex[n], following.weight[n]];
      for (let k = 0; k < 3; k++) bodyNow[6 * n + k] = bodyRest[6 * n + k] + weight * (positions[at + k] - rest[at + k]);
    }
    if (!body) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.body);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, bodyNow);
  }

  /** Draws what pushes back (a touch of contact.mjs) as an arrow with its number; null takes it away. */
  setForce(touch) {
    this.force = touch && touch.forceN > ARROW.leastN ? touch : null;
    this.forceText.textContent = touch ? `${touch.forceN.toFixed(2)} N` : '';
    this.dirty = true;
  }

  orbit(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-PITCH_LIMIT_RAD, Math.min(PITCH_LIMIT_RAD, this.pitch + pitch));
    this.dirty = true;
  }

  zoomBy(factor) {
    this.zoom = Math.max(0.6, Math.min(4, this.zoom * factor));
    this.dirty = true;
  }

  /** The point of the skin under a pointer event, into `hit`; false where it misses the finger. */
  pick(event, hit) {
    const box = this.canvas.getBoundingClientRect();
    const x = (2 * (event.clientX - box.left)) / box.width - 1;
    const y = 1 - (2 * (event.clientY - box.top)) / box.height;
    this.#aimCamera();
    const m = this.view;
    const dx = x / this.projection[0];
    const dy = y / this.projection[5];
    // The view matrix is a rotation R and a shift s: the eye is at -R^T s, a ray d comes from R^T d.
    for (let k = 0; k < 3; k++) {
      this.direction[k] = m[4 * k] * dx + m[4 * k + 1] * dy - m[4 * k + 2];
      this.origin[k] = -(m[4 * k] * m[12] + m[4 * k + 1] * m[13] + m[4 * k + 2] * m[14]);
    }
    return this.atlas.intersect(this.origin, this.direction, hit);
  }

  /** Draws if anything changed since the last call. */
  draw() {
    if (!this.dirty || this.gl.isContextLost()) return;
    const { gl, canvas } = this;
    if (fit(canvas) === 0) return;
    const { width, height } = canvas;
    this.dirty = false;
    this.#aimCamera();
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    this.#drawBody();
    this.#drawSkin();
    if (this.force) this.#drawForce();
    if (this.press) this.#drawIndenter();
  }

  #drawSkin() {
    const { gl, skin } = this;
    gl.useProgram(skin.handle);
    gl.uniformMatrix4fv(skin.uniforms.u_view, false, this.view);
    gl.uniformMatrix4fv(skin.uniforms.u_projection, false, this.projection);
    gl.uniform1f(skin.uniforms.u_max, this.sedMax);
    gl.uniform1f(skin.uniforms.u_decades, this.decades);
    gl.uniform1f(skin.uniforms.u_floor, this.floor);
    gl.uniform3fv(skin.uniforms.u_clay, this.clay);
    gl.bindVertexArray(this.skinArray);
    gl.drawElements(gl.TRIANGLES, this.atlas.triangles.length, gl.UNSIGNED_INT, 0);
  }

  #drawBody() {
    const { gl, body } = this;
    gl.useProgram(body.handle);
    gl.uniformMatrix4fv(body.uniforms.u_view, false, this.view);
    gl.uniformMatrix4fv(body.uniforms.u_projection, false, this.projection);
    for (const [tint, gloss, array, count] of [[this.clay, 0, this.bodyArray, this.bodyCount], [this.nailTint, NAIL_GLOSS, this.nailArray, this.nailCount]]) {
      gl.uniform3fv(body.uniforms.u_tint, tint);
      gl.uniform1f(body.uniforms.u_gloss, gloss);
      gl.bindVertexArray(array);
      gl.drawArrays(gl.TRIANGLES, 0, count);
    }
  }

  #drawForce() {
    const { gl, arrow, model } = this;
    const { force, forceN, centreMm } = this.force;
    const z = force.map((c) => c / forceN);
    const axis = Math.abs(z[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
    const x = perpendicular(axis, z);
    const lengthMm = Math.min(ARROW.mostMm, ARROW.mmPerN * forceN);
    for (let k = 0; k < 3; k++) {
      model[k] = x[k];
      model[4 + k] = z[(k + 1) % 3] * x[(k + 2) % 3] - z[(k + 2) % 3] * x[(k + 1) % 3];
      model[8 + k] = lengthMm * z[k];
      model[12 + k] = centreMm[k];
    }
    model[15] = 1;
    gl.useProgram(arrow.handle);
    gl.uniformMatrix4fv(arrow.uniforms.u_view, false, this.view);
    gl.uniformMatrix4fv(arrow.uniforms.u_projection, false, this.projection);
    gl.uniformMatrix4fv(arrow.uniforms.u_model, false, model);
    gl.uniform3fv(arrow.uniforms.u_tint, this.forceTint);
    gl.bindVertexArray(this.arrowArray);
    gl.drawArrays(gl.TRIANGLES, 0, this.arrowCount);
  }

  #drawIndenter() {
    const { gl, glass, press, model } = this;
    for (let k = 0; k < 3; k++) {
      model[k] = press.tangent[k];
      model[4 + k] = press.bitangent[k];
      model[8 + k] = press.normal[k];
      model[12 + k] = press.pointMm[k] + (press.heightMm + GLASS_OFFSET_MM) * press.normal[k];
    }
    model[15] = 1;
    gl.useProgram(glass.handle);
    gl.uniformMatrix4fv(glass.uniforms.u_view, false, this.view);
    gl.uniformMatrix4fv(glass.uniforms.u_projection, false, this.projection);
    gl.uniformMatrix4fv(glass.uniforms.u_model, false, model);
    gl.uniform3fv(glass.uniforms.u_tint, this.glassTint);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.bindVertexArray(this.glassArray);
    gl.drawArrays(gl.TRIANGLES, 0, this.glassCount);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  #updateIndenter(press) {
    if (press.body === this.glassBody) return;
    this.glassBody = press.body;
    const mesh = indenterMesh(press);
    this.glassCount = mesh.length / 6;
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.buffers.glass);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, mesh, this.gl.STATIC_DRAW);
  }

  /** Centre, a little towards the base, and radius of the patch, for the camera. */
  #measure() {
    const p = this.atlas.skin.positionsMm;
    this.centre = [0, 0, 0];
    for (let k = 0; k < 3; k++) {
      let [low, high] = [Infinity, -Infinity];
      for (let i = k; i < p.length; i += 3) {
        low = Math.min(low, p[i]);
        high = Math.max(high, p[i]);
      }
      this.centre[k] = (low + high) / 2;
    }
    this.centre[0] += TOWARDS_BASE_MM;
    this.radius = 0;
    for (let i = 0; i < p.length; i += 3) {
      const r = Math.hypot(p[i] - this.centre[0], p[i + 1] - this.centre[1], p[i + 2] - this.centre[2]);
      this.radius = Math.max(this.radius, r);
    }
  }

  /** Camera axes at rest: right = -y, up = -x (the tip), towards the eye = -z (the pad). */
  #aimCamera() {
    const cy = Math.cos(this.yaw);
    const sy = Math.sin(this.yaw);
    const cp = Math.cos(this.pitch);
    const sp = Math.sin(this.pitch);
    const { view, projection, centre } = this;
    // Column by column, as WebGL wants it.
    view[0] = 0;
    view[1] = -cp;
    view[2] = -sp;
    view[4] = -cy;
    view[5] = -sp * sy;
    view[6] = cp * sy;
    view[8] = -sy;
    view[9] = sp * cy;
    view[10] = -cp * cy;
    view[15] = 1;
    for (let row = 0; row < 3; row++) {
      view[12 + row] = -(view[row] * centre[0] + view[4 + row] * centre[1] + view[8 + row] * centre[2]);
    }
    const aspect = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight);
    const far = (1.08 * this.radius) / (Math.sin(FIELD_OF_VIEW_RAD / 2) * this.zoom * Math.min(1, aspect));
    view[14] -= far;
    const near = Math.max(1, far - 4 * this.radius);
    const back = far + 4 * this.radius;
    projection.fill(0);
    projection[5] = 1 / Math.tan(FIELD_OF_VIEW_RAD / 2);
    projection[0] = projection[5] / aspect;
    projection[10] = (back + near) / (near - back);
    projection[11] = -1;
    projection[14] = (2 * back * near) / (near - back);
  }

  #readTheme() {
    const style = getComputedStyle(this.canvas);
    const rgb = (name) => style.getPropertyValue(name).trim().split(/\s+/).map((x) => Number(x) / 255);
    this.clay = rgb('--clay');
    this.glassTint = rgb('--glass');
    this.forceTint = rgb('--force');
    this.nailTint = rgb('--nail');
    this.dirty = true;
  }

  #build() {
    const { gl, atlas } = this;
    this.skin = program(gl, SKIN_VERTEX, SKIN_FRAGMENT);
    this.body = program(gl, BODY_VERTEX, BODY_FRAGMENT);
    this.glass = program(gl, GLASS_VERTEX, GLASS_FRAGMENT);
    this.arrow = program(gl, GLASS_VERTEX, ARROW_FRAGMENT);
    this.buffers = {};
    const buffer = (name, data, usage) => {
      this.buffers[name] = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
      gl.bufferData(gl.ARRAY_BUFFER, data, usage);
    };
    const attribute = (location, size, stride = 0, offset = 0) => {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, stride, offset);
    };
    this.skinArray = gl.createVertexArray();
    gl.bindVertexArray(this.skinArray);
    buffer('position', this.positions, gl.DYNAMIC_DRAW);
    attribute(0, 3);
    buffer('normal', this.normals, gl.DYNAMIC_DRAW);
    attribute(1, 3);
    buffer('uv', atlas.interface.uvPx, gl.STATIC_DRAW);
    attribute(2, 2);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, atlas.triangles, gl.STATIC_DRAW);
    this.glassArray = gl.createVertexArray();
    gl.bindVertexArray(this.glassArray);
    buffer('glass', new Float32Array(6), gl.STATIC_DRAW);
    attribute(0, 3, 24);
    attribute(1, 3, 24, 12);
    this.glassBody = null;
    this.glassCount = 0;
    for (const [name, mesh] of [['body', this.bodyNow], ['nail', nailMesh()]]) {
      this[`${name}Count`] = mesh.length / 6;
      this[`${name}Array`] = gl.createVertexArray();
      gl.bindVertexArray(this[`${name}Array`]);
      buffer(name, mesh, name === 'body' ? gl.DYNAMIC_DRAW : gl.STATIC_DRAW);
      attribute(0, 3, 24);
      attribute(1, 3, 24, 12);
    }
    const arrow = arrowMesh();
    this.arrowCount = arrow.length / 6;
    this.arrowArray = gl.createVertexArray();
    gl.bindVertexArray(this.arrowArray);
    buffer('arrow', arrow, gl.STATIC_DRAW);
    attribute(0, 3, 24);
    attribute(1, 3, 24, 12);
    gl.bindVertexArray(null);
    texture(gl, UNIT.table, gl.RGBA, TABLE_LEN, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(TABLES.inferno.buffer), gl.LINEAR);
    texture(gl, UNIT.sed, gl.R16F, SIDE_PX, SIDE_PX, gl.RED, gl.FLOAT, this.sed, gl.LINEAR);
    gl.useProgram(this.skin.handle);
    gl.uniform1i(this.skin.uniforms.u_sed, UNIT.sed);
    gl.uniform1i(this.skin.uniforms.u_table, UNIT.table);
    this.#readTheme();
  }
}

/** Unit vector of `a` less its part along the unit vector `n`. */
function perpendicular(a, n) {
  const along = a[0] * n[0] + a[1] * n[1] + a[2] * n[2];
  const rest = a.map((c, k) => c - along * n[k]);
  const size = Math.hypot(...rest);
  return rest.map((c) => c / size);
}
