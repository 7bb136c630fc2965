//! How many presses there are to be, and what that will take.

use super::Args;
use super::error::TeachError;
use super::lender::Lender;
use super::programs::Programs;
use super::sequence::Sequence;
use papilla_campaign::{CampaignError, Status, StatusReader};
use papilla_fingertip::campaign::{CampaignSpec, held_out, indentations};
use papilla_output::atomic;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::ffi::OsStr;
use std::path::Path;

/// Presses of which one is held out; `--hours` asks for a multiple.
const BLOCK: usize = 5;
/// Most presses.
const MOST: usize = 1000;
/// Presses among which the deepest of each indenter is looked for, to say what it takes.
const LOOKED_AT: usize = 100;
/// Core seconds of a contact model.
const CONTACT_S: f64 = 180.0;
/// Solved presses from which on the forecast is corrected by what they took.
const ENOUGH: usize = 3;
/// Steps of the training, and samples in each.
const STEPS: usize = 1500;
pub(super) const BATCH: usize = 8;
const EPOCHS: std::ops::RangeInclusive<usize> = 10..=400;

/// What a run is going to do.
#[derive(Debug, Serialize)]
pub(super) struct Plan {
    pub presses: usize,
    pub states: usize,
    pub held_out: usize,
    /// Of the presses, those that are solved.
    pub solved: usize,
    /// Passes over the presses in training.
    pub epochs: usize,
    /// Core hours of all presses; none if all are solved.
    pub press_hours: Option<f64>,
    /// Core hours of those that are not solved.
    pub press_hours_left: f64,
    /// Memory of one that is being solved.
    pub memory_bytes: usize,
    pub contact_hours: f64,
    /// Core hours of each network's training.
    pub training_hours: Vec<(String, f64)>,
    /// The campaign, as it is going to be written.
    #[serde(skip)]
    pub text: String,
    #[serde(skip)]
    pub spec: CampaignSpec,
}

impl Plan {
    /// Core hours of all that is left to be done.
    pub(super) fn hours_left(&self) -> f64 {
        let training: f64 = self.training_hours.iter().map(|(_, hours)| hours).sum();
        self.press_hours_left + self.contact_hours + training
    }

    /// For people.
    pub(super) fn human(&self, folder: &Path) -> String {
        let Self { presses, states, held_out, solved, .. } = self;
        let mut text = format!(
            "{}: {presses} presses, {states} states; {} presses to learn from, {held_out} held out\n\
             about, in hours of one core of this machine:\n",
            folder.display(),
            presses - held_out
        );
        let mut row = |what: &str, hours: f64, more: String| {
            text += &format!("  {what:12} {hours:6.2}  {more}\n");
        };
        let memory = self.memory_bytes as f64 / f64::from(1 << 30);
        let of_each = match solved < presses {
            true => format!("{memory:.1} GiB for each that is being solved; "),
            false => String::new(),
        };
        row("presses", self.press_hours_left, format!("{of_each}{solved} are solved already"));
        row("contact", self.contact_hours, String::new());
        for (name, hours) in &self.training_hours {
            row(name, *hours, format!("training, {} epochs", self.epochs));
        }
        row("together", self.hours_left(), String::new());
        text
    }
}

/// Refuses what makes no sense, before anything else is looked at.
pub(super) fn require(args: &Args) -> Result<(), TeachError> {
    match (args.presses, args.hours) {
        (Some(presses), _) if presses < BLOCK => {
            Err(TeachError::FewPresses { presses, least: BLOCK })
        }
        (Some(presses), _) if presses > MOST => {
            Err(TeachError::ManyPresses { presses, most: MOST })
        }
        (None, Some(hours)) if !(hours > 0.0 && hours.is_finite()) => Err(TeachError::Hours(hours)),
        (None, None) if !args.campaign_path().is_file() => Err(TeachError::HowMany),
        _ => Ok(()),
    }
}

/// Plans a run.
pub(super) fn plan(
    args: &Args,
    programs: &Programs,
    sequence: &Sequence,
    lenders: &[Lender],
    needs_contact: bool,
) -> anyhow::Result<Plan> {
    let campaign = args.campaign_path();
    let of = |presses: usize| -> anyhow::Result<(String, CampaignSpec)> {
        let text = sequence.text(presses)?;
        let spec = CampaignSpec::parse(&campaign, &text)?;
        Ok((text, spec))
    };
    let planned = match campaign.is_file() {
        true => Some(CampaignSpec::read(&campaign)?.presses),
        false => None,
    };
    let contact_hours = if needs_contact { CONTACT_S / 3600.0 } else { 0.0 };
    let training = |presses: usize, epochs: usize| -> Vec<(String, f64)> {
        let hours = |lender: &Lender| {
            lender.seconds_per_press_and_epoch() * (epochs * presses) as f64 / 3600.0
        };
        lenders.iter().map(|lender| (lender.name.clone(), hours(lender))).collect()
    };
    // A network that learns both sees each state twice: with its own pressure, and with contact's.
    let learns_both = |of: &Lender| of.knows_contact() && !of.knows_contact_alone();
    let pressures = 1 + usize::from(!args.without_contact && lenders.iter().any(learns_both));
    let probe = of(LOOKED_AT)?;
    let mut forecast = None;
    let presses = match (args.presses, args.hours, planned) {
        (Some(asked), _, Some(planned)) if asked < planned => {
            return Err(TeachError::Fewer { campaign, planned, asked }.into());
        }
        (Some(presses), ..) => presses,
        (None, Some(hours), _) => {
            let found = Forecast::of(&probe, args, programs)?;
            let (_, longest) = of(MOST)?;
            let needed = |presses: usize| {
                let epochs = epochs_of(args, &longest, presses, pressures);
                let training: f64 = training(presses, epochs).iter().map(|(_, h)| h).sum();
                found.hours(&longest, presses) + contact_hours + training
            };
            let fits = |presses: &usize| needed(*presses) <= hours;
            let most = (BLOCK..=MOST).step_by(BLOCK).take_while(fits).last();
            let Some(presses) = most.or(planned) else {
                let needed = needed(BLOCK);
                return Err(TeachError::ShortHours { hours, least: BLOCK, needed }.into());
            };
            forecast = Some(found);
            // Those that are there stay.
            presses.max(planned.unwrap_or(0))
        }
        (None, None, Some(planned)) => planned,
        (None, None, None) => return Err(TeachError::HowMany.into()),
    };
    let (text, spec) = of(presses)?;
    let solved = standing(&spec, args)?.map_or(0, |status| status.solved + status.failed.len());
    if solved < presses && forecast.is_none() {
        forecast = Some(Forecast::of(&probe, args, programs)?);
    }
    let press_hours = forecast.as_ref().map(|forecast| forecast.hours(&spec, presses));
    let left = presses - solved.min(presses);
    let held_out = held_out(&spec).test.len();
    let epochs = epochs_of(args, &spec, presses, pressures);
    Ok(Plan {
        presses,
        states: spec.samples(),
        held_out,
        solved,
        epochs,
        press_hours,
        press_hours_left: press_hours.unwrap_or(0.0) * left as f64 / presses as f64,
        memory_bytes: forecast.map_or(0, |forecast| forecast.memory_bytes),
        contact_hours,
        training_hours: training(presses - held_out, epochs),
        text,
        spec,
    })
}

/// Passes over the presses in training: as many steps, however few presses. Of each state so many
/// `pressures` are learnt.
fn epochs_of(args: &Args, spec: &CampaignSpec, presses: usize, pressures: usize) -> usize {
    let own = CampaignSpec { presses, ..spec.clone() };
    let states_per_press = own.samples() as f64 / presses as f64;
    let learnt = presses - held_out(&own).test.len();
    let samples = (learnt as f64 * states_per_press * pressures as f64).max(1.0);
    let epochs = ((STEPS * BATCH) as f64 / samples).ceil() as usize;
    args.epochs.unwrap_or(epochs.clamp(*EPOCHS.start(), *EPOCHS.end()))
}

/// How far the presses are; none if they were not begun.
pub(super) fn standing(spec: &CampaignSpec, args: &Args) -> anyhow::Result<Option<Status>> {
    Ok(reader(spec, args)?.map(|(_, status)| status))
}

fn reader(spec: &CampaignSpec, args: &Args) -> anyhow::Result<Option<(StatusReader, Status)>> {
    let folder = args.presses_path();
    match StatusReader::new(spec, &folder) {
        Ok(mut reader) => {
            let status = reader.read()?;
            Ok(Some((reader, status)))
        }
        Err(CampaignError::NotBegun { .. }) => Ok(None),
        Err(CampaignError::Occupied { .. }) => Err(TeachError::OtherPresses { folder }.into()),
        Err(error) => Err(error.into()),
    }
}

/// Core hours that the solved presses took, as far as it is known.
pub(super) fn solved_hours(spec: &CampaignSpec, args: &Args) -> anyhow::Result<f64> {
    let found = reader(spec, args)?;
    Ok(found.map_or(0.0, |(reader, _)| {
        reader.processor_s().map(|(_, seconds)| seconds).sum::<f64>() / 3600.0
    }))
}

/// What `explain` says of a campaign.
#[derive(Deserialize)]
struct Explained {
    memory_bytes: usize,
    seconds_mean: f64,
    indenters: Vec<ExplainedIndenter>,
}

#[derive(Deserialize)]
struct ExplainedIndenter {
    indenter: String,
    seconds: f64,
}

/// What a press takes, by its indenter.
struct Forecast {
    by_indenter: HashMap<String, f64>,
    mean_s: f64,
    memory_bytes: usize,
    /// What solved presses took, over what had been forecast for them.
    correction: f64,
}

impl Forecast {
    /// Meshes are made, and nothing is solved: by a process of its own, which can be interrupted.
    fn of(
        (text, probe): &(String, CampaignSpec),
        args: &Args,
        programs: &Programs,
    ) -> anyhow::Result<Self> {
        let file = tempfile::Builder::new()
            .prefix(atomic::PARTIAL_PREFIX)
            .suffix(".toml")
            .tempfile_in(args.path(""))?;
        std::fs::write(file.path(), text)?;
        let cost: Explained = programs.ask(programs.own([
            OsStr::new("explain"),
            file.path().as_os_str(),
            OsStr::new("--json"),
        ]))?;
        let by_indenter: HashMap<String, f64> =
            cost.indenters.into_iter().map(|i| (i.indenter, i.seconds)).collect();
        let mut found = Self {
            by_indenter,
            mean_s: cost.seconds_mean,
            memory_bytes: cost.memory_bytes,
            correction: 1.0,
        };
        if let Some((reader, _)) = reader(probe, args)? {
            let candidates = probe.candidates();
            let took: Vec<(usize, f64)> = reader.processor_s().collect();
            let due: f64 = took.iter().map(|(k, _)| found.seconds(&candidates[*k].name)).sum();
            if took.len() >= ENOUGH && due > 0.0 {
                found.correction = took.iter().map(|(_, seconds)| seconds).sum::<f64>() / due;
            }
        }
        Ok(found)
    }

    fn seconds(&self, indenter: &str) -> f64 {
        self.correction * self.by_indenter.get(indenter).copied().unwrap_or(self.mean_s)
    }

    /// Core hours of the first `presses`.
    fn hours(&self, spec: &CampaignSpec, presses: usize) -> f64 {
        let own = CampaignSpec { presses, ..spec.clone() };
        indentations(&own).iter().map(|p| self.seconds(&p.indenter)).sum::<f64>() / 3600.0
    }
}
