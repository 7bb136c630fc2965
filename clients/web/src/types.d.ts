// The texts of a session, as docs/reference/protocol.md defines them.

export type SampleType = 'f32' | 'f16' | 'u16' | 'u8';
/** A place on the finger: pixels of the map, or mm in the finger's frame. */
export type Place = { px: [number, number] } | { mm: [number, number, number] };

export interface Relaxation {
  tissue?: 'skin' | 'subcutaneous';
  prony?: { g: number; tau_s: number }[];
  moduli?: 'instantaneous' | 'long_term';
}

export interface Afferents {
  e_ref_kpa?: number;
  theta_kpa?: number;
  k_s_hz_per_kpa?: number;
  k_d_hz_s_per_kpa?: number;
  /** Whether the map of rates comes beside that of SED (default true). */
  map?: boolean;
}

export interface Actuators {
  input: 'sed' | 'sa1_rate';
  drive?: 'formula' | 'fitted' | 'corrected';
  radius_mm?: number;
  gain?: number;
  threshold?: number;
  max?: number;
  actuators: { at: Place; radius_mm?: number; gain?: number; threshold?: number; max?: number }[];
}

/** Simulated nerve fibres and their spikes: docs/reference/protocol-effects.md#spikes. */
export interface SpikesWish {
  seed?: number;
  sa1_per_cm2?: number;
  ra_per_cm2?: number;
  pc_per_cm2?: number;
  units?: { class: 'sa1' | 'ra' | 'pc'; at: Place; model?: number }[];
  e_ref_kpa?: number;
  noise?: boolean;
  spikes_max?: number;
}

/** What a client asks for; `type` and `version` are added by the client. */
export interface Hello {
  effects?: string[];
  budget_us?: number | null;
  tier?: string | null;
  sample_type?: SampleType;
  answer_sample_type?: SampleType;
  pressure_scale_pa?: number | null;
  atlas_hash?: string | null;
  map?: boolean;
  contact_pa?: number;
  out_of_range?: 'clamp' | 'flag' | 'refuse';
  stale_after_us?: number | null;
  contact_window?: { margin_px?: number };
  points?: Place[];
  actuators?: Actuators;
  afferents?: Afferents;
  relaxation?: Relaxation;
  spikes?: SpikesWish;
  /** Answers carry `errorEstimate`. */
  error_estimate?: boolean;
}

/** A shape of scene files with its dimensions, or a closed mesh. */
export type Shape =
  | { shape: 'mesh'; vertices_mm: [number, number, number][]; triangles: [number, number, number][] }
  | ({ shape: string } & Record<string, unknown>);

/** How pressure is found, from fast and rough to slow and accurate. */
export type ContactMethod = 'springs' | 'small_strain' | 'second_order' | 'coarse_pixels' | 'pixels';

/** Median and 95th percentile. */
export interface Spread {
  median: number;
  p95: number;
}

/** What a hand asks for; answers are f32. */
export interface HandHello {
  objects?: { shape: Shape; stiffness_mpa_per_mm?: number; friction?: number }[];
  /** `name`: one of `GET /v1/fingers`; left out: the server's default finger. */
  fingers?: { name?: string; width?: number; stiffness?: number }[];
  input_layout?: 'map' | 'vertices';
  answer_layout?: 'map' | 'vertices';
  /** Left out: the most accurate that can serve, which `ready.method` names. */
  method?: ContactMethod;
  force_target?: boolean;
  stiffness?: boolean;
  /** Answers carry `errorEstimate`. */
  error_estimate?: boolean;
  pressure?: 'map' | 'vertices';
  /** Answers carry `shearPa`. */
  shear?: boolean;
  /** Answers carry `displacementMm`. */
  displacement?: boolean;
  /** Of gaps: a coefficient, and whether frames tell how things move. */
  friction?: number;
  velocity?: boolean;
  map?: boolean;
  effects?: string[];
  tier?: string | null;
  budget_us?: number | null;
  atlas_hash?: string | null;
  points?: Place[];
  actuators?: Actuators;
  afferents?: Afferents;
  relaxation?: Relaxation;
  spikes?: SpikesWish;
}

/** Where an object is in a finger's frame: mm, and a unit quaternion x y z w. */
export interface Pose {
  at: [number, number, number];
  turn?: [number, number, number, number];
}

/** A net force to be met: a unit vector in the finger's frame, and N along it. */
export interface NetForce {
  direction: [number, number, number];
  forceN: number;
}

/** What pushes back on a finger, in its frame. */
export interface Touch {
  forceN: [number, number, number];
  torqueNMm: [number, number, number];
  areaMm2: number;
  centreMm: [number, number, number];
  penetrationMm: number;
  /** 0 if it was not asked for. */
  stiffnessNPerMm: number;
  /** How far things travelled to meet a net force. */
  travelMm: number;
  pressureMaxPa: number;
  /** Of the second order of finite strain in the displacement. */
  share: number;
  solveUs: number;
}

export interface Section {
  name: 'touch' | 'pressure' | 'shear' | 'displacement' | 'error_estimate' | 'summary' | 'points' | 'point_rates' | 'actuators' | 'spikes' | 'rates' | 'map' | 'vertices';
  offset: number;
  bytes: number;
}

/** What a method errs against finite elements. */
export interface MethodError {
  set: string;
  states: number;
  pressure_relative_l2: Spread;
  force_relative: Spread;
  sed_relative_l2?: Spread;
}

/** On what terms one finger of a session is rendered. */
export interface FingerTerms {
  name: string;
  tier: string;
  tier_number: number;
  /** The finger whose presses trained the tier, if another: its SED is by similarity alone. */
  trained_on?: string;
  atlas_hash: string;
  vertices: number;
  pressure_max_pa: number;
  sed_scale_j_per_m3: number;
  predicted_latency_us: number;
  method?: ContactMethod;
  expected_error?: MethodError;
  units?: Ready['units'];
}

export interface Ready {
  type: 'ready';
  version: 3;
  session: number;
  tier: string;
  tier_number: number;
  effects: string[];
  session_effects: string[];
  atlas_hash: string;
  predicted_latency_us: number;
  budget_us: number | null;
  meets_budget: boolean | null;
  width: number;
  height: number;
  sample_type: SampleType;
  answer_sample_type: SampleType;
  pressure_max_pa: number;
  sed_scale_j_per_m3: number;
  sections: Section[];
  /** Of the atlas, for what is laid out by them. */
  vertices: number;
  fingers: number;
  /** Of the effect `spikes`, by number. */
  units?: { class: 'sa1' | 'ra' | 'pc'; model: number; px: [number, number] }[];
  /** Of each finger by its number, where the hello names any; what is beside them is of the first. */
  finger_terms?: FingerTerms[];
  contact_us?: number;
  /** How pressure is found; missing where frames are pressure. */
  method?: ContactMethod;
  /** What that method errs against finite elements; missing where nobody measured it. */
  expected_error?: MethodError;
  /** What of the hello is met, but perhaps not as it was meant. */
  warnings?: { member: string; value?: number; question: string }[];
}

/** A refusal, of a hello or of a frame (then with its `sequence`). */
export interface Problem {
  type: 'error';
  code: string;
  message: string;
  field?: string | null;
  sequence?: number | null;
  closes: boolean;
}

/** connecting | ready | waiting (for the next attempt) | refused (the hello; nothing is tried again) | closed */
export type State = 'connecting' | 'ready' | 'waiting' | 'refused' | 'closed';

export interface Options {
  /** Bearer token, for a server that asks for one. */
  token?: string;
  /** Cut a full map to the rectangle of its non-zero pixels before sending (default true). */
  crop?: boolean;
  /** A frame without an answer for so long is lost, ms (default 5000). */
  timeoutMs?: number;
  /** us of the client's clock, for the header (default: performance.now). */
  clockUs?: () => number;
}
