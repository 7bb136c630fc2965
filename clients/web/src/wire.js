// The frames of the protocol: a header of 48 bytes, little-endian, and the samples.

export const SIDE_PX = 224;
export const MAP_LEN = SIDE_PX * SIDE_PX;
export const HEADER_BYTES = 48;
/** Before the samples of the section `rates`: their scale, and zeros. */
export const RATES_HEAD_BYTES = 16;
/** The most spikes that an answer carries, and its bytes of them: two numbers, then a unit and a time each. */
const SPIKES_MAX = 16384;
const SPIKES_BYTES_MAX = 8 + 4 * SPIKES_MAX;
/** Room for the largest answer: header, summary, 1024 points with their rates, 1024 actuators, spikes, f32 rates and an f32 map. */
export const ANSWER_BYTES_MAX = HEADER_BYTES + 64 + 3 * 4096 + SPIKES_BYTES_MAX + RATES_HEAD_BYTES + 2 * 4 * MAP_LEN;

export const STATUS = /** @type {const} */ (['ok', 'superseded', 'late', 'error', 'stale']);
export const SAMPLE_TYPES = /** @type {const} */ (['f32', 'f16', 'u16', 'u8']);
export const SAMPLE_BYTES = [4, 2, 2, 1];
export const KIND = { pressure: 1, sed: 2 };
export const FLAG = { outOfRange: 1, noContact: 2, unfamiliar: 4, unsettled: 8, cutOff: 16, notTracked: 32, coarseClock: 64 };

export const MAGIC = 0x314c5050; // the bytes 'P' 'P' 'L' '1'
export const VERSION = 3;
const TWO_POW_32 = 4294967296;
const F16_MAX = 65504;

const asFloat = new Float32Array(1);
const asBits = new Uint32Array(asFloat.buffer);

/** @param {number} value @returns {number} bits of the nearest f16, ties to even, clamped to +-65504 */
export function toHalf(value) {
  asFloat[0] = value > F16_MAX ? F16_MAX : value < -F16_MAX ? -F16_MAX : value;
  const bits = asBits[0];
  const sign = (bits >>> 16) & 0x8000;
  const exponent = (bits >>> 23) & 0xff;
  const fraction = bits & 0x7fffff;
  if (exponent === 0xff) return sign | 0x7c00 | (fraction ? 0x200 : 0);
  if (exponent >= 113) {
    // A carry out of the fraction raises the exponent, as it should.
    const kept = ((exponent - 112) << 10) | (fraction >>> 13);
    return sign | roundedUp(kept, fraction & 0x1fff, 0x1000);
  }
  if (exponent < 102) return sign;
  // Subnormal: units of 2^-24.
  const shift = 126 - exponent;
  const whole = fraction | 0x800000;
  return sign | roundedUp(whole >>> shift, whole & ((1 << shift) - 1), 1 << (shift - 1));
}

/** @param {number} kept @param {number} rest @param {number} half */
function roundedUp(kept, rest, half) {
  return rest > half || (rest === half && kept & 1) ? kept + 1 : kept;
}

/** @type {Float32Array | null} */
let halves = null;

/** @returns {Float32Array} the value of each of the 65536 f16 */
function halfTable() {
  if (halves) return halves;
  halves = new Float32Array(65536);
  for (let bits = 0; bits < 65536; bits++) {
    const exponent = (bits >>> 10) & 31;
    const fraction = bits & 1023;
    let value = exponent === 0 ? fraction * 2 ** -24 : (1 + fraction / 1024) * 2 ** (exponent - 15);
    if (exponent === 31) value = fraction ? NaN : Infinity;
    halves[bits] = bits & 0x8000 ? -value : value;
  }
  return halves;
}

/** A request whose buffer is made once and refilled for every frame. */
export class RequestFrame {
  constructor() {
    this.buffer = new ArrayBuffer(HEADER_BYTES + 4 * MAP_LEN);
    this.bytes = HEADER_BYTES;
    this.header = new DataView(this.buffer, 0, HEADER_BYTES);
    this.samplesF32 = new Float32Array(this.buffer, HEADER_BYTES, MAP_LEN);
    this.samplesU16 = new Uint16Array(this.buffer, HEADER_BYTES, MAP_LEN);
    this.samplesU8 = new Uint8Array(this.buffer, HEADER_BYTES, MAP_LEN);
    this.header.setUint32(0, MAGIC, true);
    this.header.setUint8(4, VERSION);
    this.header.setUint8(5, KIND.pressure);
  }

  /**
   * Sequence, deadline (us, 0: the session's) and the client's time in us, split by hand because a
   * BigInt would be an allocation.
   * @param {number} sequence @param {number} timeUs @param {number} deadlineUs
   */
  stamp(sequence, timeUs, deadlineUs) {
    this.header.setUint32(8, sequence, true);
    this.header.setUint32(16, timeUs % TWO_POW_32, true);
    this.header.setUint32(20, timeUs / TWO_POW_32, true);
    this.header.setUint32(24, deadlineUs, true);
  }

  /** That nobody knows what presses: a header alone. */
  encodeNotTracked() {
    this.encode(this.samplesF32, 0, 0, 0, 0, 0, 0, 0, 1);
    this.header.setUint8(46, FLAG.notTracked);
  }

  /**
   * Encodes a window of the map.
   * @param {Float32Array} values Pa, row-major
   * @param {number} first index of the window's first sample in `values`
   * @param {number} stride samples of `values` from one row to the next
   * @param {number} column place of the window in the map
   * @param {number} row
   * @param {number} width
   * @param {number} height
   * @param {number} type index into SAMPLE_TYPES
   * @param {number} scale Pa per unit of u16 and u8
   */
  encode(values, first, stride, column, row, width, height, type, scale) {
    const { header } = this;
    header.setUint8(46, 0);
    header.setUint8(6, type);
    header.setUint16(12, width, true);
    header.setUint16(14, height, true);
    header.setFloat32(28, type >= 2 ? scale : 1, true);
    header.setUint16(32, column, true);
    header.setUint16(34, row, true);
    this.bytes = HEADER_BYTES + width * height * SAMPLE_BYTES[type];
    // Rounding is by what the server multiplies with: the f32 of the scale.
    const perPa = type >= 2 ? 1 / Math.fround(scale) : 1;
    let to = 0;
    for (let y = 0; y < height; y++) {
      const from = first + y * stride;
      switch (type) {
        case 0: for (let x = 0; x < width; x++) this.samplesF32[to++] = values[from + x]; break;
        case 1: for (let x = 0; x < width; x++) this.samplesU16[to++] = toHalf(values[from + x]); break;
        case 2: for (let x = 0; x < width; x++) this.samplesU16[to++] = clampUnit(values[from + x] * perPa, 65535); break;
        default: for (let x = 0; x < width; x++) this.samplesU8[to++] = clampUnit(values[from + x] * perPa, 255);
      }
    }
  }
}

/**
 * Who fired since the answer before, in the order of time.
 * @typedef {object} Spikes
 * @property {Uint16Array} unit number of the unit in `ready.units`
 * @property {Float64Array} timeUs when, by the client's clock
 * @property {number} total spikes of the finger since the hello, those too that no answer carried; modulo 2^32
 */

/**
 * The section `spikes` of an answer.
 * @param {DataView} view @param {number} offset @param {number} bytes of the section @param {number} clientTimeUs
 * @returns {Spikes}
 */
export function readSpikes(view, offset, bytes, clientTimeUs) {
  const count = view.getUint32(offset + 4, true);
  if (8 + 4 * count > bytes) throw new Error(`an answer names ${count} spikes in ${bytes} bytes`);
  const unit = new Uint16Array(count);
  const timeUs = new Float64Array(count);
  for (let i = 0; i < count; i++) {
    unit[i] = view.getUint16(offset + 8 + 4 * i, true);
    timeUs[i] = clientTimeUs - view.getUint16(offset + 10 + 4 * i, true);
  }
  return { unit, timeUs, total: view.getUint32(offset, true) };
}

/** An answer was asked for what its session does not carry. */
export class NotCarriedError extends Error {
  /** @param {string} member @param {string} advice */
  constructor(member, advice) {
    super(`the answer carries no ${member}: ${advice}`);
    this.name = 'NotCarriedError';
    this.member = member;
  }
}

/** @param {number} units @param {number} most @returns {number} the nearest whole number in 0 ..= most */
function clampUnit(units, most) {
  return units >= most ? most : units > 0 ? (units + 0.5) | 0 : 0;
}

/**
 * An answer whose memory is made once: every message is copied into it, so what it holds stays until the
 * next one and nothing but the browser's own message is allocated.
 */
export class Answer {
  #buffer = new ArrayBuffer(ANSWER_BYTES_MAX);
  #all = new Uint8Array(this.#buffer);
  #view = new DataView(this.#buffer);
  #f32 = new Float32Array(this.#buffer);
  #u16 = new Uint16Array(this.#buffer);

  constructor() {
    /** @type {'ok' | 'superseded' | 'late' | 'stale' | 'error' | 'lost'} */
    this.status = 'lost';
    this.sequence = 0;
    /** What was wrong with a frame of status `error`. @type {import('./types.js').Problem | null} */
    this.problem = null;
    /** SED, J/m3: 224 x 224, row-major; 0 outside the window. Overwritten by the next answer. */
    this.map = new Float32Array(MAP_LEN);
    /** The window of the map that came (effect `contact_window`; else all of it). */
    this.column = 0;
    this.row = 0;
    this.width = 0;
    this.height = 0;
    /** The sixteen numbers of the effect `summary`, in the protocol's order (SUMMARY); null without it. @type {Float32Array | null} */
    this.summary = null;
    /** Whether the session carries a map of SED. */
    this.hasMap = false;
    /** Firing rates, Hz, 224 x 224: the effect `afferents`; `ratesHz` throws without. @type {Float32Array | null} */
    this.rates = null;
    /** SED at each point of the effect `points`, J/m3. @type {Float32Array | null} */
    this.points = null;
    /** Firing rates there, Hz: with the effect `afferents` too. @type {Float32Array | null} */
    this.pointRatesHz = null;
    /** One intensity an actuator of the effect `actuators`. @type {Float32Array | null} */
    this.actuators = null;
    /** The effect `spikes`. @type {Spikes | null} */
    this.spikes = null;
    /** How wrong this answer is likely to be, by what it shows (ERROR_ESTIMATE); what is not stated is infinite. */
    this.errorEstimate = new Float32Array(4).fill(Infinity);
    this.clientTimeUs = 0;
    this.roundTripUs = 0;
    /** Receipt to sending, in the server. */
    this.totalUs = 0;
    this.queueUs = 0;
    this.inferUs = 0;
    this.tierNumber = 0;
    this.outOfRange = false;
    this.noContact = false;
    /** The map is rougher or heavier than any the tier was trained on: its answer may mean nothing. */
    this.unfamiliar = false;
    this.cutOff = false;
    /** To a frame that told that nobody knows where things are: all is zero. */
    this.notTracked = false;
    /** The client's clock ticks so coarsely, or counts ms or ns, that rates and spikes may be far off. */
    this.coarseClock = false;
  }

  /** SED, J/m3, 224 x 224; throws NotCarriedError where the session carries no map. */
  get sed() {
    if (this.hasMap) return this.map;
    throw new NotCarriedError('sed', "leave 'map' true in the hello");
  }

  /** Firing rates, Hz, 224 x 224; throws NotCarriedError where the session carries none. */
  get ratesHz() {
    if (this.rates) return this.rates;
    throw new NotCarriedError('ratesHz', "name the effect 'afferents' in the hello, and leave 'map' true");
  }

  /**
   * Views for the sections of a `ready`.
   * @param {readonly import('./types.js').Section[]} sections
   */
  views(sections) {
    const of = (/** @type {string} */ name) => {
      const section = sections.find((s) => s.name === name);
      return section ? new Float32Array(this.#buffer, section.offset, section.bytes / 4) : null;
    };
    const map = sections.find((s) => s.name === 'map');
    const rates = sections.find((s) => s.name === 'rates');
    return {
      errorEstimate: of('error_estimate') ?? new Float32Array(4).fill(Infinity), summary: of('summary'), points: of('points'), pointRatesHz: of('point_rates'), actuators: of('actuators'),
      spikes: sections.find((s) => s.name === 'spikes') ?? null,
      mapOffset: map ? map.offset : -1, ratesOffset: rates ? rates.offset : -1, rates: rates ? new Float32Array(MAP_LEN) : null,
    };
  }

  /**
   * Reads the header; a fault is an Error that says what is wrong.
   * @param {ArrayBuffer} data
   */
  readHeader(data) {
    const bytes = data.byteLength;
    if (bytes < HEADER_BYTES || bytes > ANSWER_BYTES_MAX) {
      throw new Error(`an answer of ${bytes} bytes; ${HEADER_BYTES} to ${ANSWER_BYTES_MAX} can come`);
    }
    this.#all.set(new Uint8Array(data));
    const view = this.#view;
    if (view.getUint32(0, true) !== MAGIC) throw new Error('an answer does not start with PPL1');
    if (view.getUint8(4) !== VERSION) throw new Error(`an answer has protocol version ${view.getUint8(4)}`);
    const kind = view.getUint8(5);
    if (kind !== KIND.sed) throw new Error(`an answer is of kind ${kind}`);
    this.status = STATUS[view.getUint8(7)] ?? 'error';
    this.sequence = view.getUint32(8, true);
    this.clientTimeUs = view.getUint32(16, true) + TWO_POW_32 * view.getUint32(20, true);
    this.totalUs = view.getUint32(24, true);
    this.queueUs = view.getUint32(36, true);
    this.inferUs = view.getUint32(40, true);
    this.tierNumber = view.getUint16(44, true);
    const flags = view.getUint8(46);
    this.outOfRange = (flags & FLAG.outOfRange) !== 0;
    this.noContact = (flags & FLAG.noContact) !== 0;
    this.unfamiliar = (flags & FLAG.unfamiliar) !== 0;
    this.cutOff = (flags & FLAG.cutOff) !== 0;
    this.notTracked = (flags & FLAG.notTracked) !== 0;
    this.coarseClock = (flags & FLAG.coarseClock) !== 0;
  }

  /**
   * Decodes what `readHeader` copied into `map`, `summary`, `points` and `actuators`.
   * @param {ReturnType<Answer['views']>} views
   * @param {number} bytes length of the message
   */
  readBody(views, bytes) {
    this.errorEstimate = views.errorEstimate;
    this.summary = views.summary;
    this.points = views.points;
    this.pointRatesHz = views.pointRatesHz;
    this.actuators = views.actuators;
    const { spikes } = views;
    this.spikes = spikes ? readSpikes(this.#view, spikes.offset, spikes.bytes, this.clientTimeUs) : null;
    this.hasMap = views.mapOffset >= 0;
    this.rates = views.rates;
    // Only what the last answer wrote has to go.
    for (let y = this.row; y < this.row + this.height; y++) {
      this.map.fill(0, y * SIDE_PX + this.column, y * SIDE_PX + this.column + this.width);
    }
    this.width = this.height = this.column = this.row = 0;
    const view = this.#view;
    if (this.rates) {
      const sampleType = view.getUint8(6);
      const end = views.ratesOffset + RATES_HEAD_BYTES + MAP_LEN * (SAMPLE_BYTES[sampleType] ?? 0);
      if (sampleType > 3 || end > bytes) throw new Error(`an answer of ${bytes} bytes ends before its rates`);
      const scale = view.getFloat32(views.ratesOffset, true);
      this.#decode(this.rates, views.ratesOffset + RATES_HEAD_BYTES, sampleType, scale, 0, 0, SIDE_PX, SIDE_PX);
    }
    if (views.mapOffset < 0) return;
    const [width, height] = [view.getUint16(12, true), view.getUint16(14, true)];
    const [column, row] = [view.getUint16(32, true), view.getUint16(34, true)];
    const type = view.getUint8(6);
    const due = views.mapOffset + width * height * (SAMPLE_BYTES[type] ?? 0);
    if (type > 3 || due !== bytes || column + width > SIDE_PX || row + height > SIDE_PX) {
      throw new Error(`an answer of sample type ${type}, ${width} x ${height} at (${column}, ${row}) has ${bytes} bytes, ${due} are due`);
    }
    this.width = width;
    this.height = height;
    this.column = column;
    this.row = row;
    this.#decode(this.map, views.mapOffset, type, view.getFloat32(28, true), column, row, width, height);
  }

  /**
   * @param {Float32Array} map @param {number} offset @param {number} type @param {number} scale
   * @param {number} column @param {number} row @param {number} width @param {number} height
   */
  #decode(map, offset, type, scale, column, row, width, height) {
    const table = halfTable();
    let from = offset / SAMPLE_BYTES[type];
    for (let y = 0; y < height; y++) {
      const to = (row + y) * SIDE_PX + column;
      switch (type) {
        case 0: for (let x = 0; x < width; x++) map[to + x] = this.#f32[from++]; break;
        case 1: for (let x = 0; x < width; x++) map[to + x] = table[this.#u16[from++]]; break;
        case 2: for (let x = 0; x < width; x++) map[to + x] = this.#u16[from++] * scale; break;
        default: for (let x = 0; x < width; x++) map[to + x] = this.#all[from++] * scale;
      }
    }
  }
}

/** Names of the numbers in `Answer.errorEstimate`: relative errors against finite elements. */
export const ERROR_ESTIMATE = /** @type {const} */ (['sed_median', 'sed_p90', 'force_median', 'force_p90']);

/** Names of the numbers in `Answer.summary`, with their units. */
export const SUMMARY = /** @type {const} */ ([
  'force_n', 'contact_area_mm2', 'pressure_max_pa', 'pressure_u_px', 'pressure_v_px', 'sed_max_j_per_m3',
  'sed_max_u_px', 'sed_max_v_px', 'sed_integral_uj_per_m', 'sed_u_px', 'sed_v_px', 'sed_uu_px2', 'sed_uv_px2',
  'sed_vv_px2', 'sed_mean_j_per_m3', 'sa1_rate_hz',
]);
