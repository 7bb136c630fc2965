//! A row for each figure, and pages and plots of them.

mod charts;
mod page;
mod rates;
mod tables;
pub(crate) mod words;

use crate::people::PeopleError;
use crate::people::afferents::Afferents;
use crate::people::force_path::ForcePath;
use crate::people::measured::{Figure, Measured};
use crate::people::mesh_error::MeshError;
use crate::people::press::Materials;
use crate::people::receptors::Stimulus;
use crate::people::solution::Solution;
use papilla_fingertip::mesh::fingertip::Density;
use papilla_output::{OutputError, atomic};
use papilla_processor::today_here;
use serde::Serialize;
use std::path::Path;

/// Folder of the plots, beside the page.
const PICTURES: &str = "pictures/human";
/// R2 that is asked of rates under spheres at forces that were not fitted.
const R2_RATES: f64 = 0.9;
/// R2 that is asked of profiles.
const R2_PROFILES: f64 = 0.85;
/// How far a profile may peak from where people's does, mm.
const PEAK_MM: f64 = 0.5;

/// What a row says.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Within the spread, or the bound holds.
    Ok,
    /// Not so.
    Failed,
    /// The source gives one figure: the finger's over it.
    TimesPeople(f64),
    /// The press does not come so far, and why.
    NotReached(String),
}

/// One figure.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// What is compared, with its unit.
    pub quantity: String,
    /// The finger's; absent where the press does not come so far.
    pub here: Option<f64>,
    /// People's, or what is asked.
    pub people: String,
    /// What is known of its spread.
    pub spread: &'static str,
    /// Where it is from.
    pub source: String,
    /// How they compare.
    pub verdict: Verdict,
    /// What would bring the finger nearer.
    pub mends: &'static str,
}

impl Row {
    /// The finger's figure, or why there is none, beside people's.
    pub(crate) fn new(figure: &Figure, here: Result<f64, String>) -> Self {
        let Figure { quantity, value, range, at_most, at_least, source, second_hand } = figure;
        let within = |ok: bool| if ok { Verdict::Ok } else { Verdict::Failed };
        let (spread, verdict): (_, Box<dyn Fn(f64) -> Verdict>) =
            match (*range, at_most.or(*at_least), *value) {
                (Some([low, high]), ..) => {
                    ("least and largest", Box::new(move |v| within(low <= v && v <= high)))
                }
                (_, Some(bound), _) if at_least.is_some() => {
                    ("least", Box::new(move |v| within(v >= bound)))
                }
                (_, Some(bound), _) => ("largest", Box::new(move |v| within(v <= bound))),
                (.., value) => {
                    let value = value.unwrap_or(f64::NAN);
                    ("one figure, no spread", Box::new(move |v| Verdict::TimesPeople(v / value)))
                }
            };
        let verdict = match &here {
            Ok(here) => verdict(*here),
            Err(why) => Verdict::NotReached(why.clone()),
        };
        let hand = if *second_hand { " (second hand)" } else { "" };
        Self {
            quantity: words::quantity(quantity),
            here: here.ok(),
            people: figure.people(),
            spread,
            source: format!("{source}{hand}"),
            verdict,
            mends: words::mends(quantity),
        }
    }

    /// A figure that is asked to be at least, or at most, a bound.
    fn asked(quantity: String, here: f64, bound: f64, at_least: bool, source: &str) -> Self {
        let holds = if at_least { here >= bound } else { here <= bound };
        Self {
            quantity,
            here: Some(here),
            people: format!("{} {bound}", if at_least { "at least" } else { "at most" }),
            spread: "asked here",
            source: source.into(),
            verdict: if holds { Verdict::Ok } else { Verdict::Failed },
            mends: words::RATES_MEND,
        }
    }
}

/// A plate and how far it came.
#[derive(Clone, Debug, Serialize)]
pub struct Plate {
    /// Inclination, degrees.
    pub pitch_deg: f64,
    /// Depths and forces.
    pub path: ForcePath,
    /// Contact area at each, mm2.
    pub area_mm2: Vec<f64>,
    /// Why it went no deeper.
    pub ended: Option<String>,
    /// Unknowns.
    pub unknowns: usize,
    /// Largest |stored energy - work| over work.
    pub energy_vs_work_max: f64,
    /// Processor time, s.
    pub solve_s: f64,
}

impl Plate {
    pub(crate) fn new(pitch_deg: f64, found: Solution) -> Self {
        let area = |s: &crate::people::solution::State| s.contact.map_or(0.0, |c| c.area_mm2);
        Self {
            pitch_deg,
            area_mm2: found.states.iter().map(area).collect(),
            energy_vs_work_max: found.energy_vs_work_max(),
            path: found.path,
            ended: found.ended,
            unknowns: found.unknowns,
            solve_s: found.solve_s,
        }
    }
}

/// The comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Date and processor.
    pub made: String,
    /// Laws and constants of the tissues.
    pub materials: Materials,
    /// Name of the finger, if it is not the default one.
    pub finger: Option<String>,
    /// Mesh of the spheres' states.
    pub density: Density,
    /// A row a figure.
    pub rows: Vec<Row>,
    /// Rates of SA1 afferents.
    pub afferents: Option<Afferents>,
    /// How far what receptors feel moves on a finer mesh.
    pub mesh_errors: Vec<MeshError>,
    /// Presses with a plate.
    pub plates: Vec<Plate>,
}

impl Report {
    pub(crate) fn new(materials: Materials, finger: Option<String>, density: Density) -> Self {
        Self {
            made: today_here(),
            materials,
            finger,
            density,
            rows: Vec::new(),
            afferents: None,
            mesh_errors: Vec::new(),
            plates: Vec::new(),
        }
    }

    /// Takes the rates, with the rows of SED at the interface.
    pub(crate) fn take_afferents(&mut self, found: Afferents, measured: &Measured) {
        let source = &measured.sa1.source;
        let fit = &found.fits[0];
        debug_assert_eq!((fit.stimulus, fit.depth), (Stimulus::Sed, 0));
        let others = (measured.sa1.force_n.len() - 1) * measured.sa1.curvature_per_m.len();
        let rates = format!("SA1 from SED at the interface: R2 of the {others} rates not fitted");
        self.rows.push(Row::asked(rates, fit.r2_others, R2_RATES, true, source));
        let profiles = "SA1 from SED at the interface: R2 of the profiles".into();
        self.rows.push(Row::asked(profiles, fit.r2_profiles, R2_PROFILES, true, source));
        for p in &fit.peaks {
            let peak = format!(
                "SA1 from SED at the interface: peak of the profile under {} 1/m, distance from \
                 the measured one at {} mm, mm",
                p.curvature_per_m, p.people_mm
            );
            let away = (p.here_mm - p.people_mm).abs();
            self.rows.push(Row::asked(peak, away, PEAK_MM, false, source));
        }
        self.afferents = Some(found);
    }

    /// Whether every row with a spread lies within it, every bound holds and every press comes as
    /// far as its figure asks.
    #[must_use]
    pub fn passed(&self) -> bool {
        let bad = |r: &Row| matches!(r.verdict, Verdict::Failed | Verdict::NotReached(_));
        !self.rows.iter().any(bad)
    }

    /// Writes `human.json`, `human.md`, the tables beside it and the plots.
    pub(crate) fn write(&self, folder: &Path) -> Result<(), PeopleError> {
        atomic::write_json(&folder.join("human.json"), self)?;
        atomic::write(&folder.join("human.md"), self.markdown().as_bytes())?;
        self.write_tables(folder)?;
        Ok(self.write_charts(folder)?)
    }

    fn write_tables(&self, folder: &Path) -> Result<(), OutputError> {
        for (name, text) in self.tables() {
            atomic::write(&folder.join(format!("human-{name}.csv")), text.as_bytes())?;
        }
        Ok(())
    }

    /// Writes the page, and tables and plots beside it.
    ///
    /// # Errors
    /// [`OutputError`] if a file cannot be written.
    pub fn write_page(&self, page: &Path) -> Result<(), OutputError> {
        atomic::write(page, self.markdown().as_bytes())?;
        let beside = page.parent().unwrap_or_else(|| Path::new(""));
        self.write_tables(beside)?;
        let folder = beside.join(PICTURES);
        atomic::create_folder(&folder)?;
        self.write_charts(&folder)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::people::measured::Quantity;

    fn figure(value: Option<f64>, range: Option<[f64; 2]>, at_most: Option<f64>) -> Figure {
        let quantity = Quantity::VolumeLost { to_n: 10.0, pitch_deg: 0.0 };
        let source = "somebody".into();
        Figure { quantity, value, range, at_most, at_least: None, source, second_hand: true }
    }

    #[test]
    fn a_spread_is_judged_and_one_figure_is_not() {
        let verdict = |f: Figure, here: f64| Row::new(&f, Ok(here)).verdict;
        assert_eq!(verdict(figure(None, Some([1.0, 2.0]), None), 1.5), Verdict::Ok);
        assert_eq!(verdict(figure(None, Some([1.0, 2.0]), None), 2.5), Verdict::Failed);
        assert_eq!(verdict(figure(None, None, Some(5.0)), 5.1), Verdict::Failed);
        assert_eq!(verdict(figure(Some(4.0), None, None), 1.0), Verdict::TimesPeople(0.25));
        let least = Figure { at_least: Some(1.0), ..figure(None, None, None) };
        assert_eq!(verdict(least.clone(), 1.2), Verdict::Ok);
        assert_eq!(verdict(least, 0.4), Verdict::Failed);
        let row = Row::new(&figure(Some(4.0), None, None), Err("stuck".into()));
        assert_eq!((row.here, row.verdict), (None, Verdict::NotReached("stuck".into())));
        assert!(row.source.contains("(second hand)"));
    }
}
