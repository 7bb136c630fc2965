//! `relaxation`: the tissue creeps under the pressure.
//!
//! In a linear viscoelastic body whose moduli all relax alike (constant Poisson's ratio), stress
//! under given pressure does not depend on the modulus, and strain is the elastic strain under the
//! pressure filtered with the creep compliance (correspondence principle). So the elastic map is
//! asked about `p~(t) = integral J(t - s) dp(s)`, where J is the inverse of the Prony series
//! `G(t) = 1 - sum g_i (1 - exp(-t / tau_i))`: `J(t) = 1/G(inf) - sum j_i exp(-x_i t)`.
//!
//! Between frames pressure goes straight from one to the next; for that the recursion below is
//! exact, however long the step. The first frame comes as a jump from nothing.

use papilla_proto::{
    MAP_LEN, Problem,
    effects::{Moduli, PronyTerm, Relaxation as Parameters},
};
use papilla_session_state::{Reader, StateError, Writer};

use super::{summary::peak, unusable};

/// Most terms of a series.
const TERMS_MAX: usize = 6;

/// Pressure below which nothing is left of a press, Pa: it ends the work that a release leaves
/// behind. SED goes with the square.
const NOTHING_PA: f32 = 0.1;

/// The filter and the history of every pixel.
#[derive(Debug)]
pub(super) struct Relaxation {
    /// `J(inf)`, times the long-term modulus if the map stands for that.
    gain: f32,
    branches: Vec<Branch>,
    /// Pressure of the last frame as it was sent, Pa.
    sent_pa: Vec<f32>,
    last_us: Option<u64>,
}

#[derive(Debug)]
struct Branch {
    /// `x_i`, 1/s.
    rate_per_s: f64,
    /// `j_i`, times the long-term modulus likewise.
    share: f32,
    /// `integral exp(-x_i (t - s)) dp(s)` of every pixel, Pa.
    state_pa: Vec<f32>,
}

impl Relaxation {
    /// # Errors
    /// Terms that make no relaxing solid.
    pub(super) fn new(of: &Parameters) -> Result<Self, Problem> {
        let preset = of.tissue.prony();
        let creep = Creep::of(of.prony.as_deref().unwrap_or(&preset))?;
        let modulus = match of.moduli {
            Moduli::Instantaneous => 1.0,
            Moduli::LongTerm => 1.0 / creep.long_term,
        };
        let branch = |&(rate_per_s, share): &(f64, f64)| Branch {
            rate_per_s,
            share: (share * modulus) as f32,
            state_pa: vec![0.0; MAP_LEN],
        };
        Ok(Self {
            gain: (creep.long_term * modulus) as f32,
            branches: creep.branches.iter().map(branch).collect(),
            sent_pa: vec![0.0; MAP_LEN],
            last_us: None,
        })
    }

    /// Takes the next pressure, `time_us` by the client's clock, and leaves what the elastic
    /// map is to be asked about in its place; returns the greatest value.
    ///
    /// A time that has not gone on makes a jump.
    pub(super) fn step(&mut self, pressure_pa: &mut [f32], time_us: u64) -> f32 {
        let passed_us = self.last_us.map_or(0, |last_us| time_us.saturating_sub(last_us));
        self.last_us = Some(time_us);
        let passed_s = passed_us as f64 * 1e-6;
        // The states first: they need the pressure of both frames.
        for branch in &mut self.branches {
            let x = branch.rate_per_s * passed_s;
            let kept = (-x).exp() as f32;
            let taken = if x > 0.0 { (-(-x).exp_m1() / x) as f32 } else { 1.0 };
            let pixels = branch.state_pa.iter_mut().zip(&self.sent_pa).zip(&*pressure_pa);
            for ((state, before), now) in pixels {
                let state_pa = kept * *state + taken * (now - before);
                // What has faded must not linger as a denormal number, which is slow.
                *state = if state_pa.abs() < 1e-6 { 0.0 } else { state_pa };
            }
        }
        self.sent_pa.copy_from_slice(pressure_pa);
        pressure_pa.iter_mut().for_each(|pa| *pa *= self.gain);
        for Branch { share, state_pa, .. } in &self.branches {
            for (pa, state) in pressure_pa.iter_mut().zip(state_pa) {
                *pa -= share * state;
            }
        }
        for pa in pressure_pa.iter_mut() {
            *pa = if *pa < NOTHING_PA { 0.0 } else { *pa };
        }
        peak(pressure_pa)
    }

    /// Nobody knows what presses: the tissue stays as it is, and no time passes until somebody does.
    pub(super) fn lose(&mut self) {
        self.last_us = None;
    }

    /// Writes the history of every pixel.
    pub(super) fn save(&self, state: &mut Writer) {
        state.option(self.last_us);
        state.floats(&self.sent_pa);
        self.branches.iter().for_each(|branch| state.floats(&branch.state_pa));
    }

    /// Goes on from the history that a filter of the same parameters has written.
    pub(super) fn restore(&mut self, state: &mut Reader<'_>) -> Result<(), StateError> {
        self.last_us = state.option()?;
        state.floats(&mut self.sent_pa)?;
        self.branches.iter_mut().try_for_each(|branch| state.floats(&mut branch.state_pa))
    }

    /// The pressure as it was sent, Pa.
    pub(super) fn sent_pa(&self) -> &[f32] {
        &self.sent_pa
    }
}

/// A creep compliance, `J(t) = long_term - sum j_i exp(-x_i t)` with `J(0) = 1`.
struct Creep {
    long_term: f64,
    /// `(x_i, j_i)`, x in 1/s.
    branches: Vec<(f64, f64)>,
}

impl Creep {
    /// Inverts a Prony series. Times s the Laplace transform of G is
    /// `G~(s) = g_inf + sum g_i s tau_i / (1 + s tau_i)` and that of J is `1 / G~(s)`: the `x_i` are
    /// where `G~(-x) = 0`, one below each pole `1 / tau_i` and above the pole before it.
    fn of(terms: &[PronyTerm]) -> Result<Self, Problem> {
        let refuse = |message: String| unusable("relaxation", message);
        if terms.is_empty() || terms.len() > TERMS_MAX {
            return Err(refuse(format!("{} Prony terms; name 1 to {TERMS_MAX}", terms.len())));
        }
        for (i, PronyTerm { g, tau_s }) in terms.iter().enumerate() {
            if !(*g > 0.0 && *g < 1.0 && *tau_s >= 1e-6 && *tau_s <= 1e6) {
                return Err(refuse(format!(
                    "Prony term {i} has g = {g}, tau_s = {tau_s}; 0 < g < 1 and 1e-6 to 1e6 s are due"
                )));
            }
        }
        let at_rest = 1.0 - terms.iter().map(|term| term.g).sum::<f64>();
        if at_rest < 0.01 {
            return Err(refuse("the Prony terms leave less than 1 % of the modulus".to_owned()));
        }
        let mut terms = terms.to_vec();
        terms.sort_by(|a, b| b.tau_s.total_cmp(&a.tau_s));
        if let Some(pair) = terms.windows(2).find(|pair| pair[1].tau_s > 0.999 * pair[0].tau_s) {
            let tau_s = pair[0].tau_s;
            return Err(refuse(format!("two Prony terms have tau_s near {tau_s}; make them one")));
        }
        let modulus = |x: f64| {
            let branch = |term: &PronyTerm| term.g * -x * term.tau_s / (1.0 - x * term.tau_s);
            at_rest + terms.iter().map(branch).sum::<f64>()
        };
        let mut branches = Vec::with_capacity(terms.len());
        let mut pole_before = 0.0;
        for term in &terms {
            let pole = 1.0 / term.tau_s;
            // From positive above the pole before (g_inf at 0) to negative below this one.
            let (mut low, mut high) = (pole_before, pole);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if modulus(middle) > 0.0 { low = middle } else { high = middle }
            }
            let x = 0.5 * (low + high);
            let slope: f64 =
                terms.iter().map(|t| t.g * t.tau_s / (1.0 - x * t.tau_s).powi(2)).sum();
            branches.push((x, 1.0 / (x * slope)));
            pole_before = pole;
        }
        Ok(Self { long_term: 1.0 / at_rest, branches })
    }
}

#[cfg(test)]
mod tests;
