//! The shipped ladder with the times of this machine.
//!
//! Errors do not depend on the machine, so they are taken from `ladder.json`. The times of every
//! model are measured anew, in each engine that this machine has.

use super::{Progress, Timing, machine, model};
use crate::{ExportError, read, read_text};
use papilla_engine::ladder::{Ladder, LatencyByEngine, Percentiles, REFERENCE_SET, Rung};
use papilla_engine::{EngineError, MAP_LEN, MAP_SIDE_PX};
use std::fmt::Write;
use std::path::Path;
use std::time::Duration;

/// Some three seconds for each model and engine.
const TIMING: Timing = Timing { rounds: 6, round: Duration::from_millis(350), runs_min: 2 };

/// Measures the models of a folder that its ladder lists.
///
/// # Errors
/// The ladder or a model is unreadable, is not what was measured, or does not run.
pub fn measure(models: &Path, progress: &dyn Progress) -> Result<Ladder, ExportError> {
    let path = models.join("ladder.json");
    let mut ladder = Ladder::from_json(&read_text(&path)?).map_err(ExportError::engine(&path))?;
    // The solver's rows were timed elsewhere.
    ladder.rungs.retain(|rung| rung.model.is_some());
    progress.total(ladder.rungs.len() as u64);
    for rung in &mut ladder.rungs {
        progress.stage(&rung.name);
        let path = models.join(format!("{}.onnx", rung.model.as_ref().unwrap_or(&rung.name)));
        rung.latency_ms = Some(times(&path, rung)?);
        progress.step();
    }
    ladder.machine = machine();
    ladder.mark_front();
    Ok(ladder)
}

fn times(path: &Path, rung: &Rung) -> Result<LatencyByEngine, ExportError> {
    let onnx = read(path)?;
    let tract = papilla_engine::load(&onnx, None).map_err(ExportError::engine(path))?;
    let info = tract.info();
    if let Some(measured) = rung.onnx_sha256.as_ref().filter(|hash| **hash != info.onnx_sha256) {
        let (card, model) = (measured.clone(), info.onnx_sha256.clone());
        let mismatch = EngineError::CardMismatch { field: "onnx_sha256", card, model };
        return Err(ExportError::engine(path)(mismatch));
    }
    let maps = contacts(info.pressure_max_pa);
    let tract = model::time(tract.as_ref(), path, &maps, TIMING)?;
    Ok(LatencyByEngine { tract, ort: model::time_ort(&onnx, path, &maps, TIMING)? })
}

/// Contacts of four sizes, Pa.
fn contacts(pressure_max_pa: f32) -> Vec<Vec<f32>> {
    let contact = |radius_px: f32| {
        let pressure_pa = |i: usize| {
            let (row, column) = ((i / MAP_SIDE_PX) as f32, (i % MAP_SIDE_PX) as f32);
            let r2 = ((row - 90.0).powi(2) + (column - 112.0).powi(2)) / radius_px.powi(2);
            0.5 * pressure_max_pa * (1.0 - r2).max(0.0).sqrt()
        };
        (0..MAP_LEN).map(pressure_pa).collect()
    };
    [8.0, 16.0, 32.0, 48.0].map(contact).into()
}

/// The same ladder with a rung for each engine, for a picture of both.
#[must_use]
pub fn by_engine(ladder: &Ladder) -> Ladder {
    let mut both = ladder.clone();
    for rung in &ladder.rungs {
        let Some(ort) = rung.latency_ms.as_ref().and_then(|latency| latency.ort) else { continue };
        let latency_ms = Some(LatencyByEngine { tract: ort, ort: None });
        let name = format!("{}, ONNX", rung.name);
        both.rungs.push(Rung { name, latency_ms, ..rung.clone() });
    }
    both.mark_front();
    both
}

/// The page. `stem` is the name of the picture without `.svg`.
#[must_use]
pub fn markdown(ladder: &Ladder, stem: &str) -> String {
    let set = ladder.pareto_set.as_deref().unwrap_or(REFERENCE_SET);
    let mut text = format!(
        "# Error against time on this machine\n\nWritten by `model-export here`. Measured on {}. One map \
         after another: p50 and p99\nof the quietest of {} rounds. Errors: the shipped ladder's, median \
         relative L2 on `{set}`.\n\n![Error against time]({stem}.svg)\n\n\
         | model | error | tract p50, ms | p99 | ONNX Runtime p50, ms | p99 | faster |\n\
         |---|---|---|---|---|---|---|\n",
        ladder.machine, TIMING.rounds
    );
    let mut rungs: Vec<&Rung> = ladder.rungs.iter().collect();
    let time = |rung: &Rung| rung.time_ms().unwrap_or(f64::INFINITY);
    rungs.sort_by(|a, b| time(a).total_cmp(&time(b)));
    for rung in rungs {
        let Some(latency) = &rung.latency_ms else { continue };
        let error = rung.relative_l2(set).map_or("-".to_owned(), |e| format!("{:.1} %", 100.0 * e));
        let times = |t: Option<Percentiles>| {
            t.map_or("- | -".to_owned(), |t| format!("{:.2} | {:.2}", t.p50, t.p99))
        };
        let faster = match latency.ort {
            None => "tract, alone here".to_owned(),
            Some(ort) if ort.p50 < latency.tract.p50 => {
                format!("ONNX Runtime, {:.1} times", latency.tract.p50 / ort.p50)
            }
            Some(ort) => format!("tract, {:.1} times", ort.p50 / latency.tract.p50),
        };
        let (tract, ort) = (times(Some(latency.tract)), times(latency.ort));
        // Writing to a String cannot fail.
        let _ = writeln!(text, "| {} | {error} | {tract} | {ort} | {faster} |", rung.name);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ladder() -> Ladder {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models/ladder.json");
        Ladder::from_json(&read_text(&path).unwrap()).unwrap()
    }

    #[test]
    fn both_engines_have_a_rung_and_the_page_says_which_is_faster() {
        let mut ladder = ladder();
        for (name, tract, ort) in
            [("large", 8.0, Some(4.0)), ("nano", 1.0, Some(7.0)), ("small", 2.0, None)]
        {
            let rung = ladder.rungs.iter_mut().find(|rung| rung.name == name).unwrap();
            let time = |ms| Percentiles { p50: ms, p99: 2.0 * ms };
            rung.latency_ms = Some(LatencyByEngine { tract: time(tract), ort: ort.map(time) });
        }
        let ort = |rung: &&Rung| rung.latency_ms.as_ref().is_some_and(|times| times.ort.is_some());
        let with_ort = ladder.rungs.iter().filter(ort).count();
        let both = by_engine(&ladder);
        assert!(with_ort >= 2 && both.rungs.len() == ladder.rungs.len() + with_ort);
        let of = |name: &str| both.rungs.iter().find(|rung| rung.name == name);
        assert_eq!(of("large, ONNX").and_then(Rung::time_ms), Some(4.0));
        assert!(of("small, ONNX").is_none());
        let page = markdown(&ladder, "here");
        let row =
            |name: &str| page.lines().find(|l| l.starts_with(&format!("| {name} |"))).unwrap();
        for (name, due) in [
            ("large", "| 8.00 | 16.00 | 4.00 | 8.00 | ONNX Runtime, 2.0 times |"),
            ("nano", "| 1.00 | 2.00 | 7.00 | 14.00 | tract, 7.0 times |"),
            ("small", "| 2.00 | 4.00 | - | - | tract, alone here |"),
        ] {
            assert!(row(name).ends_with(due), "{}", row(name));
        }
        assert!(page.contains(&ladder.machine));
    }
}
