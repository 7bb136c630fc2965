//! `fidelity`: finite elements as rows of the ladder.

use super::part::Part;
use super::{CHECKS_FAILED, print, wrong_usage};
use papilla_fingertip::campaign::CampaignSpec;
use papilla_progress::Progress;
use papilla_validation::fidelity::{self, Ladder, Report};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Solve held-out indentations of a campaign at every fidelity level and by the reference.
///
/// Levels: coarse and medium meshes, linear and quadratic elements, small and finite
/// strain. Reference: linear elements on the fine mesh at finite strain; its own error
/// is told by quadratic elements on the fine mesh (--check). All fields are read at the
/// vertices of the medium atlas; times are processor seconds, the path to a state
/// included. Writes rungs.json and one npz a level; see docs/reports/fe-rungs.md.
///
/// Can be killed at any moment and started again: every indentation at every level is one
/// file in DIR/parts. With --slice solves its part only; any number of them may share DIR, and
/// the same command as a whole (--slice 1/1) solves what is left and writes the files.
#[derive(clap::Args)]
#[command(
    after_help = "An indentation of the fine mesh takes minutes and 3 GB; a state that a level cannot solve \
                        is left out everywhere and reported (exit code 3).\n\
                        Example: fe-datagen fidelity campaigns/heldout.toml --presses 3 --out out/rungs"
)]
pub(super) struct Args {
    /// Campaign file (see campaigns/ and docs/reference/dataset.md).
    campaign: PathBuf,
    /// Held-out indentations to solve, spread over the campaign's indenters.
    #[arg(long)]
    presses: usize,
    /// Indentations that the fine mesh with quadratic elements solves too.
    #[arg(long, default_value_t = 1)]
    check: usize,
    #[command(flatten)]
    part: Part,
    /// Folder for rungs.json, the archives and what a restart needs.
    #[arg(long)]
    out: PathBuf,
    /// Print the report as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let slice = match args.part.slice() {
        Ok(slice) => slice,
        Err(error) => return Ok(wrong_usage(&error)),
    };
    let spec = CampaignSpec::read(&args.campaign)?;
    let progress = Progress::new("solutions", 1, 0, args.json);
    let ladder = Ladder::usual(args.check);
    let tell = &mut |what: &str, done: usize, all: usize| {
        progress.set_length(all);
        progress.set_position(done);
        progress.set_message(what);
    };
    let found = fidelity::run(&spec, &ladder, (args.presses, slice), &args.out, tell)?;
    drop(progress);
    let Some(report) = found else { return Ok(ExitCode::SUCCESS) };
    print(&report, args.json, || human(&report))?;
    let clean = report.left_out.is_empty();
    Ok(if clean { ExitCode::SUCCESS } else { ExitCode::from(CHECKS_FAILED) })
}

fn human(r: &Report) -> String {
    let mut text = format!(
        "campaign {}: {} states\nlevel                           unknowns   s a state   SED error: \
         median     p95\n",
        r.campaign,
        r.states.len()
    );
    for level in &r.levels {
        let mut seconds = level.seconds.clone();
        seconds.sort_by(f64::total_cmp);
        let e = &level.sed_relative_l2;
        let _ = writeln!(
            text,
            "{:30} {:9} {:11.2} {:19.4} {:7.4}",
            level.name,
            level.unknowns,
            seconds[seconds.len() / 2],
            e.median,
            e.p95
        );
        if let Some(own) = &level.discretisation_error {
            let _ = writeln!(text, "  its own error {:.4}: {}", own.sed_relative_l2, own.how);
        }
    }
    for l in &r.left_out {
        let _ = writeln!(
            text,
            "left out: indentation {} at {:.3} mm, {}: {}",
            l.press, l.depth_mm, l.level, l.why
        );
    }
    text
}
