//! A line of lattice intervals whose lengths follow a wanted spacing.

/// A map of `[-reach, reach]` onto itself, rising, that turns evenly spaced places into places
/// as dense as was asked for.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LineMap {
    reach_mm: f64,
    /// Where each of the even places goes, mm.
    at_mm: Vec<f64>,
    /// Even places for one interval of the wanted spacing, summed: how many intervals the
    /// spacing needs over the whole line.
    pub intervals: f64,
}

impl LineMap {
    /// The map for a spacing (mm) sampled at the middles of `spacing_mm.len()` even cells of
    /// `[-reach_mm, reach_mm]`.
    pub(super) fn new(reach_mm: f64, spacing_mm: &[f64]) -> Self {
        let cell = 2.0 * reach_mm / spacing_mm.len() as f64;
        let mut cumulative = vec![0.0];
        for h in spacing_mm {
            cumulative.push(cumulative[cumulative.len() - 1] + cell / h);
        }
        let intervals = cumulative[spacing_mm.len()];
        let count = spacing_mm.len();
        let mut at_mm = Vec::with_capacity(count + 1);
        let mut k = 0;
        for i in 0..=count {
            let wanted = intervals * i as f64 / count as f64;
            while k + 1 < count && cumulative[k + 1] < wanted {
                k += 1;
            }
            let part = (wanted - cumulative[k]) / (cumulative[k + 1] - cumulative[k]);
            at_mm.push(-reach_mm + cell * (k as f64 + part));
        }
        at_mm[0] = -reach_mm;
        at_mm[count] = reach_mm;
        Self { reach_mm, at_mm, intervals }
    }

    /// Where the place `x_mm` goes; what lies beyond the reach stays.
    pub(super) fn moved_mm(&self, x_mm: f64) -> f64 {
        let count = self.at_mm.len() - 1;
        let t = (x_mm + self.reach_mm) / (2.0 * self.reach_mm) * count as f64;
        if !(t > 0.0 && t < count as f64) {
            return x_mm;
        }
        let k = (t as usize).min(count - 1);
        let part = t - k as f64;
        (1.0 - part) * self.at_mm[k] + part * self.at_mm[k + 1]
    }
}

/// Lowers a spacing (mm, at even places `cell_mm` apart) until neighbours differ by at most
/// `growth` of their distance.
pub(super) fn limit_growth(spacing_mm: &mut [f64], cell_mm: f64, growth: f64) {
    for i in 1..spacing_mm.len() {
        spacing_mm[i] = spacing_mm[i].min(spacing_mm[i - 1] + growth * cell_mm);
    }
    for i in (1..spacing_mm.len()).rev() {
        spacing_mm[i - 1] = spacing_mm[i - 1].min(spacing_mm[i] + growth * cell_mm);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_spacing_moves_nothing() {
        let map = LineMap::new(6.0, &[0.3; 120]);
        for x in [-7.0, -6.0, -1.234, 0.0, 2.5, 6.0, 9.0] {
            assert!((map.moved_mm(x) - x).abs() < 1e-12, "{x}");
        }
        assert!((map.intervals - 40.0).abs() < 1e-9);
    }

    #[test]
    fn lines_are_as_dense_as_asked() {
        // .1 mm over |x| < 1, .4 beyond: 20 and 25 intervals.
        let spacing: Vec<f64> = (0..1200)
            .map(|i| if (0.01 * (f64::from(i) + 0.5) - 6.0).abs() < 1.0 { 0.1 } else { 0.4 })
            .collect();
        let map = LineMap::new(6.0, &spacing);
        assert!((map.intervals - 45.0).abs() < 1e-6);
        let even: Vec<f64> = (0..=45).map(|i| -6.0 + 12.0 / 45.0 * f64::from(i)).collect();
        let at: Vec<f64> = even.iter().map(|&x| map.moved_mm(x)).collect();
        assert!(at.windows(2).all(|w| w[1] > w[0]));
        let narrow = at.windows(2).filter(|w| w[0].abs() < 0.95 && w[1].abs() < 0.95);
        assert!(narrow.clone().count() >= 18);
        for w in narrow {
            assert!((w[1] - w[0] - 0.1).abs() < 0.01, "{w:?}");
        }
    }

    #[test]
    fn growth_is_limited_both_ways() {
        let mut h = vec![1.0, 1.0, 0.1, 1.0, 1.0];
        limit_growth(&mut h, 0.5, 0.4);
        let expected = [0.5, 0.3, 0.1, 0.3, 0.5];
        assert!(h.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{h:?}");
    }
}
