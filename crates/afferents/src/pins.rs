//! TouchSim's own skin: flat round pins on an elastic half-space (Sneddon 1946), and waves.

use std::f64::consts::PI;

use crate::{
    class::Class,
    neuron::{Neuron, SAMPLES_PER_S},
};

/// Young's modulus of TouchSim's skin, MPa, and its Poisson's ratio.
const E_MPA: f64 = 0.05;
const POISSON: f64 = 0.4;

/// Speed of waves along the skin, mm/s (Manfredi et al. 2012, as TouchSim has it).
pub(crate) const WAVE_MM_PER_S: f64 = 8000.0;

/// A pin that presses with a force of its own, of whatever lies beside it.
#[derive(Debug, Clone)]
pub struct Pin {
    /// Where it stands on the plane, mm.
    pub at_mm: [f64; 2],
    /// Its radius, mm.
    pub radius_mm: f64,
    /// Its force, N, at [`SAMPLES_PER_S`].
    pub force_n: Vec<f64>,
}

/// What drives a unit, sample by sample.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// Vertical stress at the receptor, MPa.
    pub stress_mpa: Vec<f64>,
    /// Dynamic pressure at the receptor, N/(s mm3).
    pub drive: Vec<f64>,
}

impl Pin {
    /// A single pin that is pushed in by so much, mm: `F = 2 R E d / (1 - nu^2)`.
    #[must_use]
    pub fn indenting(at_mm: [f64; 2], radius_mm: f64, indentation_mm: &[f64]) -> Self {
        let n_per_mm = 2.0 * radius_mm * E_MPA / (1.0 - POISSON * POISSON);
        let force_n = indentation_mm.iter().map(|mm| n_per_mm * mm).collect();
        Self { at_mm, radius_mm, force_n }
    }

    /// Change of the force, N/s: central differences, the ends like their neighbours.
    fn force_rate_n_per_s(&self, sample: usize) -> f64 {
        let Some(last) = self.force_n.len().checked_sub(3) else { return 0.0 };
        let before = sample.saturating_sub(1).min(last);
        let change = self.force_n[before + 2] - self.force_n[before];
        0.5 * change * f64::from(SAMPLES_PER_S)
    }
}

/// Vertical stress at a distance and a depth, in units of `F / (2 pi R^2)`, both in radii of the
/// pin (Sneddon 1946).
fn vertical_stress(distance: f64, depth: f64) -> f64 {
    let (d2, z2) = (distance * distance, depth * depth);
    let root = ((d2 + z2 - 1.0).powi(2) + 4.0 * z2).sqrt();
    let (theta, phi) = ((1.0 / depth).atan(), (2.0 * depth).atan2(d2 + z2 - 1.0));
    let j01 = (0.5 * phi).sin() / root.sqrt();
    let j02 = (1.0 + z2).sqrt() * (1.5 * phi - theta).sin() / root.powf(1.5);
    j01 + depth * j02
}

/// Drive at a distance from a load that spreads over a radius, both mm, per N/s and mm2 of depth:
/// how the deflection of the skin falls off (Sneddon 1946).
pub(crate) fn spread_per_mm(distance_mm: f64, radius_mm: f64) -> f64 {
    if distance_mm <= radius_mm {
        return 0.5 / radius_mm;
    }
    (radius_mm / distance_mm).asin() / (PI * radius_mm)
}

/// What drives a unit of a class at a place on the plane while pins press.
#[must_use]
pub fn inputs(pins: &[Pin], class: Class, at_mm: [f64; 2]) -> Inputs {
    let samples = pins.iter().map(|pin| pin.force_n.len()).max().unwrap_or(0);
    let mut of = Inputs { stress_mpa: vec![0.0; samples], drive: vec![0.0; samples] };
    let depth_mm = class.depth_mm();
    for pin in pins {
        let distance_mm = (at_mm[0] - pin.at_mm[0]).hypot(at_mm[1] - pin.at_mm[1]);
        let radius_mm = pin.radius_mm;
        let per_n = vertical_stress(distance_mm / radius_mm, depth_mm / radius_mm)
            / (2.0 * PI * radius_mm * radius_mm);
        let per_rate = spread_per_mm(distance_mm, radius_mm) / (depth_mm * depth_mm);
        let delay_s = (distance_mm - radius_mm).max(0.0) / WAVE_MM_PER_S;
        let delay = (delay_s * f64::from(SAMPLES_PER_S)).round_ties_even() as usize;
        for sample in 0..pin.force_n.len() {
            of.stress_mpa[sample] += per_n * pin.force_n[sample];
            if let Some(source) = sample.checked_sub(delay) {
                of.drive[sample] += per_rate * pin.force_rate_n_per_s(source);
            }
        }
    }
    of
}

/// Times at which a neuron fires under these inputs, s.
#[must_use]
pub fn spikes_s(mut neuron: Neuron, inputs: &Inputs) -> Vec<f64> {
    let mut samples = inputs.stress_mpa.iter().zip(&inputs.drive).enumerate();
    if let Some((_, (stress_mpa, drive))) = samples.next() {
        neuron.begin(*stress_mpa, *drive);
    }
    samples
        .filter_map(|(sample, (stress_mpa, drive))| {
            let fires = neuron.step(*stress_mpa, *drive, 0.0);
            fires.then(|| sample as f64 / f64::from(SAMPLES_PER_S))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stress_under_the_axis_is_the_closed_form() {
        for depth in [0.05, 0.3, 1.0, 2.0, 9.0_f64] {
            let due = (1.0 + 3.0 * depth * depth) / (1.0 + depth * depth).powi(2);
            let found = vertical_stress(0.0, depth);
            assert!((found - due).abs() < 1e-12, "at {depth}: {found}, not {due}");
        }
    }

    #[test]
    fn stress_of_a_plane_carries_the_whole_force() {
        // In units of F / (2 pi R^2) its integral over a plane below is 2 pi.
        let step = 0.01;
        let ring = |n: i32| {
            let distance = (f64::from(n) + 0.5) * step;
            2.0 * PI * distance * step * vertical_stress(distance, 0.7)
        };
        let found: f64 = (0..20_000).map(ring).sum();
        assert!((found / (2.0 * PI) - 1.0).abs() < 1e-3, "{found}");
    }

    #[test]
    fn a_rate_of_stress_drives_as_a_pin_of_one_millimetre_does() {
        let ramp: Vec<f64> = (0..9).map(|n| 0.01 * f64::from(n)).collect();
        let pin = [Pin::indenting([0.0; 2], 1.0, &ramp)];
        let at_sa1 = inputs(&pin, Class::Sa1, [0.0; 2]).stress_mpa;
        let rate = (at_sa1[5] - at_sa1[4]) * f64::from(SAMPLES_PER_S);
        for class in Class::ALL {
            let drive = inputs(&pin, class, [0.0; 2]).drive[4];
            let found = class.drive_per_stress_rate() * rate;
            assert!((found / drive - 1.0).abs() < 1e-9, "{class}: {found}, not {drive}");
        }
    }
}
