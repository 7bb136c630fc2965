//! What was asked of the ladder, each with what was measured.

mod compare;

use super::model::Measured;
use crate::ExportError;
use compare::lost;
use papilla_engine::ladder::{Bar, Kind, Ladder, Rung, SetErrors};
use std::path::Path;

const PRESSES: &str = "heldout-presses";
const SHAPES: &str = "heldout-shapes";
/// Channels of the S1 network that is the baseline.
const BASELINE_BASE: u64 = 16;
/// Time of the fastest rung that must beat the baseline, tract on one core, ms.
const FAST_MS: f64 = 1.0;
/// Answer to no pressure that counts as zero, relative to the greatest SED.
const ZERO: f64 = 1e-6;
/// All files of `models/` together, bytes.
const MODELS_BYTES: u64 = 20_000_000;

/// Judges all bars.
pub(super) fn judge(
    ladder: &Ladder,
    models: &[Measured],
    folder: &Path,
) -> Result<Vec<Bar>, ExportError> {
    let mut bars = vec![fast_rung_beats_the_baseline(models)];
    bars.extend(best_network(models));
    bars.push(teacher(ladder, models));
    bars.push(no_wrong_answers(models));
    bars.push(regenerates(models));
    bars.push(folder_size(folder)?);
    Ok(bars)
}

fn bar(bar: &str, measured: impl Into<String>, met: bool) -> Bar {
    Bar { bar: bar.to_owned(), measured: measured.into(), met }
}

fn percent(value: f64) -> String {
    format!("{:.2} %", 100.0 * value)
}

fn median(rung: &Rung, set: &str) -> Option<f64> {
    rung.relative_l2(set)
}

fn is_baseline(model: &Measured) -> bool {
    let base = model.info.network.get("base").and_then(serde_json::Value::as_u64);
    model.rung.kind == Kind::S1Network && base == Some(BASELINE_BASE)
}

/// The baselines for a rung: S1's networks of base 16, of the same data if there are such.
fn baselines<'a>(models: &'a [Measured], rung: Option<&Measured>) -> Vec<&'a Measured> {
    let all: Vec<&Measured> = models.iter().filter(|m| is_baseline(m)).collect();
    let Some(rung) = rung else { return all };
    let same = |m: &&&Measured| m.info.dataset_sha256 == rung.info.dataset_sha256;
    let of_same_data: Vec<&Measured> = all.iter().filter(same).copied().collect();
    if of_same_data.is_empty() { all } else { of_same_data }
}

fn fast_rung_beats_the_baseline(models: &[Measured]) -> Bar {
    const WHAT: &str = "a rung of at most 1 ms (p50, tract, one core) beats S1's network of base 16 in \
                        every error, median and p95, on held-out presses";
    let is_fast = |m: &&Measured| {
        let fast = m.rung.time_ms().is_some_and(|ms| ms <= FAST_MS);
        fast && m.rung.kind != Kind::S1Network && m.rung.errors.contains_key(PRESSES)
    };
    let mut outcomes: Vec<(usize, String)> = Vec::new();
    for model in models.iter().filter(is_fast) {
        let Some(ours) = model.rung.errors.get(PRESSES) else { continue };
        let baselines = baselines(models, Some(model));
        let mut lines = Vec::new();
        let mut worst = 0;
        for baseline in baselines {
            let Some(theirs) = baseline.rung.errors.get(PRESSES) else { continue };
            let (lost, count) = lost(ours, theirs);
            worst = worst.max(lost.len());
            let but = if lost.is_empty() {
                String::new()
            } else {
                format!(", not in {}", lost.join("; "))
            };
            let name = &baseline.rung.name;
            lines.push(format!(
                "better than {name} in {} of {count} figures{but}",
                count - lost.len()
            ));
        }
        if !lines.is_empty() {
            let ms = model.rung.time_ms().unwrap_or(f64::NAN);
            outcomes
                .push((worst, format!("{} ({ms:.2} ms): {}", model.rung.name, lines.join("; "))));
        }
    }
    match outcomes.into_iter().min_by_key(|(lost, _)| *lost) {
        Some((lost, measured)) => bar(WHAT, measured, lost == 0),
        None => {
            let fastest =
                models.iter().filter_map(|m| m.rung.time_ms()).fold(f64::INFINITY, f64::min);
            let why = format!(
                "not measured: it takes a rung of 1 ms (the fastest takes {fastest:.2} ms), S1's network of base 16 and the held-out presses"
            );
            bar(WHAT, why, false)
        }
    }
}

/// The network of least median error on held-out presses, or on another set without those.
fn best(models: &[Measured], set: &str) -> Option<usize> {
    let is_network = |m: &Measured| m.rung.kind.is_network();
    (0..models.len())
        .filter(|&i| is_network(&models[i]) && median(&models[i].rung, set).is_some())
        .min_by(|&a, &b| {
            let error = |i: usize| median(&models[i].rung, set).unwrap_or(f64::NAN);
            error(a).total_cmp(&error(b))
        })
}

fn best_network(models: &[Measured]) -> Vec<Bar> {
    let best = best(models, PRESSES).map(|i| &models[i]);
    let errors = |set: &str| best.and_then(|m| Some((m, m.rung.errors.get(set)?)));
    let held =
        |what: &str, set: &str, limit: f64, pick: fn(&SetErrors) -> Option<f64>| match errors(set)
            .and_then(|(m, e)| Some((m, pick(e)?)))
        {
            Some((m, value)) => {
                bar(what, format!("{}: {}", m.rung.name, percent(value)), value <= limit)
            }
            None => bar(what, "not measured", false),
        };
    let nail_base = |m: &Measured| m.rung.errors.get(PRESSES)?.nail_base_error.map(|s| s.median);
    let what = "best network: nail-base error at most a quarter of S1's network's (base 16)";
    let theirs = baselines(models, best).into_iter().filter_map(|m| Some((m, nail_base(m)?)));
    let theirs = theirs.min_by(|a, b| a.1.total_cmp(&b.1));
    let spread = match best.and_then(|m| Some((m, nail_base(m)?))).zip(theirs) {
        Some(((m, ours), (s1, theirs))) => {
            let text = format!(
                "{}: {}, {}: {}",
                m.rung.name,
                percent(ours),
                s1.rung.name,
                percent(theirs)
            );
            bar(what, text, ours <= 0.25 * theirs)
        }
        None => bar(what, "not measured", false),
    };
    vec![
        held(
            "best network: relative L2 at most 3 % (median) on held-out presses",
            PRESSES,
            0.03,
            |e| Some(e.relative_l2.median),
        ),
        held(
            "best network: relative L2 at most 8 % (p95) on held-out presses",
            PRESSES,
            0.08,
            |e| Some(e.relative_l2.p95),
        ),
        held(
            "best network: relative L2 at most 10 % (median) on held-out shapes",
            SHAPES,
            0.10,
            |e| Some(e.relative_l2.median),
        ),
        held(
            "best network: far field at most 10 % (median) on held-out presses",
            PRESSES,
            0.10,
            |e| e.far_field_relative_l2.map(|s| s.median),
        ),
        spread,
    ]
}

/// The floor: what the FE that taught the networks is itself off by.
fn teacher(ladder: &Ladder, models: &[Measured]) -> Bar {
    const WHAT: &str = "the networks' errors are compared with the discretisation error of the FE that taught them";
    const SET: &str = "reference";
    // The campaigns are solved on the medium mesh, at finite strain, by linear elements.
    let is_teacher = |rung: &&Rung| {
        let name = rung.name.as_str();
        rung.kind == Kind::Fe
            && !rung.reference
            && ["medium", "linear", "finite"].iter().all(|w| name.contains(w))
    };
    let found = ladder.rungs.iter().find(is_teacher).and_then(|r| Some((r, median(r, SET)?)));
    let network =
        best(models, SET).and_then(|i| Some((&models[i].rung, median(&models[i].rung, SET)?)));
    let Some(((teacher, floor), (network, error))) = found.zip(network) else {
        return bar(WHAT, "not measured: no FE rungs were given", false);
    };
    let own = ladder.discretisation_error.as_ref().map_or_else(String::new, |d| {
        format!("; the reference itself is good to {}", percent(d.sed_relative_l2))
    });
    let text = format!(
        "on the reference's states the teacher ({}) is {} off, the best network ({}) {}{own}",
        teacher.name,
        percent(floor),
        network.name,
        percent(error)
    );
    bar(WHAT, text, true)
}

fn no_wrong_answers(models: &[Measured]) -> Bar {
    const WHAT: &str = "no rung answers a negative, NaN or infinite SED, and no pressure gives none (1e-6 of the scale)";
    let refused: Vec<String> = models
        .iter()
        .filter(|m| m.rung.refused > 0)
        .map(|m| format!("{}: {} answers refused", m.rung.name, m.rung.refused))
        .collect();
    let zero = |m: &&Measured| m.rung.zero_answer.is_some_and(|z| z > ZERO);
    let not_zero: Vec<String> = models
        .iter()
        .filter(zero)
        .map(|m| {
            format!(
                "{}: {:.1e} of the scale without pressure",
                m.rung.name,
                m.rung.zero_answer.unwrap_or(f64::NAN)
            )
        })
        .collect();
    let met = refused.is_empty() && not_zero.is_empty();
    let faults = [refused, not_zero].concat().join("; ");
    let text = if met {
        "none, on all samples and on maps that no finger makes".to_owned()
    } else {
        faults
    };
    bar(WHAT, text, met)
}

fn regenerates(models: &[Measured]) -> Bar {
    const WHAT: &str = "every rung regenerates from a seed, its hours stated";
    let number =
        |m: &Measured, key: &str| m.info.training.get(key).and_then(serde_json::Value::as_f64);
    let silent: Vec<&str> = models
        .iter()
        .filter(|m| m.rung.kind.is_network())
        .filter(|m| number(m, "seed").is_none() || number(m, "seconds").is_none())
        .map(|m| m.rung.name.as_str())
        .collect();
    let hours = models.iter().filter_map(|m| number(m, "seconds")).sum::<f64>() / 3600.0;
    let text = format!(
        "{hours:.1} h of training in the models' metadata; commands in training.md and dataset.md"
    );
    if silent.is_empty() {
        return bar(WHAT, text, true);
    }
    bar(WHAT, format!("{text}; without seed or time: {}", silent.join(", ")), false)
}

fn folder_size(folder: &Path) -> Result<Bar, ExportError> {
    let failed = |source| ExportError::Io { action: "read", path: folder.to_owned(), source };
    let mut bytes = 0;
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let meta = entry.and_then(|entry| entry.metadata()).map_err(failed)?;
        bytes += if meta.is_file() { meta.len() } else { 0 };
    }
    let text = format!("{:.1} MB", bytes as f64 / 1e6);
    Ok(bar("the shipped models stay under 20 MB together", text, bytes < MODELS_BYTES))
}
