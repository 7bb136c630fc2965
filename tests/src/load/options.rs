//! What the load generator can be told.

use papilla_dataset::Split;
use std::{
    num::{NonZeroU32, NonZeroUsize},
    path::PathBuf,
};

use clap::{Parser, ValueEnum};
use papilla_proto::{SampleType, contact::ContactMethod};

use super::contact::Contact;

const HELP_TAIL: &str = "\
Frames leave at their instants whether or not answers come (open loop), and times are
counted from the instant a frame was meant to leave, so that no wait is hidden.
A frame is missed if no map came back within --deadline-us of that instant: late,
superseded, refused, lost, or ok but too slow.

Examples:
  papilla-load                                  one session, 90 Hz, 10 s
  papilla-load --sessions 8 --rate-hz 30 --tier small
  papilla-load --budget-us 0 --deadline-us 11111
                                                drop nothing, count what a 90 Hz frame misses
  papilla-load --dataset data/broad-graded --sample-type u16 --verify
  papilla-load --arrivals poisson --sessions 16 --rate-hz 60
                                                frames that do not keep a beat
  papilla-load --against 127.0.0.1:7225         two services in turn, and how they compare
  papilla-load --speak oip --tier nano --sessions 8 --against 127.0.0.1:8000 --dataset data/heldout-graded
                                                beside any other Open Inference server
  papilla-load --contact touch --rate-hz 1000 --fingers 2
                                                poses in, forces out, beside an echo of the bytes
  papilla-load --contact vertices --method second_order --tier nano --rate-hz 1000 --budget-us 0
                                                poses in, SED at the vertices out, contact at vertices
  papilla-load --floor                          what the machine itself does
  papilla-load --allow-miss-percent 1 --json    for a script

Exit codes:
  0  done
  1  failed: no session, a wrong, lost, refused or disordered answer, a closed session
  2  wrong usage
  3  more misses than --allow-miss-percent";

/// How frames follow one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Arrivals {
    /// One a period, sessions evenly staggered.
    Steady,
    /// At random, independently: gaps are exponential with the period as their mean.
    Poisson,
    /// Some at once (--burst), as after a hitch, then none for as many periods.
    Burst,
}

/// What is spoken with the service.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Speak {
    /// WebSocket sessions.
    Session,
    /// POST /v1/sed with raw float32, a kept connection a client. Any service that answers it
    /// with the raw map can be loaded so.
    Http,
    /// Open Inference Protocol with binary tensors, likewise: also Triton and its kin.
    Oip,
}

/// Loads a Papilla service with pressure frames and measures when maps come back.
#[derive(Clone, Debug, Parser)]
#[command(name = "papilla-load", version, after_help = HELP_TAIL, args_override_self = true)]
pub struct Options {
    /// The service.
    #[arg(
        long,
        env = "PAPILLA_SERVER",
        default_value = "127.0.0.1:7224",
        value_name = "HOST:PORT"
    )]
    pub server: String,

    /// What is spoken with it. Over http and oip a client has one request under way; frames that
    /// come meanwhile replace each other, and those that never leave count as superseded.
    #[arg(long, value_enum, default_value = "session", value_name = "WHAT")]
    pub speak: Speak,

    /// Sends poses of a ball in place of pressure, to a service with --contact; answers carry this
    /// beside what pushes back.
    #[arg(long, value_enum, value_name = "WHAT", conflicts_with_all = ["dataset", "verify", "floor", "speak"])]
    pub contact: Option<Contact>,

    /// Fingers of a session with --contact; each sends a frame at every instant.
    #[arg(long, default_value = "1", requires = "contact", value_name = "N", value_parser = clap::value_parser!(u8).range(1..=10))]
    pub fingers: u8,

    /// How the service finds the pressure with --contact, such as second_order
    /// [default: the service's own choice].
    #[arg(long, requires = "contact", value_name = "NAME", value_parser = method)]
    pub method: Option<ContactMethod>,

    /// Sessions at a time, their frames evenly staggered.
    #[arg(long, default_value = "1", value_name = "K")]
    pub sessions: NonZeroUsize,

    /// Frames a second and session.
    #[arg(long, default_value = "90", value_name = "HZ", value_parser = positive)]
    pub rate_hz: f64,

    /// How frames follow one another.
    #[arg(long, value_enum, default_value = "steady", value_name = "HOW")]
    pub arrivals: Arrivals,

    /// Frames that come at once with --arrivals burst.
    #[arg(long, default_value = "4", value_name = "N")]
    pub burst: NonZeroU32,

    /// Seed of --arrivals poisson.
    #[arg(long, default_value = "0", value_name = "SEED")]
    pub seed: u64,

    /// Go on over another connection when the service asks for it, and when one breaks.
    #[arg(long, conflicts_with_all = ["floor", "speak"])]
    pub follow: bool,

    /// Load nothing; measure for --duration-s what this machine does without any service: how
    /// late it wakes, and what the bytes of a frame cost over loopback.
    #[arg(long, conflicts_with = "against")]
    pub floor: bool,

    /// A second service, loaded in turn with the first.
    #[arg(long, value_name = "HOST:PORT")]
    pub against: Option<String>,

    /// Turns of each with --against; the measured time is shared between them.
    #[arg(long, default_value = "4", value_name = "N")]
    pub rounds: NonZeroU32,

    /// Time measured, seconds.
    #[arg(long, default_value = "10", value_name = "S", value_parser = positive)]
    pub duration_s: f64,

    /// Time before that whose frames are sent but not counted, seconds.
    #[arg(long, default_value = "1", value_name = "S", value_parser = not_negative)]
    pub warmup_s: f64,

    /// Samples on the wire: f32, f16, u16 or u8.
    #[arg(long, default_value = "f32", value_name = "TYPE", value_parser = sample_type)]
    pub sample_type: SampleType,

    /// Budget of a frame, us, after which the service drops it; 0: none. Touch may lag 50 ms
    /// behind sight unnoticed.
    #[arg(long, default_value = "50000", value_name = "US")]
    pub budget_us: u32,

    /// Time after which a map counts as missed, us [default: the budget].
    #[arg(long, value_name = "US")]
    pub deadline_us: Option<NonZeroU32>,

    /// Tier by name [default: the one the service chooses for the budget].
    #[arg(long, value_name = "NAME")]
    pub tier: Option<String>,

    /// Folder of a dataset whose maps are sent [default: the service's own states].
    #[arg(long, value_name = "DIR")]
    pub dataset: Option<PathBuf>,

    /// Split of the dataset.
    #[arg(long, default_value_t = Split::Test, value_name = "SPLIT")]
    pub split: Split,

    /// Most maps to take turns.
    #[arg(long, default_value = "64", value_name = "N")]
    pub maps: NonZeroUsize,

    /// Compare every answer with what the engine answers here, to 1e-6 of the map's maximum
    /// (and the error of the sample type).
    #[arg(long)]
    pub verify: bool,

    /// Folder of the models that the service runs, for --verify.
    #[arg(long, default_value = "models", value_name = "DIR")]
    pub models: PathBuf,

    /// How long to wait for answers after the last frame, seconds.
    #[arg(long, default_value = "5", value_name = "S")]
    pub drain_s: u64,

    /// Exit with 3 if a greater share of the frames is missed, percent.
    #[arg(long, value_name = "P", value_parser = not_negative)]
    pub allow_miss_percent: Option<f64>,

    /// Print the report as JSON.
    #[arg(long)]
    pub json: bool,
}

impl Options {
    /// The budget as the protocol has it.
    pub(super) fn budget(&self) -> Option<u32> {
        (self.budget_us > 0).then_some(self.budget_us)
    }

    /// Time after which a map counts as missed, us; none: never.
    pub(super) fn deadline(&self) -> Option<u32> {
        self.deadline_us.map(NonZeroU32::get).or_else(|| self.budget())
    }

    /// Frames of one session that are sent but not counted, and those that are.
    pub(super) fn frames(&self) -> (u32, u32) {
        let frames = |seconds: f64| (seconds * self.rate_hz).round() as u32;
        let counted = NonZeroU32::new(frames(self.duration_s)).unwrap_or(NonZeroU32::MIN);
        (frames(self.warmup_s), counted.get())
    }
}

fn number(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    // More than any clock or network keeps up with; and products stay within u32.
    if value.abs() <= 30_000.0 { Ok(value) } else { Err("more than 30000".to_owned()) }
}

fn positive(text: &str) -> Result<f64, String> {
    number(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err("has to be above 0".to_owned()) })
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text).and_then(|v| if v >= 0.0 { Ok(v) } else { Err("has to be 0 or more".to_owned()) })
}

fn sample_type(text: &str) -> Result<SampleType, String> {
    let names = ["f32", "f16", "u16", "u8"];
    let found = names.iter().position(|name| *name == text);
    found.map(|i| SampleType::ALL[i]).ok_or_else(|| format!("there are {}", names.join(", ")))
}

fn method(text: &str) -> Result<ContactMethod, String> {
    let found = ContactMethod::ALL.into_iter().find(|method| method.as_str() == text);
    let names = || ContactMethod::ALL.map(ContactMethod::as_str).join(", ");
    found.ok_or_else(|| format!("there are {}", names()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(arguments: &[&str]) -> Result<Options, clap::Error> {
        Options::try_parse_from([&["papilla-load"][..], arguments].concat())
    }

    #[test]
    fn the_command_line_is_sound() {
        use clap::CommandFactory;
        Options::command().debug_assert();
        for wrong in [
            ["--sessions", "0"],
            ["--rate-hz", "0"],
            ["--rate-hz", "NaN"],
            ["--duration-s", "-1"],
            ["--sample-type", "f64"],
            ["--allow-miss-percent", "-1"],
            ["--fingers", "2"],
            ["--method", "pixels"],
        ] {
            assert!(parse(&wrong).is_err(), "{wrong:?}");
        }
        assert_eq!(parse(&["--sample-type", "u8"]).unwrap().sample_type, SampleType::U8);
        let method = |name| parse(&["--contact", "touch", "--method", name]).map(|o| o.method);
        assert_eq!(method("second_order").unwrap(), Some(ContactMethod::SecondOrder));
        assert!(method("second").is_err());
    }

    #[test]
    fn the_deadline_is_the_budget_unless_told() {
        let deadline = |arguments: &[&str]| parse(arguments).unwrap().deadline();
        assert_eq!(deadline(&["--budget-us", "7000"]), Some(7000));
        assert_eq!(deadline(&["--budget-us", "0"]), None);
        assert_eq!(deadline(&["--budget-us", "0", "--deadline-us", "5"]), Some(5));
    }

    #[test]
    fn frames_are_rate_times_time_and_at_least_one() {
        let frames = |arguments: &[&str]| parse(arguments).unwrap().frames();
        assert_eq!(frames(&[]), (90, 900));
        assert_eq!(frames(&["--duration-s", "0.001", "--warmup-s", "0"]), (0, 1));
    }
}
