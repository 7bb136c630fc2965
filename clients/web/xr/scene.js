// Fingers that touch objects: where these are -> the server -> force, drawn, and SED, painted on the finger.

import {
  CanvasTexture, Color, DirectionalLight, HemisphereLight, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, PlaneGeometry, Scene, SRGBColorSpace, Vector3, WebGLRenderer,
} from 'three';
import { Atlas } from '../papilla.js';
import { BASE } from './base.js';
import { Finger, Scale } from './finger.js';
import { Hold } from './grab.js';
import { FINGERS, Hands, Pointer } from './hands.js';
import { Motors } from './motors.js';
import { makeObjects } from './objects.js';
import { Solved, Springs } from './touching.js';

/** The finger and what it touches are drawn twelve times as large as they are. */
const MM_TO_WORLD = 0.012;
const SHOWN_MM_TO_WORLD = 0.03;
const WORDS_MS = 200;
/** A line for each finger, and the legend below. */
const BOARD_PX = { width: 768, height: 240 };
/** As the page's own legend has them. */
const LEGEND = ['#d8a98f', '#280b54', '#65156e', '#9f2a63', '#d44842', '#f57d15', '#fac228', '#fcffa4'];
/** So far from the middle the outermost object reaches, in the world's units. */
const OBJECTS_HALF_WIDTH = 0.85;
/** One frame of a headset; `?tier=NAME&budget_us=N` in the address says otherwise. */
const BUDGET_US = 11000;

/** @returns {import('../src/types.js').Hello} */
function wish() {
  const asked = new URLSearchParams(location.search);
  const budgetUs = Number(asked.get('budget_us') ?? BUDGET_US);
  return { tier: asked.get('tier'), budget_us: budgetUs, effects: ['summary'], sample_type: 'u16', answer_sample_type: 'u8' };
}

const element = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));

/** Words in the world, for those who wear a headset. */
class Board {
  constructor() {
    this.canvas = document.createElement('canvas');
    this.canvas.width = BOARD_PX.width;
    this.canvas.height = BOARD_PX.height;
    this.texture = new CanvasTexture(this.canvas);
    this.texture.colorSpace = SRGBColorSpace;
    this.mesh = new Mesh(new PlaneGeometry(1.2, (1.2 * BOARD_PX.height) / BOARD_PX.width), new MeshBasicMaterial({ map: this.texture }));
    this.mesh.position.set(-0.95, 1.95, -1.5);
  }

  /** @param {string} text @param {string} most what the brightest colour stands for */
  write(text, most) {
    const context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext('2d'));
    context.fillStyle = '#20242a';
    context.fillRect(0, 0, BOARD_PX.width, BOARD_PX.height);
    context.fillStyle = '#e8e8e8';
    context.font = '26px system-ui, sans-serif';
    text.split('\n').forEach((line, n) => context.fillText(line, 12, 34 + 34 * n));
    const bar = context.createLinearGradient(12, 0, 312, 0);
    LEGEND.forEach((colour, n) => bar.addColorStop(n / (LEGEND.length - 1), colour));
    context.fillStyle = bar;
    context.fillRect(12, BOARD_PX.height - 40, 300, 24);
    context.fillStyle = '#e8e8e8';
    context.fillText(`0 to ${most} under the skin`, 326, BOARD_PX.height - 19);
    this.texture.needsUpdate = true;
  }
}

/** @param {WebGLRenderer} renderer */
async function offerVr(renderer) {
  const button = /** @type {HTMLButtonElement} */ (element('enter'));
  const { xr } = navigator;
  if (!xr || !(await xr.isSessionSupported('immersive-vr'))) return;
  button.hidden = false;
  button.onclick = async () => {
    const session = await xr.requestSession('immersive-vr', { optionalFeatures: ['local-floor', 'hand-tracking'] });
    button.hidden = true;
    session.addEventListener('end', () => { button.hidden = false; });
    await renderer.xr.setSession(session);
  };
}

/** @param {(aspect: number) => void} onResize */
function makeWorld(onResize) {
  const renderer = new WebGLRenderer({ antialias: true });
  renderer.xr.enabled = true;
  renderer.setPixelRatio(Math.min(2, devicePixelRatio));
  document.body.prepend(renderer.domElement);
  const camera = new PerspectiveCamera(50, 1, 0.05, 20);
  const scene = new Scene();
  scene.background = new Color(0x20242a);
  scene.add(new HemisphereLight(0xffffff, 0x556070, 2));
  const sun = new DirectionalLight(0xffffff, 2);
  sun.position.set(1, 3, 2);
  scene.add(sun);
  const table = new Mesh(new PlaneGeometry(2.4, 1).rotateX(-Math.PI / 2), new MeshLambertMaterial({ color: 0x4a4f58 }));
  table.position.set(0, 0.9, -0.75);
  scene.add(table);
  const resize = () => {
    camera.aspect = innerWidth / innerHeight;
    // Upright, the view is as wide as the objects and the finger stands higher.
    camera.fov = camera.aspect < 1 ? 62 : 50;
    const halfWidth = Math.tan((camera.fov * Math.PI) / 360) * camera.aspect;
    camera.position.set(0, 1.55, Math.max(0.75, OBJECTS_HALF_WIDTH / halfWidth - 0.75));
    camera.lookAt(0, camera.aspect < 1 ? 1.7 : 1.25, -0.9);
    camera.updateMatrixWorld();
    camera.updateProjectionMatrix();
    onResize(camera.aspect);
    renderer.setSize(innerWidth, innerHeight);
  };
  addEventListener('resize', resize);
  resize();
  return { renderer, camera, scene };
}

/** What a finger feels: the object, depth, force and greatest SED. @param {Finger} finger */
function inWords({ name, touched, deepestMm, forceN, sedMax, flags }) {
  const tail = flags && ` (${flags})`;
  return `${name}: ${touched?.name}, ${deepestMm.toFixed(1)} mm, ${forceN.toFixed(2)} N, ${sedMax.toFixed(0)} J/m3${tail}`;
}

async function start() {
  const atlas = await Atlas.load(BASE);
  const { methods } = await (await fetch(`${BASE}/v1/tiers`)).json();
  const isSolved = methods !== null;
  const scale = new Scale();
  const fingers = FINGERS.slice(0, isSolved ? FINGERS.length : 1).map((name) => new Finger(atlas, name, scale));
  const motors = new Motors(fingers.length);
  const [finger] = fingers;
  // The first finger, larger, its pad towards the viewer and its tip up.
  const shown = finger.picture();
  const { renderer, camera, scene } = makeWorld((aspect) => {
    shown.scale.setScalar(SHOWN_MM_TO_WORLD * (aspect < 1 ? 1.9 : 1));
    shown.position.set(0, aspect < 1 ? 2.9 : 1.95, -1.5);
  });
  const objects = makeObjects(MM_TO_WORLD);
  for (const { mesh } of objects) scene.add(mesh);
  scene.updateMatrixWorld(true);

  const meshes = fingers.map(({ mesh }) => mesh);
  for (const mesh of meshes) mesh.scale.setScalar(MM_TO_WORLD);
  shown.setRotationFromMatrix(new Matrix4().makeBasis(new Vector3(0, -1, 0), new Vector3(-1, 0, 0), new Vector3(0, 0, -1)));
  const board = new Board();
  scene.add(...meshes, shown, board.mesh);

  const hello = { ...wish(), atlas_hash: atlas.hash };
  const tell = (/** @type {string} */ words) => { element('state').textContent = `${words}; ${(isSolved ? Solved : Springs).words}`; };
  const touching = isSolved ? new Solved(fingers, objects, hello, tell, motors) : new Springs(fingers, hello, tell, motors);
  scene.userData.camera = camera;
  const state = { renderer, scene, finger, fingers, objects, motors, touching, frames: 0, isPresenting: false };

  const pointer = new Pointer(renderer.domElement, camera, objects);
  const hands = new Hands(renderer.xr, scene);
  const hold = new Hold(renderer.xr, objects);
  let [lastMs, wordsMs] = [0, 0];
  renderer.setAnimationLoop((nowMs) => {
    const seconds = Math.min(0.1, (nowMs - lastMs) / 1000);
    lastMs = nowMs;
    state.isPresenting = renderer.xr.isPresenting;
    // The page's own words say the same.
    board.mesh.visible = state.isPresenting;
    if (!state.isPresenting) pointer.move(meshes, seconds);
    else {
      hold.move();
      hands.move(meshes);
    }
    for (const one of fingers) if (one.mesh.visible) one.touch(objects);
    touching.step();
    for (const one of fingers) one.dent();
    motors.step(state.isPresenting ? hands.gamepad : null);
    if (nowMs - wordsMs > WORDS_MS) {
      wordsMs = nowMs;
      const lines = fingers.filter((one) => one.mesh.visible && one.touched).map(inWords);
      const text = lines.length ? lines.join('\n') : 'nothing touched';
      const most = `${scale.sed.toFixed(0)} J/m3`;
      element('figures').textContent = text;
      element('most').textContent = most;
      board.write(text, most);
    }
    renderer.render(scene, camera);
    state.frames++;
  });
  await offerVr(renderer);
  return state;
}

/** For those who look from outside, as the tests do. */
Object.assign(globalThis, { papillaXr: await start() });
