// A finger that touches objects: penetration -> pressure (elastic foundation) -> the server -> SED, painted on the finger.

import {
  CanvasTexture, Color, DirectionalLight, HemisphereLight, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, PlaneGeometry, Scene, SRGBColorSpace, Vector3, WebGLRenderer,
} from 'three';
import { Atlas, SUMMARY, Session } from '../papilla.js';
import { Finger } from './finger.js';
import { Hands, Pointer } from './hands.js';
import { makeObjects } from './objects.js';

/** The finger and what it touches are drawn twelve times as large as they are. */
const MM_TO_WORLD = 0.012;
const SHOWN_MM_TO_WORLD = 0.03;
const WORDS_MS = 200;
/** So far from the middle the outermost object reaches, in the world's units. */
const OBJECTS_HALF_WIDTH = 0.85;
/** So many late maps in a row, and the budget is doubled. */
const LATE_MOST = 30;
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
    this.canvas.width = 512;
    this.canvas.height = 96;
    this.texture = new CanvasTexture(this.canvas);
    this.texture.colorSpace = SRGBColorSpace;
    this.mesh = new Mesh(new PlaneGeometry(0.8, 0.15), new MeshBasicMaterial({ map: this.texture }));
    this.mesh.position.set(0, 1.08, -1.4);
  }

  /** @param {string} text */
  write(text) {
    const context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext('2d'));
    context.fillStyle = '#20242a';
    context.fillRect(0, 0, 512, 96);
    context.fillStyle = '#e8e8e8';
    context.font = '26px system-ui, sans-serif';
    text.split('; ').forEach((line, n) => context.fillText(line, 12, 38 + 36 * n));
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

async function start() {
  const atlas = await Atlas.load();
  const finger = new Finger(atlas);
  // The same finger, larger, its pad towards the viewer and its tip up.
  const shown = finger.mesh();
  const { renderer, camera, scene } = makeWorld((aspect) => {
    shown.scale.setScalar(SHOWN_MM_TO_WORLD * (aspect < 1 ? 1.9 : 1));
    shown.position.set(0, aspect < 1 ? 3.05 : 1.95, -1.5);
  });
  const objects = makeObjects(MM_TO_WORLD);
  for (const { mesh } of objects) scene.add(mesh);
  scene.updateMatrixWorld(true);

  const mesh = finger.mesh();
  mesh.scale.setScalar(MM_TO_WORLD);
  shown.setRotationFromMatrix(new Matrix4().makeBasis(new Vector3(0, -1, 0), new Vector3(-1, 0, 0), new Vector3(0, 0, -1)));
  const board = new Board();
  scene.add(mesh, shown, board.mesh);

  let hello = wish();
  let late = 0;
  const session = new Session('', hello);
  scene.userData.camera = camera;
  const state = { renderer, scene, finger, mesh, objects, session, sedMax: 0, forceN: 0, flags: '', answers: 0, frames: 0, isPresenting: false };
  session.onstate = (now, why) => { element('state').textContent = why ? `${now}: ${why}` : now; };
  session.onready = (ready) => { element('state').textContent = `ready: ${ready.tier}, some ${(ready.predicted_latency_us / 1000).toFixed(1)} ms a map`; };
  session.onanswer = (answer) => {
    late = answer.status === 'late' ? late + 1 : answer.status === 'ok' ? 0 : late;
    if (late >= LATE_MOST && session.ready) {
      late = 0;
      hello = { ...hello, budget_us: 2 * (hello.budget_us ?? BUDGET_US) };
      session.renew(hello);
    }
    if (answer.status !== 'ok' || !answer.summary) return;
    state.answers++;
    state.flags = [answer.outOfRange && 'harder than learnt', answer.unfamiliar && 'unlike anything learnt', answer.cutOff && 'cut off at the edge'].filter(Boolean).join(', ');
    state.sedMax = answer.summary[SUMMARY.indexOf('sed_max_j_per_m3')];
    state.forceN = answer.summary[SUMMARY.indexOf('force_n')];
    // Grows at once, shrinks slowly, and never below what a light touch makes.
    finger.greatestSed = Math.max(40, state.sedMax, 0.99 * finger.greatestSed);
    finger.paint(answer.map, finger.greatestSed);
  };
  session.open();

  const pointer = new Pointer(renderer.domElement, camera, objects);
  const hands = new Hands(renderer.xr, scene);
  let [lastMs, wordsMs] = [0, 0];
  renderer.setAnimationLoop((nowMs) => {
    const seconds = Math.min(0.1, (nowMs - lastMs) / 1000);
    lastMs = nowMs;
    state.isPresenting = renderer.xr.isPresenting;
    // The page's own words say the same.
    board.mesh.visible = state.isPresenting;
    mesh.visible = true;
    if (!state.isPresenting) pointer.move(mesh, seconds);
    else mesh.visible = hands.move(mesh);
    if (mesh.visible) finger.touch(mesh, objects);
    if (session.ready) session.send(finger.pressureMap(Infinity));
    finger.dent();
    if (nowMs - wordsMs > WORDS_MS) {
      wordsMs = nowMs;
      const what = finger.touched ? `${finger.touched.name}, ${finger.deepestMm.toFixed(1)} mm` : 'nothing touched';
      const flags = state.flags && `; ${state.flags}`;
      const text = `${what}; ${state.forceN.toFixed(2)} N, SED up to ${state.sedMax.toFixed(0)} J/m3${flags}`;
      element('figures').textContent = text;
      board.write(text);
    }
    renderer.render(scene, camera);
    state.frames++;
  });
  await offerVr(renderer);
  return state;
}

/** For those who look from outside, as the tests do. */
Object.assign(globalThis, { papillaXr: await start() });
