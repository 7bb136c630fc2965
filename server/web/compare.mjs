// The other way: a second model or contact method on the same press, in a session of its own. It gets the
// same pose as the first one, so that its time and the error that it expects are of the whole way from
// poses. Where the service has no contact model, both get the same map of pressure.

import { MAP_LEN, Session, sessionUrl } from './protocol.mjs';
import { Times } from './times.mjs';

/** The second answer may take its time: the first session watches the server. */
const SILENT_MS = 10000;

/** |a - b| / |b| over the pixels. */
export function relativeL2(a, b, pixels) {
  let [error, size] = [0, 0];
  for (let n = 0; n < pixels.length; n++) {
    const [x, y] = [a[pixels[n]], b[pixels[n]]];
    error += (x - y) * (x - y);
    size += y * y;
  }
  return size > 0 ? Math.sqrt(error / size) : NaN;
}

/** A pair of answers to one contact. */
export class Comparison {
  /** `onpair(first, second, answer)` is called with two SED maps of one contact. */
  constructor(onpair, onfault) {
    this.onpair = onpair;
    this.onfault = onfault;
    this.session = null;
    this.with = '';
    /** Whether its frames are poses. */
    this.givesPoses = false;
    /** What the answer that is due is to be held against. */
    this.first = new Float32Array(MAP_LEN);
    this.times = new Times();
  }

  get isOn() {
    return this.with !== '';
  }

  /** Compares with `tier:NAME` or `method:NAME` from now on; '' ends it. */
  choose(what, hello) {
    this.with = what;
    this.givesPoses = hello.input === 'objects';
    this.times.clear();
    if (what === '') {
      this.session?.close();
      this.session = null;
      return;
    }
    this.session ??= new Session(sessionUrl(), {
      onstate: () => {},
      onready: () => this.times.clear(),
      onanswer: (answer) => this.#answer(answer),
      onfault: (code, message) => this.onfault(message),
    }, SILENT_MS);
    this.session.open(hello);
  }

  /** Offers a contact that was answered; it is taken if none is on its way. `pose` is where the indenter was. */
  offer(pressurePa, sedJPerM3, pose, nowMs) {
    const { session } = this;
    if (!session?.ready || session.inFlight) return;
    const frame = this.givesPoses ? session.poseFrame : session.mapFrame;
    frame.values.set(this.givesPoses ? pose : pressurePa);
    if (session.send(nowMs, frame)) this.first.set(sedJPerM3);
  }

  #answer(answer) {
    if (answer.status !== 'ok') return;
    this.times.push(answer);
    this.onpair(this.first, answer.sedJPerM3, answer);
  }
}
