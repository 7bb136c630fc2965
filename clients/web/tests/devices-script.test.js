// The script of devices, clients/conformance/devices.json, as every client runs it: without a service, on a clock of its own.

import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { test } from 'node:test';
import { Device, actuators, force, spikeRate } from '../src/devices.js';
import { NotCarriedError, SUMMARY } from '../src/wire.js';

const SCRIPT = JSON.parse(await readFile(new URL('../../conformance/devices.json', import.meta.url), 'utf8'));
/** @type {Record<string, number>} */
const WORDS = { nan: NaN, inf: Infinity };
/** @param {number | string} said */
const number = (said) => (typeof said === 'string' ? WORDS[said] : said);

/** @param {any} said @param {() => number} clockMs */
function deviceOf(said, clockMs) {
  const read = said.force ? force(number(said.force.full_n), said.force.threshold_n)
    : said.actuators ? actuators(said.actuators.full)
      : spikeRate({ units: said.spike_rate.units.map((/** @type {string} */ name) => ({ class: name })) }, said.spike_rate.full_hz);
  const { fingers, max_hz: maxHz } = said;
  const [holdMs, fadeMs] = [said.hold_s, said.fade_s].map((s) => (s === undefined ? s : 1000 * s));
  return new Device(read, { fingers, maxHz, holdMs, fadeMs, clockMs });
}

/** @param {any} said @returns {import('../src/devices.js').Felt} */
function answerOf(said) {
  const touch = said.force_n ? /** @type {any} */ ({ forceN: said.force_n.map(number) }) : null;
  const summary = said.summary_force_n === undefined ? null : SUMMARY.map((name) => (name === 'force_n' ? said.summary_force_n : 0));
  return {
    finger: said.finger, status: said.status, clientTimeUs: said.client_time_us ?? 0, noContact: said.no_contact ?? false,
    notTracked: said.not_tracked ?? false, touch, summary, actuators: said.actuators ?? null, spikes: said.spikes ? { unit: said.spikes } : null,
  };
}

/** @param {number} found @param {number} due */
const near = (found, due) => assert.ok(Math.abs(found - due) <= SCRIPT.tolerance, `${found}, not ${due}`);

/** @param {import('../src/devices.js').Command | null} command @param {any} due */
function compare(command, due) {
  if (due === null) return assert.equal(command, null);
  assert.ok(command, 'no command');
  due.levels.forEach((/** @type {number[]} */ row, /** @type {number} */ finger) => row.forEach((level, k) => near(command.levels[finger][k] ?? 0, level)));
  assert.equal(command.levels.length, due.levels.length);
  near(command.amplitude, due.amplitude);
  near(command.durationMs / 1000, due.duration_s);
}

for (const { name, device: said, refused, steps } of SCRIPT.cases) {
  test(name, () => {
    let nowMs = 0;
    const clockMs = () => nowMs;
    if (refused) {
      assert.throws(() => deviceOf(said, clockMs), RangeError);
      return;
    }
    const device = deviceOf(said, clockMs);
    for (const step of steps) {
      nowMs = 1000 * step.at_s;
      if ('poll' in step) compare(device.poll(), step.poll);
      else if (step.stop) compare(device.stop(), step.stop);
      else if (step.refused || step.not_carried) assert.throws(() => device.feed(answerOf(step.feed)), step.refused ? RangeError : NotCarriedError);
      else device.feed(answerOf(step.feed));
    }
  });
}
