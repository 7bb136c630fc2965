//! What the service counts and times, in the Prometheus text format.
//!
//! Handles that the hot path uses are made once per tier, so that counting a
//! frame looks nothing up and allocates nothing.

mod contact;
mod labels;
mod process;

use std::{
    sync::atomic::{AtomicI64, AtomicU64},
    sync::{Arc, OnceLock},
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use papilla_proto::ErrorCode;
use prometheus_client::{
    encoding::text,
    metrics::{counter::Counter, family::Family, gauge::Gauge, histogram::Histogram, info::Info},
    registry::{Metric, Registry, Unit},
};

pub use contact::ContactMetrics;
use labels::{
    CodeLabels, GrantLabels, LateLabels, MapLabels, ModelLabels, ReloadLabels, RequestLabels,
    ShedLabels, StageLabels, Word,
};
pub use labels::{Shed, Stage, TierLabels, Transport};
pub use process::resident_bytes;

/// Greatest number of tiers of a finger, counting every name since the start: handles have fixed
/// places, so that the hot path takes no lock.
pub const TIERS_MAX: usize = 64;

/// Greatest number of fingers, the default one among them, counting every one since the start. The
/// tiers of the finger at place `f` have the numbers from `f * TIERS_MAX`.
pub const BUNDLES_MAX: usize = 64;

/// The timers of a finger's tiers.
type OfFinger = Box<[OnceLock<TierMetrics>; TIERS_MAX]>;

/// Buckets of every stage, seconds: from a memory copy to a dropped session.
///
/// Dense around the budgets that matter: 1 ms (force loop), 5.5 ms (tap), 11.1 ms (90 Hz).
pub const BUCKETS_S: [f64; 18] = [
    50e-6, 100e-6, 200e-6, 500e-6, 1e-3, 2e-3, 3e-3, 4e-3, 5.5e-3, 8e-3, 11.1e-3, 16e-3, 25e-3,
    50e-3, 100e-3, 200e-3, 500e-3, 2.0,
];

/// What became of a reload.
const RELOADS: [&str; 3] = ["ok", "refused", "busy"];
/// What became of a model that was loaded when its tier was first named.
const FIRST_USES: [&str; 2] = ["ok", "refused"];

type Stages = Family<StageLabels, Histogram, fn() -> Histogram>;
type Requests = Family<RequestLabels, Histogram, fn() -> Histogram>;

/// A histogram of one stage of one tier.
#[derive(Debug, Clone)]
pub struct Timer(Histogram);

impl Timer {
    /// Takes note of a time.
    pub fn observe(&self, time: Duration) {
        self.0.observe(time.as_secs_f64());
    }
}

/// The timers of one tier.
#[derive(Debug)]
pub struct TierMetrics {
    /// Waiting for a thread.
    pub queue: Timer,
    /// Decoding and checking.
    pub decode: Timer,
    /// In the network.
    pub infer: Timer,
    /// Encoding the answer.
    pub encode: Timer,
    /// Handing the answer of a session to the socket.
    pub send: Timer,
    /// From receipt until the answer was handed to the socket.
    pub total: Timer,
    /// Maps that its network was asked for, rendered or not.
    pub asked: AtomicU64,
}

/// The counts of one transport.
#[derive(Debug)]
pub struct TransportMetrics {
    /// Answered with a map.
    pub ok: Counter,
    /// Replaced by a newer frame.
    pub superseded: Counter,
    /// Answered late.
    pub late: Counter,
    /// Answered stale.
    pub stale: Counter,
    /// Refused.
    pub error: Counter,
    /// Not rendered, since its session had ended.
    pub gone: Counter,
}

/// Everything that is counted.
#[derive(Debug)]
pub struct Metrics {
    registry: Registry,
    stages: Stages,
    /// By finger, then in its catalogue's order; of a finger that was never loaded there are none.
    tiers: [OnceLock<OfFinger>; BUNDLES_MAX],
    /// Stands in for a tier without a place, which no catalogue has; in no registry.
    stray: TierMetrics,
    requests: Requests,
    models: Family<ModelLabels, Gauge>,
    shed: Family<ShedLabels, Counter>,
    reloads: Family<ReloadLabels, Counter>,
    first_uses: Family<ReloadLabels, Counter>,
    real_time: Family<GrantLabels, Gauge>,
    http: TransportMetrics,
    session: TransportMetrics,
    oip: TransportMetrics,
    late: Family<LateLabels, Counter>,
    errors: Family<CodeLabels, Counter>,
    /// Contact of sessions.
    pub contact: ContactMetrics,
    /// Zero maps, answered without inference.
    pub zero_maps: Counter,
    /// Frames that took long beside their network.
    pub long_frames: Counter,
    /// Hellos whose client left before they were worked out.
    pub hellos_left: Counter,
    /// Thread time that maps of the last seconds ask for, by what they take here, over what there is.
    pub load: Gauge<f64, AtomicU64>,
    /// When the folder of models was last looked at, Unix seconds; 0 if it is not watched.
    looked_at: Gauge<f64, AtomicU64>,
    /// Slots that wait for a thread.
    pub queue_length: Gauge<i64, AtomicI64>,
    /// Open sessions.
    pub sessions_open: Gauge<i64, AtomicI64>,
    /// Sessions ever opened.
    pub sessions: Counter<u64, AtomicU64>,
    /// Open connections.
    pub connections_open: Gauge<i64, AtomicI64>,
    /// Fingers that are loaded, the default one among them.
    pub fingers_loaded: Gauge<i64, AtomicI64>,
}

impl Metrics {
    /// All metrics at zero; no tiers yet.
    pub fn new() -> Arc<Self> {
        let mut root = Registry::default();
        root.register_collector(Box::new(process::Process::default()));
        let registry = root.sub_registry_with_prefix("papilla");
        let version = vec![("version", env!("CARGO_PKG_VERSION"))];
        registry.register("build", "The running version", Info::new(version));
        let maps = registered(registry, "maps", "Pressure maps by transport and outcome");
        let stages = Stages::new_with_constructor(|| Histogram::new(BUCKETS_S));
        let help = "Time a map spends in each stage; total is from receipt to the socket";
        registry.register_with_unit("stage", help, Unit::Seconds, stages.clone());
        let requests = Requests::new_with_constructor(|| Histogram::new(BUCKETS_S));
        let help = "Time of a request, from its head to the head of the answer";
        registry.register_with_unit("request", help, Unit::Seconds, requests.clone());
        let metrics = Self {
            stray: tier_metrics(|_| Timer(Histogram::new(BUCKETS_S))),
            tiers: std::array::from_fn(|_| OnceLock::new()),
            stages,
            requests,
            models: registered(registry, "model", "Models on offer; the value is always 1"),
            shed: registered(registry, "shed", "Work turned away, by reason"),
            reloads: registered(registry, "reloads", "Reloads of the models, by outcome"),
            first_uses: registered(
                registry,
                "first_uses",
                "Models loaded when their tier was first named, by outcome",
            ),
            real_time: registered(
                registry,
                "real_time",
                "What the system has granted of the priorities that were asked for: 1, or 0",
            ),
            http: transport_metrics(&maps, "http"),
            session: transport_metrics(&maps, "session"),
            oip: transport_metrics(&maps, "oip"),
            late: registered(registry, "late", "Late maps by the stage that found them so"),
            errors: registered(registry, "errors", "Errors sent to clients by code"),
            contact: ContactMetrics::new(registry),
            zero_maps: registered(registry, "zero_maps", "Zero maps, answered without inference"),
            long_frames: registered(
                registry,
                "long_frames",
                "Frames that held a thread for more than 10 ms beside their network",
            ),
            hellos_left: registered(
                registry,
                "hellos_left",
                "Hellos whose client left before they were worked out",
            ),
            load: registered_ratio(registry),
            looked_at: registered_time(registry),
            queue_length: registered(registry, "queue_length", "Slots that wait for a thread"),
            sessions_open: registered(registry, "sessions_open", "Open sessions"),
            sessions: registered(registry, "sessions", "Sessions ever opened"),
            connections_open: registered(registry, "connections_open", "Open connections"),
            fingers_loaded: registered(registry, "fingers_loaded", "Fingers that are loaded"),
            registry: Registry::default(),
        };
        for stage in Stage::ALL {
            let _ = metrics.late.get_or_create(&LateLabels { stage: stage.word() });
        }
        for shed in Shed::ALL {
            let _ = metrics.shed.get_or_create(&ShedLabels { reason: shed.word() });
        }
        // Counted from nothing, so that the first one is a rise and not a new line.
        for outcome in RELOADS {
            let _ = metrics.reloads.get_or_create(&ReloadLabels { outcome: Word(outcome) });
        }
        for outcome in FIRST_USES {
            let _ = metrics.first_uses.get_or_create(&ReloadLabels { outcome: Word(outcome) });
        }
        for code in ErrorCode::ALL {
            let _ = metrics.errors.get_or_create(&CodeLabels { code: Word(code.as_str()) });
        }
        Arc::new(Self { registry: root, ..metrics })
    }

    /// Gives every tier its timers, and lists the models on offer; of all fingers at once.
    pub fn name_tiers<'a>(&self, tiers: impl IntoIterator<Item = TierLabels<'a>>) {
        self.models.clear();
        for tier in tiers {
            let Some(finger) = self.tiers.get(tier.number / TIERS_MAX) else { continue };
            let none = || Box::new(std::array::from_fn(|_| OnceLock::new()));
            finger.get_or_init(none)[tier.number % TIERS_MAX].get_or_init(|| {
                tier_metrics(|stage| {
                    let labels = StageLabels { tier: tier.name.clone().into_owned(), stage };
                    Timer(self.stages.get_or_create(&labels).clone())
                })
            });
            if !tier.is_offered {
                continue;
            }
            let labels = ModelLabels {
                tier: tier.name.into_owned(),
                atlas_hash: tier.atlas_hash.to_owned(),
                onnx_sha256: tier.onnx_sha256.to_owned(),
                backend: tier.backend.to_owned(),
                default: Word(if tier.is_default { "true" } else { "false" }),
            };
            self.models.get_or_create(&labels).set(1);
        }
    }

    /// The timers of the tier of this number.
    pub fn tier(&self, number: usize) -> &TierMetrics {
        let finger = self.tiers.get(number / TIERS_MAX).and_then(OnceLock::get);
        let tier = finger.and_then(|tiers| tiers[number % TIERS_MAX].get());
        tier.unwrap_or(&self.stray)
    }

    /// Takes note of a request.
    pub fn request(&self, route: &'static str, status: u16, time: Duration) {
        let labels = RequestLabels { route: Word(route), status };
        self.requests.get_or_create(&labels).observe(time.as_secs_f64());
    }

    /// Counts work that was turned away.
    pub fn shed(&self, shed: Shed) {
        self.shed.get_or_create(&ShedLabels { reason: shed.word() }).inc();
    }

    /// Takes note of what the system has granted of the priorities that were asked for.
    pub fn real_time(&self, what: &'static str, is_granted: bool) {
        let labels = GrantLabels { what: Word(what) };
        self.real_time.get_or_create(&labels).set(is_granted.into());
    }

    /// The folder of models was looked at now.
    pub fn models_looked_at(&self) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        self.looked_at.set(now.as_secs_f64());
    }

    /// Counts a reload that was done, or changed nothing.
    pub fn reload(&self, is_ok: bool) {
        self.count_reload(RELOADS[usize::from(!is_ok)]);
    }

    /// Counts a model that was loaded when its tier was first named, or was unusable.
    pub fn first_use(&self, is_ok: bool) {
        let outcome = Word(FIRST_USES[usize::from(!is_ok)]);
        self.first_uses.get_or_create(&ReloadLabels { outcome }).inc();
    }

    /// Counts a reload that came while another was under way.
    pub fn reload_busy(&self) {
        self.count_reload(RELOADS[2]);
    }

    fn count_reload(&self, outcome: &'static str) {
        self.reloads.get_or_create(&ReloadLabels { outcome: Word(outcome) }).inc();
    }

    /// The counts of `transport`.
    pub fn of(&self, transport: Transport) -> &TransportMetrics {
        match transport {
            Transport::Http => &self.http,
            Transport::Session => &self.session,
            Transport::Oip => &self.oip,
        }
    }

    /// Counts a late map.
    pub fn late(&self, transport: Transport, stage: Stage) {
        self.of(transport).late.inc();
        self.late.get_or_create(&LateLabels { stage: stage.word() }).inc();
    }

    /// Counts an error sent to a client.
    pub fn error(&self, code: ErrorCode) {
        self.errors.get_or_create(&CodeLabels { code: Word(code.as_str()) }).inc();
    }

    /// The text a scraper reads.
    pub fn encode(&self) -> Result<String, std::fmt::Error> {
        let mut out = String::with_capacity(16 * 1024);
        text::encode(&mut out, &self.registry)?;
        Ok(out)
    }
}

/// A metric that is registered as it is made.
fn registered<M: Metric + Clone + Default>(
    registry: &mut Registry,
    name: &'static str,
    help: &'static str,
) -> M {
    let metric = M::default();
    registry.register(name, help, metric.clone());
    metric
}

/// By what the watch over the folder of models is watched.
fn registered_time(registry: &mut Registry) -> Gauge<f64, AtomicU64> {
    let (looked_at, help) =
        (Gauge::default(), "When the folder of models was last looked at, Unix");
    let name = "models_looked_at_timestamp";
    registry.register_with_unit(name, help, Unit::Seconds, looked_at.clone());
    looked_at
}

/// What autoscalers scale by.
fn registered_ratio(registry: &mut Registry) -> Gauge<f64, AtomicU64> {
    let (load, help) = (Gauge::default(), "Maps asked for, by what they take here, over capacity");
    registry.register_with_unit("load", help, Unit::Other("ratio".to_owned()), load.clone());
    load
}

fn tier_metrics(timer: impl Fn(&'static str) -> Timer) -> TierMetrics {
    TierMetrics {
        queue: timer("queue"),
        decode: timer("decode"),
        infer: timer("infer"),
        encode: timer("encode"),
        send: timer("send"),
        total: timer("total"),
        asked: AtomicU64::new(0),
    }
}

fn transport_metrics(
    maps: &Family<MapLabels, Counter>,
    transport: &'static str,
) -> TransportMetrics {
    let count = |outcome| {
        let labels = MapLabels { transport: Word(transport), outcome: Word(outcome) };
        maps.get_or_create(&labels).clone()
    };
    TransportMetrics {
        ok: count("ok"),
        superseded: count("superseded"),
        late: count("late"),
        stale: count("stale"),
        error: count("error"),
        gone: count("gone"),
    }
}
