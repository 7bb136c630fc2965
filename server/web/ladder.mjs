// The ladder: error against time of every rung, the running one marked; a click on a rung switches to it.
// Times of rungs that this server serves are its own calibration, the others' are those shipped.

import { byId, put } from './notice.mjs';
import { fetchJson } from './replay.mjs';
import { choosable, errorFrom, setFor, suits } from './tiers.mjs';
import { aboutMethod, aboutSet, aboutTier, nameOfMethod, nameOfOthers, nameOfSet, nameOfTier } from './words.mjs';

const SVG = 'http://www.w3.org/2000/svg';
const MARGIN = { left: 52, right: 14, top: 12, bottom: 38 };
const FONT_PX = 11;
const DOT_PX = 5;
/** Least distance of two numbers on the time axis. */
const TICK_PX = 46;
const KINDS = {
  closed_form: 'closed form', operator: 'operator', network: 'network', s1_network: 'published U-Net', fe: 'finite elements (FE)',
};

/** Two significant digits without needless zeros. */
export function short(value) {
  const digits = Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(Math.max(1e-9, Math.abs(value))))));
  return String(Number(value.toFixed(digits)));
}

export const showTime = (ms) => (ms < 1000 ? `${short(ms)} ms` : `${short(ms / 1000)} s`);
export const showError = (error) => `${short(100 * error)} %`;

/** Names of the sets that were measured; without a ladder the cards' own figures. */
export function setsOf(data) {
  const sets = (data.ladder?.sets ?? []).filter((set) => set.samples > 0).map((set) => set.name);
  return sets.length ? sets : ['cards'];
}

/** The rungs that have a time and an error on `set`, which of them can be served, and which nothing beats. */
export function rungsOn(data, set) {
  const tierOf = (name) => data.tiers.find((tier) => tier.name === name);
  const here = (tier) => (tier.calibrated_us?.p50 ?? tier.predicted_latency_us) / 1000;
  const rungs = [];
  for (const rung of data.ladder?.rungs ?? []) {
    const tier = tierOf(rung.model);
    const timeMs = tier ? here(tier) : rung.latency_ms?.tract.p50 ?? 1000 * (rung.seconds?.p50 ?? NaN);
    const own = rung.reference ? data.ladder.discretisation_error?.sed_relative_l2 : rung.errors[set]?.relative_l2.median;
    const error = rung.errors[set] ? own : NaN;
    rungs.push({ name: rung.name, kind: rung.kind, tier: tier?.name ?? null, timeMs, error, reference: rung.reference === true });
  }
  if (set === 'cards') {
    for (const tier of data.tiers) {
      rungs.push({ name: tier.name, kind: tier.kind, tier: tier.name, timeMs: here(tier), error: tier.relative_l2_median, reference: false });
    }
  }
  const drawn = rungs.filter(({ timeMs, error }) => timeMs > 0 && error > 0);
  const beats = (a, b) => a.timeMs <= b.timeMs && a.error <= b.error && (a.timeMs < b.timeMs || a.error < b.error);
  const served = drawn.filter((rung) => rung.tier !== null);
  return drawn
    .map((rung) => ({ ...rung, onFront: !drawn.some((other) => beats(other, rung)), onServedFront: rung.tier !== null && !served.some((other) => beats(other, rung)) }))
    .sort((a, b) => a.timeMs - b.timeMs);
}

/** A logarithmic axis over the values: ends and ticks; a decade at least. */
export function logAxis(values, low, high) {
  let least = Math.min(...values) / low;
  let most = Math.max(...values) * high;
  if (!(most > least)) [least, most] = [0.1, 1];
  const grow = Math.max(0, 1.05 - Math.log10(most / least)) / 2;
  least *= 10 ** -grow;
  most *= 10 ** grow;
  const steps = Math.log10(most / least) < 2.5 ? [1, 2, 5] : [1];
  const ticks = [];
  for (let power = Math.floor(Math.log10(least)); power <= Math.log10(most); power++) {
    for (const step of steps) {
      const tick = step * 10 ** power;
      if (tick >= least && tick <= most) ticks.push(tick);
    }
  }
  const span = Math.log(most / least);
  return { least, most, ticks, part: (value) => Math.log(value / least) / span };
}

/** Left end and middle height of a name beside its dot, clear of dots and other names; null where there is no room. */
export function placeName(taken, x, y, width, right) {
  const half = FONT_PX / 2 + 1;
  const candidates = [];
  for (const lift of [0, 9, -9]) candidates.push([x + 11, y + lift]);
  for (const lift of [15, -15]) candidates.push([x - width / 2, y + lift]);
  for (const lift of [0, 9, -9]) candidates.push([x - 11 - width, y + lift]);
  for (const lift of [26, -26]) candidates.push([x - width / 2, y + lift], [x + 8, y + lift]);
  const box = ([left, middle]) => [left, middle - half, left + width, middle + half];
  const apart = (a, b) => a[2] < b[0] || b[2] < a[0] || a[3] < b[1] || b[3] < a[1];
  const free = (c) => c[0] > MARGIN.left && c[0] + width < right && taken.every((t) => apart(box(c), t));
  const found = candidates.find(free) ?? null;
  if (found) taken.push(box(found));
  return found;
}

const oneDigit = (value) => value.toFixed(value < 9.95 ? 1 : 0);
const least = (among, key) => among.reduce((a, b) => (a === undefined || b[key] < a[key] ? b : a), undefined);

/**
 * Ways to answer a frame, each with its time, ms: every network that learnt what is given, with every
 * contact method where frames are poses.
 */
function waysOf({ tiers, methods }, given) {
  const networks = choosable(tiers, given);
  const contacts = given === 'poses' && methods ? methods : [null];
  return networks.flatMap((tier) => contacts.map((method) => ({
    tier: tier.name, error: errorFrom(tier, given), method: method?.name ?? null, ms: (tier.predicted_latency_us + (method?.contact_us ?? 0)) / 1000,
    contactError: method?.errors?.[0]?.pressure_relative_l2.median ?? 0,
  })));
}

/**
 * What to do where frames are late, or in words that nothing is that fast: the most accurate way within
 * the budget, of networks alone, since a closed form is another thing than a fast network.
 */
export function adviseTier(listing, { tier, method, budgetMs, given }) {
  const ways = waysOf(listing, given);
  if (ways.length === 0) return { text: 'raise the budget' };
  const meeting = ways.filter((way) => way.ms <= budgetMs && (way.tier !== tier || (given === 'poses' && way.method !== method)));
  const said = (way) => `${nameOfTier(way.tier)}${way.method && way.method !== method ? ` with contact ${nameOfMethod(way.method)}` : ''}`;
  const best = least(meeting.map((way) => ({ ...way, sum: Math.hypot(way.error, way.contactError) })), 'sum');
  if (best) return { text: `raise the budget or take ${said(best)}`, tier: best.tier, method: best.method };
  const fastest = least(ways, 'ms');
  return { text: `no model is that fast here; the fastest, ${said(fastest)}, takes some ${short(fastest.ms)} ms`, tier: fastest.tier, method: fastest.method };
}

function optionOf(tier, text, value, given) {
  const option = new Option(text, value);
  option.title = aboutTier(tier.name, tier, given);
  return option;
}

/** Choices of tiers: those that learnt what is given, then a group of the others. */
function choicesOf(tiers, given, option) {
  const others = Object.assign(document.createElement('optgroup'), { label: nameOfOthers(given) });
  others.append(...tiers.filter((tier) => !suits(tier, given)).map(option));
  return [...tiers.filter((tier) => suits(tier, given)).map(option), ...(others.childElementCount > 0 ? [others] : [])];
}

/** The tiers as the choices of the model, each with its error from what is given; first those that learnt it. */
export function offerTiers({ tiers }, given) {
  const select = byId('tier');
  const chosen = select.value;
  const [byBudget] = select.options;
  const option = (tier) => {
    // As in the plot: the model alone, as measured here when the service started.
    const ms = showTime((tier.calibrated_us?.p50 ?? tier.predicted_latency_us) / 1000);
    const error = errorFrom(tier, given);
    return optionOf(tier, `${nameOfTier(tier.name)} (${ms}${error > 0 ? `, ${oneDigit(100 * error)} % off` : ''})`, tier.name, given);
  };
  select.replaceChildren(byBudget, ...choicesOf(tiers, given, option));
  select.value = chosen;
}

/** What the server says of its tiers and methods; they go into the choices. */
export async function listTiers() {
  const listing = await fetchJson('v1/tiers');
  const given = listing.methods === null ? 'pressure' : 'poses';
  offerTiers(listing, given);
  byId('with').append(...choicesOf(listing.tiers, given, (tier) => optionOf(tier, nameOfTier(tier.name), `tier:${tier.name}`, given)));
  for (const method of listing.methods ?? []) {
    const name = nameOfMethod(method.name);
    const option = new Option(`${name} (${oneDigit(method.contact_us / 1000)} ms)`, method.name);
    option.title = aboutMethod(method.name);
    byId('method').append(option);
    byId('with').append(new Option(`contact ${name}`, `method:${method.name}`));
  }
  return listing;
}

function make(parent, tag, attributes, text) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  if (text !== undefined) element.textContent = text;
  parent.append(element);
  return element;
}

export class LadderView {
  /** `data` as /v1/tiers gives it; `choose(tier)` is called with the name of the rung clicked. */
  constructor(data, given, choose) {
    this.data = data;
    this.given = given;
    this.choose = choose;
    this.svg = byId('ladder-plot');
    this.select = byId('ladder-set');
    this.running = '';
    this.ready = null;
    this.budgetMs = NaN;
    this.live = null;
    this.select.replaceChildren(...setsOf(data).map((set) => new Option(nameOfSet(set), set)));
    // The set of the errors in the choices, so that all say the same.
    this.select.value = setFor(data, setsOf(data), given);
    this.select.addEventListener('change', () => this.draw());
    byId('ladder-machine').textContent = data.ladder ? `Shipped figures: ${data.ladder.machine}.` : '';
    new ResizeObserver(() => this.draw()).observe(this.svg);
    this.#listen();
    this.draw();
  }

  /** Dragging goes from one served model to the next, along the line. */
  #listen() {
    const { svg } = this;
    const follow = (event) => {
      const { left } = svg.getBoundingClientRect();
      const near = this.rungs.filter((rung) => rung.tier !== null && rung.onServedFront).map((rung) => ({ rung, px: Math.abs(this.x(rung.timeMs) - (event.clientX - left)) }));
      const nearest = least(near, 'px');
      if (nearest && nearest.rung.tier !== this.running) {
        this.running = nearest.rung.tier;
        this.choose(nearest.rung.tier);
      }
    };
    svg.addEventListener('pointerdown', (event) => {
      if (event.target.closest('.served') || !this.rungs?.length) return;
      svg.setPointerCapture(event.pointerId);
      follow(event);
    });
    svg.addEventListener('pointermove', (event) => { if (svg.hasPointerCapture(event.pointerId)) follow(event); });
  }

  /** Other things are given: the set that judges that is shown, unless the visitor had chosen another one. */
  setGiven(given) {
    const sets = setsOf(this.data);
    if (this.select.value === setFor(this.data, sets, this.given)) this.select.value = setFor(this.data, sets, given);
    this.given = given;
    this.draw();
  }

  /** The session has new terms. */
  setReady(ready) {
    this.ready = ready;
    this.running = ready.tier;
    this.budgetMs = ready.budget_us ? ready.budget_us / 1000 : NaN;
    this.draw();
  }

  /** Name and median relative L2 of each set that a tier was measured on. */
  medians(tier) {
    const sets = setsOf(this.data).map((set) => [set, rungsOn(this.data, set).find((rung) => rung.tier === tier)?.error]);
    return sets.filter(([, median]) => median > 0);
  }

  draw() {
    const { svg } = this;
    const [width, height] = [svg.clientWidth, svg.clientHeight];
    if (width === 0 || height === 0) return;
    svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
    this.rungs = rungsOn(this.data, this.select.value);
    byId('ladder-set-about').textContent = `${nameOfSet(this.select.value)}: ${aboutSet(this.data.ladder?.sets, this.select.value)}.`;
    const focused = document.activeElement?.dataset?.tier;
    svg.replaceChildren();
    this.live = null;
    if (this.rungs.length === 0) return;
    this.#key();
    this.#axes(width, height);
    this.#front();
    this.#dots(width);
    if (focused) svg.querySelector(`[data-tier="${CSS.escape(focused)}"]`)?.focus();
    this.#words(NaN, NaN);
  }

  /** Names the kinds that this set shows. */
  #key() {
    const kinds = new Set(this.rungs.map((rung) => rung.kind));
    const key = (kind, name) => Object.assign(document.createElement('span'), { className: `key ${kind}`, textContent: name });
    const shown = Object.entries(KINDS).filter(([kind]) => kinds.has(kind)).map(([kind, name]) => key(kind, name));
    byId('ladder-key').replaceChildren(...shown, key('now', 'now'));
  }

  #axes(width, height) {
    const { svg, rungs } = this;
    const times = rungs.map((rung) => rung.timeMs);
    const time = logAxis(Number.isNaN(this.budgetMs) ? times : [...times, this.budgetMs], 2, 2.5);
    const error = logAxis(rungs.map((rung) => rung.error), 1.6, 1.6);
    const bottom = height - MARGIN.bottom;
    this.x = (ms) => MARGIN.left + Math.min(1, Math.max(0, time.part(ms))) * (width - MARGIN.left - MARGIN.right);
    this.y = (value) => bottom - Math.min(1, Math.max(0, error.part(value))) * (bottom - MARGIN.top);
    let lastPx = -Infinity;
    for (const tick of time.ticks) {
      make(svg, 'line', { class: 'grid', x1: this.x(tick), x2: this.x(tick), y1: MARGIN.top, y2: bottom });
      if (this.x(tick) - lastPx < TICK_PX) continue;
      lastPx = this.x(tick);
      make(svg, 'text', { class: 'tick', x: this.x(tick), y: bottom + 14, 'text-anchor': 'middle' }, showTime(tick));
    }
    for (const tick of error.ticks) {
      make(svg, 'line', { class: 'grid', x1: MARGIN.left, x2: width - MARGIN.right, y1: this.y(tick), y2: this.y(tick) });
      make(svg, 'text', { class: 'tick', x: MARGIN.left - 6, y: this.y(tick) + 4, 'text-anchor': 'end' }, showError(tick));
    }
    make(svg, 'text', { class: 'tick', x: width - MARGIN.right, y: height - 6, 'text-anchor': 'end' }, 'time of one map (FE: one state)');
    if (!Number.isNaN(this.budgetMs)) {
      const x = this.x(this.budgetMs);
      make(svg, 'line', { class: 'budget', x1: x, x2: x, y1: MARGIN.top, y2: bottom });
      const isRight = x + 4 + 6 * FONT_PX > width;
      make(svg, 'text', { class: 'tick', x: isRight ? x - 4 : x + 4, y: MARGIN.top + 8, 'text-anchor': isRight ? 'end' : 'start' }, 'budget');
    }
  }

  #front() {
    const points = this.rungs.filter((rung) => rung.onFront).map((rung) => `${this.x(rung.timeMs)},${this.y(rung.error)}`);
    make(this.svg, 'polyline', { class: 'front', points: points.join(' ') });
  }

  #dots(width) {
    const { svg, rungs } = this;
    const taken = rungs.map((rung) => {
      const [x, y] = [this.x(rung.timeMs), this.y(rung.error)];
      const reach = rung.tier !== null && rung.tier === this.running ? DOT_PX + 5 : DOT_PX + 2;
      return [x - reach, y - reach, x + reach, y + reach];
    });
    this.live = make(svg, 'g', { class: 'live', 'aria-hidden': 'true' });
    this.liveLine = make(this.live, 'line', {});
    this.liveDot = make(this.live, 'path', { d: 'M-5 0H5M0 -5V5' });
    const groups = new Map();
    for (const rung of rungs) {
      const [x, y] = [this.x(rung.timeMs), this.y(rung.error)];
      const group = make(svg, 'g', { class: `rung ${rung.kind}` });
      make(group, 'title', {}, `${nameOfTier(rung.name)} (${KINDS[rung.kind] ?? rung.kind}): ${showError(rung.error)} in ${showTime(rung.timeMs)}. ${aboutTier(rung.name, this.data.tiers.find(({ name }) => name === rung.tier), this.given)}`);
      if (rung.tier) this.#button(group, rung);
      if (rung.tier !== null && rung.tier === this.running) make(group, 'circle', { class: 'ring', cx: x, cy: y, r: DOT_PX + 4 });
      if (rung.kind === 'fe') make(group, 'path', { class: rung.reference ? 'dot hollow' : 'dot', d: `M${x} ${y - 6}l6 6l-6 6l-6 -6z` });
      else make(group, 'circle', { class: 'dot', cx: x, cy: y, r: DOT_PX });
      groups.set(rung, group);
    }
    // The running rung first, then those that can be had: where room is short, the others stay without a name.
    const weight = (rung) => (rung.tier === null ? 2 : rung.tier === this.running ? 0 : 1);
    for (const rung of [...rungs].sort((a, b) => weight(a) - weight(b))) {
      const boldness = rung.tier !== null && rung.tier === this.running ? 0.62 : 0.56;
      const place = placeName(taken, this.x(rung.timeMs), this.y(rung.error), nameOfTier(rung.name).length * FONT_PX * boldness, width - 2);
      if (place) make(groups.get(rung), 'text', { x: place[0], y: place[1] + 4 }, nameOfTier(rung.name));
    }
  }

  #button(group, rung) {
    group.classList.add('served');
    group.dataset.tier = rung.tier;
    group.setAttribute('role', 'button');
    group.setAttribute('tabindex', '0');
    group.setAttribute('aria-label', `${nameOfTier(rung.name)}: ${showError(rung.error)}, ${showTime(rung.timeMs)}`);
    group.setAttribute('aria-pressed', String(rung.tier === this.running));
    group.addEventListener('click', () => this.choose(rung.tier));
    group.addEventListener('keydown', (event) => {
      if (event.key !== 'Enter' && event.key !== ' ') return;
      event.preventDefault();
      this.choose(rung.tier);
    });
  }

  /** Moves the cross: what the running rung does now. `error` is NaN where the truth is not known. */
  showLive(serverMs, error) {
    const rung = this.rungs?.find(({ tier }) => tier === this.running);
    const known = rung && this.live && serverMs > 0;
    if (this.live) this.live.style.display = known ? '' : 'none';
    if (known) {
      const [x, y] = [this.x(serverMs), this.y(error > 0 ? error : rung.error)];
      this.liveDot.setAttribute('transform', `translate(${x} ${y})`);
      for (const [name, value] of [['x1', this.x(rung.timeMs)], ['y1', this.y(rung.error)], ['x2', x], ['y2', y]]) {
        this.liveLine.setAttribute(name, value.toFixed(1));
      }
    }
    this.#words(serverMs, error);
  }

  #words(serverMs, error) {
    const rung = this.rungs?.find(({ tier }) => tier === this.running);
    const parts = [];
    if (rung) parts.push(`${nameOfTier(rung.name)}: ${showError(rung.error)} off (${nameOfSet(this.select.value)}), ${showTime(rung.timeMs)} alone`);
    else if (this.running) parts.push(`${nameOfTier(this.running)}: not on this set`);
    if (serverMs > 0) parts.push(`now ${showTime(serverMs)} in the server${this.ready?.method ? ' with contact' : ''}`);
    if (error > 0) parts.push(`${showError(error)} on this frame`);
    if (this.ready?.meets_budget === false) parts.push('not expected to meet the budget');
    put('tab-ladder', rung ? `${serverMs > 0 ? showTime(serverMs) : '–'}, ${showError(error > 0 ? error : rung.error)} off` : '–');
    const text = parts.join('; ');
    if (byId('ladder-now').textContent !== text) byId('ladder-now').textContent = text;
  }
}
