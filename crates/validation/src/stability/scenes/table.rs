//! How hard the scenes were, indenter by indenter.

use super::ending::{Ending, SceneRecord};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The scenes of one indenter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Its name in the campaign.
    pub indenter: String,
    /// Scenes with it.
    pub scenes: usize,
    /// Those in equilibrium with every balance kept.
    pub balanced: usize,
    /// Those with a halved load step.
    pub with_cuts: usize,
    /// Newton iterations: half the scenes take no more.
    pub newton_iterations_median: u32,
    /// Newton iterations, most of a scene.
    pub newton_iterations_max: u32,
    /// Smallest `J`; absent without an equilibrium.
    pub j_min: Option<f64>,
    /// Processor time of a scene, mean, s.
    pub seconds_per_scene: f64,
    /// Processor time of the slowest scene, s.
    pub seconds_max: f64,
}

/// One row an indenter, in the order of the campaign.
pub(super) fn rows(records: &[&SceneRecord]) -> Vec<Row> {
    let mut by_candidate = BTreeMap::<usize, Vec<&SceneRecord>>::new();
    for &record in records {
        by_candidate.entry(record.press.candidate).or_default().push(record);
    }
    by_candidate.into_values().filter_map(|records| row(&records)).collect()
}

fn row(records: &[&SceneRecord]) -> Option<Row> {
    let mut iterations: Vec<_> = records.iter().map(|r| r.newton_iterations).collect();
    iterations.sort_unstable();
    let scenes = records.len();
    Some(Row {
        indenter: records.first()?.press.indenter.clone(),
        scenes,
        balanced: records.iter().filter(|r| r.ending == Ending::Balanced).count(),
        with_cuts: records.iter().filter(|r| r.cuts > 0).count(),
        newton_iterations_median: iterations[(scenes - 1) / 2],
        newton_iterations_max: *iterations.last()?,
        j_min: records.iter().filter_map(|r| r.j_min).reduce(f64::min),
        seconds_per_scene: records.iter().map(|r| r.seconds).sum::<f64>() / scenes as f64,
        seconds_max: records.iter().map(|r| r.seconds).fold(0.0, f64::max),
    })
}

impl Row {
    /// Its values as they are printed.
    pub(super) fn cells(&self) -> [String; 9] {
        [
            self.indenter.clone(),
            self.scenes.to_string(),
            self.balanced.to_string(),
            self.with_cuts.to_string(),
            self.newton_iterations_median.to_string(),
            self.newton_iterations_max.to_string(),
            format!("{:.3}", self.j_min.unwrap_or(f64::NAN)),
            format!("{:.2}", self.seconds_per_scene),
            format!("{:.1}", self.seconds_max),
        ]
    }
}

/// The rows as a table of the page in docs/reports.
pub(super) fn markdown(rows: &[Row]) -> String {
    let mut out = String::from(
        "| indenter | scenes | balanced | with halved steps | iterations, median | most | smallest volume ratio | mean time, s | longest, s |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let _ = writeln!(out, "| {} |", row.cells().join(" | "));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::report::tests::record;
    use super::*;

    #[test]
    fn a_row_is_of_one_indenter() {
        let of = |id: usize, candidate: usize, newton_iterations: u32, ending: Ending| {
            let mut record = record(id, ending);
            (record.press.candidate, record.newton_iterations) = (candidate, newton_iterations);
            record.press.indenter = format!("indenter {candidate}");
            record
        };
        let none = SceneRecord {
            j_min: None,
            cuts: 3,
            seconds: 4.0,
            ..of(3, 1, 90, Ending::Refused("x".into()))
        };
        let all = [
            of(0, 1, 5, Ending::Balanced),
            of(1, 0, 8, Ending::Balanced),
            of(2, 1, 6, Ending::Balanced),
            none,
        ];
        let rows = rows(&all.iter().collect::<Vec<_>>());
        assert_eq!(rows.len(), 2);
        assert_eq!((rows[0].indenter.as_str(), rows[0].scenes), ("indenter 0", 1));
        let expected = Row {
            indenter: "indenter 1".into(),
            scenes: 3,
            balanced: 2,
            with_cuts: 1,
            newton_iterations_median: 6,
            newton_iterations_max: 90,
            j_min: Some(0.5),
            seconds_per_scene: 2.0,
            seconds_max: 4.0,
        };
        assert_eq!(rows[1], expected);
        assert_eq!(markdown(&rows).lines().count(), 4);
    }
}
