// Shaders of the 3-D finger and the little WebGL2 that goes with them.

/** Compiles and links; throws with the driver's own words. */
export function program(gl, vertexSource, fragmentSource) {
  const linked = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertexSource], [gl.FRAGMENT_SHADER, fragmentSource]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error(`shader: ${gl.getShaderInfoLog(shader)}`);
    }
    gl.attachShader(linked, shader);
  }
  gl.linkProgram(linked);
  if (!gl.getProgramParameter(linked, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`program: ${gl.getProgramInfoLog(linked)}`);
  }
  const uniforms = {};
  const count = gl.getProgramParameter(linked, gl.ACTIVE_UNIFORMS) ?? 0;
  for (let k = 0; k < count; k++) {
    const { name } = gl.getActiveUniform(linked, k);
    uniforms[name] = gl.getUniformLocation(linked, name);
  }
  return { handle: linked, uniforms };
}

/** A texture on its own unit, for good. */
export function texture(gl, unit, internalFormat, width, height, format, type, data, filter) {
  const made = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, internalFormat, width, height, 0, format, type, data);
  for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, which, filter);
  for (const which of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, which, gl.CLAMP_TO_EDGE);
  return made;
}

const CAMERA = `
uniform mat4 u_view;
uniform mat4 u_projection;
`;

// How skin and nail are lit, of their normal and the direction to the eye: what their colour is multiplied by, the gloss
// on it, and what of their colour is added at the rim.
const SHADE = `
vec3 shade(vec3 n, vec3 eye, float glossiness) {
  vec3 lamp = vec3(-0.35, 0.55, 0.75);
  float key = 0.5 + 0.5 * dot(n, normalize(lamp));
  float gloss = glossiness * pow(max(dot(n, normalize(eye + lamp)), 0.0), 30.0);
  return vec3(0.38 + 0.62 * key * key, gloss, 0.14 * pow(1.0 - abs(dot(n, eye)), 3.0));
}
`;

export const SKIN_VERTEX = `#version 300 es
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in vec2 a_uv;
${CAMERA}
out vec3 v_view;
out vec3 v_normal;
out vec2 v_uv;
void main() {
  vec4 p = u_view * vec4(a_position, 1.0);
  v_view = p.xyz;
  v_normal = mat3(u_view) * a_normal;
  v_uv = a_uv;
  gl_Position = u_projection * p;
}`;

// Skin without SED keeps the colour of clay, so that the shape stays visible.
export const SKIN_FRAGMENT = `#version 300 es
precision highp float;
uniform highp sampler2D u_sed;
uniform sampler2D u_table;
uniform float u_max;
uniform float u_decades;
uniform float u_floor;
uniform vec3 u_clay;
in vec3 v_view;
in vec3 v_normal;
in vec2 v_uv;
out vec4 colour;

${SHADE}
/** Where a value lies on the scale, 0 to 1. */
float place(float value) {
  float t = value / u_max;
  if (u_decades > 0.0) t = t > 0.0 ? 1.0 + log2(t) / (3.321928 * u_decades) : 0.0;
  return clamp(t, 0.0, 1.0);
}

void main() {
  float t = place(texture(u_sed, v_uv / 224.0).r);
  vec3 painted = texture(u_table, vec2((t * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  // From the floor on colours fade in, as on the maps.
  float paint = clamp((t - place(u_floor)) / 0.12, 0.0, 1.0);
  vec3 n = normalize(v_normal);
  vec3 eye = normalize(-v_view);
  // Seen from behind, as where the patch ends, it is skin as well.
  if (!gl_FrontFacing) n = -n;
  vec3 shaded = shade(n, eye, 0.10);
  // Painted skin is shaded less: its colour is a value to be read off the scale.
  vec3 lit = mix(u_clay * shaded.x, painted * (0.72 + 0.28 * shaded.x), paint);
  colour = vec4(lit + shaded.y + shaded.z * u_clay, 1.0);
}`;

// The rest of the finger, lit like the skin, and its nail, which shines.
export const BODY_VERTEX = `#version 300 es
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
${CAMERA}
out vec3 v_view;
out vec3 v_normal;
void main() {
  vec4 p = u_view * vec4(a_position, 1.0);
  v_view = p.xyz;
  v_normal = mat3(u_view) * a_normal;
  gl_Position = u_projection * p;
}`;

export const BODY_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 u_tint;
uniform float u_gloss;
in vec3 v_view;
in vec3 v_normal;
out vec4 colour;
${SHADE}
void main() {
  vec3 n = normalize(v_normal);
  vec3 eye = normalize(-v_view);
  if (dot(n, eye) < 0.0) n = -n;
  vec3 shaded = shade(n, eye, 0.10 + u_gloss);
  colour = vec4(u_tint * (shaded.x + shaded.z) + shaded.y, 1.0);
}`;

export const GLASS_VERTEX = `#version 300 es
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
${CAMERA}
uniform mat4 u_model;
out vec3 v_view;
out vec3 v_normal;
void main() {
  vec4 p = u_view * u_model * vec4(a_position, 1.0);
  v_view = p.xyz;
  v_normal = mat3(u_view) * mat3(u_model) * a_normal;
  gl_Position = u_projection * p;
}`;

export const ARROW_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 u_tint;
in vec3 v_view;
in vec3 v_normal;
out vec4 colour;
void main() {
  colour = vec4(u_tint * (0.55 + 0.45 * abs(dot(normalize(v_normal), normalize(v_view)))), 1.0);
}`;

export const GLASS_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 u_tint;
in vec3 v_view;
in vec3 v_normal;
out vec4 colour;
void main() {
  float across = 1.0 - abs(dot(normalize(v_normal), normalize(v_view)));
  float alpha = 0.09 + 0.5 * across * across * across;
  colour = vec4(u_tint * alpha, alpha);
}`;
