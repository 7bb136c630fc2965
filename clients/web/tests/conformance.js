// The steps of docs/reference/conformance.md by this client; runs in the page, which has nothing but the client and the server.

import {
  Atlas, Hand, MAP_LEN, PapillaError, SIDE_PX, Session, feltInWorld, fingerOfJoints, poseInFinger, postPressure,
} from '../papilla.js';
import { addressOf, cleanToken } from '../src/address.js';

/** @typedef {Record<string, any>} Step */
/** @typedef {Record<string, any>} Outcome what an answer held, copied */

const FLAGS = /** @type {const} */ ([['out_of_range', 'outOfRange'], ['no_contact', 'noContact'], ['unfamiliar', 'unfamiliar'], ['cut_off', 'cutOff'], ['not_tracked', 'notTracked'], ['coarse_clock', 'coarseClock']]);

const wait = (/** @type {number} */ ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** @param {Step} pattern @param {number} [part] */
function pressureMap(pattern, part = 1) {
  const map = new Float32Array(MAP_LEN);
  for (let i = 0; i < MAP_LEN; i++) {
    const [u, v] = [(i % SIDE_PX) + 0.5, Math.floor(i / SIDE_PX) + 0.5];
    let p = 0;
    for (const [u0, v0, sigma, peak] of pattern.gaussians ?? []) p += peak * Math.exp(-((u - u0) ** 2 + (v - v0) ** 2) / (2 * sigma * sigma));
    if (pattern.disc) {
      const [u0, v0, radius, pressure] = pattern.disc;
      if ((u - u0) ** 2 + (v - v0) ** 2 <= radius * radius) p += pressure;
    }
    map[i] = p < 1 ? 0 : p * part;
  }
  if (pattern.bad) {
    const [row, column, value] = pattern.bad;
    map[row * SIDE_PX + column] = value === 'nan' ? NaN : value === 'inf' ? Infinity : value;
  }
  return map;
}

/** @param {Float32Array} map @param {number[]} window */
function cut(map, [column, row, width, height]) {
  const samples = new Float32Array(width * height);
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) samples[y * width + x] = map[(row + y) * SIDE_PX + column + x] ?? 0;
  }
  return samples;
}

/** @param {string} what @param {unknown} found @param {unknown} due */
function same(what, found, due) {
  if (JSON.stringify(found) !== JSON.stringify(due)) throw new Error(`${what} is ${JSON.stringify(found)}, not ${JSON.stringify(due)}`);
}

/** @param {string} what @param {number} found @param {number[]} due */
function near(what, found, [value, tolerance]) {
  if (!(Math.abs(found - value) <= tolerance)) throw new Error(`${what} is ${found}, not ${value} +- ${tolerance}`);
}

/** @param {string} what @param {ArrayLike<number> | null} found @param {number[][]} due */
function allNear(what, found, due) {
  if (!found || found.length !== due.length) throw new Error(`${what}: ${found?.length} numbers, ${due.length} are due`);
  due.forEach((pair, n) => near(`${what}[${n}]`, found[n], pair));
}

/** How wrong the answer says that it may be: what is null is infinite. @param {Step} expect @param {Float32Array} found */
function checkErrors({ error_estimate: due }, found) {
  if (!due) return;
  same('numbers of error_estimate', found.length, due.length);
  due.forEach((/** @type {number[] | null} */ pair, /** @type {number} */ n) => {
    if (pair) near(`error_estimate[${n}]`, found[n], pair);
    else if (found[n] !== Infinity) throw new Error(`error_estimate[${n}] is ${found[n]}, not infinite`);
  });
}

/** @param {Step} expect @param {Float32Array} map */
function checkMap(expect, map) {
  for (const [row, column, value, tolerance] of expect.pixels ?? []) near(`pixel (${row}, ${column})`, map[row * SIDE_PX + column], [value, tolerance]);
  if (expect.sum) near('sum', map.reduce((sum, value) => sum + value, 0), expect.sum);
  if (expect.max) near('max', map.reduce((most, value) => Math.max(most, value), 0), expect.max);
}

/** One case's session. */
class Runner {
  /** @type {Session | null} */ session = null;
  /** @type {Hand | null} */ hand = null;
  /** @type {Map<number, Outcome>} */ outcomes = new Map();
  /** @type {number[]} */ order = [];
  /** @type {Map<number, string>} */ tiers = new Map();
  clockUs = 0;
  // The session before the last move.
  /** @type {number | undefined} */ moved;

  /** @param {string} url @param {string} control @param {Atlas} atlas @param {number} patienceMs */
  constructor(url, control, atlas, patienceMs) {
    Object.assign(this, { url, control, atlas, patienceMs });
    this.url = url;
    this.control = control;
    this.atlas = atlas;
    this.patienceMs = patienceMs;
  }

  now() {
    return this.clockUs || Math.round((performance.timeOrigin + performance.now()) * 1000);
  }

  /** @template T @param {string} what @param {() => T | undefined | null | false} look @returns {Promise<T>} */
  async until(what, look, patienceMs = this.patienceMs) {
    const end = performance.now() + patienceMs;
    for (;;) {
      const found = look();
      if (found) return found;
      if (performance.now() > end) throw new Error(`${what}: not within ${patienceMs} ms`);
      await wait(2);
    }
  }

  /** @param {Step} step */
  address({ address, expect }) {
    if (expect.status !== 'error') {
      const found = addressOf(address);
      return same(address, [found.session, found.http('/v1/atlas')], [expect.session, expect.http]);
    }
    for (const use of [() => new Session(address), () => addressOf(address)]) this.throws(use, expect);
  }

  /** @param {Step} step */
  token({ token, expect }) {
    if (expect.status !== 'error') return same('the token', cleanToken(token), expect.token);
    this.throws(() => new Session(this.url, {}, { token }), expect);
  }

  /** @param {() => unknown} use @param {Step} expect */
  throws(use, { code, says = '' }) {
    let error;
    try {
      use();
    } catch (thrown) {
      error = thrown;
    }
    if (!(error instanceof PapillaError)) throw new Error(`it is taken: ${error}`);
    same('code', error.code, code);
    if (!error.message.includes(says)) throw new Error(`${error.message} does not say ${says}`);
  }

  /** @param {Step} step */
  async hello({ hello: wire, expect }) {
    // What a case does not say is the protocol's default, not the client's.
    const hello = { sample_type: 'f32', ...wire };
    if (wire.input) return this.announce(wire, expect);
    let reply = /** @type {any} */ (null);
    const fresh = this.session === null || this.session.state === 'refused';
    if (fresh) this.session = new Session(this.url, hello, { crop: false, clockUs: () => this.now(), timeoutMs: this.patienceMs });
    const session = /** @type {Session} */ (this.session);
    session.onready = (ready) => { reply = ready; this.tiers.set(ready.tier_number, ready.tier); };
    session.onrefused = (problem) => { reply = problem; };
    session.onanswer = (answer) => this.keep(answer);
    if (fresh) session.open();
    else session.renew(hello);
    await this.until('ready', () => reply);
    if (expect.status === 'error') {
      same('reply', reply.type, 'error');
      for (const member of ['code', 'field']) if (expect[member]) same(member, reply[member], expect[member]);
      return;
    }
    if (reply.type !== 'ready') throw new Error(`${reply.code}: ${reply.message}`);
    this.moved ??= reply.session;
    for (const words of expect.warnings ?? []) this.told(words);
    for (const [member, due] of Object.entries(expect.ready ?? {})) same(`ready.${member}`, reply[member], due);
  }

  /** @param {import('../papilla.js').Answer} answer */
  keep(answer) {
    if (this.outcomes.has(answer.sequence)) throw new Error(`frame ${answer.sequence} has two outcomes`);
    const { map, summary, points, pointRatesHz, rates, actuators, errorEstimate, ...rest } = answer;
    const copy = (/** @type {Float32Array | null} */ values) => (values ? Float32Array.from(values) : null);
    this.outcomes.set(answer.sequence, { ...rest, map: copy(map), summary: copy(summary), points: copy(points), pointRatesHz: copy(pointRatesHz), rates: copy(rates), actuators: copy(actuators), errorEstimate: copy(errorEstimate) });
    this.order.push(answer.sequence);
  }

  /** @param {Step} step */
  async frame({ pressure, window, client_time_us: timeUs, deadline_us: deadlineUs, attempts = 1, expect }) {
    const session = /** @type {Session} */ (this.session);
    const map = pressureMap(pressure);
    session.deadlineUs = deadlineUs ?? 0;
    for (let attempt = 1; ; attempt++) {
      if (timeUs) this.clockUs = timeUs;
      const sentUs = this.now();
      let sequence;
      try {
        sequence = window ? session.sendWindow(cut(map, window), window[0], window[1], window[2], window[3]) : session.send(map);
      } catch (error) {
        if (!(error instanceof PapillaError)) throw error;
        this.check(expect, { status: 'error', problem: error.problem, map: new Float32Array(0) });
        return;
      } finally {
        this.clockUs = 0;
      }
      const afterUs = this.now();
      const outcome = await this.until('the outcome', () => this.outcomes.get(sequence));
      if (outcome.status === 'lost' && attempt < attempts) continue;
      if (['ok', 'late', 'stale', 'superseded'].includes(outcome.status)) {
        if (timeUs) same('client time', outcome.clientTimeUs, timeUs);
        else if (outcome.clientTimeUs < sentUs || outcome.clientTimeUs > afterUs) throw new Error(`client time ${outcome.clientTimeUs}, sent from ${sentUs} to ${afterUs}`);
      }
      this.check(expect, outcome);
      return;
    }
  }

  /** @param {Step} expect @param {Outcome} outcome */
  check(expect, outcome) {
    same(`status (${outcome.problem?.message ?? ''})`, outcome.status, expect.status ?? 'ok');
    if (outcome.status === 'error') {
      if (expect.code) same('code', outcome.problem.code, expect.code);
      if (expect.field) same('field', outcome.problem.field, expect.field);
    }
    if (outcome.status !== 'ok') return;
    if (outcome.inferUs + outcome.queueUs > outcome.totalUs) throw new Error(`${outcome.inferUs} + ${outcome.queueUs} us are more than ${outcome.totalUs}`);
    same('rates', outcome.rates != null, expect.rates !== undefined);
    if (expect.rates) checkMap(expect.rates, outcome.rates);
    if (expect.point_rates) allNear('point_rates', outcome.pointRatesHz, expect.point_rates);
    if (expect.flags) same('flags', FLAGS.filter(([, member]) => outcome[member]).map(([name]) => name), expect.flags);
    if (expect.tier) same('tier', this.tiers.get(outcome.tierNumber), expect.tier);
    if (expect.window) same('window', [outcome.column, outcome.row, outcome.width, outcome.height], expect.window);
    if (expect.map === false) same('samples', outcome.width * outcome.height, 0);
    for (const section of ['summary', 'points', 'actuators']) if (expect[section]) allNear(section, outcome[section], expect[section]);
    checkMap(expect, outcome.map);
    checkErrors(expect, outcome.errorEstimate);
  }

  /** @param {string} what */
  async steer(what) {
    const response = await fetch(`${this.control}/${what}`, { method: 'POST' });
    if (!response.ok) throw new Error(`the runner does not ${what}: HTTP ${response.status}`);
  }

  /** @param {Step} step */
  async burst({ count, gap_ms: gapMs = 0, pressure, paused, expect }) {
    const session = /** @type {Session} */ (this.session);
    const before = session.supersededByClient;
    const maps = Array.from({ length: count }, (_, k) => pressureMap(pressure, (k + 1) / count));
    if (paused) await this.steer('pause');
    /** @type {number[]} */
    const sequences = /** @type {number[]} */ ([]);
    for (const map of maps) {
      sequences.push(session.send(map));
      if (gapMs) await wait(gapMs);
    }
    if (paused) await this.steer('resume');
    await this.until('all outcomes', () => sequences.every((sequence) => this.outcomes.has(sequence)));
    const all = sequences.map((sequence) => /** @type {Outcome} */ (this.outcomes.get(sequence)));
    const odd = all.find(({ status }) => status !== 'ok' && status !== 'superseded');
    if (odd) throw new Error(`a frame of the burst was ${odd.status}`);
    const rendered = this.order.filter((sequence) => sequences.includes(sequence) && this.outcomes.get(sequence)?.status === 'ok');
    same('order', rendered, [...rendered].sort((a, b) => a - b));
    this.check(expect.newest ?? {}, all[count - 1]);
    const superseded = all.filter(({ status }) => status === 'superseded').length;
    if (superseded < (expect.superseded ?? 0)) throw new Error(`${superseded} superseded, ${expect.superseded} are due`);
    const own = session.supersededByClient - before;
    if (own < (expect.superseded_by_client ?? 0)) throw new Error(`${own} superseded by the client, ${expect.superseded_by_client} are due`);
  }

  /** @param {Step} step */
  async reconnect({ within_s: withinS }) {
    const session = /** @type {Session} */ (this.session);
    const before = session.ready?.session;
    let fresh = false;
    session.onready = (ready) => { fresh = true; this.tiers.set(ready.tier_number, ready.tier); };
    await this.steer('restart');
    await this.until(`a session after ${before}`, () => fresh && session.ready, withinS * 1000);
  }

  /** @param {string} words */
  told(words) {
    const { warnings } = /** @type {Session} */ (this.session);
    if (!warnings.some((each) => each.includes(words))) throw new Error(`nobody was told '${words}', but ${JSON.stringify(warnings)}`);
  }

  /** The service stops, or dies, while frames wait for it. @param {Step} step */
  async silence({ how, timeout_ms: timeoutMs, count, pressure, within_s: withinS }) {
    const session = /** @type {Session} */ (this.session);
    const usualMs = session.timeoutMs;
    const map = pressureMap(pressure);
    const first = session.send(map);
    await this.until('the frame before', () => this.outcomes.get(first));
    session.timeoutMs = timeoutMs;
    await this.steer(how);
    let last = 0;
    const sequences = /** @type {number[]} */ ([]);
    for (let k = 0; k < count; k++) {
      sequences.push((last = session.send(map)));
      await wait(50);
    }
    await this.until('all outcomes', () => sequences.every((sequence) => this.outcomes.has(sequence)));
    for (const sequence of sequences) {
      const { status } = /** @type {Outcome} */ (this.outcomes.get(sequence));
      if (status !== 'lost' && (status !== 'superseded' || sequence === last)) throw new Error(`a frame is ${status}`);
    }
    this.told('no answer within');
    let fresh = false;
    session.onready = () => { fresh = true; };
    await this.steer(how === 'pause' ? 'resume' : 'start');
    session.timeoutMs = usualMs;
    await this.until('a session', () => fresh && session.ready, withinS * 1000);
  }

  /** @param {Step} step */
  async move({ within_s: withinS }) {
    const session = /** @type {Session} */ (this.session);
    const before = this.moved;
    await this.until('another connection', () => session.ready && session.ready.session !== before, withinS * 1000);
    this.moved = session.ready?.session;
  }

  /** It was asked to move and could not, and says why. @param {Step} step */
  async stay({ says, within_s: withinS }) {
    const session = /** @type {Session} */ (this.session);
    await this.until(`the warning '${says}'`, () => session.warnings.some((words) => words.includes(says)), withinS * 1000);
    same('session', session.ready?.session, this.moved);
  }

  /** @param {Step} step */
  async http({ pressure, tier, expect }) {
    let outcome;
    try {
      const { map, tier: rendered } = await postPressure(this.url, pressureMap(pressure), { tier });
      if (expect.tier) same('tier', rendered, expect.tier);
      outcome = { status: 'ok', map, inferUs: 0, queueUs: 0, totalUs: 0 };
    } catch (error) {
      if (!(error instanceof PapillaError)) throw error;
      outcome = { status: 'error', problem: error.problem };
    }
    this.check({ ...expect, tier: undefined }, outcome);
  }

  /** @param {Step} wire @param {Step} expect */
  async announce(wire, expect) {
    this.hand?.close();
    try {
      // As above: a hand by itself asks for no map.
      this.hand = await Hand.connect(this.url, { map: true, ...wire }, undefined, { timeoutMs: this.patienceMs });
    } catch (error) {
      return this.refused(expect, error);
    }
    same('status', expect.status ?? 'ok', 'ok');
    for (const [member, due] of Object.entries(expect.ready ?? {})) same(`ready.${member}`, /** @type {Step} */ (this.hand.ready)[member], due);
  }

  /** @param {Step} expect @param {unknown} error */
  refused(expect, error) {
    if (!(error instanceof PapillaError)) throw error;
    same(`status (${error.message})`, 'error', expect.status);
    for (const member of /** @type {const} */ (['code', 'field'])) if (expect[member]) same(member, error.problem[member], expect[member]);
  }

  /** @param {Step} step */
  async touch(step) {
    if (step.engines) return this.placed(step);
    const poses = step.poses && step.poses.map((/** @type {number[]} */ p) => ({ at: p.slice(0, 3), turn: p.slice(3) }));
    return this.press(step, (hand, more) => hand.touch(poses, more));
  }

  /** The objects where the step says that WebXR has them. @param {Step} step */
  async placed(step) {
    const { finger, objects, joints: { distal, tip, inside_mm: insideMm } } = step.engines.openxr;
    const place = (/** @type {number[]} */ seven) => /** @type {import('../src/frames.js').PlaceInWorld} */ ({ at: seven.slice(0, 3), turn: seven.slice(3) });
    const poses = objects.map((/** @type {number[]} */ object) => poseInFinger(place(finger), place(object)));
    const tracked = fingerOfJoints(place(distal), place(tip), { insideMm });
    step.poses.forEach((/** @type {number[]} */ due, /** @type {number} */ k) => {
      for (const { at, turn } of [poses[k], poseInFinger(tracked, place(objects[k]))]) {
        for (let i = 0; i < 3; i++) near(`place ${i} of object ${k}`, at[i], [due[i], 2e-3]);
        // A quaternion and its negative are one turn.
        near(`turn of object ${k}`, Math.abs(turn.reduce((/** @type {number} */ sum, /** @type {number} */ v, /** @type {number} */ i) => sum + v * due[3 + i], 0)), [1, 1e-6]);
      }
    });
    const { touch } = await this.press(step, (hand, more) => hand.touch(poses, more)) ?? {};
    if (!touch) throw new Error('no touch');
    const felt = feltInWorld(place(finger), touch);
    const due = step.expect.engines.openxr;
    allNear('force', felt.forceN, due.force_n);
    allNear('torque', felt.torqueNM, due.torque_n_m);
    allNear('centre', felt.centre, due.centre);
  }

  /** @param {Step} step */
  gaps(step) {
    const [x, y, z, radius] = step.sphere;
    const p = this.atlas.skin.positionsMm;
    const depths = Array.from({ length: this.atlas.vertexCount }, (_, i) => radius - Math.hypot(p[3 * i] - x, p[3 * i + 1] - y, p[3 * i + 2] - z));
    const velocities = step.velocity ? depths.flatMap(() => step.velocity) : [];
    return this.press(step, (hand, more) => hand.touchGaps(Float32Array.from([...depths, ...velocities]), more));
  }

  /** @param {Step} step @param {(hand: Hand, more: any) => Promise<import('../src/hand.js').HandAnswer>} send */
  async press({ finger = 0, net, expect }, send) {
    let answer;
    try {
      answer = await send(/** @type {Hand} */ (this.hand), { finger, net: net && { direction: net.slice(0, 3), forceN: net[3] } });
    } catch (error) {
      this.refused(expect, error);
      return null;
    }
    const { forceN, torqueNMm, areaMm2, centreMm, penetrationMm, stiffnessNPerMm, travelMm, pressureMaxPa, share } = answer.touch;
    same('finger', answer.finger, finger);
    allNear('touch', [...forceN, ...torqueNMm, areaMm2, ...centreMm, penetrationMm, stiffnessNPerMm, travelMm, pressureMaxPa, share], expect.touch);
    if (expect.pressure_sum) near('pressure', /** @type {Float32Array} */ (answer.pressurePa).reduce((sum, value) => sum + value, 0), expect.pressure_sum);
    same('flags', [...(answer.noContact ? ['no_contact'] : []), ...(answer.notTracked ? ['not_tracked'] : [])], expect.flags);
    same('odd flags', [answer.outOfRange, answer.unsettled], [false, false]);
    checkErrors(expect, answer.errorEstimate);
    return answer;
  }

  /** @param {Step} step */
  rasterise({ vertices, expect }) {
    const [x, y, z, sigma, peak] = vertices.gaussian_mm;
    const p = this.atlas.skin.positionsMm;
    const values = Float32Array.from({ length: this.atlas.vertexCount }, (_, i) =>
      peak * Math.exp(-((p[3 * i] - x) ** 2 + (p[3 * i + 1] - y) ** 2 + (p[3 * i + 2] - z) ** 2) / (2 * sigma * sigma)));
    checkMap(expect, this.atlas.pressureMap(values, new Float32Array(MAP_LEN)));
  }

  /** @param {Step} step */
  contacts({ contacts, expect }) {
    const list = /** @type {Step[]} */ (contacts);
    const map = new Float32Array(MAP_LEN);
    const radiiMm = list.every((c) => c.radius_mm) ? list.map((c) => c.radius_mm) : null;
    this.atlas.contactMap(list.flatMap((c) => c.at_mm), list.map((c) => c.force_n), radiiMm, map);
    checkMap(expect, map);
    if (expect.force_n) near('force', this.atlas.forceN(map), expect.force_n);
  }
}

/**
 * Runs all cases.
 * @param {{url: string, control: string, file: Step, report: (line: string) => void}} options
 * @returns {Promise<number>} how many failed
 */
export async function run({ url, control, file, report }) {
  const atlas = await Atlas.load(url);
  same('the atlas', atlas.hash, file.atlas_hash);
  let failed = 0;
  for (const { name, steps } of file.cases) {
    const runner = new Runner(url, control, atlas, file.timeout_s * 1000);
    let at = 0;
    try {
      for (const step of steps) {
        at++;
        await /** @type {any} */ (runner)[step.do](step);
      }
      report(`ok ${name}`);
    } catch (error) {
      failed++;
      report(`FAIL ${name}: step ${at} (${steps[at - 1]?.do}): ${error instanceof Error ? error.message : error}`);
    }
    runner.session?.close();
    runner.hand?.close();
  }
  return failed;
}
