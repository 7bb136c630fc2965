//! `model-export pseudo-labels`.

use super::{load_model, print_json};
use papilla_engine::Backend;
use papilla_fingertip::campaign::CampaignSpec;
use papilla_model_export::contact::{Labeller, Models, PseudoLabels};
use papilla_model_export::{ExportError, evaluate, read_atlas, write};
use papilla_progress::Progress;
use serde_json::json;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// The network whose answers are to be learnt, `.onnx`.
    network: PathBuf,
    /// Campaigns whose indentations are drawn.
    #[arg(required = true)]
    campaigns: Vec<PathBuf>,
    /// The contact model that finds the pressures, a file of `fe-datagen contact`.
    #[arg(long, value_name = "FILE")]
    contact: PathBuf,
    /// The atlas of both.
    #[arg(long, value_name = "FILE", default_value = "models/atlas.json")]
    atlas: PathBuf,
    /// Indentations of each campaign, in place of its own number.
    #[arg(long, value_name = "N", default_value_t = 300)]
    presses: usize,
    /// Changes the campaigns' seeds, so that none of their own indentations is drawn.
    #[arg(long, value_name = "N", default_value_t = 1_000_003)]
    seed: u64,
    /// File to write, which the trainer reads (`--pseudo-labels`).
    #[arg(long, value_name = "FILE.npz")]
    write: PathBuf,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let models = Models::read(&options.contact)?;
    let atlas = read_atlas(&options.atlas)?;
    let network = load_model(&options.network, Backend::default(), None)?;
    let what = options.atlas.display().to_string();
    evaluate::require_atlas(&what, atlas.hash(), network.info())?;
    let failed = |source| ExportError::Engine { path: options.network.clone(), source };
    let session = network.session().map_err(failed)?;
    let mut labeller = Labeller::new(&models, (&options.atlas, &atlas), session, &options.network)?;
    let mut labels = PseudoLabels::default();
    let mut specs = Vec::new();
    for path in &options.campaigns {
        let mut spec = CampaignSpec::read(path)?;
        spec.presses = options.presses;
        spec.seed ^= options.seed;
        spec.validate()?;
        specs.push(spec);
    }
    let progress = Progress::new("presses", specs.len() * options.presses, 0, json);
    for spec in &specs {
        labeller.label(spec, &mut labels, || progress.inc())?;
    }
    drop(progress);
    write(&options.write, &labels.npz(atlas.hash(), &network.info().name)?)?;
    let (pairs, left_out) = (labels.len(), labels.left_out);
    if json {
        return print_json(&json!({"write": options.write, "maps": pairs, "left_out": left_out}));
    }
    println!("{}: {pairs} maps; {left_out} states left out", options.write.display());
    Ok(())
}
