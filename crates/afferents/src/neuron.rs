//! One unit's membrane: leaky integrate and fire with a current after each spike.

use std::{f64::consts::PI, sync::LazyLock};

use crate::{
    class::Class,
    constants::{self, Constants},
    filter::{Butterworth, Delays},
};

/// Samples a second.
pub const SAMPLES_PER_S: u32 = 5000;

/// Time between two samples, us.
pub const SAMPLE_US: u64 = 200;

/// Samples for which a spike is felt.
pub(crate) const AFTER_LEN: usize = 190;

/// Samples after a spike in which there is no other.
const REFRACTORY: usize = 5;

/// Below this a state without drive is put to rest: no spike is that near.
const REST: f64 = 1e-12;

/// A model neuron, as all units that have it share it.
#[derive(Debug)]
struct Model {
    constants: Constants,
    filter: Butterworth,
    after: [f64; AFTER_LEN],
}

/// All neurons, class by class.
static MODELS: LazyLock<[Vec<Model>; 3]> = LazyLock::new(|| {
    Class::ALL.map(|class| constants::of(class).iter().copied().map(Model::new).collect())
});

impl Model {
    fn new(constants: Constants) -> Self {
        // Humps of the current after a spike: raised cosines in the logarithm of time, of which
        // the first is greatest at once and the second after 40 samples.
        let hump = |at: usize, greatest: f64| {
            let octaves = ((at as f64 + 5.0) / (greatest + 5.0)).ln() / 3_f64.ln();
            let angle = (0.75 * PI * octaves).clamp(-PI, PI);
            0.5 * (1.0 + angle.cos())
        };
        let [first, second] = constants.after;
        let after = std::array::from_fn(|at| first * hump(at, 0.0) + second * hump(at, 40.0));
        let corner = 10.0 * constants.corner / (f64::from(SAMPLES_PER_S) / 2.0);
        Self { constants, filter: Butterworth::new(corner), after }
    }

    /// Current of filtered stress and drive, `drive_step` the drive's change to the next sample.
    fn current(&self, stress: f64, drive: f64, drive_step: f64, noise: f64) -> f64 {
        let side = |[up, down]: [f64; 2], value: f64| {
            if value >= 0.0 { up * value } else { -down * value }
        };
        let of = &self.constants;
        let current = side(of.stress, stress)
            + side(of.drive, drive)
            + side(of.step, drive_step)
            + of.noise * noise;
        if of.saturation > 0.0 {
            of.saturation * current / (of.saturation + current.abs())
        } else {
            current
        }
    }
}

/// A unit's membrane.
#[derive(Debug, Clone)]
pub struct Neuron {
    model: &'static Model,
    pub(crate) state: State,
}

/// What a neuron remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct State {
    pub(crate) filters: [Delays; 2],
    /// Filtered stress and drive of the sample before.
    pub(crate) before: [f64; 2],
    pub(crate) membrane: f64,
    /// Samples since the last spike, [`AFTER_LEN`] at most.
    pub(crate) since: usize,
}

impl State {
    pub(crate) const REST: Self =
        Self { filters: [Delays([0.0; 3]); 2], before: [0.0; 2], membrane: 0.0, since: AFTER_LEN };

    fn is_fading(&self) -> bool {
        let [Delays(stress), Delays(drive)] = self.filters;
        self.since == AFTER_LEN
            && self.membrane.abs() < REST
            && self.before.iter().chain(&stress).chain(&drive).all(|value| value.abs() < REST)
    }
}

impl Neuron {
    /// Model neurons of a class.
    #[must_use]
    pub fn models(class: Class) -> usize {
        MODELS[class as usize].len()
    }

    /// A neuron at rest; none if its class has no such model.
    #[must_use]
    pub fn new(class: Class, model: usize) -> Option<Self> {
        MODELS[class as usize].get(model).map(|model| Self { model, state: State::REST })
    }

    /// Whether nothing is left of what drove it.
    #[must_use]
    pub fn is_resting(&self) -> bool {
        self.state == State::REST
    }

    pub(crate) fn rest(&mut self) {
        self.state = State::REST;
    }

    /// Takes the first sample, before which there was none to integrate.
    pub(crate) fn begin(&mut self, stress_mpa: f64, drive: f64) {
        self.state = State::REST;
        self.filter(stress_mpa, drive);
    }

    /// Filters a sample; returns what the sample before was filtered to.
    fn filter(&mut self, stress_mpa: f64, drive: f64) -> [f64; 2] {
        let [of_stress, of_drive] = &mut self.state.filters;
        let now = [
            self.model.filter.step(of_stress, stress_mpa),
            self.model.filter.step(of_drive, drive),
        ];
        std::mem::replace(&mut self.state.before, now)
    }

    /// Takes the next sample: stress in MPa, drive in N/(s mm3), and a standard normal number (0:
    /// no noise). Whether it fires, at the time of this sample.
    pub fn step(&mut self, stress_mpa: f64, drive: f64, noise: f64) -> bool {
        let [stress, drive_before] = self.filter(stress_mpa, drive);
        let drive_step = self.state.before[1] - drive_before;
        let State { membrane, since, .. } = &mut self.state;
        *membrane += self.model.current(stress, drive_before, drive_step, noise)
            - *membrane / self.model.constants.tau;
        if let Some(after) = self.model.after.get(*since) {
            *membrane += after;
            *since += 1;
        }
        if *membrane > 1.0 && *since > REFRACTORY {
            (*membrane, *since) = (0.0, 0);
            return true;
        }
        let without_input = [stress_mpa, drive, noise].iter().all(|input| input.abs() <= 0.0);
        if without_input && self.state.is_fading() {
            self.rest();
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_stress_fires_at_the_closed_form_of_the_first_interval() {
        // Membrane after n samples: tau I (1 - (1 - 1/tau)^n), while stress has been there long.
        let mut neuron = Neuron::new(Class::Sa1, 1).unwrap();
        let of = neuron.model.constants;
        let (stress_mpa, current) = (0.05, 0.05 * of.stress[0]);
        // Filters filled, membrane and spikes emptied.
        for _ in 0..2000 {
            neuron.step(stress_mpa, 0.0, 0.0);
        }
        (neuron.state.membrane, neuron.state.since) = (0.0, AFTER_LEN);
        let due = (1.0 - 1.0 / (of.tau * current)).ln() / (1.0 - 1.0 / of.tau).ln();
        let found = (1..).find(|_| neuron.step(stress_mpa, 0.0, 0.0)).unwrap();
        assert_eq!(found, due.ceil() as usize);
    }

    #[test]
    fn what_is_let_go_comes_to_rest_and_stays_silent() {
        for class in Class::ALL {
            for model in 0..Neuron::models(class) {
                let mut neuron = Neuron::new(class, model).unwrap();
                for n in 0..1000 {
                    neuron.step(0.1, f64::from(n % 7), 0.0);
                }
                assert!(!neuron.is_resting());
                for _ in 0..60_000 {
                    neuron.step(0.0, 0.0, 0.0);
                }
                assert!(neuron.is_resting(), "{class} {model}: {:?}", neuron.state);
                assert!(!neuron.step(0.0, 0.0, 0.0));
            }
            assert!(Neuron::new(class, Neuron::models(class)).is_none());
        }
    }
}
