//! The values that TouchSim's own tests hold to one spike and 0.25 ms (`tests/test_timing.py` of
//! github.com/hsaal/touchsim): what a pin does for a second, and what the first neuron of a class
//! makes of it.

use std::f64::consts::TAU;

use crate::{
    class::Class,
    neuron::{Neuron, SAMPLES_PER_S},
    pins::{Pin, inputs, spikes_s},
};

/// Most that a count may differ.
pub const SPIKES_TOLERANCE: f64 = 1.0;

/// Most that the time of the first spike may differ, ms.
pub const FIRST_TOLERANCE_MS: f64 = 0.25;

/// How a pin moves; it fades in and out within 50 ms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// In, held and out.
    Ramp {
        /// How deep, mm.
        depth_mm: f64,
    },
    /// To and fro.
    Sine {
        /// How often a second.
        frequency_hz: f64,
        /// How far, mm.
        amplitude_mm: f64,
    },
}

/// One of the values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Published {
    /// Whose first neuron.
    pub class: Class,
    /// What the pin does.
    pub motion: Motion,
    /// Radius of the pin, mm.
    pub radius_mm: f64,
    /// Distance of the unit from the pin's axis, mm.
    pub distance_mm: f64,
    /// Spikes within the second.
    pub spikes: f64,
    /// Time of the first one, ms.
    pub first_ms: f64,
}

const fn of(
    class: Class,
    motion: Motion,
    [radius_mm, distance_mm, spikes, first_ms]: [f64; 4],
) -> Published {
    Published { class, motion, radius_mm, distance_mm, spikes, first_ms }
}

const RAMP: Motion = Motion::Ramp { depth_mm: 1.0 };

const fn sine(frequency_hz: f64, amplitude_mm: f64) -> Motion {
    Motion::Sine { frequency_hz, amplitude_mm }
}

/// All of them.
pub const PUBLISHED: [Published; 8] = [
    of(Class::Sa1, RAMP, [1.0, 0.0, 22.0, 6.2]),
    of(Class::Sa1, sine(10.0, 0.5), [0.5, 0.0, 43.0, 13.0]),
    of(Class::Ra, RAMP, [1.0, 0.0, 7.0, 9.2]),
    of(Class::Ra, sine(25.0, 0.5), [0.5, 0.0, 119.0, 12.6]),
    of(Class::Pc, RAMP, [1.0, 0.0, 3.0, 0.4]),
    of(Class::Pc, sine(250.0, 0.005), [0.5, 0.0, 247.0, 4.2]),
    of(Class::Pc, sine(250.0, 0.01), [0.5, 25.0, 40.0, 23.8]),
    of(Class::Pc, sine(250.0, 0.01), [0.5, 50.0, 29.0, 43.0]),
];

impl Motion {
    /// Indentation for a second, mm, at [`SAMPLES_PER_S`].
    #[must_use]
    pub fn trace_mm(self) -> Vec<f64> {
        let last = SAMPLES_PER_S - 1;
        let fade = SAMPLES_PER_S / 20;
        let at = |n: u32| {
            let edge = n.min(last - n);
            let share = (f64::from(edge) / f64::from(fade - 1)).min(1.0);
            share
                * match self {
                    Self::Ramp { depth_mm } => depth_mm,
                    Self::Sine { frequency_hz, amplitude_mm } => {
                        let turns = frequency_hz * f64::from(n) / f64::from(last);
                        amplitude_mm * (TAU * turns).sin()
                    }
                }
        };
        (0..=last).map(at).collect()
    }
}

impl Published {
    /// Times at which this crate's neuron fires, s.
    #[must_use]
    pub fn found_s(&self) -> Vec<f64> {
        let pin = Pin::indenting([0.0; 2], self.radius_mm, &self.motion.trace_mm());
        let inputs = inputs(&[pin], self.class, [self.distance_mm, 0.0]);
        Neuron::new(self.class, 0).map_or_else(Vec::new, |neuron| spikes_s(neuron, &inputs))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_is_met() {
        for value in PUBLISHED {
            let found_s = value.found_s();
            let off = found_s.len() as f64 - value.spikes;
            assert!(off.abs() <= SPIKES_TOLERANCE, "{value:?}: {} spikes", found_s.len());
            let first_ms = 1e3 * found_s[0];
            assert!(
                (first_ms - value.first_ms).abs() <= FIRST_TOLERANCE_MS,
                "{value:?}: {first_ms} ms"
            );
        }
    }
}
