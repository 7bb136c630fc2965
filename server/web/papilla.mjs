// The page: wires atlas, press, sessions, maps and figures together. One loop, driven by the display.

import { Atlas } from './atlas.mjs';
import { Comparison, relativeL2 } from './compare.mjs';
import { Contact, poseOf, readTouch } from './contact.mjs';
import { PressControl } from './control.mjs';
import { rms } from './colour.mjs';
import { EffectSwitches } from './effects.mjs';
import { FingerView } from './finger.mjs';
import { HandView } from './fingers.mjs';
import { HardCases } from './hard.mjs';
import { LadderView, adviseTier, listTiers, offerTiers } from './ladder.mjs';
import { MapView } from './map.mjs';
import { countDifferences } from './mask.mjs';
import { meshOf } from './mesh.mjs';
import { Meters } from './meters.mjs';
import { Press } from './press.mjs';
import { MAP_LEN, SIDE_PX, Session, sessionUrl } from './protocol.mjs';
import { Replay, fetchJson } from './replay.mjs';
import { LOG_DECADES, Scale } from './scale.mjs';
import { hashOf, npyOf, pictureOf, pythonOf, save, stateOf } from './share.mjs';
import { SpikeView } from './spikes.mjs';
import { SureBar } from './sure.mjs';
import { themeButton } from './theme.mjs';
import { choosable, defaultFor, suits, tierAfter, tierFor } from './tiers.mjs';
import { Timeline } from './timeline.mjs';
import { flagsOf, nameOfMethod, nameOfTier, notLearnt } from './words.mjs';

const byId = (id) => document.getElementById(id);
/** A complaint stays at least this long, then until frames are answered again. */
const NOTICE_MS = 6000;
/** A frame is sent so often even if nothing changes, so that a silent server is noticed. */
const QUIET_MS = 1000;
const SED_UNIT = 'J/m³';
/** A dropped file whose size could be a finger's keeps it. */
const PLAUSIBLE_MM = { least: 3, most: 30 };
/** What the second answer is without, if the first has it: it is asked of the pressure, or of the pose, alone. */
const LACKS = { shear_energy: 'without shear', relaxation: 'without creep' };
/** What the friction of the switch is, where none was chosen. */
const FRICTION = 0.5;
/** What a link says where the budget chooses the model; one that says nothing leads to the service's default. */
const BY_BUDGET = 'by-budget';

class Page {
  constructor(atlas, listing, effects) {
    this.atlas = atlas;
    this.listing = listing;
    this.mode = 'press';
    this.press = new Press(atlas);
    /** Null where the server has no contact model: pressure is then this page's estimate. */
    this.contact = listing.methods === null ? null : new Contact(this.press);
    this.ladder = new LadderView(listing, this.given, (tier) => this.#switchTo(tier));
    document.body.toggleAttribute('data-contact', this.contact !== null);
    if (!this.contact) for (const option of [...byId('with').options]) if (option.value.startsWith('method:')) option.remove();
    this.unsent = true;
    /** Whether the switch of shear has set the friction. */
    this.lentFriction = false;
    /** Other terms, other legends: the next answer is drawn even if it is the same. */
    this.repaint = true;
    /** Greatest pressure of the training of the tier that runs. */
    this.mostPa = NaN;
    this.stream = byId('stream');
    /** What is on its way: its kind, pressure (as far as the page knows it), pose, and what was pressed. */
    this.sent = { mode: 'press', pressurePa: new Float32Array(MAP_LEN), pose: new Float32Array(7), pressed: null };
    this.answered = { sequence: 0, tier: '', pressurePa: new Float32Array(MAP_LEN), sedJPerM3: new Float32Array(MAP_LEN) };
    this.pair = { of: '', first: new Float32Array(MAP_LEN), second: new Float32Array(MAP_LEN), difference: new Float32Array(MAP_LEN), apart: NaN };
    /** How far each vertex of the skin has moved, as it is drawn. */
    this.movedMm = new Float32Array(3 * atlas.vertexCount);
    this.meters = new Meters((tier, budgetMs) => this.#advice(tier, budgetMs).text);
    this.replay = new Replay(atlas);
    this.spikes = new SpikeView();
    this.sure = { sed: new SureBar(byId('sed-sure')), other: new SureBar(byId('other-sure')) };
    this.timeline = new Timeline();
    this.#makeViews();
    this.control = new PressControl(atlas, this.press, this.views.pressure);
    if (this.finger) this.control.attachFinger(this.finger);
    if (this.contact) this.contact.draws = this.finger !== null;
    this.effects = new EffectSwitches(effects, (name, on) => this.#effect(name, on));
    this.comparison = new Comparison((first, second, answer) => this.#showPair(first, second, answer), (message) => notify(message));
    this.hard = new HardCases(atlas, this.contact !== null, (given) => this.#listed(tierFor(listing, this.answered.tier, given)));
    this.session = this.#makeSession();
    this.hand = this.contact && new HandView(atlas, this.press, {
      terms: () => ({ ...this.#terms(), effects: [], error_estimate: false, ...(byId('method').value && { method: byId('method').value }) }),
      told: (ready) => this.#handReady(ready),
      notify: (message) => notify(message),
      answered: (forceN, sedPeak, serverMs) => {
        if (nowOf() - noticedAtMs > NOTICE_MS) notify('');
        this.timeline.add(nowOf(), forceN, sedPeak, NaN, null, serverMs);
        this.ladder.showLive(serverMs, NaN);
      },
    });
    this.#listen();
    this.#restore();
    this.tick = (nowMs) => this.#frame(nowMs);
  }

  #makeViews() {
    const { atlas } = this;
    this.scales = {
      pressure: new Scale(byId('pressure-scale'), { table: 'viridis', unit: 'Pa', least: 1000 }),
      sed: new Scale(byId('sed-scale'), { table: 'inferno', unit: SED_UNIT, least: 1 }),
    };
    this.scales.difference = new Scale(byId('difference-scale'), { table: 'diverging', unit: SED_UNIT, least: 1, signed: true, like: this.scales.sed });
    const view = (id, scale) => new MapView(byId(id), this.scales[scale]);
    this.views = { pressure: view('pressure', 'pressure'), sed: view('sed', 'sed'), other: view('other', 'sed'), difference: view('difference', 'difference') };
    this.views.pressure.setPatch(atlas.skin.raster, atlas.mmPerPx);
    for (const name of ['sed', 'other', 'difference']) this.views[name].setPatch(atlas.interface.raster, atlas.mmPerPx);
    try {
      this.finger = new FingerView(byId('finger'), atlas);
    } catch (error) {
      this.finger = null;
      byId('no-webgl').hidden = false;
      byId('no-webgl').textContent = `The 3-D finger cannot be drawn: ${error.message}. The maps work without it.`;
    }
    this.scales.sed.onchange = () => this.#paintFinger();
  }

  #makeSession() {
    return new Session(sessionUrl(), {
      onstate: (state, detail) => this.#state(state, detail),
      onready: (ready) => this.#ready(ready),
      onanswer: (answer, roundTripMs) => this.#answer(answer, roundTripMs),
      onfault: (code, message) => {
        this.meters.fault();
        notify(code === 'atlas_mismatch' ? `${message} Reload the page to fetch the server's atlas.` : message);
      },
    });
  }

  /** Terms that an effect brought and the server refuses are taken back: the rest goes on. */
  #state(state, detail) {
    showState(state, detail);
    const name = this.effects.last;
    if (state !== 'refused' || !this.effects.on.has(name)) return;
    this.effects.set(name, false);
    this.spikes.toggle(this.effects.on.has('spikes'));
    this.#open();
  }

  start() {
    const isHand = stateOf(location.hash).mode === 'hand' && this.hand !== null;
    if (isHand) {
      document.querySelector('input[name=mode][value=hand]').checked = true;
      this.#setMode('hand');
    } else {
      this.#open();
    }
    this.#chooseOther();
    requestAnimationFrame(this.tick);
  }

  #open() {
    const budgetUs = Number(byId('budget').value);
    this.meters.restart(budgetUs / 1000);
    if (this.mode === 'hand') this.hand.reopen();
    else this.#hello(performance.now());
  }

  #hello(nowMs) {
    const announced = this.solves ? this.contact.hello(nowMs) : {};
    this.session.open({ ...this.#terms(), ...announced });
  }

  /** What is asked for, whatever the frames are. */
  #terms() {
    return { tier: byId('tier').value || null, budget_us: Number(byId('budget').value), atlas_hash: this.atlas.hash, error_estimate: true, ...this.effects.hello(Array.from(this.press.uvPx)) };
  }

  /** Whether the server finds the pressure of this press. */
  get solves() {
    return this.contact !== null && this.mode === 'press';
  }

  /** What a press gives, of one finger or of a hand: a pose, of which the server finds the pressure, or a map. */
  get givenByPress() {
    return this.contact !== null ? 'poses' : 'pressure';
  }

  /** What the frames of this mode give: replayed are maps of pressure, whatever a press is. */
  get given() {
    return this.mode === 'replay' ? 'pressure' : this.givenByPress;
  }

  /** The model that is chosen, as a press goes on with it. */
  get tierOfPress() {
    return tierAfter(this.listing, byId('tier').value, this.given, this.givenByPress);
  }

  /** A tier as the server lists it, or null. */
  #listed(name) {
    return this.listing.tiers.find((tier) => tier.name === name) ?? null;
  }

  /** Goes on with the model that learnt what is given now. */
  #follow(before) {
    if (this.given === before) return;
    const tier = tierAfter(this.listing, byId('tier').value, before, this.given);
    offerTiers(this.listing, this.given);
    byId('tier').value = tier;
    this.ladder.setGiven(this.given);
  }

  #switchTo(tier) {
    byId('tier').value = tier;
    this.effects.forget();
    this.#open();
  }

  #advice(tier, budgetMs) {
    const { ready } = this.mode === 'hand' ? this.hand.hand ?? {} : this.session;
    return adviseTier(this.listing, { tier, method: ready?.method ?? null, budgetMs, given: this.given });
  }

  /** The session of the hand has terms: model and budget are those of all its fingers. */
  #handReady(ready) {
    if (this.mode !== 'hand') return;
    document.body.dataset.live = '';
    this.mostPa = ready.pressure_max_pa;
    this.answered.tier = ready.tier;
    this.ladder.setReady(ready);
    this.#noteBudget(ready);
    showState('ready', '');
    notify('');
    this.hard.begin();
  }

  #ready(ready) {
    if (this.mode === 'hand') return;
    this.mostPa = ready.pressure_max_pa;
    this.repaint = true;
    this.ladder.setReady(ready);
    this.spikes.setUnits(ready.units);
    this.control.changed = true;
    this.unsent = true;
    this.replay.forget();
    this.meters.ready(ready, this.ladder.medians(ready.tier));
    this.#noteBudget(ready);
    notify('');
  }

  /** Says plainly where the model learnt something else and where the budget cannot be met, and offers what comes nearest. */
  #noteBudget(ready) {
    const note = byId('budget-note');
    note.replaceChildren();
    if (ready.method && byId('method').value === '') note.append(`Contact: ${nameOfMethod(ready.method)}. `);
    // The page says in its own words what the tier did not learn.
    const tier = this.#listed(ready.tier);
    const isOther = tier && !suits(tier, this.given);
    if (isOther) note.append(`${nameOfTier(tier.name)}: ${notLearnt(this.given)}. `);
    for (const { member, question } of ready.warnings ?? []) if (!isOther || member !== 'tier') note.append(`The service asks: ${question}. `);
    if (ready.meets_budget !== false) return;
    const budgetMs = ready.budget_us / 1000;
    const advice = this.#advice(ready.tier, budgetMs);
    note.append(`Not expected within ${budgetMs} ms (${(ready.predicted_latency_us / 1000).toFixed(1)} ms are): ${advice.text}. `);
    if (!advice.tier || (advice.tier === ready.tier && (advice.method ?? ready.method) === ready.method)) return;
    const button = Object.assign(document.createElement('button'), { type: 'button', className: 'quiet', textContent: `Take ${nameOfTier(advice.tier)}` });
    button.addEventListener('click', () => {
      if (advice.method) byId('method').value = advice.method;
      if (this.contact) this.contact.method = byId('method').value;
      this.#switchTo(advice.tier);
    });
    note.append(button);
  }

  #answer(answer, roundTripMs) {
    const nowMs = performance.now();
    this.meters.answer(answer, roundTripMs, nowMs);
    if (answer.status !== 'ok') {
      this.unsent = true;
      return;
    }
    if (document.body.dataset.live === undefined) {
      document.body.dataset.live = '';
      this.hard.begin();
    }
    if (nowMs - noticedAtMs > NOTICE_MS) notify('');
    this.#followTier(answer.tierNumber);
    showFlags('flags', flagsOf(answer, this.mostPa));
    const touch = answer.touch ? readTouch(answer.touch) : null;
    // Where nothing touches there is nothing to be wrong.
    if (this.mode === 'press') this.sure.sed.show(answer.noContact ? null : answer.errorEstimate);
    if (touch) this.meters.press(touch);
    if (this.mode === 'press') {
      this.finger?.setForce(touch);
      this.#moveSkin(answer.displacementMm);
    }
    if (answer.spikes) this.spikes.show(answer.spikes, answer.timeMs, this.press.uvPx);
    this.answered.sequence = answer.sequence;
    this.answered.tier = this.session.ready?.tier;
    // All pictures are of one frame: what was pressed, what was answered, what is true.
    const pressurePa = answer.pressurePa ?? this.sent.pressurePa;
    if (this.repaint || !equal(this.answered.sedJPerM3, answer.sedJPerM3) || !equal(this.answered.pressurePa, pressurePa)) {
      this.answered.pressurePa.set(pressurePa);
      this.answered.sedJPerM3.set(answer.sedJPerM3);
      this.#showMaps(nowMs);
      this.repaint = false;
    }
    this.effects.answer(answer, this.views.sed.peak, nowMs);
    const forceN = touch?.forceN ?? (this.sent.mode === 'press' ? this.press.forceN : NaN);
    const rateHz = answer.ratesHz ? answer.ratesHz.reduce((a, b) => Math.max(a, b), 0) : NaN;
    this.timeline.add(nowMs, forceN, this.views.sed.peak, rateHz, this.sent.pressed, answer.serverUs / 1000);
    if (this.sent.mode === 'replay' && this.mode === 'replay' && this.replay.sent >= 0) this.#showErrors(nowMs, answer.errorEstimate);
    else if (this.sent.mode === 'press' && this.mode === 'press') this.comparison.offer(this.answered.pressurePa, this.answered.sedJPerM3, this.sent.pose, nowMs);
  }

  /** Draws the skin as the service moved it; a press that stands still is not drawn again. */
  #moveSkin(movedMm) {
    if (!this.finger || (movedMm && this.finger.isMoved && equal(movedMm, this.movedMm))) return;
    if (movedMm) this.movedMm.set(movedMm);
    const was = this.finger.isMoved;
    const most = this.finger.setDisplacement(movedMm);
    if (was && !movedMm) this.finger.setPress(this.press);
    put('moved', Number.isNaN(most) ? '–' : `${most.toFixed(2)} mm`);
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
    this.effects.forget();
    this.repaint = true;
  }

  #showMaps(nowMs) {
    const { pressure, sed } = this.views;
    const { atlas, session, answered, scales } = this;
    // What a model or method gets wrong by on the whole map hides what is smaller than that.
    const [off] = [this.ladder.medians(answered.tier).find(([set]) => set === byId('ladder-set').value)?.[1] ?? 0];
    scales.sed.setFloor(off * rms(answered.sedJPerM3, atlas.interface.raster.pixels), `the usual error of ${nameOfTier(answered.tier)}`);
    const found = session.ready?.expected_error?.pressure_relative_l2.median ?? 0;
    scales.pressure.setFloor(this.solves ? found * rms(answered.pressurePa, atlas.skin.raster.pixels) : 0, 'the usual error of the contact');
    pressure.show(answered.pressurePa, nowMs);
    sed.show(answered.sedJPerM3, nowMs);
    this.#paintFinger();
  }

  #paintFinger() {
    const { sed } = this.scales;
    this.finger?.setSed(this.answered.sedJPerM3, sed.max, sed.logarithmic ? LOG_DECADES : 0, sed.floor);
  }

  #showErrors(nowMs, estimate) {
    const { other, difference } = this.views;
    this.meters.errors(this.replay.judge(this.answered.sedJPerM3), this.replay.errors, this.replay.sent);
    other.show(this.replay.truth, nowMs);
    difference.show(this.replay.difference, nowMs);
    byId('other-ms').textContent = 'solved once, before';
    this.sure.sed.show(estimate, this.replay.figures.relativeL2);
    this.sure.other.show(null);
    showFlags('other-flags', []);
    byId('apart').textContent = `${(100 * this.replay.figures.relativeL2).toFixed(1)} % apart (relative L2)`;
  }

  /** Both answers are to one contact. */
  #showPair(first, second, answer) {
    if (this.mode !== 'press') return;
    const { other, difference } = this.views;
    const { pixels } = this.atlas.interface.raster;
    this.sure.other.show(answer.noContact ? null : answer.errorEstimate);
    const isSame = equal(first, this.pair.first) && equal(second, this.pair.second);
    const lacks = ['shear_energy', 'relaxation'].filter((name) => this.effects.on.has(name)).map((name) => LACKS[name]);
    put('other-ms', `${this.comparison.medianMs.toFixed(1)} ms, ${[this.comparison.isMethod ? 'contact and model' : 'model alone', ...lacks].join(', ')}`);
    if (isSame && this.pair.of === this.comparison.with) return;
    this.pair.of = this.comparison.with;
    this.pair.first.set(first);
    this.pair.second.set(second);
    for (let n = 0; n < pixels.length; n++) this.pair.difference[pixels[n]] = first[pixels[n]] - second[pixels[n]];
    this.pair.apart = relativeL2(first, second, pixels);
    const nowMs = performance.now();
    other.show(second, nowMs);
    difference.show(this.pair.difference, nowMs);
    showFlags('other-flags', flagsOf(answer, this.comparison.session?.ready?.pressure_max_pa));
    put('apart', Number.isNaN(this.pair.apart) ? 'no SED' : `${(100 * this.pair.apart).toFixed(1)} % apart (relative L2)`);
  }

  /** Opens or ends the session of the other way. */
  #chooseOther() {
    const what = this.mode === 'press' ? byId('with').value : '';
    document.body.toggleAttribute('data-with', what !== '');
    for (const name of ['other', 'difference']) this.views[name].isShown = what !== '' || this.mode === 'replay';
    const [kind, name] = what.split(':');
    const { atlas_hash: atlasHash } = this.#terms();
    const hello = { atlas_hash: atlasHash, budget_us: 500000, error_estimate: true };
    if (kind === 'tier') Object.assign(hello, { tier: name });
    else if (kind === 'method') Object.assign(hello, { tier: byId('tier').value || this.answered.tier || null, ...this.contact.terms(name) });
    this.comparison.choose(what, hello);
  }

  /** An effect was switched. */
  #effect(name, on) {
    if (name === 'spikes') this.spikes.toggle(on);
    if (name === 'shear_energy' && on && this.contact?.friction === 0) {
      this.#setFriction(FRICTION);
      this.lentFriction = true;
    } else if (!this.effects.on.has('shear_energy') && this.lentFriction) {
      // What came with the switch goes with it: nothing is computed that nobody named.
      this.#setFriction(0);
    }
    this.spikes.toggle(this.effects.on.has('spikes'));
    this.#open();
  }

  #setFriction(friction) {
    this.lentFriction = false;
    byId('friction').value = String(friction);
    byId('friction-out').textContent = friction > 0 ? friction.toFixed(2) : 'none';
    if (this.contact) this.contact.friction = friction;
    if (friction === 0 && this.effects.on.has('shear_energy')) this.effects.set('shear_energy', false);
  }

  /** One display frame: newest press, its map, and the map on its way if no answer is due. */
  #frame(nowMs) {
    requestAnimationFrame(this.tick);
    if (this.mode === 'hand') {
      this.hand.step(nowMs, Number(byId('depth').value), this.stream.checked);
      this.timeline.draw(nowMs);
      return;
    }
    if (this.solves && this.session.ready && this.contact.isDue(nowMs)) {
      this.#hello(nowMs);
      if (this.comparison.isMethod) this.#chooseOther();
    }
    const map = this.session.mapFrame.values;
    const changed = this.mode === 'press' ? this.#stepPress(nowMs, map) : this.#stepReplay(nowMs, map);
    if (changed) {
      if (this.unsent && this.session.inFlight) this.meters.skip();
      this.unsent = true;
    }
    for (const scale of Object.values(this.scales)) scale.fit(nowMs);
    const ready = this.mode === 'press' || this.replay.loaded;
    const isQuiet = nowMs - this.session.sentAtMs > QUIET_MS;
    if (ready && (this.unsent || this.stream.checked || isQuiet)) this.#send(nowMs, map);
    this.finger?.draw();
    this.timeline.draw(nowMs);
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
    this.sent.pose.set(this.session.poseFrame.values);
    const { press, control } = this;
    this.sent.pressed = { u: press.uvPx[0], v: press.uvPx[1], depthMm: control.depthMm, slidMm: press.slidMm };
    if (this.mode === 'replay') this.replay.rememberTruth();
  }

  #stepPress(nowMs, map) {
    const due = this.timeline.due(nowMs);
    const { press, control } = this;
    if (due) {
      press.moveToPixel(due.u, due.v);
      press.slideTo(due.slidMm);
      control.depthMm = due.depthMm;
      control.lastMs = nowMs;
    } else if (!control.step(nowMs)) {
      return false;
    }
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
    byId('tier').addEventListener('change', () => this.#switchTo(byId('tier').value));
    byId('budget').addEventListener('change', () => this.#open());
    byId('method').addEventListener('change', () => {
      if (this.contact) this.contact.method = byId('method').value;
      this.effects.forget();
      this.#open();
    });
    byId('with').addEventListener('change', () => this.#chooseOther());
    byId('friction').addEventListener('input', () => {
      this.#setFriction(Number(byId('friction').value));
      this.effects.forget();
      this.#open();
    });
    byId('replay-press').addEventListener('change', () => {
      this.#play(false);
      this.replay.choose(Number(byId('replay-press').value));
    });
    byId('replay-play').addEventListener('click', () => this.#play(!this.replay.playing));
    this.#listenToFiles();
    this.#listenToShare();
  }

  #listenToFiles() {
    const take = async (file) => {
      try {
        const mesh = meshOf(await file.arrayBuffer(), file.name);
        const size = mesh.sideMm >= PLAUSIBLE_MM.least && mesh.sideMm <= PLAUSIBLE_MM.most ? Number(mesh.sideMm.toFixed(2)) : 10;
        this.control.takeMesh(mesh, size);
        const kept = size === Number(mesh.sideMm.toFixed(2));
        byId('mesh-note').textContent = `${file.name}: ${mesh.triangles.length} triangles; ${kept ? 'its own size' : `${mesh.sideMm.toPrecision(3)} mm in the file, made ${size} mm`}. Its +z presses.`;
      } catch (error) {
        notify(error.message);
      }
    };
    const end = () => { delete document.body.dataset.dragging; };
    document.addEventListener('dragover', (event) => {
      event.preventDefault();
      document.body.dataset.dragging = '';
    });
    document.addEventListener('dragleave', (event) => { if (!event.relatedTarget) end(); });
    document.addEventListener('drop', (event) => {
      event.preventDefault();
      end();
      if (event.dataTransfer.files.length) take(event.dataTransfer.files[0]);
    });
    byId('mesh-file').addEventListener('change', () => { if (byId('mesh-file').files.length) take(byId('mesh-file').files[0]); });
    // The chip of one's own mesh asks for a file, unless there is one already.
    document.querySelector('input[name=shape][value=mesh]').addEventListener('click', () => { if (!this.control.mesh) byId('mesh-file').click(); });
  }

  #listenToShare() {
    const say = (text) => { byId('share-note').textContent = text; };
    const copy = async (text, what) => {
      try {
        await navigator.clipboard.writeText(text);
        say(`${what} copied.`);
      } catch {
        // Without a secure origin a page may not write the clipboard: what it would hold is shown instead.
        window.prompt(`${what}:`, text);
      }
    };
    byId('copy-link').addEventListener('click', () => {
      history.replaceState(null, '', hashOf(this.state));
      copy(location.href, 'Link');
    });
    byId('copy-python').addEventListener('click', () => {
      if (!this.contact) {
        say('This server has no contact model: there is no pose to send.');
        return;
      }
      const origin = new URL('.', document.baseURI).href.replace(/\/$/, '');
      copy(pythonOf({ origin, terms: { ...this.#terms(), tier: this.tierOfPress || null, ...this.contact.terms(this.contact.method) }, pose: this.session.poseFrame.values }), 'Program');
    });
    byId('save-csv').addEventListener('click', () => save('papilla.csv', 'text/csv', this.timeline.csv()));
    byId('save-npy').addEventListener('click', () => {
      save('papilla.npy', 'application/octet-stream', npyOf([this.answered.pressurePa, this.answered.sedJPerM3], SIDE_PX));
      say('papilla.npy: pressure (Pa) and SED (J/m³), 2 x 224 x 224.');
    });
    byId('save-png').addEventListener('click', () => {
      const figures = ['pressure', 'sed', 'other', 'difference'].map(byId);
      pictureOf(figures, this.finger?.canvas).toBlob((blob) => save('papilla.png', 'image/png', blob));
    });
  }

  /** What a link holds; it leads to a press, or to a hand. */
  get state() {
    return { mode: this.mode === 'hand' ? 'hand' : '', ...this.control.state, tier: this.tierOfPress || BY_BUDGET, budget: byId('budget').value, method: byId('method').value, with: byId('with').value || 'none', friction: byId('friction').value, effects: [...this.effects.on].join(' ') };
  }

  /** Takes what the link says. */
  #restore() {
    const state = stateOf(location.hash);
    const choose = (id, value) => { if (value && [...byId(id).options].some((option) => option.value === value)) byId(id).value = value; };
    this.control.state = state;
    byId('tier').value = state.tier === BY_BUDGET ? '' : defaultFor(this.listing, this.given);
    for (const name of ['tier', 'budget', 'method']) choose(name, state[name]);
    if (this.contact) this.contact.method = byId('method').value;
    // Beside the press by the chosen tier, the same press by another one.
    const chosen = byId('tier').value || defaultFor(this.listing, this.given);
    const served = choosable(this.listing.tiers, this.given).filter((tier) => tier.name !== chosen);
    const fastest = served.reduce((a, b) => (a && a.predicted_latency_us <= b.predicted_latency_us ? a : b), null);
    if (state.with === 'none') byId('with').value = '';
    else choose('with', state.with ?? (fastest ? `tier:${fastest.name}` : ''));
    if (Number(state.friction) > 0) this.#setFriction(Math.min(1, Number(state.friction)));
    for (const name of (state.effects ?? '').split(' ')) this.effects.set(name, true);
    this.spikes.toggle(this.effects.on.has('spikes'));
  }

  #setMode(mode) {
    const before = this.given;
    this.mode = mode;
    document.body.dataset.mode = mode;
    this.#follow(before);
    this.hand?.toggle(mode === 'hand');
    // What an effect brings is of one finger.
    byId('effects-list').inert = mode === 'hand';
    this.control.changed = true;
    this.replay.changed = true;
    this.replay.judged = false;
    this.timeline.play(false);
    // Replayed are maps, whatever a press is; what needs friction of an object cannot be had of them.
    if (mode === 'replay' && this.effects.on.has('shear_energy')) this.effects.set('shear_energy', false);
    this.effects.forget();
    this.repaint = true;
    this.pair.of = '';
    if (this.contact && mode !== 'hand') this.#open();
    this.#chooseOther();
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

const nowOf = () => performance.now();

/** A press that does not move is answered alike again and again: no reason to draw it again. */
function equal(a, b) {
  for (let i = 0; i < a.length; i++) if (a[i] !== b[i]) return false;
  return true;
}

function put(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

function showState(state, detail) {
  const words = { connecting: 'connecting', ready: 'connected', waiting: 'disconnected', refused: 'refused' };
  byId('state').dataset.state = state;
  byId('state-text').textContent = detail ? `${words[state]}: ${detail}` : words[state];
}

/** What a network says that has not learnt such a press. */
function showFlags(id, words) {
  const text = words.join('; ');
  if (byId(id).dataset.said === text) return;
  byId(id).dataset.said = text;
  byId(id).replaceChildren(...words.map((word) => Object.assign(document.createElement('span'), { textContent: word })));
  byId(id).hidden = text === '';
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
    // Read on the processor: a graphics processor that draws the finger would be waited for.
    const context = new OffscreenCanvas(image.width, image.height).getContext('2d', { willReadFrequently: true });
    context.drawImage(image, 0, 0);
    const differing = countDifferences(atlas[patch].raster.mask, context.getImageData(0, 0, image.width, image.height).data);
    if (differing > 0) words.push(`${differing} pixels of the ${patch} mask differ from the server's`);
  }
  byId('mask-check').textContent = words.length ? words.join(', ') : '(masks equal the server’s)';
  byId('mask-check').classList.toggle('bad', words.length > 0);
}

document.body.dataset.mode = 'press';
document.querySelector('input[name=mode][value=press]').checked = true;
themeButton(byId('theme'));
try {
  const atlas = new Atlas(await fetchJson('v1/atlas'));
  byId('atlas-hash').textContent = atlas.hash.slice(0, 12);
  const page = new Page(atlas, await listTiers(), await fetchJson('v1/effects'));
  page.start();
  // For the console and the tests: the last answered pair of maps and what the page holds.
  globalThis.papilla = page;
  checkMasks(atlas).catch((error) => notify(error.message));
} catch (error) {
  showState('waiting', '');
  byId('state').dataset.state = 'failed';
  byId('state-text').textContent = error.status === 401 ? 'a token is due' : 'not working';
  if (error.status === 401) {
    byId('token').hidden = false;
  } else {
    notify(`${error.message}. Reload the page to try again.`);
    throw error;
  }
}
