// The page: wires atlas, press, session, maps and figures together. One loop, driven by the display.

import { Atlas } from './atlas.mjs';
import { Contact, poseOf, readTouch } from './contact.mjs';
import { PressControl } from './control.mjs';
import { FingerView } from './finger.mjs';
import { LadderView, adviseTier, listTiers } from './ladder.mjs';
import { LOG_DECADES, MapView } from './map.mjs';
import { countDifferences } from './mask.mjs';
import { Meters } from './meters.mjs';
import { Press } from './press.mjs';
import { MAP_LEN, Session } from './protocol.mjs';
import { Replay, fetchJson } from './replay.mjs';
import { SpikeView } from './spikes.mjs';

const byId = (id) => document.getElementById(id);
/** A complaint stays at least this long, then until frames are answered again. */
const NOTICE_MS = 6000;
/** A frame is sent so often even if nothing changes, so that a silent server is noticed. */
const QUIET_MS = 1000;
const SED_UNIT = 'J/m³';

class Page {
  constructor(atlas, listing) {
    this.atlas = atlas;
    this.ladder = new LadderView(listing, (tier) => this.#switchTo(tier));
    this.mode = 'press';
    this.press = new Press(atlas);
    /** Null where the server has no contact model: pressure is then this page's estimate. */
    this.contact = listing.methods === null ? null : new Contact(this.press);
    document.body.toggleAttribute('data-contact', this.contact !== null);
    this.unsent = true;
    this.stream = byId('stream');
    this.log = false;
    this.sent = { mode: 'press', pressurePa: new Float32Array(MAP_LEN) };
    this.answered = { sequence: 0, tier: '', pressurePa: new Float32Array(MAP_LEN), sedJPerM3: new Float32Array(MAP_LEN) };
    this.meters = new Meters((tier, budgetMs) => adviseTier(listing.tiers, tier, budgetMs));
    this.replay = new Replay(atlas);
    this.spikes = new SpikeView();
    this.#makeViews();
    this.control = new PressControl(atlas, this.press, this.views.pressure);
    if (this.finger) this.control.attachFinger(this.finger);
    this.session = this.#makeSession();
    this.#listen();
    this.tick = (nowMs) => this.#frame(nowMs);
  }

  #makeViews() {
    const { atlas } = this;
    const view = (id, options) => new MapView(byId(id), options);
    this.views = {
      pressure: view('pressure', { table: 'viridis', unit: 'Pa', least: 1000 }),
      sed: view('sed', { table: 'inferno', unit: SED_UNIT, least: 1 }),
      truth: view('truth', { table: 'inferno', unit: SED_UNIT, least: 1 }),
      difference: view('difference', { table: 'diverging', unit: SED_UNIT, least: 1, signed: true }),
    };
    this.views.difference.options.like = this.views.sed;
    this.views.pressure.setPatch(atlas.skin.raster, atlas.mmPerPx);
    for (const name of ['sed', 'truth', 'difference']) this.views[name].setPatch(atlas.interface.raster, atlas.mmPerPx);
    try {
      this.finger = new FingerView(byId('finger'), atlas);
    } catch (error) {
      this.finger = null;
      byId('no-webgl').hidden = false;
      byId('no-webgl').textContent = `The 3-D finger cannot be drawn: ${error.message}. The maps work without it.`;
    }
  }

  #makeSession() {
    const url = new URL('v1/session', document.baseURI);
    url.protocol = url.protocol === 'https:' ? 'wss:' : 'ws:';
    return new Session(url.href, {
      onstate: (state, detail) => showState(state, detail),
      onready: (ready) => this.#ready(ready),
      onanswer: (answer, roundTripMs) => this.#answer(answer, roundTripMs),
      onfault: (code, message) => {
        this.meters.fault();
        notify(code === 'atlas_mismatch' ? `${message} Reload the page to fetch the server's atlas.` : message);
      },
    });
  }

  start() {
    this.#open();
    requestAnimationFrame(this.tick);
  }

  #open() {
    const budgetUs = Number(byId('budget').value);
    this.meters.restart(budgetUs / 1000);
    this.#hello(performance.now());
  }

  #hello(nowMs) {
    const announced = this.solves ? this.contact.hello(nowMs) : {};
    const budgetUs = Number(byId('budget').value);
    this.session.open({ tier: byId('tier').value || null, budget_us: budgetUs, atlas_hash: this.atlas.hash, effects: this.spikes.isOn ? ['spikes'] : [], ...announced });
  }

  /** Whether the server finds the pressure of this press. */
  get solves() {
    return this.contact !== null && this.mode === 'press';
  }

  #switchTo(tier) {
    byId('tier').value = tier;
    this.#open();
  }

  #ready(ready) {
    this.ladder.setReady(ready);
    this.spikes.setUnits(ready.units);
    this.control.changed = true;
    this.unsent = true;
    this.replay.forget();
    this.meters.ready(ready, this.ladder.medians(ready.tier));
    notify('');
  }

  #answer(answer, roundTripMs) {
    const nowMs = performance.now();
    this.meters.answer(answer, roundTripMs, nowMs);
    if (answer.status !== 'ok') {
      this.unsent = true;
      return;
    }
    if (nowMs - noticedAtMs > NOTICE_MS) notify('');
    this.#followTier(answer.tierNumber);
    showFlags(answer, this.session.ready?.pressure_max_pa);
    if (answer.touch) this.#showTouch(answer, nowMs);
    if (answer.spikes) this.spikes.show(answer.spikes, answer.timeMs);
    this.answered.sequence = answer.sequence;
    this.answered.tier = this.session.ready?.tier;
    this.answered.pressurePa.set(answer.pressurePa ?? this.sent.pressurePa);
    if (!equal(this.answered.sedJPerM3, answer.sedJPerM3)) {
      this.answered.sedJPerM3.set(answer.sedJPerM3);
      this.#showSed(nowMs);
    }
    if (this.sent.mode === 'replay' && this.mode === 'replay' && !this.replay.judged) this.#showErrors(nowMs);
  }

  /** What the server found for a pose. */
  #showTouch({ pressurePa, touch }, nowMs) {
    const found = readTouch(touch);
    this.views.pressure.show(pressurePa, nowMs);
    this.meters.press(found);
    this.finger?.setForce(found);
  }

  /** The budget may go on with another tier while the session lasts. */
  #followTier(number) {
    const { ready } = this.session;
    const tier = ready?.tier_names?.[number];
    if (!tier || tier === ready.tier) return;
    ready.tier = tier;
    this.ladder.setReady(ready);
    this.meters.ready(ready, this.ladder.medians(tier));
    this.replay.forget();
  }

  #showSed(nowMs) {
    this.views.sed.show(this.answered.sedJPerM3, nowMs);
    this.#paintFinger();
  }

  #paintFinger() {
    this.finger?.setSed(this.answered.sedJPerM3, this.views.sed.range.max, this.log ? LOG_DECADES : 0);
  }

  #showErrors(nowMs) {
    const { truth, difference, sed } = this.views;
    this.meters.errors(this.replay.judge(this.answered.sedJPerM3), this.replay.errors, this.replay.sent);
    truth.show(this.replay.truth, nowMs, sed.range);
    difference.show(this.replay.difference, nowMs);
  }

  /** One display frame: newest press, its map, and the map on its way if no answer is due. */
  #frame(nowMs) {
    requestAnimationFrame(this.tick);
    if (this.solves && this.session.ready && this.contact.isDue(nowMs)) this.#hello(nowMs);
    const map = this.session.mapFrame.values;
    const changed = this.mode === 'press' ? this.#stepPress(nowMs, map) : this.#stepReplay(nowMs, map);
    if (changed) {
      if (this.unsent && this.session.inFlight) this.meters.skip();
      this.unsent = true;
      if (!this.solves) this.views.pressure.show(map, nowMs);
    } else {
      this.views.pressure.settle(nowMs);
    }
    if (this.views.sed.settle(nowMs)) {
      this.#paintFinger();
      this.views.truth.show(this.replay.truth, nowMs, this.views.sed.range);
    }
    const ready = this.mode === 'press' || this.replay.loaded;
    const isQuiet = nowMs - this.session.sentAtMs > QUIET_MS;
    if (ready && (this.unsent || this.stream.checked || isQuiet)) this.#send(nowMs, map);
    this.finger?.draw();
    if (this.meters.refresh(nowMs, this.unsent || this.stream.checked, this.session.ready !== null)) {
      const judged = this.mode === 'replay' && this.replay.judged;
      this.ladder.showLive(this.meters.serverMs, judged ? this.meters.errorsNow?.relativeL2 ?? NaN : NaN);
    }
  }

  #send(nowMs, map) {
    // A pose is of the announced indenter.
    if (this.solves && this.contact.isOther) return;
    if (!this.session.send(nowMs, this.solves ? this.session.poseFrame : this.session.mapFrame)) return;
    this.unsent = false;
    this.sent.mode = this.mode;
    this.sent.pressurePa.set(map);
    if (this.mode === 'replay') this.replay.rememberTruth();
  }

  #stepPress(nowMs, map) {
    if (!this.control.step(nowMs)) return false;
    const { press, control } = this;
    press.evaluate(control.depthMm);
    this.views.pressure.setMarker(press.uvPx);
    this.finger?.setPress(press);
    if (this.solves) {
      poseOf(press, control.depthMm, this.session.poseFrame.values);
      return true;
    }
    this.atlas.skin.raster.rasterise(press.pressurePa, map);
    this.meters.press(press);
    return true;
  }

  #stepReplay(nowMs, map) {
    if (!this.replay.loaded || !this.replay.step(nowMs)) return false;
    this.replay.pressureInto(map);
    byId('replay-press').value = String(this.replay.chosen);
    return true;
  }

  #listen() {
    for (const input of document.querySelectorAll('input[name=mode]')) {
      input.addEventListener('change', () => this.#setMode(input.value));
    }
    byId('controls').addEventListener('submit', (event) => event.preventDefault());
    byId('tier').addEventListener('change', () => this.#open());
    byId('budget').addEventListener('change', () => this.#open());
    byId('spikes-on').addEventListener('change', () => {
      this.spikes.toggle(byId('spikes-on').checked);
      this.#open();
    });
    byId('log').addEventListener('change', () => {
      this.log = byId('log').checked;
      for (const name of ['sed', 'truth']) this.views[name].setLogarithmic(this.log, performance.now());
      this.#showSed(performance.now());
    });
    byId('replay-press').addEventListener('change', () => {
      this.#play(false);
      this.replay.choose(Number(byId('replay-press').value));
    });
    byId('replay-play').addEventListener('click', () => this.#play(!this.replay.playing));
  }

  #setMode(mode) {
    this.mode = mode;
    document.body.dataset.mode = mode;
    this.control.changed = true;
    this.replay.changed = true;
    this.replay.judged = false;
    // Replayed are maps, whatever a press is.
    if (this.contact) this.#open();
    if (mode === 'replay') {
      this.views.pressure.setMarker(null);
      this.finger?.setPress(null);
      this.finger?.setForce(null);
      if (!this.replay.loaded) this.#loadPresses();
    }
  }

  async #loadPresses() {
    try {
      await this.replay.load();
      const { presses } = this.replay;
      byId('replay-press').replaceChildren(...presses.map((press, n) => new Option(press.name, String(n))));
      this.meters.listPresses(presses.map((press) => press.name));
      if (presses.length === 0) {
        throw new Error('this server has no FE states to replay: fe-datagen dataset replay DATASET --out MODELS makes its replay.json');
      }
    } catch (error) {
      notify(error.message);
    }
  }

  #play(on) {
    this.replay.playing = on;
    byId('replay-play').setAttribute('aria-pressed', String(on));
    byId('replay-play').textContent = on ? 'Pause' : 'Play';
  }
}

/** A press that does not move is answered alike again and again: no reason to draw it again. */
function equal(a, b) {
  for (let i = 0; i < a.length; i++) if (a[i] !== b[i]) return false;
  return true;
}

function showState(state, detail) {
  const words = { connecting: 'connecting', ready: 'connected', waiting: 'disconnected', refused: 'refused' };
  byId('state').dataset.state = state;
  byId('state-text').textContent = detail ? `${words[state]}: ${detail}` : words[state];
}

/** What a network says that has not learnt such a press. */
function showFlags({ outOfRange, unfamiliar, unsettled, cutOff }, mostPa) {
  const words = [];
  if (outOfRange) words.push(`harder than any press it learnt: it saw ${(mostPa / 1000).toFixed(0)} kPa at most`);
  if (unfamiliar) words.push('unlike any press it learnt: this may mean nothing');
  if (unsettled) words.push('the contact did not settle: rough');
  if (cutOff) words.push('cut off at the edge of the map');
  const text = words.join('; ');
  if (byId('flags').textContent === text) return;
  byId('flags').textContent = text;
  byId('flags').hidden = text === '';
}

let noticedAtMs = Infinity;

function notify(message) {
  noticedAtMs = message === '' ? Infinity : performance.now();
  byId('notice').textContent = message;
  byId('notice').hidden = message === '';
}

/** Says on the page whether this raster equals the server's own mask, pixel by pixel. */
async function checkMasks(atlas) {
  const words = [];
  for (const patch of ['skin', 'interface']) {
    const response = await fetch(`v1/atlas/mask.png?patch=${patch}`);
    if (!response.ok) throw new Error(`v1/atlas/mask.png: HTTP ${response.status}`);
    const image = await createImageBitmap(await response.blob(), { colorSpaceConversion: 'none' });
    const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
    context.drawImage(image, 0, 0);
    const differing = countDifferences(atlas[patch].raster.mask, context.getImageData(0, 0, image.width, image.height).data);
    if (differing > 0) words.push(`${differing} pixels of the ${patch} mask differ from the server's`);
  }
  byId('mask-check').textContent = words.length ? words.join(', ') : '(masks equal the server’s)';
  byId('mask-check').classList.toggle('bad', words.length > 0);
}

document.body.dataset.mode = 'press';
document.querySelector('input[name=mode][value=press]').checked = true;
try {
  const atlas = new Atlas(await fetchJson('v1/atlas'));
  byId('atlas-hash').textContent = atlas.hash.slice(0, 12);
  const page = new Page(atlas, await listTiers());
  page.start();
  // For the console and the tests: the last answered pair of maps and what the page holds.
  globalThis.papilla = page;
  await checkMasks(atlas);
} catch (error) {
  showState('waiting', '');
  byId('state').dataset.state = 'failed';
  byId('state-text').textContent = 'not working';
  notify(`${error.message}. Reload the page to try again.`);
  throw error;
}
