//! What is fitted, between which printed values.

use papilla_fingertip::materials::MaterialSpec;
use papilla_fingertip::scene::{MaterialSet, TissueTable};
use serde::Serialize;

/// One constant, between the least and the largest value that was found printed.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Parameter {
    /// Its name, with its unit.
    pub name: &'static str,
    /// Least printed value.
    pub low: f64,
    /// Largest printed value.
    pub high: f64,
    /// Where the search begins.
    pub start: f64,
    /// Who prints `low`.
    pub low_source: &'static str,
    /// Who prints `high`.
    pub high_source: &'static str,
}

/// Poisson's ratio at rest. With .48 a fat that stiffens is squeezed together rather than aside: the
/// bulk modulus does not stiffen with it.
const POISSONS_RATIO: f64 = 0.495;

/// Exponent of dermis: human skin (Shergold & Fleck 2005; second hand).
const DERMIS_ALPHA: f64 = 9.0;
/// Young's modulus of epidermis, MPa: about the middle, by its logarithm, of .136 (Maeno; Chen, Shuai &
/// Zhu) and 2 (Geerligs et al. 2011, abstract: 1 to 2).
const EPIDERMIS_MPA: f64 = 0.6;

/// The constants that are fitted. The search takes them by their logarithms.
pub const PARAMETERS: [Parameter; 3] = [
    Parameter {
        name: "shear modulus of fat, MPa",
        low: 0.001_084,
        high: 0.0165,
        start: 0.008,
        low_source: "Chokhandre, Halloran, van den Bogert & Erdemir 2012 (heel pad; abstract)",
        high_source: "Erdemir, Viveiros, Ulbrecht & Cavanagh 2006 (heel pads; second hand)",
    },
    Parameter {
        name: "exponent of fat",
        low: 2.0,
        high: 9.78,
        start: 9.0,
        low_source: "neo-Hooke, as the set `papers`",
        high_source: "Chokhandre, Halloran, van den Bogert & Erdemir 2012 (abstract)",
    },
    Parameter {
        name: "shear modulus of dermis, MPa",
        low: 0.027,
        high: 0.11,
        start: 0.07,
        low_source: "Maeno, Kobayashi & Yamazaki 1998 (E = .080 MPa)",
        high_source: "Shergold & Fleck 2005 (human skin; second hand)",
    },
];

impl Parameter {
    /// The value at a place between 0 (`low`) and 1 (`high`).
    #[must_use]
    pub fn value(&self, at: f64) -> f64 {
        self.low * (at * (self.high / self.low).ln()).exp()
    }

    /// The place of a value.
    #[must_use]
    pub fn place(&self, value: f64) -> f64 {
        (value / self.low).ln() / (self.high / self.low).ln()
    }
}

/// Where the search begins.
#[must_use]
pub fn start() -> Vec<f64> {
    PARAMETERS.iter().map(|p| p.place(p.start)).collect()
}

/// Values of the parameters at a point of the search, to four digits: files of one press are named
/// by what it was solved from.
#[must_use]
pub fn values(at: &[f64]) -> Vec<f64> {
    PARAMETERS.iter().zip(at).map(|(p, x)| four_digits(p.value(*x))).collect()
}

fn four_digits(v: f64) -> f64 {
    // By decimal digits: a product with a power of ten would not be the nearest number to them.
    format!("{v:.3e}").parse().unwrap_or(v)
}

/// The tissues with these values, nail and bone as ever.
#[must_use]
pub fn table(values: &[f64]) -> TissueTable {
    let term = |mu, alpha| MaterialSpec::one_term(mu, alpha, POISSONS_RATIO);
    TissueTable {
        epidermis: MaterialSpec::elastic(EPIDERMIS_MPA, POISSONS_RATIO),
        dermis: term(values[2], DERMIS_ALPHA),
        subcutaneous: term(values[0], values[1]),
        ..MaterialSet::Papers.table()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_begins_within_what_is_printed() {
        for (p, at) in PARAMETERS.iter().zip(start()) {
            assert!(0.0 < at && at < 1.0, "{}: {at}", p.name);
            assert!((p.value(at) / p.start - 1.0).abs() < 1e-12);
            assert!((p.value(0.0) / p.low - 1.0).abs() < 1e-12 && p.place(p.high) == 1.0);
        }
    }

    #[test]
    fn values_have_four_digits() {
        assert!((four_digits(0.012_345_6) / 0.012_35 - 1.0).abs() < 1e-12);
        assert!((four_digits(9.780_04) / 9.78 - 1.0).abs() < 1e-12);
        assert_eq!(four_digits(0.027_000_000_000_000_003).to_string(), "0.027");
    }
}
