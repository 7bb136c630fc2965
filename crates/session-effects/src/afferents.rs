//! `afferents`: the firing rate of slowly adapting type 1 (SA1) units.
//!
//! SED is one accepted predictor of SA1 firing, not the only one. It becomes a stress,
//! `sigma = sqrt(2 E_ref SED)`, and that a rate, `k_s (sigma - theta)+ + k_d (d sigma / dt)+`.

use papilla_proto::{MAP_LEN, Problem, effects::Afferents as Parameters};
use papilla_session_state::{Reader, StateError, Writer};

use super::unusable;

/// Greatest value of a parameter: far beyond any tissue, and no rate overflows f32 with it, not
/// even that of a jump within 1 us.
const PARAMETER_MAX: f32 = 1e6;

/// Parameters, and what the last frame left.
#[derive(Debug)]
pub(super) struct Afferents {
    of: Parameters,
    /// Stress of the last frame, kPa, and its time by the client's clock.
    sigma_kpa: Vec<f32>,
    last_us: Option<u64>,
    /// The same of the last frame of an older time, if there was one since the clock began.
    older_kpa: Vec<f32>,
    older_us: Option<u64>,
    rate_hz: Vec<f32>,
}

impl Afferents {
    /// # Errors
    /// A parameter that is no number, or below zero.
    pub(super) fn new(of: Parameters) -> Result<Self, Problem> {
        for (name, value, above) in [
            ("e_ref_kpa", of.e_ref_kpa, true),
            ("theta_kpa", of.theta_kpa, false),
            ("k_s_hz_per_kpa", of.k_s_hz_per_kpa, false),
            ("k_d_hz_s_per_kpa", of.k_d_hz_s_per_kpa, false),
        ] {
            if !((0.0..=PARAMETER_MAX).contains(&value) && !(above && value <= 0.0)) {
                let message = format!(
                    "'{name}' is {value}; it has to be above zero and at most {PARAMETER_MAX}"
                );
                return Err(unusable("afferents", message));
            }
        }
        let [sigma_kpa, older_kpa, rate_hz] = [(); 3].map(|()| vec![0.0; MAP_LEN]);
        Ok(Self { of, sigma_kpa, last_us: None, older_kpa, older_us: None, rate_hz })
    }

    /// Takes the next map, `time_us` by the client's clock. What changes is held against the last
    /// frame of an older time; without one (in the first frame, and where the clock goes back) the
    /// rate is the steady one.
    pub(super) fn step(&mut self, sed_j_per_m3: &[f32], time_us: u64) {
        match self.last_us.replace(time_us) {
            Some(last_us) if last_us < time_us => {
                std::mem::swap(&mut self.sigma_kpa, &mut self.older_kpa);
                self.older_us = Some(last_us);
            }
            Some(last_us) if last_us == time_us => {}
            _ => self.older_us = None,
        }
        let k_d_hz_per_kpa = self.older_us.map_or(0.0, |older_us| {
            self.of.k_d_hz_s_per_kpa / ((time_us - older_us) as f64 * 1e-6) as f32
        });
        let (e_ref, theta, k_s) = (self.of.e_ref_kpa, self.of.theta_kpa, self.of.k_s_hz_per_kpa);
        let older = self.sigma_kpa.iter_mut().zip(&self.older_kpa);
        let maps = self.rate_hz.iter_mut().zip(older).zip(sed_j_per_m3);
        for ((rate_hz, (sigma, older_kpa)), sed) in maps {
            let now_kpa = sigma_kpa(e_ref, *sed);
            *rate_hz =
                k_s * (now_kpa - theta).max(0.0) + k_d_hz_per_kpa * (now_kpa - *older_kpa).max(0.0);
            *sigma = now_kpa;
        }
    }

    /// Nobody knows what presses: nothing is shown, and the next frame is the first.
    pub(super) fn lose(&mut self) {
        (self.last_us, self.older_us) = (None, None);
        self.rate_hz.fill(0.0);
    }

    /// Writes what the last frames left.
    pub(super) fn save(&self, state: &mut Writer) {
        state.option(self.last_us);
        state.floats(&self.sigma_kpa);
        state.option(self.older_us);
        state.floats(&self.older_kpa);
    }

    /// Goes on from what another one has written.
    pub(super) fn restore(&mut self, state: &mut Reader<'_>) -> Result<(), StateError> {
        self.last_us = state.option()?;
        state.floats(&mut self.sigma_kpa)?;
        self.older_us = state.option()?;
        state.floats(&mut self.older_kpa)?;
        // A later frame would have no time to have passed.
        if self.older_us.is_some_and(|older_us| self.last_us.is_none_or(|last| older_us >= last)) {
            return Err(StateError::Value("rates"));
        }
        Ok(())
    }

    /// The rates of the last frame, Hz.
    pub(super) fn rate_hz(&self) -> &[f32] {
        &self.rate_hz
    }
}

/// Stress at this SED, kPa.
fn sigma_kpa(e_ref_kpa: f32, sed_j_per_m3: f32) -> f32 {
    // J/m3 are Pa; kPa x Pa = 1e-3 kPa^2.
    (2e-3 * e_ref_kpa * sed_j_per_m3).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The SED, J/m3, whose stress is `kpa` at 80 kPa.
    fn sed_of(kpa: f32) -> f32 {
        kpa * kpa / 0.16
    }

    fn rate(afferents: &mut Afferents, kpa: f32, time_us: u64) -> f32 {
        afferents.step(&vec![sed_of(kpa); MAP_LEN], time_us);
        assert_eq!(afferents.rate_hz()[0].to_bits(), afferents.rate_hz()[MAP_LEN - 1].to_bits());
        afferents.rate_hz()[0]
    }

    #[test]
    fn a_held_stress_gives_what_is_above_the_threshold() {
        let mut afferents = Afferents::new(Parameters::default()).unwrap();
        for (kpa, due_hz) in [(5.0, 0.0), (8.0, 0.0), (20.0, 12.0), (50.0, 42.0)] {
            // Twice at the same time: nothing moves.
            rate(&mut afferents, kpa, 7);
            let found_hz = rate(&mut afferents, kpa, 7);
            assert!((found_hz - due_hz).abs() < 1e-3, "{kpa} kPa: {found_hz} Hz");
        }
    }

    #[test]
    fn a_ramp_adds_its_slope_whatever_the_step_and_its_fall_nothing() {
        for step_ms in [1, 11, 40] {
            let mut afferents = Afferents::new(Parameters::default()).unwrap();
            let slope_kpa_per_s = 100.0;
            for n in 0..5_u64 {
                let time_us = 1_000_000 + 1000 * step_ms * n;
                let kpa = 10.0 + slope_kpa_per_s * (step_ms * n) as f32 * 1e-3;
                let steady_hz = kpa - 8.0;
                let due_hz = if n == 0 { steady_hz } else { steady_hz + 0.2 * slope_kpa_per_s };
                let found_hz = rate(&mut afferents, kpa, time_us);
                assert!((found_hz - due_hz).abs() < 0.02, "{step_ms} ms: {found_hz}, not {due_hz}");
            }
            let found_hz = rate(&mut afferents, 9.0, 9_000_000);
            assert!((found_hz - 1.0).abs() < 1e-3, "{found_hz}");
        }
    }

    #[test]
    fn a_clock_that_goes_back_makes_no_motion() {
        let mut afferents = Afferents::new(Parameters::default()).unwrap();
        rate(&mut afferents, 10.0, 500);
        assert!((rate(&mut afferents, 30.0, 400) - 22.0).abs() < 1e-3);
    }

    #[test]
    fn no_parameter_and_no_clock_makes_a_rate_that_is_no_number() {
        let most = Parameters {
            e_ref_kpa: PARAMETER_MAX,
            theta_kpa: 0.0,
            k_s_hz_per_kpa: PARAMETER_MAX,
            k_d_hz_s_per_kpa: PARAMETER_MAX,
            map: true,
        };
        let mut afferents = Afferents::new(most).unwrap();
        // From nothing to 1e12 J/m3 within 1 us, and the other way round by a clock that jumps.
        for (sed, time_us) in [(0.0, 0), (1e12, 1), (0.0, 2), (1e12, u64::MAX), (1e12, 0), (0.0, 9)]
        {
            afferents.step(&vec![sed; MAP_LEN], time_us);
            assert!(afferents.rate_hz().iter().all(|rate| rate.is_finite() && *rate >= 0.0));
        }
    }

    /// Two frames of one tick: both are held against the frame before them.
    #[test]
    fn frames_of_one_tick_share_their_motion() {
        let mut afferents = Afferents::new(Parameters::default()).unwrap();
        rate(&mut afferents, 10.0, 0);
        // 100 kPa/s: 1 kPa in 10 ms, then 2 kPa.
        assert!((rate(&mut afferents, 11.0, 10_000) - (3.0 + 20.0)).abs() < 0.01);
        assert!((rate(&mut afferents, 12.0, 10_000) - (4.0 + 40.0)).abs() < 0.01);
        assert!((rate(&mut afferents, 13.0, 20_000) - (5.0 + 20.0)).abs() < 0.01);
    }

    /// Tracking that is lost shows nothing, and its return is no motion.
    #[test]
    fn what_comes_back_does_not_burst() {
        let mut afferents = Afferents::new(Parameters::default()).unwrap();
        rate(&mut afferents, 20.0, 0);
        rate(&mut afferents, 20.0, 10_000);
        afferents.lose();
        assert!(afferents.rate_hz().iter().all(|rate| *rate <= 0.0));
        assert!((rate(&mut afferents, 30.0, 20_000) - 22.0).abs() < 0.01);
        assert!((rate(&mut afferents, 30.0, 30_000) - 22.0).abs() < 0.01);
    }

    #[test]
    fn numbers_that_are_none_are_refused() {
        for of in [
            Parameters { e_ref_kpa: 0.0, ..Parameters::default() },
            Parameters { theta_kpa: -1.0, ..Parameters::default() },
            Parameters { k_s_hz_per_kpa: f32::NAN, ..Parameters::default() },
            Parameters { k_d_hz_s_per_kpa: f32::INFINITY, ..Parameters::default() },
            Parameters { e_ref_kpa: 1e38, ..Parameters::default() },
            Parameters { k_d_hz_s_per_kpa: 1e35, ..Parameters::default() },
        ] {
            assert!(Afferents::new(of).is_err(), "{of:?}");
        }
    }
}
