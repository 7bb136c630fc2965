//! What drives Pacinian units: the rate of force on the whole finger, as waves along the skin.

use crate::{
    class::Class,
    neuron::SAMPLES_PER_S,
    pins::{WAVE_MM_PER_S, spread_per_mm},
};

/// Samples that a wave may take: 6.2 ms, 50 mm.
pub(crate) const DELAYS: usize = 32;

/// A part of the skin whose force acts as that of a round pin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Its middle, mm.
    pub at_mm: [f32; 3],
    /// Its area, mm2.
    pub area_mm2: f32,
}

/// How a cell's force reaches a unit.
#[derive(Debug, Clone, Copy)]
struct Path {
    /// Drive per N/s.
    weight: f32,
    /// Samples on the way.
    delay: u8,
}

/// One unit.
#[derive(Debug, Clone)]
pub(crate) struct Reached {
    paths: Vec<Path>,
    /// Drive of the waves that leave in this frame, by their time on the way.
    leaving: [f64; DELAYS],
    /// Drive that is under way, in a ring.
    pub(crate) arriving: [f64; DELAYS],
}

/// All Pacinian units of a finger.
#[derive(Debug)]
pub(crate) struct Pacinian {
    pub(crate) units: Vec<Reached>,
    pub(crate) force_n: Vec<f32>,
    /// Place in the rings of what arrives now.
    pub(crate) at: usize,
    /// Samples since a wave left, up to [`DELAYS`].
    pub(crate) silence: usize,
    is_moving: bool,
}

impl Pacinian {
    pub(crate) fn new(places_mm: &[[f32; 3]], cells: &[Cell]) -> Self {
        let depth_mm2 = Class::Pc.depth_mm().powi(2);
        let path = |place_mm: &[f32; 3], cell: &Cell| {
            let distance_mm = (0..3)
                .map(|axis| f64::from(place_mm[axis] - cell.at_mm[axis]).powi(2))
                .sum::<f64>()
                .sqrt();
            let radius_mm = (f64::from(cell.area_mm2) / std::f64::consts::PI).sqrt();
            let way_s = (distance_mm - radius_mm).max(0.0) / WAVE_MM_PER_S;
            let samples = (way_s * f64::from(SAMPLES_PER_S)).round_ties_even();
            let weight = if radius_mm > 0.0 {
                spread_per_mm(distance_mm, radius_mm) / depth_mm2
            } else {
                0.0
            };
            Path { weight: weight as f32, delay: samples.min((DELAYS - 1) as f64) as u8 }
        };
        let unit = |place_mm: &[f32; 3]| Reached {
            paths: cells.iter().map(|cell| path(place_mm, cell)).collect(),
            leaving: [0.0; DELAYS],
            arriving: [0.0; DELAYS],
        };
        Self {
            units: places_mm.iter().map(unit).collect(),
            force_n: vec![0.0; cells.len()],
            at: 0,
            silence: DELAYS,
            is_moving: false,
        }
    }

    /// Nothing is under way.
    pub(crate) fn rest(&mut self) {
        self.units.iter_mut().for_each(|unit| unit.arriving = [0.0; DELAYS]);
        (self.at, self.silence) = (0, DELAYS);
    }

    /// Takes the force on every cell after `span_s`, in which it changes evenly; 0: at once and
    /// unfelt.
    pub(crate) fn take(&mut self, force_n: &[f32], span_s: f64) {
        self.units.iter_mut().for_each(|unit| unit.leaving = [0.0; DELAYS]);
        self.is_moving = false;
        for (cell, (before_n, &now_n)) in self.force_n.iter_mut().zip(force_n).enumerate() {
            let change_n = f64::from(now_n) - f64::from(*before_n);
            *before_n = now_n;
            if change_n.abs() <= 0.0 || span_s <= 0.0 {
                continue;
            }
            self.is_moving = true;
            let rate_n_per_s = change_n / span_s;
            for unit in &mut self.units {
                let Path { weight, delay } = unit.paths[cell];
                unit.leaving[usize::from(delay)] += f64::from(weight) * rate_n_per_s;
            }
        }
    }

    /// Whether nothing arrives in this frame.
    pub(crate) fn is_still(&self) -> bool {
        !self.is_moving && self.silence >= DELAYS
    }

    /// Goes on by a sample.
    pub(crate) fn advance(&mut self) {
        if self.is_still() {
            return;
        }
        let gone = self.at;
        self.at = (self.at + 1) % DELAYS;
        for Reached { leaving, arriving, .. } in &mut self.units {
            arriving[gone] = 0.0;
            if self.is_moving {
                for (delay, drive) in leaving.iter().enumerate() {
                    arriving[(self.at + delay) % DELAYS] += drive;
                }
            }
        }
        self.silence = if self.is_moving { 0 } else { self.silence + 1 };
    }

    /// What arrives at a unit now, N/(s mm3).
    pub(crate) fn drive(&self, unit: usize) -> f64 {
        self.units.get(unit).map_or(0.0, |unit| unit.arriving[self.at])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_punch_in_many_cells_drives_as_one_pin() {
        // Pressure F / (2 pi R sqrt(R^2 - r^2)) deflects everything under the punch alike.
        let (radius_mm, side) = (2.0, 200_u32);
        let at = |n: u32| 2.0 * radius_mm * ((f64::from(n) + 0.5) / f64::from(side) - 0.5);
        let area_mm2 = (2.0 * radius_mm / f64::from(side)).powi(2);
        let (mut cells, mut force_n) = (Vec::new(), Vec::new());
        for (x, y) in (0..side).flat_map(|x| (0..side).map(move |y| (at(x), at(y)))) {
            let left = radius_mm * radius_mm - x * x - y * y;
            if left > 0.0 {
                let at_mm = [x as f32, y as f32, 0.0];
                cells.push(Cell { at_mm, area_mm2: area_mm2 as f32 });
                force_n.push((area_mm2 / left.sqrt()) as f32);
            }
        }
        let sum: f32 = force_n.iter().sum();
        force_n.iter_mut().for_each(|n| *n /= sum);
        let mut unit = Pacinian::new(&[[0.0; 3]], &cells);
        // 1 N within 10 ms: all waves arrive in that time.
        unit.take(&force_n, 0.01);
        (0..50).for_each(|_| unit.advance());
        let due = 100.0 / (2.0 * radius_mm * Class::Pc.depth_mm().powi(2));
        let found = unit.drive(0);
        assert!((found / due - 1.0).abs() < 0.01, "{found}, not {due}");
    }

    #[test]
    fn a_wave_arrives_after_its_way_and_passes() {
        // 16 mm at 8 m/s, from a cell of next to no size: 10 samples.
        let cell = Cell { at_mm: [16.0, 0.0, 0.0], area_mm2: 1e-6 };
        let mut unit = Pacinian::new(&[[0.0; 3]], &[cell]);
        let mut heard = Vec::new();
        for _ in 0..3 {
            unit.take(&[1.0], 0.001);
            for _ in 0..5 {
                unit.advance();
                heard.push(unit.drive(0) > 0.0);
            }
        }
        let due: Vec<_> = (0..15).map(|sample| (10..15).contains(&sample)).collect();
        assert_eq!(heard, due);
        unit.take(&[1.0], 0.01);
        (0..50).for_each(|_| unit.advance());
        assert!(unit.is_still());
    }
}
