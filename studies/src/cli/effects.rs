//! `effects`: what each effect of a scene changes and costs.

use papilla_fe_datagen::cli::print;
use papilla_fingertip::scene::effects::EFFECTS;
use papilla_fingertip::scene::{EffectName, Scene};
use papilla_output::atomic;
use papilla_output::plot::{Axis, Chart, Mark, Series, write_svg};
use papilla_processor::today_here;
use papilla_progress::Progress;
use papilla_studies::effects::{self, Change, Outcome, Study, Switched};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// Solve a scene with each effect switched off (or on) in turn.
///
/// Prints what the effect changes at the last stored state (relative L2 and peak of
/// SED and pressure, force) and what it costs (seconds, iterations, unknowns). With
/// --out also writes effects.json, effects.md and the plot effects.svg.
#[derive(clap::Args)]
#[command(after_help = "Solves the scene once for every effect: try a coarse mesh first.\n\
                        Example: papilla-studies effects scenes/flat-press.toml --out out/effects")]
pub(super) struct Args {
    /// Scene file (see scenes/ and docs/reference/scenes.md).
    scene: PathBuf,
    /// Folder for table and plot.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Only these effects, separated by commas.
    #[arg(long, value_delimiter = ',', value_parser = effect)]
    only: Vec<EffectName>,
    /// Take the scene's path in each of these times, s: one study a time.
    #[arg(long, value_delimiter = ',')]
    seconds: Vec<f64>,
    /// Print the study as JSON; with --seconds a list of studies.
    #[arg(long)]
    json: bool,
}

fn effect(name: &str) -> Result<EffectName, String> {
    name.to_owned().try_into()
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let scene = Scene::read(&args.scene)?;
    if !args.seconds.is_empty() {
        return at_rates(&scene, args);
    }
    writable(args)?;
    let study = study(&scene, args)?;
    let table = markdown(&study);
    if let Some(out) = &args.out {
        atomic::write_json(&out.join("effects.json"), &study)?;
        atomic::write(&out.join("effects.md"), table.as_bytes())?;
        write_svg(&out.join("effects.svg"), &chart(&study))?;
    }
    print(&study, args.json, || table)?;
    Ok(ExitCode::SUCCESS)
}

/// Makes the folder for table and plot before anything is solved.
fn writable(args: &Args) -> anyhow::Result<()> {
    Ok(args.out.as_deref().map_or(Ok(()), atomic::create_folder)?)
}

/// A study for each time that the path is taken in.
fn at_rates(scene: &Scene, args: &Args) -> anyhow::Result<ExitCode> {
    let (mut studies, mut text) = (Vec::new(), String::new());
    let mut scenes = Vec::new();
    for &seconds in &args.seconds {
        scenes.push((seconds, effects::taken_in(scene, seconds)?));
    }
    writable(args)?;
    for (seconds, scene) in scenes {
        let found = study(&scene, args)?;
        let _ = write!(text, "## In {seconds} s\n\n{}\n", markdown(&found));
        studies.push(found);
    }
    if let Some(out) = &args.out {
        atomic::write_json(&out.join("effects.json"), &studies)?;
        atomic::write(&out.join("effects.md"), text.as_bytes())?;
    }
    print(&studies, args.json, || text)?;
    Ok(ExitCode::SUCCESS)
}

fn study(scene: &Scene, args: &Args) -> anyhow::Result<Study> {
    let all = if args.only.is_empty() { EFFECTS.len() } else { args.only.len() };
    let progress = Progress::new("variants", all + 1, 0, args.json);
    let mut begun = false;
    Ok(effects::run(scene, &args.only, &mut |what| {
        progress.set_message(what);
        if std::mem::replace(&mut begun, true) {
            progress.inc();
        }
    })?)
}

fn markdown(study: &Study) -> String {
    let base = &study.base;
    let names: Vec<_> = study.effects.iter().map(EffectName::as_str).collect();
    let mut text = format!(
        "{}.\n\nAs it stands ({}): {:.4} N, peak pressure {:.0} Pa, peak SED {:.1} J/m3; {} unknowns, \
         {:.1} s, {} Newton iterations.\n\n",
        today_here(),
        if names.is_empty() { "no effect".into() } else { names.join(", ") },
        base.force_n,
        base.pressure_pa_max,
        base.sed_j_per_m3_max,
        base.unknowns,
        base.solve_s,
        base.effort.newton_iterations,
    );
    text.push_str(
        "| switched | SED, L2 | SED, peak | pressure, L2 | pressure, peak | force | seconds | Newton | unknowns |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for s in &study.switched {
        let _ = writeln!(text, "| {} | {} |", label(s), row(&s.outcome));
    }
    text
}

fn label(s: &Switched) -> String {
    let way = if s.named { "off" } else { "on" };
    if s.along.is_empty() {
        format!("`{}` {way}", s.effect)
    } else {
        format!("`{}` {way}, with `{}`", s.effect, s.along.join("`, `"))
    }
}

fn row(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Solved { state, change } => {
            let percent = |of: fn(&Change) -> f64| {
                change.as_ref().map_or("-".into(), |c| format!("{:.2} %", 100.0 * of(c)))
            };
            format!(
                "{} | {} | {} | {} | {} | {:.1} | {} | {}",
                percent(|c| c.sed_l2),
                percent(|c| c.sed_peak),
                percent(|c| c.pressure_l2),
                percent(|c| c.pressure_peak),
                percent(|c| c.force),
                state.solve_s,
                state.effort.newton_iterations,
                state.unknowns
            )
        }
        Outcome::Refused(why) => format!("not for this scene: {why} | | | | | | |"),
        Outcome::Failed(why) => format!("no equilibrium: {why} | | | | | | |"),
    }
}

/// Cost against benefit, one dot an effect.
fn chart(study: &Study) -> Chart {
    let series = study.switched.iter().filter_map(|s| match &s.outcome {
        Outcome::Solved { state, change: Some(change) } => {
            let (with, without) = if s.named {
                (study.base.solve_s, state.solve_s)
            } else {
                (state.solve_s, study.base.solve_s)
            };
            Some(Series {
                name: label(s).replace('`', ""),
                points: vec![(with / without, 100.0 * change.sed_l2.max(1e-6))],
                mark: Mark::Dots,
            })
        }
        _ => None,
    });
    Chart {
        title: "What an effect changes and costs".into(),
        x: Axis::log("time with the effect over time without"),
        y: Axis::log("change of SED at the interface, relative L2, %"),
        series: series.collect(),
    }
}
