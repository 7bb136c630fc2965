//! What became of the scenes.

use crate::campaign::Press;
use serde::{Deserialize, Serialize};
use std::fmt::{self, Write as _};

/// What became of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// In equilibrium, every balance of a dataset kept.
    Balanced,
    /// In equilibrium, a balance missed.
    Unbalanced(String),
    /// A typed error.
    Refused(String),
    /// A panic.
    Panicked(String),
}

/// One scene in the record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneRecord {
    /// What was pressed how.
    pub press: Press,
    /// What became of it.
    pub ending: Ending,
    /// Newton iterations.
    pub newton_iterations: u32,
    /// Halved load steps.
    pub cuts: u32,
    /// Smallest `J`; absent without an equilibrium.
    pub j_min: Option<f64>,
    /// Processor time, s.
    pub seconds: f64,
}

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
    /// Scenes with a halved load step.
    pub with_cuts: usize,
    /// Most Newton iterations of a scene.
    pub newton_iterations_max: u32,
    /// Smallest `J` of a scene.
    pub j_min: Option<f64>,
    /// Mean processor time of a scene, s.
    pub seconds_per_scene: f64,
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
    /// docs/stability-scenes.md.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut out = format!(
            "# Random scenes\n\nWritten by `fe-datagen stability --scenes {} --seed ... --markdown \
             docs/stability-scenes.md` ([stability.md](stability.md)): {}.\n\n\
             | | scenes |\n|---|---|\n| converged, every balance kept | {} |\n| converged, a balance missed | {} |\n\
             | refused with a typed error | {} |\n| panicked | {} |\n| with cut load steps | {} |\n\n\
             At most {} Newton iterations a scene, smallest J {:.4}, {:.2} s of processor time a scene. The bar (99.9 % \
             converge, each of them balances, no panic) is {}.\n",
            self.scenes,
            self.drawn_from,
            self.balanced,
            self.unbalanced.len(),
            self.refused.len(),
            self.panicked.len(),
            self.with_cuts,
            self.newton_iterations_max,
            self.j_min.unwrap_or(f64::NAN),
            self.seconds_per_scene,
            if self.passed() { "met by these" } else { "**not met by these**" },
        );
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
             errors, {} panics; {} with cut steps, at most {} Newton iterations, least J {:.4}; {:.2} s of processor time a scene",
            self.drawn_from,
            self.scenes,
            self.reused,
            self.balanced,
            self.unbalanced.len(),
            self.refused.len(),
            self.panicked.len(),
            self.with_cuts,
            self.newton_iterations_max,
            self.j_min.unwrap_or(f64::NAN),
            self.seconds_per_scene,
        )?;
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
        with_cuts: records.iter().filter(|r| r.cuts > 0).count(),
        newton_iterations_max: records.iter().map(|r| r.newton_iterations).max().unwrap_or(0),
        j_min: records.iter().filter_map(|r| r.j_min).reduce(f64::min),
        seconds_per_scene: records.iter().map(|r| r.seconds).sum::<f64>() / scenes.max(1) as f64,
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
    report
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in super::super) fn record(id: usize, ending: Ending) -> SceneRecord {
        let press = Press {
            id,
            candidate: 0,
            indenter: "plate".into(),
            shape: "plate".into(),
            pose: crate::press::record::Pose::default(),
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
