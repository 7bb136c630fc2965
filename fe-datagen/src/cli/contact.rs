//! `contact`: computes the contact model of the finger, for the contact solver of the service.

use crate::contact_model::{self, Recipe};
use papilla_output::atomic;
use papilla_progress::Progress;
use std::path::PathBuf;
use std::process::ExitCode;

/// Make a contact model of this finger for the real-time contact solver.
///
/// Two parts: how far each vertex of the skin moves under a force on any other one at small strain
/// (one factorization, 3 V right-hand sides), and the second order of finite strain over the load
/// modes of the datasets' training indentations (exact derivatives of the internal forces, no fit).
/// Held-out indentations are not read. Layers and finite strain on, rigid bone and nail.
#[derive(clap::Args)]
#[command(after_help = "Takes 1.4 min of a core and 0.8 GB.\n\
                        Example: fe-datagen contact data/s1-graded data/broad-graded --out out/contact")]
pub(super) struct Args {
    /// Datasets of this finger, by density medium.
    #[arg(required = true)]
    datasets: Vec<PathBuf>,
    /// A finger of your own: its folder, or its name in `fingers/`.
    #[arg(long, value_name = "FINGER")]
    finger: Option<PathBuf>,
    /// Load modes of the second order.
    #[arg(long, default_value_t = contact_model::MODES)]
    modes: usize,
    /// Displacements of the second order.
    #[arg(long, default_value_t = contact_model::OUTPUTS)]
    outputs: usize,
    /// Folder for finger.contact.
    #[arg(long)]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let finger = super::chosen_finger::named(args.finger.as_deref())?;
    let recipe = Recipe {
        finger: &finger,
        datasets: &args.datasets,
        of_any_finger: false,
        finger_file_sha256: String::new(),
        modes: args.modes,
        outputs: args.outputs,
    };
    println!("{}", write(&recipe, &args.out)?);
    Ok(ExitCode::SUCCESS)
}

/// Makes a contact model and writes it into a folder; what was done, for people.
///
/// # Errors
/// A dataset cannot be read or is of another finger; the finger cannot be solved.
pub(super) fn write(recipe: &Recipe<'_>, folder: &std::path::Path) -> anyhow::Result<String> {
    let mut progress: Option<(&str, Progress)> = None;
    let made = contact_model::make(recipe, &mut |part, done, all| {
        if progress.as_ref().is_none_or(|(name, _)| *name != part) {
            progress = Some((part, Progress::new(part, all, 0, false)));
        }
        if let Some((_, shown)) = &progress {
            shown.set_position(done);
        }
        // What comes between two parts is not the first one's.
        if done >= all {
            progress = None;
        }
    })?;
    drop(progress);
    // Not before: what is refused leaves nothing behind.
    atomic::create_folder(folder)?;
    let path = folder.join("finger.contact");
    atomic::write(&path, &made.bytes)?;
    Ok(format!(
        "contact model of {} vertices, {} load modes of {} loads, second order up to {:.0} % of the \
         displacement\nwrote {}",
        made.header.vertices,
        made.header.modes,
        made.loads,
        100.0 * made.header.share_max,
        path.display()
    ))
}
