//! The report, for people and for scripts.

use std::{collections::BTreeMap, fmt};

use papilla_proto::{SampleType, contact::ContactMethod};
use serde::{Deserialize, Serialize};

use super::{Arrivals, Contact, Options, Speak, TOLERANCE, Target, tally::Tally, tally::Times};

/// Percentiles of a time, us.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Times measured.
    pub count: u64,
    /// Median.
    pub p50: u64,
    /// One in ten is longer.
    pub p90: u64,
    /// One in a hundred is longer.
    pub p99: u64,
    /// One in a thousand is longer.
    pub p99_9: u64,
    /// The longest.
    pub max: u64,
}

impl Percentiles {
    /// None without a time.
    pub(super) fn new(Times(histogram): &Times) -> Option<Self> {
        let at = |quantile| histogram.value_at_quantile(quantile);
        (!histogram.is_empty()).then(|| Self {
            count: histogram.len(),
            p50: at(0.5),
            p90: at(0.9),
            p99: at(0.99),
            p99_9: at(0.999),
            max: histogram.max(),
        })
    }
}

/// Answers held against the engine's own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verification {
    /// Maps compared, those of the warm-up included.
    pub maps: u64,
    /// Maps that differ by more than `tolerance`.
    pub wrong: u64,
    /// Greatest difference, relative to the greatest value of the map, beyond the error of
    /// the sample type.
    pub difference_max: f64,
    /// Greatest difference allowed, likewise.
    pub tolerance: f64,
}

/// What a load run found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Host and port of the service.
    pub server: String,
    /// What was spoken with it.
    pub speak: Speak,
    /// Sessions at a time.
    pub sessions: usize,
    /// Frames a second and session.
    pub rate_hz: f64,
    /// Time measured, s.
    pub duration_s: f64,
    /// How frames followed one another.
    pub arrivals: Arrivals,
    /// What answers to poses carried; none: frames were pressure.
    pub contact: Option<Contact>,
    /// The method that was asked for; none: the service's own choice.
    pub method: Option<ContactMethod>,
    /// Fingers of a session.
    pub fingers: u8,
    /// Samples on the wire.
    pub sample_type: SampleType,
    /// Budget of a frame, us; none: nothing is dropped.
    pub budget_us: Option<u32>,
    /// Time after which a map counts as missed, us; none: never.
    pub deadline_us: Option<u32>,
    /// The tier that rendered.
    pub tier: String,
    /// Latency that the server expected on an idle machine, us; sessions are told.
    pub predicted_latency_us: Option<u64>,
    /// Where the maps are from.
    pub source: String,
    /// Maps that took turns.
    pub maps: usize,
    /// Frames counted.
    pub frames: u64,
    /// Answered with a map.
    pub ok: u64,
    /// Answered: a newer frame took its place.
    pub superseded: u64,
    /// Answered: too late.
    pub late: u64,
    /// Answered: old when it came.
    pub stale: u64,
    /// Refusals by code.
    pub errors: BTreeMap<String, u64>,
    /// Never answered.
    pub lost: u64,
    /// Maps that came after the map of a later frame.
    pub out_of_order: u64,
    /// Answers to no frame, or second answers.
    pub unexpected: u64,
    /// Frames without a map within the deadline, from the intended instant.
    pub missed: u64,
    /// The same, percent of the frames.
    pub missed_percent: f64,
    /// From the intended instant to the map, us; none if no map came.
    pub round_trip_us: Option<Percentiles>,
    /// In the server, from receipt to sending, us.
    pub server_us: Option<Percentiles>,
    /// Of that, waiting for a thread, us.
    pub queue_us: Option<Percentiles>,
    /// Of that, in the network, us.
    pub infer_us: Option<Percentiles>,
    /// Of that, solving the contact, us.
    pub solve_us: Option<Percentiles>,
    /// Of that, neither waiting, solving nor in the network, us: the service's own.
    pub service_us: Option<Percentiles>,
    /// The bytes of such a frame and its answer over loopback TCP, between two threads, with
    /// nothing done; with --contact.
    pub echo_us: Option<Percentiles>,
    /// From the sending to the map, but for the network, us: what transport and service add.
    pub overhead_us: Option<Percentiles>,
    /// Age of the newest map, looked at every millisecond, us: since the instant its frame was
    /// meant to leave.
    pub age_us: Option<Percentiles>,
    /// From one map of a session to the next, us.
    pub gap_us: Option<Percentiles>,
    /// For how long frames were held back when a session moved, us; with --follow.
    pub held_us: Option<Percentiles>,
    /// Times that a session was opened anew after its connection broke; with --follow.
    pub reopened: u64,
    /// From the intended instant to the sending, us: the generator's own part.
    pub send_delay_us: Option<Percentiles>,
    /// Share of all cores' time that the host of this virtual machine withheld, percent; none
    /// where the system does not tell.
    pub stolen_percent: Option<f64>,
    /// Comparison with the engine's own answers, if asked for.
    pub verification: Option<Verification>,
    /// Why sessions ended before their time.
    pub ended: Vec<String>,
    /// Greatest share of misses allowed, percent.
    pub allow_miss_percent: Option<f64>,
}

impl Report {
    pub(super) fn new(options: &Options, target: &Target, t: &Tally, echo: Option<&Times>) -> Self {
        let verification = options.verify.then_some(Verification {
            maps: t.verified,
            wrong: t.wrong,
            difference_max: t.difference_max,
            tolerance: TOLERANCE,
        });
        Self {
            server: options.server.clone(),
            speak: options.speak,
            sessions: options.sessions.get(),
            rate_hz: options.rate_hz,
            duration_s: options.duration_s,
            arrivals: options.arrivals,
            contact: options.contact,
            method: options.method,
            fingers: options.fingers,
            sample_type: options.sample_type,
            budget_us: options.budget(),
            deadline_us: options.deadline(),
            tier: target.tier.clone(),
            predicted_latency_us: target.predicted_latency_us,
            source: target.source.clone(),
            maps: target.encoded.payloads.len(),
            frames: t.frames,
            ok: t.ok,
            superseded: t.superseded,
            late: t.late,
            stale: t.stale,
            errors: t.errors.clone(),
            lost: t.lost,
            out_of_order: t.out_of_order,
            unexpected: t.unexpected,
            missed: t.missed(),
            missed_percent: 100.0 * t.missed() as f64 / t.frames.max(1) as f64,
            round_trip_us: Percentiles::new(&t.round_trip),
            server_us: Percentiles::new(&t.server),
            queue_us: Percentiles::new(&t.queue),
            infer_us: Percentiles::new(&t.infer),
            solve_us: Percentiles::new(&t.solve),
            service_us: Percentiles::new(&t.rest),
            echo_us: echo.and_then(Percentiles::new),
            overhead_us: Percentiles::new(&t.overhead),
            age_us: Percentiles::new(&t.age),
            gap_us: Percentiles::new(&t.gap),
            held_us: Percentiles::new(&t.held),
            reopened: t.reopened,
            send_delay_us: Percentiles::new(&t.send_delay),
            stolen_percent: t.processor.stolen_percent(),
            verification,
            ended: t.ended.clone(),
            allow_miss_percent: options.allow_miss_percent,
        }
    }

    /// What the service did that it must not do; misses are not among it.
    #[must_use]
    pub fn faults(&self) -> Vec<String> {
        let mut faults = self.ended.clone();
        let errors = self.errors.values().sum();
        for (count, what) in [
            (errors, "refused"),
            (self.lost, "never answered"),
            (self.out_of_order, "out of order"),
            (self.unexpected, "not asked for"),
        ] {
            if count > 0 {
                faults.push(format!("{count} {what}"));
            }
        }
        match self.verification {
            Some(v) if v.wrong > 0 => faults.push(format!("{} maps are not the engine's", v.wrong)),
            Some(v) if v.maps == 0 => faults.push("no map to verify".to_owned()),
            _ => {}
        }
        faults
    }

    /// Exit code of the program: 0, 1 with a fault, 3 with more misses than allowed.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        if !self.faults().is_empty() {
            return 1;
        }
        let allowed = self.allow_miss_percent.unwrap_or(f64::INFINITY);
        if self.missed_percent > allowed { 3 } else { 0 }
    }
}

impl Report {
    fn write_times(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{:24}{:>9}{:>9}{:>9}{:>9}{:>9}", "us", "p50", "p90", "p99", "p99.9", "max")?;
        for (name, times) in [
            ("round trip", self.round_trip_us),
            ("  of it in the server", self.server_us),
            ("    waiting", self.queue_us),
            ("    solving the contact", self.solve_us),
            ("    in the network", self.infer_us),
            ("    the service's own", self.service_us),
            ("bare echo of the bytes", self.echo_us),
            ("trip without network", self.overhead_us),
            ("age of the newest map", self.age_us),
            ("from map to map", self.gap_us),
            ("held back in a move", self.held_us),
            ("sent late by", self.send_delay_us),
        ] {
            write!(f, "{name:24}")?;
            let columns = times.map(|p| [p.p50, p.p90, p.p99, p.p99_9, p.max]);
            for column in columns.map_or([None; 5], |times| times.map(Some)) {
                write!(f, "{:>9}", column.map_or_else(|| "-".to_owned(), |us| us.to_string()))?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.speak {
            Speak::Session => "session",
            Speak::Http => "HTTP client",
            Speak::Oip => "Open Inference client",
        };
        let plural = if self.sessions == 1 { "" } else { "s" };
        writeln!(
            f,
            "{} {what}{plural} at {} Hz ({}) for {} s, {:?} samples, {} maps from {}",
            self.sessions,
            self.rate_hz,
            format!("{:?}", self.arrivals).to_lowercase(),
            self.duration_s,
            self.sample_type,
            self.maps,
            self.source
        )?;
        if let Some(contact) = self.contact {
            let plural = if self.fingers == 1 { "" } else { "s" };
            writeln!(f, "{} finger{plural}, poses in, {contact:?} out", self.fingers)?;
            if let Some(method) = self.method {
                writeln!(f, "contact by {method}")?;
            }
        }
        write!(f, "tier {}", self.tier)?;
        if let Some(us) = self.predicted_latency_us {
            write!(f, ", expected {us} us")?;
        }
        writeln!(
            f,
            "; {}",
            self.budget_us.map_or("no budget".to_owned(), |us| format!("budget {us} us"))
        )?;
        let errors: u64 = self.errors.values().sum();
        writeln!(
            f,
            "{} frames: {} ok, {} superseded, {} late, {} stale, {errors} refused, {} lost; {} out of order",
            self.frames,
            self.ok,
            self.superseded,
            self.late,
            self.stale,
            self.lost,
            self.out_of_order
        )?;
        for (code, count) in &self.errors {
            writeln!(f, "  refused: {count} {code}")?;
        }
        let within = self.deadline_us.map_or_else(String::new, |us| {
            format!(" within {us} us of the instant they were meant to leave")
        });
        writeln!(f, "{} missed ({:.2} %): no map{within}", self.missed, self.missed_percent)?;
        self.write_times(f)?;
        if let Some(held) = self.held_us {
            writeln!(f, "sessions moved {} times", held.count)?;
        }
        if self.reopened > 0 {
            writeln!(f, "sessions were opened anew {} times", self.reopened)?;
        }
        if let Some(percent) = self.stolen_percent {
            writeln!(f, "the host withheld {percent:.2} % of this machine's processor time")?;
        }
        if let Some(v) = &self.verification {
            writeln!(
                f,
                "{} maps held against the engine's own: {} wrong, greatest difference {:.1e} of the maximum",
                v.maps, v.wrong, v.difference_max
            )?;
        }
        for fault in self.faults() {
            writeln!(f, "FAULT: {fault}")?;
        }
        Ok(())
    }
}
