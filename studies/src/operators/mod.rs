//! The operators of a model against what one core can do.
//!
//! An operator reads its constants and maps and does its products and sums: it can take no less time
//! than the core needs for the slower of the two. tract runs one operator after the other, so the
//! bound of a model is their sum.

pub mod rates;

use papilla_engine::{EngineError, Operator, profile};
use papilla_model_export::ladder::machine;
use rates::{LEAST_BYTES, Rates};
use std::fmt::Write;
use std::time::Duration;

/// Runs of each model.
const RUNS: usize = 400;
/// An operator with less than this share of the time has no row of its own.
const SHARE_MIN: f64 = 0.02;

/// A model's operators, timed.
#[derive(Clone, Debug)]
pub struct Profile {
    name: String,
    operators: Vec<Operator>,
}

impl Profile {
    /// Runs the model.
    ///
    /// # Errors
    /// As [`profile`].
    pub fn measure(onnx: &[u8]) -> Result<Self, EngineError> {
        let name = papilla_engine::load(onnx, None)?.info().name.clone();
        Ok(Self { name, operators: profile(onnx, RUNS)? })
    }

    fn bytes(&self) -> u64 {
        self.operators.iter().map(|o| o.constant_bytes + o.map_bytes).sum()
    }
}

/// Least time of an operator, us.
fn bound_us(operator: &Operator, rates: &Rates) -> f64 {
    let read_s = rates.read_s(operator.constant_bytes + operator.map_bytes);
    1e6 * read_s.max(operator.operations as f64 / rates.operations_per_s)
}

fn us(time: Duration) -> f64 {
    1e6 * time.as_secs_f64()
}

/// The page.
#[must_use]
pub fn markdown(profiles: &[Profile], rates: &Rates) -> String {
    let mut text = include_str!("head.md").to_owned();
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "\nMeasured on {}, {RUNS} runs of each network. The core does {:.0} operations a ns. It reads a buffer of this\n\
         size at this rate:\n\n| buffer, kB | rate, GB/s |\n|---|---|",
        machine(),
        rates.operations_per_s / 1e9
    );
    for (rate, size) in rates.bytes_per_s.iter().zip(0..) {
        let _ = writeln!(text, "| {} | {:.0} |", (LEAST_BYTES << size) >> 10, rate / 1e9);
    }
    text.push_str(
        "\n| network | weights and maps, MB | operations, million | bound, us | time, us | times the bound |\n\
         |---|---|---|---|---|---|\n",
    );
    for profile in profiles {
        let bound: f64 = profile.operators.iter().map(|o| bound_us(o, rates)).sum();
        let time: f64 = profile.operators.iter().map(|o| us(o.median)).sum();
        let _ = writeln!(
            text,
            "| `{}` | {:.2} | {:.1} | {bound:.1} | {time:.1} | {:.1} |",
            profile.name,
            profile.bytes() as f64 / 1e6,
            profile.operators.iter().map(|o| o.operations).sum::<u64>() as f64 / 1e6,
            time / bound,
        );
    }
    for profile in profiles {
        let _ = writeln!(text, "\n## `{}`\n", profile.name);
        table(&mut text, &profile.operators, rates);
    }
    text
}

fn table(text: &mut String, operators: &[Operator], rates: &Rates) {
    text.push_str(
        "| operator | constants, kB | maps, kB | operations, k | bound, us | time, us | times the bound |\n\
         |---|---|---|---|---|---|---|\n",
    );
    let all_us: f64 = operators.iter().map(|o| us(o.median)).sum();
    let (mut large, small): (Vec<&Operator>, Vec<&Operator>) =
        operators.iter().partition(|o| us(o.median) >= SHARE_MIN * all_us);
    large.sort_by_key(|operator| std::cmp::Reverse(operator.median));
    for operator in &large {
        let name = format!("{} `{}`", operator.kind, operator.name);
        row(text, &name, &[operator], rates);
    }
    if !small.is_empty() {
        row(text, &format!("{} others", small.len()), &small, rates);
    }
    row(text, "**all**", &operators.iter().collect::<Vec<_>>(), rates);
}

fn row(text: &mut String, name: &str, operators: &[&Operator], rates: &Rates) {
    let sum = |of: &dyn Fn(&Operator) -> f64| operators.iter().map(|o| of(o)).sum::<f64>();
    let (bound, time) = (sum(&|o| bound_us(o, rates)), sum(&|o| us(o.median)));
    let _ = writeln!(
        text,
        "| {name} | {:.1} | {:.1} | {:.1} | {bound:.1} | {time:.1} | {:.1} |",
        sum(&|o| o.constant_bytes as f64) / 1e3,
        sum(&|o| o.map_bytes as f64) / 1e3,
        sum(&|o| o.operations as f64) / 1e3,
        time / bound,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bound_is_the_slower_of_reading_and_computing() {
        let rates = Rates { bytes_per_s: vec![1e9], operations_per_s: 4e9 };
        let operator = |constant_bytes, operations| Operator {
            name: "a".into(),
            kind: "MatMul".into(),
            constant_bytes,
            map_bytes: 1000,
            operations,
            median: Duration::from_micros(12),
        };
        assert!((bound_us(&operator(2000, 4), &rates) - 3.0).abs() < 1e-9);
        assert!((bound_us(&operator(2000, 40_000), &rates) - 10.0).abs() < 1e-9);
        let operators = vec![operator(2000, 4), operator(3000, 40_000)];
        let profile = Profile { name: "two".into(), operators };
        let page = markdown(&[profile], &rates);
        assert!(page.contains("| **all** | 5.0 | 2.0 | 40.0 | 13.0 | 24.0 | 1.8 |"), "{page}");
    }

    #[test]
    fn a_shipped_model_is_taken_apart() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../models/nano.onnx");
        let operators = profile(&std::fs::read(path).unwrap(), 1).unwrap();
        let sum = |of: fn(&Operator) -> u64| operators.iter().map(of).sum::<u64>();
        // map-c4-k3-r32-h4: at each level 16 channels from 4 pressures and 4 components above, by
        // kernels of 3 x 3, and the mean of 4 pressures; the correction at the middle one, 20 to 4
        // twice and 4 to 16, and at the coarsest, 20 to 16 twice by 3 x 3 and 16 to 16.
        let blocks = [112, 56, 28].map(|side: u64| side * side);
        let [middle, coarsest] = [2 * 20 * 4 + 4 * 16, 2 * 20 * 16 * 9 + 16 * 16];
        let products = blocks.iter().sum::<u64>() * (16 * (4 + 4) * 9 + 4)
            + blocks[1] * middle
            + blocks[2] * coarsest;
        let direct = || operators.iter().filter(|o| o.kind == "DirectConvolution");
        assert_eq!(direct().count(), 15, "{operators:?}");
        assert_eq!(direct().map(|o| o.operations).sum::<u64>(), 2 * products);
        let constants = 3 * (1152 + 4) + middle + coarsest;
        assert_eq!(direct().map(|o| o.constant_bytes).sum::<u64>(), 4 * constants);
        assert!(sum(|o| o.operations) > 2 * products, "{operators:?}");
    }
}
