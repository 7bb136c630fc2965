// Effects as switches: what each costs on this machine, what it changed just now, and where the time
// of a frame goes. What is not switched on is not computed: the frame's own timings show it.

import { digits } from './colour.mjs';
import { byId, put } from './notice.mjs';
import { Times, keep, median, msOf } from './times.mjs';
import { EFFECTS } from './words.mjs';

/** So many answers under new terms are compared with as many under the old ones. */
const ENOUGH = 12;
const REFRESH_MS = 300;
const PARTS = [['wait', 'waited for a thread'], ['solve', 'contact'], ['infer', 'network'], ['rest', '']];
/** What is left of a frame's time: the service does not tell effects and its own checks apart. */
const REST = { bare: 'checks and sending', more: 'effects, checks and sending' };
/** Where the electrodes of the example are, px. */
const GRID = [80, 101, 122, 143];
const OFF = 'off';
/** These exclude each other (docs/reference/protocol-effects.md). */
const EXCLUDES = { relaxation: 'shear_energy', shear_energy: 'relaxation' };

/** The last answers under the same terms. */
class Recent {
  constructor() {
    this.times = new Times();
    this.bytes = 0;
    this.peak = [];
  }

  push(answer, peak) {
    this.times.push(answer);
    keep(this.peak, peak);
    this.bytes = answer.bytes;
  }

  get count() {
    return this.peak.length;
  }
}

export class EffectSwitches {
  /** `listing` as /v1/effects gives it; `changed(name, on)` is called when a switch was moved. */
  constructor(listing, changed) {
    this.on = new Set();
    this.recent = new Recent();
    this.before = null;
    this.switched = '';
    /** The effect switched last. */
    this.last = '';
    this.said = '';
    this.shownAtMs = 0;
    this.rows = new Map();
    const session = listing.effects.filter(({ of, name }) => of === 'session' && name in EFFECTS);
    const order = Object.keys(EFFECTS);
    session.sort((a, b) => order.indexOf(a.name) - order.indexOf(b.name));
    for (const effect of session) this.#row(effect, changed);
    const bar = byId('frame-bar');
    this.bars = PARTS.map(([name]) => {
      const part = document.createElement('i');
      part.className = name;
      bar.append(part);
      return part;
    });
    this.keys = PARTS.map(([name, label]) => {
      const key = document.createElement('span');
      key.className = `key ${name}`;
      const figure = document.createElement('output');
      const words = document.createElement('span');
      words.textContent = `${label} `;
      if (name === 'rest') {
        this.restWords = words;
        words.textContent = `${REST.bare} `;
      }
      key.append(words, figure);
      byId('frame-key').append(key);
      return figure;
    });
  }

  #row({ name, cost_us: costUs }, changed) {
    const [label, about] = EFFECTS[name];
    const row = byId('effects-list').tBodies[0].insertRow();
    const head = document.createElement('th');
    head.scope = 'row';
    const box = Object.assign(document.createElement('input'), { type: 'checkbox', id: `effect-${name}`, autocomplete: 'off' });
    const check = document.createElement('label');
    check.className = 'check';
    const term = document.createElement('span');
    term.className = 'term';
    term.dataset.tip = about;
    term.textContent = label;
    // The tip beside the switch is seen; this is heard.
    const heard = Object.assign(document.createElement('span'), { className: 'sr', id: `about-${name}`, textContent: about });
    box.setAttribute('aria-describedby', heard.id);
    check.append(box, term);
    head.append(check, heard);
    row.append(head);
    row.insertCell().textContent = costUs === null ? '–' : msOf(costUs);
    const now = row.insertCell();
    now.textContent = OFF;
    this.rows.set(name, { box, now, costUs });
    box.addEventListener('change', () => {
      this.set(name, box.checked);
      changed(name, box.checked);
    });
  }

  /** Moves a switch without telling. */
  set(name, on) {
    const row = this.rows.get(name);
    if (!row) return;
    this.before = this.recent.count >= ENOUGH ? this.recent : null;
    this.recent = new Recent();
    this.switched = `${EFFECTS[name][0]} ${on ? 'on' : 'off'}`;
    this.said = '';
    this.last = name;
    row.box.checked = on;
    if (on) this.on.add(name);
    else this.on.delete(name);
    if (on && EXCLUDES[name] && this.on.has(EXCLUDES[name])) this.set(EXCLUDES[name], false);
    if (!on) row.now.textContent = OFF;
  }

  /** Whether a switch can be moved: what cannot be had is not offered. */
  allow(name, isAllowed) {
    const row = this.rows.get(name);
    if (row) row.box.disabled = !isAllowed;
  }

  /** Other terms than an effect have changed: what follows is no effect's doing. */
  forget() {
    this.before = null;
    this.recent = new Recent();
    this.said = '';
  }

  /** Members of the hello; `pressed` is where, px. */
  hello(pressed) {
    const terms = { effects: [...this.on] };
    if (this.on.has('points')) terms.points = [{ px: pressed.map((x) => Number(x.toFixed(2))) }];
    if (this.on.has('actuators')) {
      terms.actuators = { radius_mm: 1, gain: 0.005, actuators: GRID.flatMap((v) => GRID.map((u) => ({ at: { px: [u, v] } }))) };
    }
    return terms;
  }

  /** Takes an answer; `peak` is the largest SED of it. */
  answer(answer, peak, nowMs) {
    this.recent.push(answer, peak);
    if (nowMs - this.shownAtMs < REFRESH_MS) return;
    this.shownAtMs = nowMs;
    this.#bar();
    this.#results(answer);
    this.#changes();
  }

  #bar() {
    const { recent } = this;
    const rest = `${this.on.size === 0 ? REST.bare : REST.more} `;
    if (this.restWords.textContent !== rest) this.restWords.textContent = rest;
    const whole = PARTS.reduce((sum, [name]) => sum + recent.times.of(name), 0) || 1;
    PARTS.forEach(([name], k) => {
      this.bars[k].style.width = `${(100 * recent.times.of(name)) / whole}%`;
      this.keys[k].textContent = `${msOf(recent.times.of(name))} ms`;
      // Where maps are given there is no contact to find.
      this.keys[k].parentElement.hidden = name === 'solve' && recent.times.of(name) === 0;
    });
  }

  /** What each effect brought with this answer. */
  #results(answer) {
    const bring = (name, text) => {
      const row = this.rows.get(name);
      if (row && this.on.has(name) && row.now.textContent !== text) row.now.textContent = text;
    };
    if (answer.ratesHz) bring('afferents', `fastest ${answer.ratesHz.reduce((a, b) => Math.max(a, b), 0).toFixed(0)} Hz`);
    if (answer.spikes) bring('spikes', `${answer.spikes.count} in this answer, plotted below`);
    if (answer.summary) bring('summary', `${answer.summary[0].toFixed(2)} N on ${answer.summary[1].toFixed(0)} mm²`);
    if (answer.points) bring('points', `${digits(answer.points[0])} J/m³`);
    if (answer.actuators) this.#electrodes(answer.actuators);
    if (this.on.has('contact_window')) bring('contact_window', `${(answer.bytes / 1024).toFixed(0)} KiB an answer`);
    for (const name of ['relaxation', 'shear_energy']) bring(name, `peak of SED ${digits(median(this.recent.peak))} J/m³`);
  }

  /** The intensities of the electrodes, one square each, as they lie on the pad. */
  #electrodes(intensities) {
    const row = this.rows.get('actuators');
    if (!row || !this.on.has('actuators')) return;
    if (row.now.firstElementChild?.childElementCount !== intensities.length) {
      const box = document.createElement('span');
      box.className = 'electrodes';
      box.setAttribute('role', 'img');
      box.append(...Array.from(intensities, () => document.createElement('i')));
      row.now.replaceChildren(box);
    }
    const most = intensities.reduce((a, b) => Math.max(a, b), 0);
    const box = row.now.firstElementChild;
    box.setAttribute('aria-label', `strongest electrode at ${(100 * Math.min(1, most)).toFixed(0)} %`);
    box.title = box.ariaLabel;
    intensities.forEach((x, k) => { box.children[k].style.opacity = String(0.08 + 0.92 * Math.min(1, x)); });
  }

  /** What those that are on cost together, as the service lists them. */
  #listedUs() {
    let sum = 0;
    for (const name of this.on) sum += this.rows.get(name)?.costUs ?? 0;
    return sum;
  }

  #changes() {
    const { recent, before } = this;
    const note = byId('effects-note');
    if (before && recent.count >= ENOUGH) {
      const [was, is] = [before.times.workUs, recent.times.workUs];
      const peak = median(recent.peak) / median(before.peak) - 1;
      const parts = [`${this.switched}: ${is >= was ? '+' : '−'}${msOf(Math.abs(is - was))} ms a frame now (${msOf(was)} to ${msOf(is)})`];
      if (Math.abs(peak) > 0.005) parts.push(`peak of SED ${peak > 0 ? '+' : '−'}${Math.abs(100 * peak).toFixed(1)} %`);
      if (recent.bytes !== before.bytes) parts.push(`an answer ${(before.bytes / 1024).toFixed(0)} to ${(recent.bytes / 1024).toFixed(0)} KiB`);
      this.said = `${parts.join('; ')}.`;
    }
    put('tab-effects', this.on.size === 0 ? 'none on, 0 ms' : `${this.on.size} on, ${msOf(this.#listedUs())} ms`);
    const text = this.said || (this.on.size === 0 ? 'Nothing is named, so no effect is in memory and none takes time.' : '');
    if (note.textContent !== text) note.textContent = text;
  }
}
