//! The low pass between skin and membrane.

/// Coefficients of a Butterworth filter of third order.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Butterworth {
    gain: f64,
    /// Of the outputs before, the nearest first.
    back: [f64; 3],
}

/// What a filter remembers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Delays(pub(crate) [f64; 3]);

impl Butterworth {
    /// `(s + 1) (s^2 + s + 1)` by the bilinear transform, warped to meet the corner;
    /// `corner` is in units of half the sampling rate.
    pub(crate) fn new(corner: f64) -> Self {
        let k = (std::f64::consts::FRAC_PI_2 * corner).tan();
        let (k2, k3) = (k * k, k * k * k);
        let all = 1.0 + 2.0 * k + 2.0 * k2 + k3;
        let back = [
            (-3.0 - 2.0 * k + 2.0 * k2 + 3.0 * k3) / all,
            (3.0 - 2.0 * k - 2.0 * k2 + 3.0 * k3) / all,
            (-1.0 + 2.0 * k - 2.0 * k2 + k3) / all,
        ];
        Self { gain: k3 / all, back }
    }

    /// The next output (transposed direct form II).
    pub(crate) fn step(&self, Delays(delays): &mut Delays, input: f64) -> f64 {
        let x = self.gain * input;
        let out = x + delays[0];
        delays[0] = 3.0 * x - self.back[0] * out + delays[1];
        delays[1] = 3.0 * x - self.back[1] * out + delays[2];
        delays[2] = x - self.back[2] * out;
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Amplitude of what comes out for a cosine of `frequency`, in units of half the sampling rate.
    fn gain(corner: f64, frequency: f64) -> f64 {
        let (filter, mut delays) = (Butterworth::new(corner), Delays::default());
        let wave = |n: usize| (std::f64::consts::PI * frequency * n as f64).cos();
        let tail = (0..20_000).map(|n| filter.step(&mut delays, wave(n))).skip(10_000);
        // Whole periods: twice the mean square is that of the amplitude.
        (2.0 * tail.map(|value| value * value).sum::<f64>() / 10_000.0).sqrt()
    }

    #[test]
    fn amplitudes_are_those_of_the_closed_form() {
        let corner = 0.04;
        for frequency in [0.001, 0.02, 0.04, 0.08, 0.2] {
            let warp = |f: f64| (std::f64::consts::FRAC_PI_2 * f).tan();
            let due = (1.0 + (warp(frequency) / warp(corner)).powi(6)).sqrt().recip();
            let found = gain(corner, frequency);
            assert!((found - due).abs() < 1e-6 * due, "at {frequency}: {found}, not {due}");
        }
    }
}
