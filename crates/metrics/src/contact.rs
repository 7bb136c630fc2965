//! What contact takes: nothing is counted for a session that sends pressure.

use std::sync::atomic::AtomicU64;

use papilla_proto::flags;
use prometheus_client::{
    metrics::{counter::Counter, family::Family},
    registry::Registry,
};

use crate::{
    labels::{SolveLabels, Word},
    registered,
};

/// The counts of contact solves.
#[derive(Debug)]
pub struct ContactMetrics {
    settled: Counter,
    unsettled: Counter,
    in_air: Counter,
    iterations: Counter,
    /// Time that all solves that were asked for are expected to take, done or not, us.
    pub asked_us: AtomicU64,
}

impl ContactMetrics {
    pub(crate) fn new(registry: &mut Registry) -> Self {
        let help = "Contact solves by what they came to";
        let solves: Family<SolveLabels, Counter> = registered(registry, "contact_solves", help);
        let count = |outcome| solves.get_or_create(&SolveLabels { outcome: Word(outcome) }).clone();
        Self {
            settled: count("settled"),
            unsettled: count("unsettled"),
            in_air: count("in_air"),
            asked_us: AtomicU64::new(0),
            iterations: registered(
                registry,
                "contact_iterations",
                "Linearisations of all contact solves",
            ),
        }
    }

    /// Counts a solve by its flags ([`papilla_proto::flags`]) and the linearisations it took.
    pub fn solved(&self, bits: u8, iterations: u32) {
        let outcome = if bits & flags::UNSETTLED != 0 {
            &self.unsettled
        } else if bits & flags::NO_CONTACT != 0 {
            &self.in_air
        } else {
            &self.settled
        };
        outcome.inc();
        self.iterations.inc_by(iterations.into());
    }
}
