//! All units of a finger, frame by frame: strain energy density and pressure in, spikes out.

use crate::{
    class::Class,
    neuron::{Neuron, SAMPLE_US},
    pacinian::{Cell, Pacinian},
    placement::Unit,
    random::normal,
};

/// Longest time that a frame stands for, us: of a longer one only the end is simulated.
pub const FRAME_MAX_US: u64 = 50_000;

/// One spike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Spike {
    /// Number of the unit.
    pub unit: u16,
    /// When, by the clock of the frames.
    pub time_us: u64,
}

/// What units see beside their place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Modulus that turns SED into a stress, `sqrt(2 E SED)`, kPa.
    pub e_ref_kpa: f32,
    /// Seed of the membranes' noise; none: no noise.
    pub noise: Option<u32>,
}

/// The units and what they remember. Memory is taken when it is made.
///
/// Between two frames stress and pressure are linear in time. Membranes step at multiples of
/// [`SAMPLE_US`] of the frames' clock, so that spikes do not depend on when frames come.
#[derive(Debug)]
pub struct Fingertip {
    settings: Settings,
    units: Vec<Unit>,
    pub(crate) neurons: Vec<Neuron>,
    /// Stress of each unit, MPa, in the last frame and in this one.
    pub(crate) stress_mpa: [Vec<f64>; 2],
    /// Drive of each unit by the rate of stress in this frame.
    drive: Vec<f64>,
    pub(crate) pacinian: Pacinian,
    /// Place of each Pacinian unit among them.
    pacinian_of: Vec<Option<u16>>,
    /// Units that are not at rest in this frame.
    awake: Vec<u16>,
    pub(crate) last_us: Option<u64>,
    /// Nobody knows what acts: what the next frame brings is taken over at once and unfelt.
    pub(crate) is_paused: bool,
    pub(crate) fired: u32,
    spikes: Vec<Spike>,
    spikes_max: usize,
}

impl Fingertip {
    /// Units at rest. `place_mm` is where a pixel of the interface is; `cells` are where pressure
    /// acts. A frame keeps its first `spikes_max` spikes.
    #[must_use]
    pub fn new(
        units: Vec<Unit>,
        cells: &[Cell],
        place_mm: impl Fn(u32) -> [f32; 3],
        settings: Settings,
        spikes_max: usize,
    ) -> Self {
        let of_pc = |unit: &&Unit| unit.class == Class::Pc;
        let places: Vec<_> = units.iter().filter(of_pc).map(|unit| place_mm(unit.pixel)).collect();
        let mut numbers = 0..;
        let number = |unit: &Unit| (unit.class == Class::Pc).then(|| numbers.next()).flatten();
        let pacinian_of = units.iter().map(number).collect();
        let neuron = |unit: &Unit| {
            let model = usize::from(unit.model) % Neuron::models(unit.class);
            Neuron::new(unit.class, model)
        };
        Self {
            settings,
            neurons: units.iter().filter_map(neuron).collect(),
            stress_mpa: [0, 1].map(|_| vec![0.0; units.len()]),
            drive: vec![0.0; units.len()],
            pacinian: Pacinian::new(&places, cells),
            pacinian_of,
            awake: Vec::with_capacity(units.len()),
            last_us: None,
            is_paused: false,
            fired: 0,
            spikes: Vec::with_capacity(spikes_max),
            spikes_max,
            units,
        }
    }

    /// The units, by number.
    #[must_use]
    pub fn units(&self) -> &[Unit] {
        &self.units
    }

    /// Spikes of the last frame, in the order of time and unit.
    #[must_use]
    pub fn spikes(&self) -> &[Spike] {
        &self.spikes
    }

    /// All that fired so far, those too that a frame had no room for; begins again after 2^32.
    #[must_use]
    pub fn fired(&self) -> u32 {
        self.fired
    }

    /// Goes on to the next frame: its time, the SED of every pixel, J/m3, and the force on every
    /// cell, N.
    ///
    /// The first frame, and one whose time goes back, begins with membranes at rest. A frame whose
    /// time has not gone on changes nothing: what it brings is part of the way to the next one. Of
    /// more than [`FRAME_MAX_US`] between two frames the end is simulated.
    pub fn step(&mut self, time_us: u64, sed_j_per_m3: &[f32], force_n: &[f32]) {
        self.spikes.clear();
        if !self.is_paused && self.last_us == Some(time_us) {
            return;
        }
        let [before, now] = &mut self.stress_mpa;
        std::mem::swap(before, now);
        for (unit, stress_mpa) in self.units.iter().zip(now.iter_mut()) {
            // What is no number would stay in a membrane for good.
            let sed = sed_j_per_m3.get(unit.pixel as usize).map_or(0.0, |sed| sed.max(0.0));
            // kPa x Pa are 1e-9 MPa^2.
            *stress_mpa = (2e-9 * f64::from(self.settings.e_ref_kpa) * f64::from(sed)).sqrt();
        }
        let last_us = self.last_us.replace(time_us);
        let is_back = std::mem::take(&mut self.is_paused);
        let goes_back = last_us.is_none_or(|last_us| time_us < last_us);
        let begins = is_back || goes_back;
        if goes_back && !is_back {
            self.neurons.iter_mut().for_each(Neuron::rest);
            self.pacinian.rest();
        }
        let from_us = match last_us {
            Some(last_us) if !begins => last_us.max(time_us.saturating_sub(FRAME_MAX_US)),
            _ => time_us,
        };
        let span_s = 1e-6 * (time_us - from_us) as f64;
        self.pacinian.take(force_n, span_s);
        if time_us > from_us {
            self.turn_to(span_s);
            self.integrate(from_us, time_us);
        }
    }

    /// Nobody knows what acts: nothing fires until the next [`step`](Self::step), which finds
    /// membranes as they are and takes over what acts then without feeling how it came to be.
    pub fn pause(&mut self) {
        self.spikes.clear();
        self.is_paused = self.last_us.is_some();
    }

    /// Drive of this frame, and who is awake in it.
    fn turn_to(&mut self, span_s: f64) {
        let [before, now] = &self.stress_mpa;
        let kept = self.settings.noise.is_some();
        self.awake.clear();
        for (number, unit) in self.units.iter().enumerate() {
            let is_pc = unit.class == Class::Pc;
            self.drive[number] = if is_pc {
                0.0
            } else {
                unit.class.drive_per_stress_rate() * (now[number] - before[number]) / span_s
            };
            let is_still = before[number] <= 0.0 && now[number] <= 0.0;
            let sleeps = if is_pc { self.pacinian.is_still() } else { is_still };
            if kept || !sleeps || !self.neurons[number].is_resting() {
                self.awake.push(number as u16);
            }
        }
    }

    /// Steps the membranes over all samples after `from_us`, up to `time_us`.
    fn integrate(&mut self, from_us: u64, time_us: u64) {
        let [before, now] = &self.stress_mpa;
        for sample in from_us / SAMPLE_US + 1..=time_us / SAMPLE_US {
            let at_us = SAMPLE_US * sample;
            let share = (at_us - from_us) as f64 / (time_us - from_us) as f64;
            self.pacinian.advance();
            for &number in &self.awake {
                let unit = usize::from(number);
                let (stress_mpa, drive) = match self.pacinian_of[unit] {
                    Some(number) => (0.0, self.pacinian.drive(number.into())),
                    None => {
                        let rise = now[unit] - before[unit];
                        (before[unit] + share * rise, self.drive[unit])
                    }
                };
                let noise = self.settings.noise.map_or(0.0, |seed| normal(seed, unit, sample));
                if self.neurons[unit].step(stress_mpa, drive, noise) {
                    self.fired = self.fired.wrapping_add(1);
                    if self.spikes.len() < self.spikes_max {
                        self.spikes.push(Spike { unit: number, time_us: at_us });
                    }
                }
            }
        }
    }
}
