//! Two services under the same load, in turn.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{LoadError, Options, Report, Target, report::Percentiles, tally::Tally};

/// What two services made of the same load.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// The service of `--server`.
    pub server: Report,
    /// The service of `--against`.
    pub against: Report,
    /// Times of the second over those of the first.
    pub ratios: Ratios,
}

/// How many times as long the second service takes; above 1 the first is ahead.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ratios {
    /// Of the medians of the round trip; none if either sent no map.
    pub p50: Option<f64>,
    /// Of the 99th percentiles.
    pub p99: Option<f64>,
    /// Of the 99.9th percentiles.
    pub p99_9: Option<f64>,
    /// Maps of the first over maps of the second; none if the second sent none.
    pub maps: Option<f64>,
}

/// Loads the service of `--server` and that of `against` in turn, `--rounds` times each, so that
/// what else goes on in the machine meets both.
///
/// # Errors
/// As [`run`](super::run).
pub async fn compare(options: &Options, against: &str) -> Result<Comparison, LoadError> {
    let rounds = options.rounds.get();
    let turn = Options { duration_s: options.duration_s / f64::from(rounds), ..options.clone() };
    let both = [options.server.clone(), against.to_owned()]
        .map(|server| Options { server, ..turn.clone() });
    let targets = [Target::new(&both[0]).await?, Target::new(&both[1]).await?];
    let mut tallies = [Tally::default(), Tally::default()];
    for round in 0..rounds {
        // Neither always goes first.
        let order = if round % 2 == 0 { [0, 1] } else { [1, 0] };
        for which in order {
            tallies[which].add(&targets[which].load(&both[which]).await?);
        }
    }
    let report = |which: usize| {
        let options = Options { duration_s: options.duration_s, ..both[which].clone() };
        Report::new(&options, &targets[which], &tallies[which], None)
    };
    Ok(Comparison::new(report(0), report(1)))
}

impl Comparison {
    fn new(server: Report, against: Report) -> Self {
        let ratio = |of: fn(Percentiles) -> u64| {
            let (first, second) = (server.round_trip_us?, against.round_trip_us?);
            Some(of(second) as f64 / of(first).max(1) as f64)
        };
        let ratios = Ratios {
            p50: ratio(|p| p.p50),
            p99: ratio(|p| p.p99),
            p99_9: ratio(|p| p.p99_9),
            maps: (against.ok > 0).then(|| server.ok as f64 / against.ok as f64),
        };
        Self { server, against, ratios }
    }

    /// Exit code of the program: the worse of the two.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match (self.server.exit_code(), self.against.exit_code()) {
            (0, code) | (code, 0) => code,
            (1, _) | (_, 1) => 1,
            (code, _) => code,
        }
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "== {}", self.server.server)?;
        writeln!(f, "{}", self.server)?;
        writeln!(f, "== {}", self.against.server)?;
        writeln!(f, "{}", self.against)?;
        let times = |ratio: Option<f64>| ratio.map_or("-".to_owned(), |r| format!("{r:.2}"));
        let Ratios { p50, p99, p99_9, maps } = self.ratios;
        writeln!(
            f,
            "the second takes {} times as long at p50, {} at p99, {} at p99.9; the first sent {} times its maps",
            times(p50),
            times(p99),
            times(p99_9),
            times(maps)
        )
    }
}
