//! What a fingertip remembers, as whole numbers, bit by bit.

use crate::{
    filter::Delays,
    fingertip::Fingertip,
    neuron::{AFTER_LEN, Neuron, State},
    pacinian::{DELAYS, Pacinian},
};

impl Fingertip {
    /// Hands what later spikes depend on to `put`, number by number.
    pub fn save(&self, put: &mut impl FnMut(u64)) {
        put(u64::from(self.last_us.is_some()) + u64::from(self.is_paused));
        put(self.last_us.unwrap_or_default());
        put(self.fired.into());
        let [_, now] = &self.stress_mpa;
        now.iter().for_each(|stress_mpa| put(stress_mpa.to_bits()));
        self.neurons.iter().for_each(|neuron| neuron.save(put));
        self.pacinian.save(put);
    }

    /// Goes on from what another one with the same units has [saved](Self::save).
    ///
    /// # Errors
    /// Those of `next`; this fingertip is of no use any more.
    pub fn restore<E>(&mut self, next: &mut impl FnMut() -> Result<u64, E>) -> Result<(), E> {
        let begun = next()?;
        let last_us = next()?;
        self.last_us = (begun > 0).then_some(last_us);
        self.is_paused = begun > 1;
        self.fired = next()? as u32;
        for stress_mpa in &mut self.stress_mpa[1] {
            *stress_mpa = f64::from_bits(next()?);
        }
        for neuron in &mut self.neurons {
            neuron.restore(next)?;
        }
        self.pacinian.restore(next)
    }
}

impl Neuron {
    fn save(&self, put: &mut impl FnMut(u64)) {
        put((!self.is_resting()).into());
        if self.is_resting() {
            return;
        }
        let State { filters: [Delays(stress), Delays(drive)], before, membrane, since } =
            self.state;
        let values = stress.iter().chain(&drive).chain(&before).chain([&membrane]);
        values.for_each(|value| put(value.to_bits()));
        put(since as u64);
    }

    fn restore<E>(&mut self, next: &mut impl FnMut() -> Result<u64, E>) -> Result<(), E> {
        self.rest();
        if next()? == 0 {
            return Ok(());
        }
        let State { filters: [Delays(stress), Delays(drive)], before, membrane, since } =
            &mut self.state;
        for value in stress.iter_mut().chain(drive).chain(before).chain([membrane]) {
            *value = f64::from_bits(next()?);
        }
        *since = (next()? as usize).min(AFTER_LEN);
        Ok(())
    }
}

impl Pacinian {
    fn save(&self, put: &mut impl FnMut(u64)) {
        put(self.at as u64);
        put(self.silence as u64);
        self.force_n.iter().for_each(|force_n| put(force_n.to_bits().into()));
        if self.silence < DELAYS {
            let arriving = self.units.iter().flat_map(|unit| unit.arriving);
            arriving.for_each(|drive| put(drive.to_bits()));
        }
    }

    fn restore<E>(&mut self, next: &mut impl FnMut() -> Result<u64, E>) -> Result<(), E> {
        self.rest();
        self.at = next()? as usize % DELAYS;
        self.silence = (next()? as usize).min(DELAYS);
        for force_n in &mut self.force_n {
            *force_n = f32::from_bits(next()? as u32);
        }
        if self.silence < DELAYS {
            for drive in self.units.iter_mut().flat_map(|unit| &mut unit.arriving) {
                *drive = f64::from_bits(next()?);
            }
        }
        Ok(())
    }
}
