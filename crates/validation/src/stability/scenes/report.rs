//! What became of the scenes.

use super::ending::{Ending, SceneRecord};
use super::{Row, share, table};
use serde::Serialize;
use std::fmt::{self, Write as _};

/// The scenes of a run, counted.
#[derive(Clone, Debug, Serialize)]
pub struct ScenesReport {
    /// Name of the campaign and seed.
    pub drawn_from: String,
    /// Scenes solved in this run and before.
    pub scenes: usize,
    /// Those in the record before.
    pub reused: usize,
    /// In equilibrium with every balance kept.
    pub balanced: usize,
    /// In equilibrium with a balance missed: number and what.
    pub unbalanced: Vec<(usize, String)>,
    /// Typed errors.
    pub refused: Vec<(usize, String)>,
    /// Panics.
    pub panicked: Vec<(usize, String)>,
    /// Upper bound of the share of all such scenes that does not balance, at 95 % confidence.
    pub failing_at_most: f64,
    /// How hard they were.
    pub indenters: Vec<Row>,
}

/// Share of the scenes that have to converge.
const CONVERGED_SHARE: f64 = 0.999;

impl ScenesReport {
    /// At least 99.9 % converge, each of those keeps its balances, the others are typed
    /// errors.
    #[must_use]
    pub fn passed(&self) -> bool {
        let refused = self.refused.len() as f64;
        self.unbalanced.is_empty()
            && self.panicked.is_empty()
            && refused <= (1.0 - CONVERGED_SHARE) * self.scenes as f64 + 1e-9
    }
}

impl ScenesReport {
    /// docs/reports/stability-scenes.md.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut out = format!(
            "# Random scenes\n\nWritten by `fe-datagen stability --scenes {} --seed ... --markdown \
             docs/reports/stability-scenes.md` ([stability.md](stability.md)): {}.\n\n\
             | | scenes |\n|---|---|\n| converged, every balance kept | {} |\n| converged, a balance missed | {} |\n\
             | refused with a typed error | {} |\n| panicked | {} |\n\n\
             The bar (99.9 % converge, each of them balances, no panic) is {}. Of all scenes drawn like \
             these, at most {:.3} % do not balance, at 95 % confidence (Clopper and Pearson's bound, which \
             takes the scenes for independent).\n\n\
             Iterations are those of the path that was kept, seconds of processor time those of every path taken: where work and \
             energy part, a press is taken again on a finer one.\n\n",
            self.scenes,
            self.drawn_from,
            self.balanced,
            self.unbalanced.len(),
            self.refused.len(),
            self.panicked.len(),
            if self.passed() { "met by these" } else { "**not met by these**" },
            100.0 * self.failing_at_most,
        );
        out += &table::markdown(&self.indenters);
        let lists = [&self.unbalanced, &self.refused, &self.panicked];
        if lists.iter().any(|l| !l.is_empty()) {
            out += "\n| scene | what |\n|---|---|\n";
        }
        for (scene, text) in lists.into_iter().flatten() {
            let _ = writeln!(out, "| {scene} | {} |", text.replace('|', "\\|"));
        }
        out
    }
}

impl fmt::Display for ScenesReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} scenes ({} from an earlier run), {} converged and balanced, {} out of balance, {} typed \
             errors, {} panics: at most {:.3} % of all such scenes do not balance, at 95 % confidence",
            self.drawn_from,
            self.scenes,
            self.reused,
            self.balanced,
            self.unbalanced.len(),
            self.refused.len(),
            self.panicked.len(),
            100.0 * self.failing_at_most,
        )?;
        for row in &self.indenters {
            let [name, scenes, balanced, cut, median, most, j_min, mean_s, max_s] = row.cells();
            writeln!(
                f,
                "  {name:<16} {scenes:>5} scenes, {balanced} balanced, {cut} with cut steps, {median} iterations \
                 (at most {most}), least J {j_min}, {mean_s} s (at most {max_s})"
            )?;
        }
        for (what, list) in [
            ("out of balance", &self.unbalanced),
            ("typed error", &self.refused),
            ("panic", &self.panicked),
        ] {
            for (scene, text) in list {
                writeln!(f, "  scene {scene}: {what}: {text}")?;
            }
        }
        Ok(())
    }
}

/// Counts endings.
pub(super) fn count(drawn_from: String, records: Vec<SceneRecord>, reused: usize) -> ScenesReport {
    let scenes = records.len();
    let mut report = ScenesReport {
        drawn_from,
        scenes,
        reused,
        balanced: 0,
        unbalanced: Vec::new(),
        refused: Vec::new(),
        panicked: Vec::new(),
        failing_at_most: 1.0,
        indenters: table::rows(&records),
    };
    for SceneRecord { press, ending, .. } in records {
        match ending {
            Ending::Balanced => report.balanced += 1,
            Ending::Unbalanced(text) => report.unbalanced.push((press.id, text)),
            Ending::Refused(text) => report.refused.push((press.id, text)),
            Ending::Panicked(text) => report.panicked.push((press.id, text)),
        }
    }
    for list in [&mut report.unbalanced, &mut report.refused, &mut report.panicked] {
        list.sort_by_key(|(scene, _)| *scene);
    }
    report.failing_at_most = share::failing_at_most(scenes - report.balanced, scenes);
    report
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use papilla_fingertip::campaign::Indentation;

    pub(in super::super) fn record(id: usize, ending: Ending) -> SceneRecord {
        let press = Indentation {
            id,
            candidate: 0,
            indenter: "plate".into(),
            shape: "plate".into(),
            pose: papilla_fingertip::scene::Pose::default(),
            offset_mm: [0.0; 2],
            depths_mm: vec![1.0],
        };
        SceneRecord { press, ending, newton_iterations: 7, cuts: 0, j_min: Some(0.5), seconds: 1.0 }
    }

    #[test]
    fn one_scene_in_a_thousand_may_be_refused_none_out_of_balance() {
        let of = |refused: usize, unbalanced: usize| {
            let mut all: Vec<_> = (0..1000).map(|i| record(i, Ending::Balanced)).collect();
            all[..refused].iter_mut().for_each(|r| r.ending = Ending::Refused("x".into()));
            all[500..500 + unbalanced]
                .iter_mut()
                .for_each(|r| r.ending = Ending::Unbalanced("x".into()));
            count("test".into(), all, 0).passed()
        };
        assert!(of(0, 0) && of(1, 0) && !of(2, 0) && !of(0, 1));
    }
}
