//! The measurements, read from `measured.toml` or a file like it.

mod quantity;

pub use quantity::Quantity;

use crate::people::PeopleError;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What comes with the program.
const SHIPPED: &str = include_str!("../../../measured.toml");

/// Everything that the finger is compared with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// Figures of the pad as a whole.
    #[serde(rename = "figure", default)]
    pub figures: Vec<Figure>,
    /// Rates of SA1 afferents.
    pub sa1: Sa1,
}

/// One figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// What was measured.
    pub quantity: Quantity,
    /// One figure, without its spread over people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// Least and largest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// Largest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_most: Option<f64>,
    /// Least.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_least: Option<f64>,
    /// Where it is published.
    pub source: String,
    /// Whether it was not read there.
    #[serde(default)]
    pub second_hand: bool,
}

/// Rates of SA1 afferents under spheres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sa1 {
    /// Where they are published.
    pub source: String,
    /// Curvatures of the spheres, 1/m; 0 is flat.
    pub curvature_per_m: Vec<f64>,
    /// Forces, N, rising; the fit takes the first alone.
    pub force_n: Vec<f64>,
    /// Impulses a second under the middle, `[force][curvature]`.
    pub rate_per_s: Vec<Vec<f64>>,
    /// Rates beside the middle.
    #[serde(default, rename = "profile")]
    pub profiles: Vec<Profile>,
}

/// Rates along a line from the middle of a sphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// One of the curvatures, 1/m.
    pub curvature_per_m: f64,
    /// One of the forces, N.
    pub force_n: f64,
    /// Distances from the middle, mm, rising.
    pub distance_mm: Vec<f64>,
    /// Impulses a second, one a distance.
    pub rate_per_s: Vec<f64>,
}

/// Beyond it a curvature in 1/m is that of a needle.
const CURVATURE_MAX_PER_M: f64 = 2000.0;
/// Beyond it a force in N must have been meant in another unit.
const FORCE_MAX_N: f64 = 50.0;
/// Farthest that a receptor is looked for, mm.
const DISTANCE_MAX_MM: f64 = 6.0;

impl Measured {
    /// What comes with the program.
    ///
    /// # Errors
    /// As [`Self::read`]; a test holds that there is none.
    pub fn shipped() -> Result<Self, PeopleError> {
        Self::parse("measured.toml".as_ref(), SHIPPED)
    }

    /// A file of measurements.
    ///
    /// # Errors
    /// [`PeopleError::Read`] names the file and line, [`PeopleError::Field`] the field.
    pub fn read(path: &Path) -> Result<Self, PeopleError> {
        let text = papilla_json::read_text(path)
            .map_err(|e| PeopleError::Read { path: path.into(), why: e.to_string() })?;
        Self::parse(path, &text)
    }

    fn parse(path: &Path, text: &str) -> Result<Self, PeopleError> {
        let found: Self = toml::from_str(text)
            .map_err(|e| PeopleError::Read { path: path.into(), why: e.to_string() })?;
        found.validate()?;
        Ok(found)
    }

    fn validate(&self) -> Result<(), PeopleError> {
        for (i, figure) in self.figures.iter().enumerate() {
            figure.validate(&format!("figure[{i}]"))?;
        }
        self.sa1.validate()
    }
}

impl Figure {
    /// What people have, as tables say it.
    #[must_use]
    pub(crate) fn people(&self) -> String {
        match *self {
            Self { range: Some([low, high]), .. } => format!("{low} to {high}"),
            Self { at_most: Some(most), .. } => format!("at most {most}"),
            Self { at_least: Some(least), .. } => format!("at least {least}"),
            Self { value, .. } => format!("{}", value.unwrap_or(f64::NAN)),
        }
    }

    fn validate(&self, at: &str) -> Result<(), PeopleError> {
        let bounds = [self.value, self.at_most, self.at_least];
        let count =
            usize::from(self.range.is_some()) + bounds.iter().filter(|b| b.is_some()).count();
        let rule = "has to have exactly one of value, range, at_most and at_least";
        require(count == 1, at, rule, &count)?;
        let numbers = bounds.into_iter().flatten().chain(self.range.into_iter().flatten());
        let numbers: Vec<f64> = numbers.collect();
        let positive = numbers.iter().all(|v| v.is_finite() && *v > 0.0);
        require(positive, at, "has to have positive finite numbers", &format!("{numbers:?}"))?;
        let rises = self.range.is_none_or(|[low, high]| low < high);
        require(rises, &format!("{at}.range"), "has to rise", &format!("{numbers:?}"))?;
        self.quantity.validate(&format!("{at}.quantity"))
    }
}

impl Sa1 {
    fn validate(&self) -> Result<(), PeopleError> {
        require(
            self.curvature_per_m.len() >= 3,
            "sa1.curvature_per_m",
            "has to have 3 or more: two numbers are fitted",
            &self.curvature_per_m.len(),
        )?;
        for (i, &c) in self.curvature_per_m.iter().enumerate() {
            let name = format!("sa1.curvature_per_m[{i}]");
            let sane = (0.0..=CURVATURE_MAX_PER_M).contains(&c);
            require(sane, &name, "has to be 0 (flat) to 2000 1/m", &c)?;
        }
        require(!self.force_n.is_empty(), "sa1.force_n", "has to have one or more", &0)?;
        for (i, &f) in self.force_n.iter().enumerate() {
            force(f, &format!("sa1.force_n[{i}]"))?;
        }
        rising(&self.force_n, "sa1.force_n")?;
        let rows = self.rate_per_s.len();
        let rule = "has to have one row a force";
        require(rows == self.force_n.len(), "sa1.rate_per_s", rule, &rows)?;
        for (i, row) in self.rate_per_s.iter().enumerate() {
            rates(row, self.curvature_per_m.len(), &format!("sa1.rate_per_s[{i}]"))?;
        }
        for (i, p) in self.profiles.iter().enumerate() {
            let at = |name: &str| format!("sa1.profile[{i}].{name}");
            let known = self.curvature_per_m.contains(&p.curvature_per_m);
            let rule = "has to be one of sa1.curvature_per_m";
            require(known, &at("curvature_per_m"), rule, &p.curvature_per_m)?;
            let known = self.force_n.contains(&p.force_n);
            require(known, &at("force_n"), "has to be one of sa1.force_n", &p.force_n)?;
            rising(&p.distance_mm, &at("distance_mm"))?;
            let inside = p.distance_mm.iter().all(|d| (0.0..=DISTANCE_MAX_MM).contains(d));
            let found = format!("{:?}", p.distance_mm);
            require(inside, &at("distance_mm"), "has to be 0 to 6 mm", &found)?;
            rates(&p.rate_per_s, p.distance_mm.len(), &at("rate_per_s"))?;
        }
        Ok(())
    }
}

fn force(force_n: f64, at: &str) -> Result<(), PeopleError> {
    let sane = force_n > 0.0 && force_n <= FORCE_MAX_N;
    require(sane, at, "has to have a force above 0 and at most 50 N", &force_n)
}

fn rising(values: &[f64], at: &str) -> Result<(), PeopleError> {
    let rises = values.windows(2).all(|w| w[0] < w[1]);
    require(rises, at, "has to rise", &format!("{values:?}"))
}

fn rates(values: &[f64], count: usize, at: &str) -> Result<(), PeopleError> {
    require(values.len() == count, at, "has to have as many rates as places", &values.len())?;
    let sane = values.iter().all(|r| r.is_finite() && *r >= 0.0);
    require(sane, at, "has to have finite rates that are not negative", &format!("{values:?}"))
}

fn require(
    ok: bool,
    field: &str,
    rule: &'static str,
    found: &impl ToString,
) -> Result<(), PeopleError> {
    if ok {
        return Ok(());
    }
    Err(PeopleError::Field { field: field.into(), rule, found: found.to_string() })
}

#[cfg(test)]
mod tests;
