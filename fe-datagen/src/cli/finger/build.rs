//! `finger build`: computes the atlas and the contact model of a finger.

use crate::cli::contact;
use crate::contact_model::{MODES, OUTPUTS, Recipe};
use anyhow::Context as _;
use papilla_contact::finger_file_sha256;
use papilla_fingertip::mesh::fingertip::{Density, check_elements};
use papilla_fingertip::scene::Finger;
use papilla_fingertip::scene::finger::FINGER_FILE;
use papilla_fingertip::simulation::body::Body;
use papilla_output::atomic;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Write a finger's atlas.json and finger.contact into its folder.
///
/// The contact model takes FE: one factorization with 3 V right-hand sides, and exact second
/// derivatives over load modes. The modes are taken from the training indentations of datasets of
/// any finger of this template, since their vertices lie at the same (u, v).
#[derive(clap::Args)]
#[command(after_help = "Takes 1.4 min of a core and 0.8 GB; the atlas alone some seconds.\n\
                        Example: fe-datagen finger build fingers/mine")]
pub(super) struct Args {
    /// Folder of the finger.
    finger: PathBuf,
    /// Datasets that give the load modes.
    #[arg(long, num_args = 1.., default_values = ["data/s1-graded", "data/broad-graded"], value_name = "DATASET")]
    presses: Vec<PathBuf>,
    /// Load modes of the second order.
    #[arg(long, default_value_t = MODES)]
    modes: usize,
    /// Displacements of the second order.
    #[arg(long, default_value_t = OUTPUTS)]
    outputs: usize,
    /// Write the atlas alone.
    #[arg(long)]
    atlas_only: bool,
}

/// Hash of the file that describes the finger of a folder.
pub(super) fn described(folder: &Path) -> anyhow::Result<String> {
    let path = folder.join(FINGER_FILE);
    let text = papilla_json::read_text(&path).with_context(|| path.display().to_string())?;
    let skin = |name: &str| std::fs::read(folder.join(name)).ok();
    finger_file_sha256(&text, skin).with_context(|| path.display().to_string())
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let folder = &args.finger;
    anyhow::ensure!(folder.is_dir(), "{} is not the folder of a finger", folder.display());
    let finger = Finger::read(folder)?;
    check_elements(&finger.shape)?;
    let body = Body::even(&finger.shape, &finger.tissue, Density::Medium)?;
    let (atlas, _) = body.atlas().context("a fingertip has an atlas patch")??;
    let contact = folder.join("finger.contact");
    let said = if args.atlas_only {
        // One of another atlas must not stay beside this one.
        None
    } else {
        let recipe = Recipe {
            finger: &finger,
            datasets: &args.presses,
            of_any_finger: true,
            finger_file_sha256: described(folder)?,
            modes: args.modes,
            outputs: args.outputs,
        };
        Some(contact::write(&recipe, folder)?)
    };
    let path = folder.join("atlas.json");
    atomic::write(&path, atlas.to_json()?.as_bytes())?;
    println!("atlas {}\nwrote {}", atlas.hash(), path.display());
    match said {
        Some(said) => println!("{said}"),
        None if contact.exists() => println!("{} is left as it is", contact.display()),
        None => {}
    }
    Ok(ExitCode::SUCCESS)
}
