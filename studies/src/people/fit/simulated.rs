//! Points of a search as fingers, simulated.

use super::objective::Data;
use super::parameters::{Moved, shape, table};
use crate::people::PeopleError;
use crate::people::press::{Cells, Subject};
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::scene::{Finger, TissueTable};
use std::path::Path;

/// Simulates points of the unit box, and counts.
pub(crate) struct Simulated<'a> {
    data: &'a Data,
    /// The constants that points are of.
    pub moved: &'a Moved,
    folder: &'a Path,
    told: &'a mut dyn FnMut(&str, usize, usize),
    done: usize,
    all: usize,
    /// Processor time on the even and on the graded mesh, s.
    pub solve_s: [f64; 2],
}

/// The finger at a point of the unit box.
pub(crate) fn subject(moved: &Moved, at: &[f64]) -> Subject {
    let values = moved.all_values(at);
    Subject { shape: shape(&values), table: table(&values), hyperelastic: true }
}

/// The same as a finger's file has it.
pub(crate) fn finger(subject: &Subject) -> Finger {
    // The constants are of Ogden's law: without it they would be another finger's.
    let needs = subject.hyperelastic.then(|| "hyperelastic".to_owned());
    let tissue = TissueTable { needs: needs.into_iter().collect(), ..subject.table.clone() };
    Finger { shape: subject.shape.clone(), tissue, ..Finger::usual() }
}

impl<'a> Simulated<'a> {
    pub(crate) fn new(
        (data, moved): (&'a Data, &'a Moved),
        folder: &'a Path,
        told: &'a mut dyn FnMut(&str, usize, usize),
        all: usize,
    ) -> Self {
        Self { data, moved, folder, told, done: 0, all, solve_s: [0.0; 2] }
    }

    /// Features on the even coarse mesh.
    pub(crate) fn even(&mut self, at: &[f64]) -> Result<Vec<f64>, PeopleError> {
        self.features(at, Cells::COARSE, 0)
    }

    /// Features on the coarse mesh whose cells are split where they touch.
    pub(crate) fn graded(&mut self, at: &[f64]) -> Result<Vec<f64>, PeopleError> {
        self.features(at, Cells::graded(Density::Coarse), 1)
    }

    /// Not numbers of a finger that cannot be meshed or pressed at all.
    fn features(&mut self, at: &[f64], cells: Cells, mesh: usize) -> Result<Vec<f64>, PeopleError> {
        let what = ["presses", "presses on the graded mesh"][mesh];
        (self.told)(what, self.done.min(self.all), self.all);
        self.done += 1;
        let subject = subject(self.moved, at);
        match self.data.solved(&subject, cells, self.folder) {
            Ok(solutions) => {
                self.solve_s[mesh] += solutions.iter().map(|s| s.solve_s).sum::<f64>();
                self.data.features(&subject, &solutions)
            }
            Err(PeopleError::Press { press, source }) => {
                tracing::warn!(press, %source, "a finger is passed by");
                Ok(vec![f64::NAN; self.data.feature_count()])
            }
            Err(e) => Err(e),
        }
    }
}
