//! What a pressure map itself is worth: the pressure of the same state, computed on two meshes.
//!
//! A network cannot know more than its pressure map. So the pressure of the reference is compared
//! with that of the next coarser mesh, as it is and averaged over a tenth of a millimetre. And the
//! answers of each model to the two maps are compared with each other.

use super::sets::draw;
use super::{Canvas, SampleSet};
use crate::ExportError;
use crate::dataset::Dataset;
use crate::metrics::{relative_l2, spread};
use papilla_engine::ladder::Readings;
use papilla_engine::{MAP_LEN, MAP_SIDE_PX};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Standard deviation of the average, pixels of .14 mm.
const BLUR_PX: f64 = 0.7;
/// Pixels beyond which the average takes nothing: three deviations.
const BLUR_REACH_PX: usize = 2;

/// The same states on the reference and on the next finest mesh.
pub(super) struct Pairs {
    mesh: &'static str,
    maps_pa: Vec<[Vec<f32>; 2]>,
    answers: BTreeMap<String, Vec<f64>>,
}

impl Pairs {
    /// Pairs of the reference's states and those on `mesh`; none if no folder has that mesh.
    pub(super) fn read(
        mesh: &'static str,
        folders: &[PathBuf],
        reference: Option<&SampleSet>,
        canvas: &Canvas,
    ) -> Result<Self, ExportError> {
        let mut pairs = Self { mesh, maps_pa: Vec::new(), answers: BTreeMap::new() };
        let Some(reference) = reference else { return Ok(pairs) };
        for folder in folders {
            let dataset = Dataset::open(folder)?;
            if format!("fe-{}", dataset.mesh()) != mesh {
                continue;
            }
            let solved = SampleSet::of(folder, &dataset, canvas)?;
            for due in &reference.states {
                let Some(own) = solved.states.iter().find(|state| state.is_of(due)) else {
                    continue;
                };
                pairs.maps_pa.push([due, own].map(|state| {
                    let mut map = vec![0.0; MAP_LEN];
                    draw(&canvas.skin, &state.pressure_pa, &mut map);
                    map
                }));
            }
        }
        Ok(pairs)
    }

    /// Holds a model's answers to the two readings of each state against each other.
    pub(super) fn ask(
        &mut self,
        name: &str,
        mut infer: impl FnMut(&[f32], &mut [f32]) -> Result<bool, ExportError>,
    ) -> Result<(), ExportError> {
        let [mut first, mut second] = [0, 1].map(|_| vec![0.0; MAP_LEN]);
        let mut apart = Vec::with_capacity(self.maps_pa.len());
        for [reference, own] in &self.maps_pa {
            if infer(reference, &mut first)? && infer(own, &mut second)? {
                apart.extend(relative_l2(&second, &first));
            }
        }
        self.answers.insert(name.to_owned(), apart);
        Ok(())
    }

    /// What was found, if there were pairs.
    pub(super) fn found(&self) -> Option<Readings> {
        let over_pairs = |treat: &dyn Fn(&[f32]) -> Vec<f32>| {
            let apart = |[a, b]: &[Vec<f32>; 2]| relative_l2(&treat(b), &treat(a));
            spread(&self.maps_pa.iter().filter_map(apart).collect::<Vec<_>>())
        };
        let answers = self.answers.iter().filter_map(|(name, v)| Some((name.clone(), spread(v)?)));
        Some(Readings {
            mesh: self.mesh.to_owned(),
            states: self.maps_pa.len(),
            pressure: over_pairs(&<[f32]>::to_vec)?,
            averaged: over_pairs(&averaged)?,
            answers: answers.collect(),
        })
    }
}

/// A map under a Gaussian of [`BLUR_PX`], row by row, then column by column.
fn averaged(map: &[f32]) -> Vec<f32> {
    let weight = |k: usize| (-0.5 * (k as f64 / BLUR_PX).powi(2)).exp();
    let sum = weight(0) + 2.0 * (1..=BLUR_REACH_PX).map(weight).sum::<f64>();
    let along = |map: &[f32], step: usize, place: &dyn Fn(usize) -> usize| -> Vec<f32> {
        let at = |i: usize| f64::from(map[i]);
        (0..MAP_LEN)
            .map(|i| {
                let mut value = weight(0) * at(i);
                for k in 1..=BLUR_REACH_PX {
                    // Beyond the map there is no pressure.
                    let before = if place(i) >= k { at(i - k * step) } else { 0.0 };
                    let after = if place(i) + k < MAP_SIDE_PX { at(i + k * step) } else { 0.0 };
                    value += weight(k) * (before + after);
                }
                (value / sum) as f32
            })
            .collect()
    };
    let rows = along(map, 1, &|i| i % MAP_SIDE_PX);
    along(&rows, MAP_SIDE_PX, &|i| i / MAP_SIDE_PX)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is even stays, a chessboard all but goes, and nothing is lost or moved.
    #[test]
    fn an_average_takes_the_finest_away_and_keeps_the_rest() {
        let patch = |value: &dyn Fn(usize, usize) -> f32| -> Vec<f32> {
            let inside = |y: usize, x: usize| (80..120).contains(&y) && (90..130).contains(&x);
            let at = |i| (i / MAP_SIDE_PX, i % MAP_SIDE_PX);
            (0..MAP_LEN)
                .map(at)
                .map(|(y, x)| if inside(y, x) { value(y, x) } else { 0.0 })
                .collect()
        };
        let (even, board) =
            (patch(&|_, _| 1.0), patch(&|y, x| if (x + y) % 2 == 0 { 1.0 } else { -1.0 }));
        let (smooth, gone) = (averaged(&even), averaged(&board));
        let middle = 100 * MAP_SIDE_PX + 110;
        assert!((smooth[middle] - 1.0).abs() < 1e-6);
        assert!(gone[middle].abs() < 0.05, "{}", gone[middle]);
        let total = |map: &[f32]| map.iter().map(|v| f64::from(*v)).sum::<f64>();
        assert!((total(&smooth) / total(&even) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_same_map_twice_is_nothing_apart() {
        let map: Vec<f32> = (0..MAP_LEN).map(|i| (i % 7) as f32).collect();
        let twice: Vec<f32> = map.iter().map(|v| 2.0 * v).collect();
        assert_eq!(relative_l2(&map, &map), Some(0.0));
        assert_eq!(relative_l2(&twice, &map), Some(1.0));
        assert_eq!(relative_l2(&map, &vec![0.0; MAP_LEN]), None);
    }
}
