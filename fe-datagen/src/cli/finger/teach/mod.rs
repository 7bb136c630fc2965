//! `finger teach`: networks of a finger, from presses of it.
//!
//! Everything is done by commands that one may also type: `generate`, `finger build`, the trainer,
//! `model-export`. Each is printed before it runs, goes on where it was stopped, and writes its files
//! whole or not at all.

mod error;
mod lender;
mod plan;
mod programs;
mod report;
mod sequence;
mod steps;

use super::{
    super::{print, signals},
    build::described,
};
use error::TeachError;
use lender::Lender;
use papilla_contact::ContactModel;
use papilla_fingertip::mesh::fingertip::check_elements;
use papilla_fingertip::scene::Finger;
use papilla_output::atomic;
use programs::Programs;
use sequence::Sequence;
use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;

/// Train networks of a finger, from presses that are solved on it.
///
/// Presses the finger as the campaigns of the shipped networks press the default one, trains the
/// default finger's networks on with what comes of it, and measures them on presses that were held
/// out, before and after. Says beforehand what it will take. May be stopped at any time: the same
/// command goes on. Writes networks and cards into the finger's folder, and all else into `teach` in
/// it. The presses are an ordinary campaign there, so that `generate --slice` may solve them on many
/// machines first. See docs/guides/fingers.md.
#[derive(clap::Args)]
#[command(
    after_help = "Needs the program model-export (MODEL_EXPORT, else beside this one, else in PATH) and a Python\n\
                  with the trainer's packages (PYTHON, else python3); docs/guides/training.md.\n\
                  Exit codes: 0 done; 1 failed; 130 stopped by Ctrl-C or TERM.\n\
                  Example: fe-datagen finger teach fingers/mine --hours 4"
)]
pub(super) struct Args {
    /// Folder of the finger.
    finger: PathBuf,
    /// Take as many presses as this many core hours allow, with contact and training.
    #[arg(long, conflicts_with = "presses")]
    hours: Option<f64>,
    /// Take so many presses: the first of a fixed sequence, one in five of which is held out. May be
    /// more than before.
    #[arg(long)]
    presses: Option<usize>,
    /// Network to train on; may be given several times [default: those that the folder's index names
    /// as defaults, for poses and for pressure].
    #[arg(long = "network", value_name = "NAME")]
    networks: Vec<String>,
    /// Folder with these networks and their cards.
    #[arg(long, value_name = "FOLDER", default_value = "models")]
    from: PathBuf,
    /// A campaign whose presses are taken, scaled to the finger, in place of campaigns/teach.toml.
    #[arg(long, value_name = "FILE")]
    campaign: Option<PathBuf>,
    /// Passes over the presses in training [default: as many steps, however few presses].
    #[arg(long)]
    epochs: Option<usize>,
    /// Make no contact model and learn from FE's pressure alone: for frames with pressure.
    #[arg(long)]
    without_contact: bool,
    /// Presses solved at a time, and threads of the training [default: one per core].
    #[arg(long)]
    threads: Option<NonZero<usize>>,
    /// Write the campaign, say what all will take, and stop: to solve it elsewhere first.
    #[arg(long)]
    plan: bool,
    /// Print the plan or the report as JSON.
    #[arg(long)]
    json: bool,
}

impl Args {
    fn path(&self, name: &str) -> PathBuf {
        self.finger.join("teach").join(name)
    }

    fn campaign_path(&self) -> PathBuf {
        self.path("campaign.toml")
    }

    fn presses_path(&self) -> PathBuf {
        self.path("presses")
    }

    fn contact_path(&self) -> PathBuf {
        self.finger.join("finger.contact")
    }
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let stop = signals::interrupt()?;
    match teach(args, stop) {
        Ok(()) => Ok(ExitCode::SUCCESS),
        Err(error) if matches!(error.downcast_ref(), Some(TeachError::Interrupted)) => {
            eprintln!("{error}");
            Ok(ExitCode::from(signals::INTERRUPTED))
        }
        Err(error) => Err(error),
    }
}

fn teach(args: &Args, stop: std::sync::Arc<std::sync::atomic::AtomicBool>) -> anyhow::Result<()> {
    let folder = &args.finger;
    anyhow::ensure!(folder.is_dir(), "{} is not the folder of a finger", folder.display());
    plan::require(args)?;
    let finger = Finger::read(folder)?;
    check_elements(&finger.shape)?;
    if finger.tissue.skin_tension_n_per_mm.is_some() && !args.without_contact {
        return Err(TeachError::Tension { folder: folder.clone(), network: "small-maps" }.into());
    }
    let sequence = Sequence::of(args.campaign.as_deref(), &finger)?;
    let names = match args.networks.is_empty() {
        true => lender::usual(&args.from)?,
        false => args.networks.clone(),
    };
    let lenders = names
        .iter()
        .map(|name| Lender::read(&args.from, name))
        .collect::<Result<Vec<Lender>, _>>()?;
    let programs = Programs::new(stop);
    if !args.plan {
        programs.check()?;
    }
    let needs_contact = !args.without_contact && !has_contact(args, &finger)?;
    // The campaign names the finger by the way from its own folder.
    atomic::create_folder(&args.path(""))?;
    let plan = plan::plan(args, &programs, &sequence, &lenders, needs_contact)?;
    atomic::write_changed(&args.campaign_path(), plan.text.as_bytes())?;
    let said = || plan.human(folder);
    if args.plan {
        let more = format!(
            "wrote {0}\nfe-datagen generate {0} --out {1} solves it; --slice I/N a part",
            args.campaign_path().display(),
            args.presses_path().display()
        );
        return print(&plan, args.json, || said() + &more);
    }
    eprintln!("{}", said().trim_end());
    let report = steps::run(args, &programs, &finger, &plan, &lenders, needs_contact)?;
    atomic::write_json(&args.path("report.json"), &report)?;
    print(&report, args.json, || report.human())
}

/// Whether the bundle has a contact model of this very finger, as its file describes it now, with its
/// atlas.
fn has_contact(args: &Args, finger: &Finger) -> anyhow::Result<bool> {
    let path = args.contact_path();
    if !path.is_file() || !args.finger.join("atlas.json").is_file() {
        return Ok(false);
    }
    let model = ContactModel::read(&std::fs::read(&path)?)
        .map_err(|error| anyhow::anyhow!("{}: {error}; take it away", path.display()))?;
    let is_of_its_file = model.require_finger_file(&described(&args.finger)?).is_ok();
    Ok(model.header().finger_sha256 == finger.sha256() && is_of_its_file)
}
