//! `rungs.json` and one archive a fidelity level, from the parts.

use super::report::{
    DiscretisationError, FORMAT, LeftOut, LevelEntry, Quantiles, Report, StateEntry,
};
use super::solve::Target;
use super::store::{Part, SOFTWARE, archive};
use super::{FidelityError, FidelityLevel, Ladder};
use papilla_fingertip::campaign::CampaignSpec;
use papilla_fingertip::simulation::record::relative_l2;
use papilla_output::atomic;
use std::path::Path;

/// Parts of a fidelity level, one an indentation.
type Solved = (FidelityLevel, Vec<Part>);

/// Writes everything and returns the report.
pub(super) fn assemble(
    spec: &CampaignSpec,
    ladder: &Ladder,
    target: &Target,
    solved: &[Solved],
    folder: &Path,
) -> Result<Report, FidelityError> {
    let ranked = ladder.levels.len() + 1;
    let (levels, check) = solved.split_at(ranked.min(solved.len()));
    let mut left_out = Vec::new();
    let mut places = Vec::new();
    let presses = levels.first().map_or(0, |(_, parts)| parts.len());
    for p in 0..presses {
        for d in 0..levels[0].1[p].record.press.depths_mm.len() {
            let mut sound = true;
            for (level, parts) in levels {
                if let Some(why) = unsound(&parts[p], d) {
                    left_out.push(left(*level, &parts[p], d, why));
                    sound = false;
                }
            }
            if sound {
                places.push((p, d));
            }
        }
    }
    if places.is_empty() {
        let first = left_out.first().map_or_else(String::new, |l| {
            format!("{}, indentation {} at {} mm: {}", l.level, l.press, l.depth_mm, l.why)
        });
        return Err(FidelityError::NothingSolved { first });
    }
    let v = target.vertices();
    let (_, reference) = &levels[levels.len() - 1];
    let mut entries = Vec::new();
    for (k, (level, parts)) in levels.iter().enumerate() {
        let rows = rows(parts, &places, v);
        let file = format!("{}.npz", level.name());
        archive(places.len(), v, &rows)?.write(&folder.join(&file))?;
        let is_reference = k + 1 == levels.len();
        let mut entry = entry(*level, parts, &places, v, reference, file);
        entry.reference = is_reference;
        if let (true, Some(check)) = (is_reference, check.first()) {
            entry.discretisation_error = discretisation(parts, check, v, &mut left_out);
        }
        entries.push(entry);
    }
    let states = places.iter().map(|&(p, d)| {
        let press = &reference[p].record.press;
        StateEntry {
            press: press.id,
            indenter: press.indenter.clone(),
            shape: press.shape.clone(),
            depth_mm: press.depths_mm[d],
            pose: press.pose,
        }
    });
    let report = Report {
        format: FORMAT,
        software: SOFTWARE,
        atlas_hash: target.atlas_hash.clone(),
        campaign: spec.name.clone(),
        states: states.collect(),
        levels: entries,
        left_out,
    };
    atomic::write_json(&folder.join("rungs.json"), &report)?;
    Ok(report)
}

/// Why a part has no sound solution of its state `d`; `None` if it has.
fn unsound(part: &Part, d: usize) -> Option<String> {
    match part.record.faults.get(d) {
        Some(fault) => fault.clone(),
        None => Some(part.record.error.clone().unwrap_or_else(|| "not reached".into())),
    }
}

fn left(level: FidelityLevel, part: &Part, d: usize, why: String) -> LeftOut {
    let press = &part.record.press;
    LeftOut { press: press.id, depth_mm: press.depths_mm[d], level: level.name(), why }
}

fn row(values: &[f32], d: usize, v: usize) -> &[f32] {
    &values[d * v..(d + 1) * v]
}

/// The chosen states of a fidelity level, in order.
fn rows(parts: &[Part], places: &[(usize, usize)], v: usize) -> Part {
    let mut all = Part::default();
    for &(p, d) in places {
        all.pressure_pa.extend_from_slice(row(&parts[p].pressure_pa, d, v));
        all.sed_j_per_m3.extend_from_slice(row(&parts[p].sed_j_per_m3, d, v));
        all.force_n.extend_from_slice(row(&parts[p].force_n, d, 3));
    }
    all
}

type Field = fn(&Part) -> &[f32];

/// Relative L2 difference of a field of two parts at a state.
fn difference(a: &Part, b: &Part, d: usize, v: usize, of: Field) -> f64 {
    let wide = |part: &Part| row(of(part), d, v).iter().map(|x| f64::from(*x)).collect::<Vec<_>>();
    relative_l2(&wide(a), &wide(b))
}

fn entry(
    level: FidelityLevel,
    parts: &[Part],
    places: &[(usize, usize)],
    v: usize,
    reference: &[Part],
    file: String,
) -> LevelEntry {
    let against = |of: Field| {
        Quantiles::of(places.iter().map(|&(p, d)| difference(&parts[p], &reference[p], d, v, of)))
    };
    let record = &parts[0].record;
    LevelEntry {
        name: level.name(),
        density: level.density,
        order: level.order,
        kinematics: level.kinematics,
        unknowns: record.unknowns,
        factor_entries: record.factor_entries,
        reference: false,
        setup_seconds: record.setup_seconds,
        seconds: places.iter().map(|&(p, d)| parts[p].record.seconds[d]).collect(),
        file,
        sed_relative_l2: against(|p| &p.sed_j_per_m3),
        pressure_relative_l2: against(|p| &p.pressure_pa),
        discretisation_error: None,
    }
}

/// How far the reference's parts are from the check's.
fn discretisation(
    parts: &[Part],
    (level, check): &Solved,
    v: usize,
    left_out: &mut Vec<LeftOut>,
) -> Option<DiscretisationError> {
    let (mut sed, mut pressure, mut seconds, mut presses) = (vec![], vec![], vec![], vec![]);
    for (a, b) in parts.iter().zip(check) {
        for d in 0..b.record.press.depths_mm.len() {
            if let Some(why) = unsound(b, d) {
                left_out.push(left(*level, b, d, why));
            } else if unsound(a, d).is_none() {
                sed.push(difference(a, b, d, v, |p| &p.sed_j_per_m3));
                pressure.push(difference(a, b, d, v, |p| &p.pressure_pa));
                seconds.push(b.record.seconds[d]);
                presses.push(b.record.press.id);
            }
        }
    }
    let states = sed.len();
    let found = Quantiles::of(sed.into_iter());
    presses.dedup();
    (states > 0).then(|| DiscretisationError {
        sed_relative_l2: found.median,
        sed_relative_l2_p95: found.p95,
        pressure_relative_l2: Quantiles::of(pressure.into_iter()).median,
        states,
        unknowns: check[0].record.unknowns,
        seconds_median: Quantiles::of(seconds.into_iter()).median,
        how: format!(
            "median over {states} states of {} of the relative L2 difference of SED from {}",
            count(presses.len(), "indentation", "indentations"),
            level.name(),
        ),
        presses,
    })
}

fn count(n: usize, one: &str, many: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {many}") }
}
