//! What the service counts and times, in the Prometheus text format.
//!
//! Handles that the hot path uses are made once per tier, so that counting a
//! frame looks nothing up and allocates nothing.

use std::{
    sync::Arc,
    sync::atomic::{AtomicI64, AtomicU64},
    time::Duration,
};

use papilla_proto::ErrorCode;
use prometheus_client::{
    encoding::{EncodeLabelSet, EncodeLabelValue, LabelValueEncoder, text},
    metrics::{counter::Counter, family::Family, gauge::Gauge, histogram::Histogram, info::Info},
    registry::{Registry, Unit},
};

use crate::pool::Stage;

/// Buckets of every stage, seconds: from a memory copy to a dropped session.
///
/// Dense around the budgets that matter: 1 ms (force loop), 5.5 ms (tap), 11.1 ms (90 Hz).
pub(crate) const BUCKETS_S: [f64; 18] = [
    50e-6, 100e-6, 200e-6, 500e-6, 1e-3, 2e-3, 3e-3, 4e-3, 5.5e-3, 8e-3, 11.1e-3, 16e-3, 25e-3,
    50e-3, 100e-3, 200e-3, 500e-3, 2.0,
];

/// How a map came in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Transport {
    /// Posted.
    Http,
    /// In a session.
    Session,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct StageLabels {
    tier: String,
    stage: &'static str,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct MapLabels {
    transport: Word,
    outcome: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct LateLabels {
    stage: Word,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, EncodeLabelSet)]
struct CodeLabels {
    code: Word,
}

/// A label value that is one of a few fixed words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Word(&'static str);

impl EncodeLabelValue for Word {
    fn encode(&self, encoder: &mut LabelValueEncoder<'_>) -> Result<(), std::fmt::Error> {
        EncodeLabelValue::encode(&self.0, encoder)
    }
}

/// A histogram of one stage of one tier.
#[derive(Debug, Clone)]
pub(crate) struct Timer(Histogram);

impl Timer {
    pub(crate) fn observe(&self, time: Duration) {
        self.0.observe(time.as_secs_f64());
    }
}

/// The timers of one tier.
#[derive(Debug)]
pub(crate) struct TierMetrics {
    /// Waiting for a thread.
    pub(crate) queue: Timer,
    /// Decoding and checking.
    pub(crate) decode: Timer,
    /// In the network.
    pub(crate) infer: Timer,
    /// Encoding the answer.
    pub(crate) encode: Timer,
    /// From receipt until the answer was handed to the socket.
    pub(crate) total: Timer,
}

/// The counts of one transport.
#[derive(Debug)]
pub(crate) struct TransportMetrics {
    /// Answered with a map.
    pub(crate) ok: Counter,
    /// Replaced by a newer frame.
    pub(crate) superseded: Counter,
    /// Answered late.
    pub(crate) late: Counter,
    /// Answered stale.
    pub(crate) stale: Counter,
    /// Refused.
    pub(crate) error: Counter,
}

/// Everything that is counted.
#[derive(Debug)]
pub(crate) struct Metrics {
    registry: Registry,
    /// In the catalogue's order.
    pub(crate) tiers: Vec<TierMetrics>,
    http: TransportMetrics,
    session: TransportMetrics,
    late: Family<LateLabels, Counter>,
    errors: Family<CodeLabels, Counter>,
    /// Zero maps, answered without inference.
    pub(crate) zero_maps: Counter,
    /// Slots that wait for a thread.
    pub(crate) queue_length: Gauge<i64, AtomicI64>,
    /// Open sessions.
    pub(crate) sessions_open: Gauge<i64, AtomicI64>,
    /// Sessions ever opened.
    pub(crate) sessions: Counter<u64, AtomicU64>,
    /// Open connections.
    pub(crate) connections_open: Gauge<i64, AtomicI64>,
}

impl Metrics {
    /// All metrics at zero, for these tiers.
    pub(crate) fn new<'a>(tier_names: impl Iterator<Item = &'a str>) -> Arc<Self> {
        let mut registry = Registry::with_prefix("papilla");
        let version = vec![("version", env!("CARGO_PKG_VERSION"))];
        registry.register("build", "The running version", Info::new(version));

        let stages =
            Family::<StageLabels, Histogram>::new_with_constructor(|| Histogram::new(BUCKETS_S));
        registry.register_with_unit(
            "stage",
            "Time a map spends in each stage; total is from receipt to the socket",
            Unit::Seconds,
            stages.clone(),
        );
        let tiers = tier_names.map(|tier| tier_metrics(&stages, tier)).collect();

        let maps = Family::<MapLabels, Counter>::default();
        registry.register("maps", "Pressure maps by transport and outcome", maps.clone());
        let late = Family::<LateLabels, Counter>::default();
        registry.register("late", "Late maps by the stage that found them so", late.clone());
        for stage in [Stage::Admission, Stage::Dequeue, Stage::Inference, Stage::Sending] {
            let _ = late.get_or_create(&LateLabels { stage: word_of(stage) });
        }
        let errors = Family::<CodeLabels, Counter>::default();
        registry.register("errors", "Errors sent to clients by code", errors.clone());

        let metrics = Self {
            tiers,
            http: transport_metrics(&maps, "http"),
            session: transport_metrics(&maps, "session"),
            late,
            errors,
            zero_maps: Counter::default(),
            queue_length: Gauge::default(),
            sessions_open: Gauge::default(),
            sessions: Counter::default(),
            connections_open: Gauge::default(),
            registry: Registry::default(),
        };
        let m = &metrics;
        registry.register(
            "zero_maps",
            "Zero maps, answered without inference",
            m.zero_maps.clone(),
        );
        registry.register("queue_length", "Slots that wait for a thread", m.queue_length.clone());
        registry.register("sessions_open", "Open sessions", m.sessions_open.clone());
        registry.register("sessions", "Sessions ever opened", m.sessions.clone());
        registry.register("connections_open", "Open connections", m.connections_open.clone());
        Arc::new(Self { registry, ..metrics })
    }

    /// The counts of `transport`.
    pub(crate) fn of(&self, transport: Transport) -> &TransportMetrics {
        match transport {
            Transport::Http => &self.http,
            Transport::Session => &self.session,
        }
    }

    /// Counts a late map.
    pub(crate) fn late(&self, transport: Transport, stage: Stage) {
        self.of(transport).late.inc();
        self.late.get_or_create(&LateLabels { stage: word_of(stage) }).inc();
    }

    /// Counts an error sent to a client.
    pub(crate) fn error(&self, code: ErrorCode) {
        self.errors.get_or_create(&CodeLabels { code: Word(code.as_str()) }).inc();
    }

    /// The text a scraper reads.
    pub(crate) fn encode(&self) -> Result<String, std::fmt::Error> {
        let mut out = String::with_capacity(16 * 1024);
        text::encode(&mut out, &self.registry)?;
        Ok(out)
    }
}

fn word_of(stage: Stage) -> Word {
    Word(match stage {
        Stage::Admission => "admission",
        Stage::Dequeue => "dequeue",
        Stage::Inference => "inference",
        Stage::Sending => "sending",
    })
}

fn tier_metrics(
    stages: &Family<StageLabels, Histogram, fn() -> Histogram>,
    tier: &str,
) -> TierMetrics {
    let timer = |stage| {
        let labels = StageLabels { tier: tier.to_owned(), stage };
        Timer(stages.get_or_create(&labels).clone())
    };
    TierMetrics {
        queue: timer("queue"),
        decode: timer("decode"),
        infer: timer("infer"),
        encode: timer("encode"),
        total: timer("total"),
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
    }
}
