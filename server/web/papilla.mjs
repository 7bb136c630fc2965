// The page: wires atlas, press, sessions, maps and figures together. One loop, driven by the display.

import { Atlas } from './atlas.mjs';
import { Comparison } from './compare.mjs';
import { Contact, poseOf, readTouch } from './contact.mjs';
import { PressControl } from './control.mjs';
import { rms } from './colour.mjs';
import { EffectSwitches } from './effects.mjs';
import { listenToMeshes, listenToShare } from './files.mjs';
import { HandView } from './fingers.mjs';
import { HardCases } from './hard.mjs';
import { LadderView, adviseTier, listTiers, offerTiers } from './ladder.mjs';
import { differencesFromServer } from './mask.mjs';
import { Meters } from './meters.mjs';
import { byId, forgetNotice, notify, putParts, showFlags, showState } from './notice.mjs';
import { Pictures, equal } from './pictures.mjs';
import { Press } from './press.mjs';
import { MAP_LEN, SIDE_PX, Session, sessionUrl } from './protocol.mjs';
import { Replay, fetchJson } from './replay.mjs';
import { hashOf, npyOf, pictureOf, pythonOf, stateOf } from './share.mjs';
import { SpikeView } from './spikes.mjs';
import { themeButton } from './theme.mjs';
import { choosable, defaultFor, suits, tierAfter, tierFor } from './tiers.mjs';
import { Timeline } from './timeline.mjs';
import { flagsOf, nameOfMethod, nameOfOthers, nameOfTier, notLearnt } from './words.mjs';

/** A frame is sent so often even if nothing changes, so that a silent server is noticed. */
const QUIET_MS = 1000;
/** Flags lie at the foot of a map, unless a press is lower than this. */
const LOW_PX = 0.7 * SIDE_PX;
/** Effects that change SED itself: the second answer has them too, and of no such answer is an error stated. */
const CHANGES_SED = ['shear_energy', 'relaxation'];
/** What the friction of the switch is, where none was chosen. */
const FRICTION = 0.5;
/** What the service asks about as a whole: of a mesh, whether what it mended is what was meant. */
const SHAPE_MEMBER = 'objects[0].shape';
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
    /** What was refused and taken back: it is told until the session that goes on has been there for a while. */
    this.complaint = '';
    /** Other terms, other legends: the next answer is drawn even if it is the same. */
    this.repaint = true;
    /** Greatest pressure of the training of the tier that runs. */
    this.mostPa = NaN;
    this.stream = byId('stream');
    /** What is on its way: its kind, pressure (as far as the page knows it), pose, and what was pressed. */
    this.sent = { mode: 'press', pressurePa: new Float32Array(MAP_LEN), pose: new Float32Array(7), pressed: null };
    this.answered = { sequence: 0, tier: '', expected: NaN, pressurePa: new Float32Array(MAP_LEN), sedJPerM3: new Float32Array(MAP_LEN) };
    this.meters = new Meters((tier, budgetMs) => this.#advice(tier, budgetMs).text);
    this.replay = new Replay(atlas);
    this.spikes = new SpikeView();
    this.timeline = new Timeline();
    this.pictures = new Pictures(atlas);
    const { views, finger } = this.pictures;
    this.control = new PressControl(atlas, this.press, views.pressure);
    if (finger) this.control.attachFinger(finger);
    if (this.contact) this.contact.draws = finger !== null;
    this.effects = new EffectSwitches(effects, (name, on) => this.#effect(name, on));
    this.#allowShear();
    this.comparison = new Comparison((first, second, answer) => this.#showPair(first, second, answer), (message) => notify(message));
    this.hard = new HardCases(atlas, this.contact !== null, (given) => this.#listed(tierFor(listing, this.answered.tier, given)));
    this.session = this.#makeSession();
    this.hand = this.contact && new HandView(atlas, this.press, {
      terms: () => ({ ...this.#terms(), effects: [], error_estimate: false, ...(byId('method').value && { method: byId('method').value }) }),
      told: (ready) => this.#handReady(ready),
      notify: (message) => notify(message),
      refused: (message, problem) => this.#complain(message, problem),
      answered: (forceN, sedPeak, serverMs) => {
        forgetNotice();
        this.timeline.add(performance.now(), forceN, sedPeak, NaN, null, serverMs);
        this.ladder.showLive(serverMs, NaN);
      },
    });
    this.#listen();
    this.#restore();
    this.tick = (nowMs) => this.#frame(nowMs);
  }

  #makeSession() {
    return new Session(sessionUrl(), {
      onstate: (state, detail) => this.#state(state, detail),
      onready: (ready) => this.#ready(ready),
      onanswer: (answer, roundTripMs) => this.#answer(answer, roundTripMs),
      onfault: (code, message, problem) => {
        this.meters.fault();
        this.#complain(code === 'atlas_mismatch' ? `${message} Reload the page to fetch the server's atlas.` : message, problem);
      },
    });
  }

  /** Tells what is wrong. A visitor's mesh that the service refuses is taken back, and what pressed before goes on. */
  #complain(message, problem) {
    const { control, press } = this;
    const isOfMesh = press.shape === 'mesh' && control.before !== null && problem?.code === 'bad_contact' && problem.field?.startsWith('objects');
    // A visitor knows the file, and no member of a hello.
    this.complaint = isOfMesh ? `${control.mesh.name}: ${message.replace(`${problem.field}: `, '')}` : '';
    notify(this.complaint || message);
    if (!isOfMesh) return;
    control.takeBack();
    this.noteMesh(control.mesh);
  }

  /** Terms that an effect brought and the server refuses are taken back: the rest goes on. */
  #state(state, detail) {
    showState(state, detail);
    const name = this.effects.last;
    if (state !== 'refused') return;
    if (this.complaint !== '') {
      this.#open();
      return;
    }
    if (!this.effects.on.has(name)) return;
    this.complaint = detail;
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
    this.#tellTakenBack();
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
    // The second answer is of the same indenter and, but for what is compared, found in the same way.
    if (this.comparison.isOn) this.#chooseOther();
    this.#tellTakenBack();
  }

  /** There is a session again: nothing is wrong any more, but what was taken back for it is still told. */
  #tellTakenBack() {
    notify(this.complaint);
    this.complaint = '';
    if (this.isAnnounced) this.control.before = null;
  }

  /** Whether the session is one of the body that presses. */
  get isAnnounced() {
    return this.mode === 'hand' ? this.hand.body === this.press.body : this.solves && !this.contact.isOther;
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
    const [ofShape, others] = [true, false].map((is) => (ready.warnings ?? []).filter(({ member }) => (member === SHAPE_MEMBER) === is));
    if (this.press.shape === 'mesh' && this.isAnnounced) this.noteMesh(this.control.mesh, ofShape.map(({ question }) => question));
    for (const { member, question } of others) if (!isOther || member !== 'tier') note.append(`The service asks: ${question}. `);
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
    forgetNotice();
    this.#followTier(answer.tierNumber);
    showFlags('flags', flagsOf(answer, this.mostPa));
    for (const id of ['flags', 'other-flags']) byId(id).dataset.at = this.mode === 'press' && this.press.uvPx[1] > LOW_PX ? 'top' : 'bottom';
    const touch = answer.touch ? readTouch(answer.touch) : null;
    // Where nothing touches there is nothing to be wrong.
    if (this.mode === 'press') this.pictures.sure.sed.show(answer.noContact ? null : answer.errorEstimate, NaN, this.#whyUnknown(this.session.ready?.tier));
    if (touch) this.meters.press(touch);
    if (this.mode === 'press') {
      this.pictures.finger?.setForce(touch);
      this.pictures.moveSkin(answer.displacementMm, this.press);
    }
    if (answer.spikes) this.spikes.show(answer.spikes, answer.timeMs, this.press.uvPx);
    this.answered.sequence = answer.sequence;
    this.answered.tier = this.session.ready?.tier;
    const [expected] = answer.errorEstimate ?? [NaN];
    this.answered.expected = Number.isFinite(expected) ? expected : NaN;
    // All pictures are of one frame: what was pressed, what was answered, what is true.
    const pressurePa = answer.pressurePa ?? this.sent.pressurePa;
    if (this.repaint || !equal(this.answered.sedJPerM3, answer.sedJPerM3) || !equal(this.answered.pressurePa, pressurePa)) {
      this.answered.pressurePa.set(pressurePa);
      this.answered.sedJPerM3.set(answer.sedJPerM3);
      this.#showMaps(nowMs);
      this.repaint = false;
    }
    this.effects.answer(answer, this.pictures.views.sed.peak, nowMs);
    putParts('sed-ms', this.effects.recent.times.words);
    const forceN = touch?.forceN ?? (this.sent.mode === 'press' ? this.press.forceN : NaN);
    const rateHz = answer.ratesHz ? answer.ratesHz.reduce((a, b) => Math.max(a, b), 0) : NaN;
    this.timeline.add(nowMs, forceN, this.pictures.views.sed.peak, rateHz, this.sent.pressed, answer.serverUs / 1000);
    if (this.sent.mode === 'replay' && this.mode === 'replay' && this.replay.sent >= 0) this.#showErrors(nowMs, answer.errorEstimate);
    else if (this.sent.mode === 'press' && this.mode === 'press') this.comparison.offer(this.answered.pressurePa, this.answered.sedJPerM3, this.sent.pose, nowMs);
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
    if (this.comparison.isOn) this.#chooseOther();
  }

  #showMaps(nowMs) {
    const { atlas, session, answered } = this;
    const { scales } = this.pictures;
    // What an answer is likely to get wrong by on the whole map hides what is smaller than that.
    const usual = this.ladder.medians(answered.tier).find(([set]) => set === byId('ladder-set').value)?.[1] ?? 0;
    const [off, whose] = answered.expected > 0 ? [answered.expected, 'the error expected of the first answer'] : [usual, `the usual error of ${nameOfTier(answered.tier)}`];
    scales.sed.setFloor(off * rms(answered.sedJPerM3, atlas.interface.raster.pixels), whose);
    const found = session.ready?.expected_error?.pressure_relative_l2.median ?? 0;
    scales.pressure.setFloor(this.solves ? found * rms(answered.pressurePa, atlas.skin.raster.pixels) : 0, 'the usual error of the contact');
    this.pictures.showAnswered(answered, nowMs);
  }

  #showErrors(nowMs, estimate) {
    this.meters.errors(this.replay.judge(this.answered.sedJPerM3), this.replay.errors, this.replay.sent);
    this.pictures.showTruth(this.replay, estimate, nowMs);
  }

  /** Both answers are to one contact. */
  #showPair(first, second, answer) {
    if (this.mode !== 'press') return;
    const { ready } = this.comparison.session ?? {};
    this.pictures.sure.other.show(answer.noContact ? null : answer.errorEstimate, NaN, this.#whyUnknown(ready?.tier));
    putParts('other-ms', this.comparison.times.words);
    this.pictures.showPair(first, second, this.comparison.with, answer, ready?.pressure_max_pa, this.solves && this.contact.friction > 0);
  }

  /** Why the service states no error for an answer of this tier, if it states none. */
  #whyUnknown(name) {
    const tier = this.#listed(name);
    if (tier && !suits(tier, this.given)) return `unknown, as it ${nameOfOthers(this.given)}`;
    const changed = CHANGES_SED.some((effect) => this.effects.on.has(effect)) || (this.solves && this.contact.friction > 0);
    return changed ? 'unknown with friction or creep' : undefined;
  }

  /** Opens or ends the session of the other way. */
  #chooseOther() {
    const what = this.mode === 'press' ? byId('with').value : '';
    document.body.toggleAttribute('data-with', what !== '');
    this.pictures.showSecond(what !== '' || this.mode === 'replay');
    const [kind, name] = what.split(':');
    const { atlas_hash: atlasHash } = this.#terms();
    const hello = { atlas_hash: atlasHash, budget_us: 500000, error_estimate: true, effects: CHANGES_SED.filter((effect) => this.effects.on.has(effect)) };
    const { tier, method } = this.session.ready ?? { tier: byId('tier').value || null, method: this.contact?.method };
    hello.tier = kind === 'tier' ? name : tier;
    if (this.solves) Object.assign(hello, this.contact.terms(kind === 'method' ? name : method));
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

  /** Shear comes of an object that rubs: it can be had where the service finds contact. */
  #allowShear() {
    this.effects.allow('shear_energy', this.contact !== null && this.mode !== 'replay');
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
    }
    const map = this.session.mapFrame.values;
    const changed = this.mode === 'press' ? this.#stepPress(nowMs, map) : this.#stepReplay(nowMs, map);
    if (changed) {
      if (this.unsent && this.session.inFlight) this.meters.skip();
      this.unsent = true;
    }
    const ready = this.mode === 'press' || this.replay.loaded;
    const isQuiet = nowMs - this.session.sentAtMs > QUIET_MS;
    if (ready && (this.unsent || this.stream.checked || isQuiet)) this.#send(nowMs, map);
    this.pictures.fit(nowMs);
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
    this.pictures.setPress(press);
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
    this.noteMesh = listenToMeshes((mesh, sizeMm) => this.control.takeMesh(mesh, sizeMm), notify, () => this.control.mesh !== undefined);
    this.#listenToShare();
  }

  #listenToShare() {
    const origin = new URL('.', document.baseURI).href.replace(/\/$/, '');
    listenToShare({
      link: () => {
        history.replaceState(null, '', hashOf(this.state));
        return location.href;
      },
      python: () => this.contact && pythonOf({ origin, terms: { ...this.#terms(), tier: this.tierOfPress || null, ...this.contact.terms(this.contact.method) }, pose: this.session.poseFrame.values }),
      csv: () => this.timeline.csv(),
      npy: () => npyOf([this.answered.pressurePa, this.answered.sedJPerM3], SIDE_PX),
      png: () => pictureOf(Object.values(this.pictures.views), this.pictures.finger?.canvas),
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
    this.#allowShear();
    this.effects.forget();
    this.repaint = true;
    this.pictures.pair.of = '';
    if (this.contact && mode !== 'hand') this.#open();
    this.#chooseOther();
    if (mode === 'replay') {
      this.pictures.setPress(null);
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

/** Says on the page whether this raster equals the server's own mask, pixel by pixel. */
async function checkMasks(atlas) {
  const words = await differencesFromServer(atlas);
  byId('mask-check').textContent = words.length ? words.join(', ') : '(masks equal the server’s)';
  byId('mask-check').classList.toggle('bad', words.length > 0);
}

document.body.dataset.mode = 'press';
// What is set seldom is folded away where the screen is small.
const wide = matchMedia('(min-width: 1181px)');
wide.addEventListener('change', () => { byId('more').open = wide.matches; });
byId('more').open = wide.matches;
document.querySelector('input[name=mode][value=press]').checked = true;
themeButton(byId('theme'));
// What is seen beside a term when it is pointed at is heard when it is reached.
for (const term of document.querySelectorAll('.term[tabindex]')) term.setAttribute('aria-description', term.dataset.tip);
try {
  const atlas = new Atlas(await fetchJson('v1/atlas'));
  byId('atlas-hash').textContent = atlas.hash.slice(0, 12);
  const page = new Page(atlas, await listTiers(), await fetchJson('v1/effects'));
  page.start();
  // For the console and the tests: the last answered pair of maps and what the page holds.
  globalThis.papilla = page;
  checkMasks(atlas).catch((error) => notify(error.message));
} catch (error) {
  showState('failed', error.status === 401 ? 'a token is due' : 'not working');
  if (error.status === 401) {
    document.body.dataset.locked = '';
    byId('token').hidden = false;
    byId('token-text').focus();
  } else {
    notify(`${error.message}. Reload the page to try again.`);
    throw error;
  }
}
