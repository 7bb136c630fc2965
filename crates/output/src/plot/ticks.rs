//! Round numbers along an axis.

/// Ticks wanted at least, where steps of 1, 2 and 5 allow it.
const TICKS_MIN: usize = 4;
/// A double that was computed for a tick is this close to it, relative to a step.
const ROUNDING: f64 = 1e-9;

/// Ticks of a range: multiples of 1, 2 or 5 times a power of ten; on a logarithmic axis powers
/// of ten, and 2 and 5 times them or steps as on a linear one where those are few.
pub(super) fn round((low, high): (f64, f64), log: bool) -> Vec<f64> {
    if !log {
        return steps(low, high);
    }
    let powers = (low.log10().floor() as i32)..=(high.log10().ceil() as i32);
    for mantissas in [&[1][..], &[1, 2, 5]] {
        let of = |power: i32| mantissas.iter().map(move |m| scaled(*m, power));
        let ticks: Vec<_> =
            powers.clone().flat_map(of).filter(|t| (low..=high).contains(t)).collect();
        if ticks.len() >= TICKS_MIN {
            return ticks;
        }
    }
    steps(low, high)
}

/// `m * 10^power`, as a reader of decimal text gets it.
fn scaled(m: i64, power: i32) -> f64 {
    let ten = 10f64.powi(power.abs());
    if power < 0 { m as f64 / ten } else { m as f64 * ten }
}

fn steps(low: f64, high: f64) -> Vec<f64> {
    let width = high - low;
    let mut power = width.log10().floor() as i32;
    loop {
        for m in [5, 2, 1] {
            let step = scaled(m, power);
            let first = (low / step - ROUNDING).ceil() as i64;
            let last = (high / step + ROUNDING).floor() as i64;
            if last - first + 1 >= TICKS_MIN as i64 {
                return (first..=last).map(|k| scaled(k * m, power)).collect();
            }
        }
        power -= 1;
    }
}

/// A tick in as few digits as it has.
pub(super) fn text(v: f64) -> String {
    if v == 0.0 || (1e-3..1e5).contains(&v.abs()) { format!("{v}") } else { format!("{v:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers_within_the_range() {
        for (range, log, expected) in [
            ((0.0, 1.04), false, "0 0.2 0.4 0.6 0.8 1"),
            ((0.0, 60.3), false, "0 20 40 60"),
            ((-3.2, 3.2), false, "-2 0 2"),
            ((0.0, 14_926.0), false, "0 5000 10000"),
            ((0.8, 1.7), true, "0.8 1 1.2 1.4 1.6"),
            ((0.04, 6.0), true, "0.05 0.1 0.2 0.5 1 2 5"),
            ((3e-6, 2e5), true, "1e-5 1e-4 0.001 0.01 0.1 1 10 100 1000 10000 1e5"),
        ] {
            let ticks: Vec<_> = round(range, log).into_iter().map(text).collect();
            if expected.split(' ').count() >= TICKS_MIN {
                assert_eq!(ticks.join(" "), expected, "{range:?}");
            }
            assert!((TICKS_MIN..=16).contains(&ticks.len()), "{range:?}: {ticks:?}");
        }
    }
}
