//! What is asked of the shipped models, decided from their committed figures (models/ladder.json,
//! cards): errors against the FE that taught them unless said otherwise.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod compare;

use std::{fs, path::PathBuf};

use papilla_engine::{
    card::Spread,
    ladder::{Kind, Ladder, Rung, SetErrors},
};
use serde_json::Value;

const PRESSES: &str = "heldout-presses";
const SHAPES: &str = "heldout-shapes";
/// What contact finds from the poses of both.
const POSES: &str = "poses";
/// All files of `models/` together, bytes. Two networks for pressure beside those for poses are 2.2 MB
/// of it.
const MODELS_BYTES_MAX: u64 = 22_000_000;

fn models() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../models")
}

fn ladder() -> Ladder {
    Ladder::from_json(&fs::read_to_string(models().join("ladder.json")).unwrap()).unwrap()
}

fn card(model: &str) -> Value {
    let text = fs::read_to_string(models().join(format!("{model}.json"))).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn errors<'a>(row: &'a Rung, set: &str) -> &'a SetErrors {
    row.errors.get(set).unwrap_or_else(|| panic!("{} is not measured on {set}", row.name))
}

/// The network of least median error on held-out simulations.
fn best(ladder: &Ladder) -> &Rung {
    let networks = ladder.rungs.iter().filter(|row| row.kind.is_network());
    networks
        .min_by(|a, b| {
            let median = |row: &Rung| errors(row, PRESSES).relative_l2.median;
            median(a).total_cmp(&median(b))
        })
        .unwrap()
}

/// The published U-Net at 16 channels, on the data that our networks were trained on.
fn baseline(ladder: &Ladder) -> &Rung {
    ladder.rungs.iter().find(|row| row.name == "s1-base16-relative").unwrap()
}

/// What was asked for, every figure within a millisecond, is missed in the peak's: `nano` has its
/// height 5.4 / 17.0 % off (median, 95th percentile), the published network 3.8 / 9.3.
#[test]
fn a_model_of_a_millisecond_beats_the_published_network_in_every_figure_but_the_peaks_height() {
    let ladder = ladder();
    let theirs = errors(baseline(&ladder), PRESSES);
    let is_fast =
        |row: &&Rung| row.kind != Kind::PublishedUNet && row.time_ms().is_some_and(|ms| ms <= 1.0);
    let fast = ladder.rungs.iter().filter(is_fast).filter(|row| row.errors.contains_key(PRESSES));
    let lost: Vec<_> =
        fast.map(|row| (&row.name, compare::lost(errors(row, PRESSES), theirs))).collect();
    let all_but_peak = |lost: &[String]| lost.iter().all(|figure| figure.starts_with("peak"));
    assert!(lost.iter().any(|(_, (lost, count))| all_but_peak(lost) && *count > 10), "{lost:?}");
}

/// What was asked for: 6 % in the median and 12 % at the 95th percentile, 10 % on unseen shapes.
/// From pressure `large-maps` has 5.2 and 9.5 % off the reference, 6.0 and 11.4 off twelve more presses
/// of it, 6.7 and 11.2 off held-out simulations of the teacher, 7.7 off unseen shapes. These limits hold
/// what it and `small-maps`, the default, reached (docs/concepts/networks.md), so that none is lost.
#[test]
fn the_best_networks_are_as_accurate_as_the_documents_say() {
    let ladder = ladder();
    let best = best(&ladder);
    assert_eq!(best.name, "large-maps");
    let small = ladder.rungs.iter().find(|row| row.name == "small-maps").unwrap();
    for (row, limits) in [
        (best, [0.054, 0.098, 0.069, 0.115, 0.079, 0.122]),
        (small, [0.068, 0.1, 0.083, 0.123, 0.083, 0.135]),
    ] {
        let (indentations, shapes) = (errors(row, PRESSES), errors(row, SHAPES));
        let reference = errors(row, "reference").relative_l2;
        let reached = [
            ("the reference, median", reference.median),
            ("the reference, 95th percentile", reference.p95),
            ("held-out simulations, median", indentations.relative_l2.median),
            ("held-out simulations, 95th percentile", indentations.relative_l2.p95),
            ("shapes that no training saw, median", shapes.relative_l2.median),
            ("far field, median", indentations.far_field_relative_l2.unwrap().median),
        ];
        for ((what, value), limit) in reached.into_iter().zip(limits) {
            assert!(value <= limit, "{}: {what} is {value}, {limit} was reached", row.name);
        }
    }
    let nail_base = |row| errors(row, PRESSES).nail_base_error.map(|s: Spread| s.median).unwrap();
    assert!(nail_base(best) <= 0.25 * nail_base(baseline(&ladder)));
}

/// From poses, as most sessions are: median and 95th percentile that were reached. Of each size the
/// network for poses is the more accurate from poses, and the one for pressure from pressure.
#[test]
fn each_size_has_a_network_for_poses_and_one_for_pressure() {
    let ladder = ladder();
    let row = |name: &str| ladder.rungs.iter().find(|row| row.name == name).unwrap();
    for (name, median, p95) in
        [("nano", 0.098, 0.16), ("small", 0.085, 0.147), ("large", 0.08, 0.136)]
    {
        let reached = errors(row(name), POSES).relative_l2;
        assert!(reached.median <= median && reached.p95 <= p95, "{name}: {reached:?}");
    }
    for name in ["nano", "small", "large"] {
        let (for_poses, for_pressure) = (row(name), row(&format!("{name}-maps")));
        let median = |row: &Rung, set| errors(row, set).relative_l2.median;
        assert!(median(for_poses, POSES) < median(for_pressure, POSES), "{name}");
        for set in [PRESSES, SHAPES] {
            assert!(median(for_pressure, set) < median(for_poses, set), "{name}, {set}");
        }
    }
}

/// Traction explains a good part of what networks of pressure alone miss, wherever it was measured.
#[test]
fn what_traction_adds_brings_every_network_closer() {
    let found = ladder().traction;
    let ours: Vec<_> = found
        .iter()
        .filter(|t| ["nano-maps", "small-maps", "large-maps"].contains(&t.model.as_str()))
        .collect();
    let sets: std::collections::BTreeSet<_> = ours.iter().map(|t| t.set.as_str()).collect();
    assert_eq!(sets.into_iter().collect::<Vec<_>>(), ["friction", "sliding"]);
    for t in ours {
        assert!(t.felt.median < 0.75 * t.alone.median && t.felt.p95 < t.alone.p95, "{t:?}");
    }
}

#[test]
fn no_model_answers_what_is_no_density_and_no_pressure_gives_none() {
    for row in ladder().rungs.iter().filter(|row| row.model.is_some()) {
        assert_eq!(row.refused, 0, "{}: refused answers", row.name);
        assert!(row.zero_answer.unwrap() <= 1e-6, "{}: {:?}", row.name, row.zero_answer);
    }
}

#[test]
fn every_trained_model_names_its_seed_and_its_time() {
    for row in ladder().rungs.iter().filter(|row| row.kind.is_network()) {
        let training = card(row.model.as_deref().unwrap())["training"].take();
        let runs = training["mean_of"].as_array().cloned().unwrap_or_else(|| vec![training]);
        let is_named = |run: &Value| run["seed"].is_u64() && run["seconds"].is_number();
        assert!(runs.iter().all(is_named), "{}", row.name);
    }
}

#[test]
fn all_shipped_files_stay_small() {
    let bytes: u64 = fs::read_dir(models())
        .unwrap()
        .map(|entry| entry.unwrap().metadata().unwrap())
        .map(|meta| if meta.is_file() { meta.len() } else { 0 })
        .sum();
    assert!(bytes < MODELS_BYTES_MAX, "{bytes} bytes");
}
