//! What became of the scenes.

use super::ending::{Ending, How, SceneRecord};
use super::record::{Head, MendedOn};
use super::{Row, share, table};
use serde::Serialize;
use std::fmt::{self, Write as _};

/// Endings, counted; lists hold number of the scene and what.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Count {
    /// In equilibrium with every balance kept.
    pub balanced: usize,
    /// In equilibrium with a balance missed.
    pub unbalanced: Vec<(usize, String)>,
    /// Typed errors.
    pub refused: Vec<(usize, String)>,
    /// Panics.
    pub panicked: Vec<(usize, String)>,
}

/// The scenes of a run, counted.
#[derive(Clone, Debug, Serialize)]
pub struct ScenesReport {
    /// Which scenes.
    pub of: Head,
    /// Scenes solved in this run and before.
    pub scenes: usize,
    /// Those in the record before.
    pub reused: usize,
    /// As they end now.
    pub now: Count,
    /// Scenes for which nothing had been mended.
    pub counted: usize,
    /// As those ended when first run.
    pub first_run: Count,
    /// Upper bound of the share of all such scenes that does not balance, at 95 % confidence, from
    /// [`Self::first_run`].
    pub failing_at_most: f64,
    /// Scenes of which version, contact rule and attempts are recorded.
    pub recorded: usize,
    /// Those of them that were solved more than once before they were kept.
    pub retried: usize,
    /// How hard they were.
    pub indenters: Vec<Row>,
}

impl Count {
    fn add(&mut self, line: &SceneRecord) {
        let list = match &line.ending {
            Ending::Balanced => {
                self.balanced += 1;
                return;
            }
            Ending::Unbalanced(text) => (&mut self.unbalanced, text),
            Ending::Refused(text) => (&mut self.refused, text),
            Ending::Panicked(text) => (&mut self.panicked, text),
        };
        list.0.push((line.press.id, list.1.clone()));
    }

    fn lists(&self) -> [(&'static str, &[(usize, String)]); 3] {
        [
            ("converged, a balance missed", &self.unbalanced),
            ("refused with an error that names the cause", &self.refused),
            ("crashed", &self.panicked),
        ]
    }

    fn failed(&self) -> usize {
        self.lists().iter().map(|(_, list)| list.len()).sum()
    }
}

/// Share of the scenes that have to converge.
const CONVERGED_SHARE: f64 = 0.999;

impl ScenesReport {
    /// At least 99.9 % converge, each of those keeps its balances, the others are typed
    /// errors.
    #[must_use]
    pub fn passed(&self) -> bool {
        let Count { unbalanced, refused, panicked, .. } = &self.now;
        let refused = refused.len() as f64;
        unbalanced.is_empty()
            && panicked.is_empty()
            && refused <= (1.0 - CONVERGED_SHARE) * self.scenes as f64 + 1e-9
    }
}

impl ScenesReport {
    /// Its page in docs/reports.
    #[must_use]
    pub fn markdown(&self) -> String {
        let Self { of, scenes, now, counted, first_run, .. } = self;
        let mut out = format!(
            "# Random scenes, {} mesh\n\n\
             **Question.** Does every random scene converge and balance ([method and \
             command](stability.md#random-scenes))?\nThe [glossary](../glossary.md) explains terms. \
             This page has the scenes of the campaign {of} (`--scenes {scenes} --seed {}`).\n\n\
             | | last run of each scene | first run of the {counted} scenes that were not used to \
             improve the solver |\n\
             |---|---|---|\n| scenes | {scenes} | {counted} |\n\
             | converged, every balance kept | {} | {} |\n",
            format!("{:?}", of.density).to_lowercase(),
            of.seed,
            now.balanced,
            first_run.balanced
        );
        for ((what, now), (_, first)) in now.lists().into_iter().zip(first_run.lists()) {
            let _ = writeln!(out, "| {what} | {} | {} |", now.len(), first.len());
        }
        let verdict = if self.passed() { "meet" } else { "**do not meet**" };
        let _ = write!(
            out,
            "\nThe last runs {verdict} the criterion: 99.9 % converge, each of these balances, and nothing \
             crashes. Of all scenes\nthat are drawn in this way, at most **{:.3} %** fail in their first \
             run, at 95 % confidence (bound of Clopper and\nPearson for a count of {} among {counted}, which takes the \
             scenes for independent).\n",
            100.0 * self.failing_at_most,
            first_run.failed(),
        );
        if let Some(MendedOn { scenes, failed }) = of.mended_on {
            let _ = writeln!(
                out,
                "The first {scenes} scenes do not count: {failed} of them failed, and the solver was improved with \
                 their help. Their\nfirst records are lost."
            );
        }
        let _ = match self.recorded {
            0 => writeln!(out, "\nHow often a scene was solved anew was not recorded."),
            recorded => writeln!(
                out,
                "\nA scene that misses a balance is solved anew, with more steps on the path or with another contact \
                 rule.\nHow often a scene was solved is recorded for {recorded} of {scenes} scenes: {} of them were \
                 solved more than once.",
                self.retried
            ),
        };
        out += "\nIterations are those of Newton's method on the path that was kept. Times are processor \
                times of all paths\nof a scene; on which processor was not recorded. *With halved steps* are scenes in which the \
                solver halved a\nstep of the path.\n\n";
        out += &table::markdown(&self.indenters);
        let failures: Vec<_> = [("first run", first_run), ("now", now)]
            .into_iter()
            .flat_map(|(when, count)| count.lists().map(|(_, list)| (when, list)))
            .flat_map(|(when, list)| list.iter().map(move |failure| (when, failure)))
            .collect();
        if !failures.is_empty() {
            out += "\n| scene | when | what |\n|---|---|---|\n";
        }
        for (when, (scene, text)) in failures {
            let _ = writeln!(out, "| {scene} | {when} | {} |", text.replace('|', "\\|"));
        }
        out
    }
}

impl fmt::Display for ScenesReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} scenes ({} from an earlier run), {} converged and balanced, {} failed; when first run \
             {} of the {} nothing had been mended for: at most {:.3} % of all such scenes fail, at 95 % \
             confidence",
            self.of,
            self.scenes,
            self.reused,
            self.now.balanced,
            self.now.failed(),
            self.first_run.failed(),
            self.counted,
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
        for (what, list) in self.now.lists() {
            for (scene, text) in list {
                writeln!(f, "  scene {scene}: {what}: {text}")?;
            }
        }
        Ok(())
    }
}

/// Counts endings; `records` are the lines of each scene, oldest first.
pub(super) fn count(of: Head, records: &[Vec<SceneRecord>], reused: usize) -> ScenesReport {
    let (mut now, mut first_run) = (Count::default(), Count::default());
    let mended_on = of.mended_on.map_or(0, |m| m.scenes);
    let mut sorted: Vec<_> = records.iter().filter(|lines| !lines.is_empty()).collect();
    sorted.sort_by_key(|lines| lines[0].press.id);
    let lasts: Vec<_> = sorted.iter().filter_map(|lines| lines.last()).collect();
    lasts.iter().for_each(|line| now.add(line));
    let counted: Vec<_> = sorted.iter().filter(|l| l[0].press.id >= mended_on).collect();
    counted.iter().for_each(|lines| first_run.add(&lines[0]));
    let attempts = |line: &&&SceneRecord| match &line.how {
        How::Unrecorded => 0,
        How::Recorded { attempts, .. } => attempts.len().max(1),
    };
    ScenesReport {
        of,
        scenes: lasts.len(),
        reused,
        now,
        counted: counted.len(),
        failing_at_most: share::failing_at_most(first_run.failed(), counted.len()),
        first_run,
        recorded: lasts.iter().filter(|l| attempts(l) > 0).count(),
        retried: lasts.iter().filter(|l| attempts(l) > 1).count(),
        indenters: table::rows(&lasts),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use papilla_fingertip::campaign::Indentation;
    use papilla_fingertip::mesh::fingertip::Density;

    pub(in super::super) fn head(seed: u64) -> Head {
        Head { campaign: "broad".into(), seed, density: Density::Coarse, mended_on: None }
    }

    pub(in super::super) fn record(id: usize, ending: Ending) -> SceneRecord {
        let press = Indentation {
            id,
            candidate: 0,
            indenter: "plate".into(),
            shape: "plate".into(),
            pose: papilla_fingertip::scene::Pose::default(),
            offset_mm: [0.0; 2],
            depths_mm: vec![1.0],
            slide_mm: Vec::new(),
        };
        SceneRecord {
            press,
            ending,
            newton_iterations: 7,
            cuts: 0,
            j_min: Some(0.5),
            seconds: 1.0,
            how: How::Unrecorded,
        }
    }

    #[test]
    fn one_scene_in_a_thousand_may_be_refused_none_out_of_balance() {
        let of = |refused: usize, unbalanced: usize| {
            let mut all: Vec<_> = (0..1000).map(|i| record(i, Ending::Balanced)).collect();
            all[..refused].iter_mut().for_each(|r| r.ending = Ending::Refused("x".into()));
            all[500..500 + unbalanced]
                .iter_mut()
                .for_each(|r| r.ending = Ending::Unbalanced("x".into()));
            let lines: Vec<_> = all.into_iter().map(|line| vec![line]).collect();
            count(head(5), &lines, 0).passed()
        };
        assert!(of(0, 0) && of(1, 0) && !of(2, 0) && !of(0, 1));
    }
}
