//! `fit`: the finger that comes closest to people's, or to a person's own records.

use super::people::OfPeople;
use papilla_fe_datagen::cli::{print, refuse_unknown};
use papilla_studies::people::fit::parameters::{Moved, PARAMETERS};
use papilla_studies::people::fit::{self, Options, PARTS, record};
use std::path::PathBuf;
use std::process::ExitCode;

/// Fit tissues and shape of the finger, within bounds, to what plates measure on people's fingers or to
/// a person's own records, and say which constants the measurements tell.
///
/// Writes fit.json, fit.md, finger.toml (the finger) and a file a press; see studies/reports/fit.md. No
/// chance in it: the same measurements give the same constants. Can be killed at any moment and started
/// again: what is pressed is not pressed again.
#[derive(clap::Args)]
#[command(
    after_help = "A record is a table of comma-separated values with the columns press (a name), indenter \
                        (plate or ball), radius_mm (of a ball), pitch_deg (of a plate), time_s, depth_mm and \
                        force_n.\n\
                        Example: papilla-studies fit --out out/fit\n\
                        Example: papilla-studies fit --record me.csv --out fingers/me"
)]
pub(super) struct Args {
    /// A person's own record, in the place of published figures; may be given several times.
    #[arg(long, value_name = "FILE")]
    record: Vec<PathBuf>,
    /// Only this part beside the constants (constants, halves, taps, rows); may be given several times.
    #[arg(long, value_name = "PART")]
    only: Vec<String>,
    /// Only move these constants (fat, exponent, dermis, epidermis, pulp, bone, crease, thickness, nail, tension);
    /// may be given several times.
    #[arg(long = "move", value_name = "CONSTANT")]
    moved: Vec<String>,
    /// Fingers simulated before the first search: the start and points spread over the bounds.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u16).range(3..=1000))]
    design: u16,
    /// Fingers simulated after it at most.
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u16).range(0..=1000))]
    rounds: u16,
    /// Fingers simulated on the graded mesh at most, each some ten times as long; 0 leaves the even mesh
    /// uncorrected.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u16).range(0..=100))]
    graded: u16,
    #[command(flatten)]
    people: OfPeople,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    refuse_unknown(&args.only, &PARTS)?;
    let people = &args.people;
    let measured = people.measured()?;
    let read = |path: &PathBuf| Ok((path.display().to_string(), record::read(path)?));
    let records = args.record.iter().map(read).collect::<anyhow::Result<Vec<_>>>()?;
    refuse_unknown(&args.moved, &PARAMETERS.map(|p| p.key))?;
    let options = Options {
        moved: Moved::named(&args.moved),
        design: args.design.into(),
        rounds: args.rounds.into(),
        graded: args.graded.into(),
        only: args.only.clone(),
    };
    let all = options.design + options.rounds + options.graded;
    let fit = people
        .told("fingers", all, |told| fit::run(&measured, records, &options, &people.out, told))?;
    if let Some(page) = &people.markdown {
        fit.write_page(page)?;
    }
    print(&fit, people.json, || fit.human())?;
    Ok(ExitCode::SUCCESS)
}
