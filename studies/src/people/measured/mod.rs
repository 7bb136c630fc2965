//! The measurements, read from `measured.toml` or a file like it.

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
    /// Where it is published.
    pub source: String,
    /// Whether it was not read there.
    #[serde(default)]
    pub second_hand: bool,
}

/// What is measured of the pad.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "of", rename_all = "snake_case", deny_unknown_fields)]
pub enum Quantity {
    /// `dF/dd` under a plate, N/mm.
    Stiffness {
        /// Force, N.
        force_n: f64,
        /// Inclination of the plate, tip first, degrees.
        pitch_deg: f64,
    },
    /// Stiffness at one force over that at another.
    Stiffening {
        /// Smaller force, N.
        from_n: f64,
        /// Larger force, N.
        to_n: f64,
        /// Inclination of the plate, degrees.
        pitch_deg: f64,
    },
    /// R2 of the line of stiffness over force, which an exponential law makes 1.
    Exponential {
        /// Largest force, N.
        to_n: f64,
        /// Inclination of the plate, degrees.
        pitch_deg: f64,
    },
    /// A time of the reduced relaxation, s.
    RelaxationTime {
        /// 1 is the shortest.
        rank: usize,
    },
    /// Peak over mean of the pressure under a plate.
    PeakOverMean {
        /// Force, N.
        force_n: f64,
        /// Inclination of the plate, degrees.
        pitch_deg: f64,
    },
    /// Contact area at one force over that at another.
    AreaRatio {
        /// Smaller force, N.
        from_n: f64,
        /// Larger force, N.
        to_n: f64,
        /// Inclination of the plate, degrees.
        pitch_deg: f64,
    },
    /// Young's modulus of Hertz' law under a plate, MPa.
    HertzModulus {
        /// Force, N.
        force_n: f64,
        /// Inclination of the plate, degrees.
        pitch_deg: f64,
    },
    /// Largest loss of volume under a plate, %.
    VolumeLost {
        /// Largest force, N.
        to_n: f64,
        /// Inclination of the plate, degrees.
        pitch_deg: f64,
    },
    /// Energy lost in a tap with a plate, %.
    EnergyLost {
        /// Depth, mm.
        depth_mm: f64,
        /// Time down, and time up again, s.
        time_s: f64,
    },
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
        match (self.range, self.at_most, self.value) {
            (Some([low, high]), ..) => format!("{low} to {high}"),
            (_, Some(most), _) => format!("at most {most}"),
            (.., value) => format!("{}", value.unwrap_or(f64::NAN)),
        }
    }

    fn validate(&self, at: &str) -> Result<(), PeopleError> {
        let given = [self.value.is_some(), self.range.is_some(), self.at_most.is_some()];
        let count = given.iter().filter(|g| **g).count();
        require(count == 1, at, "has to have exactly one of value, range and at_most", &count)?;
        let numbers = self.value.into_iter().chain(self.range.into_iter().flatten());
        let numbers: Vec<f64> = numbers.chain(self.at_most).collect();
        let positive = numbers.iter().all(|v| v.is_finite() && *v > 0.0);
        require(positive, at, "has to have positive finite numbers", &format!("{numbers:?}"))?;
        let rises = self.range.is_none_or(|[low, high]| low < high);
        require(rises, &format!("{at}.range"), "has to rise", &format!("{numbers:?}"))?;
        self.quantity.validate(&format!("{at}.quantity"))
    }
}

impl Quantity {
    /// The plate press that it is read from: inclination, degrees, and largest force, N.
    #[must_use]
    pub fn plate(&self) -> Option<(f64, f64)> {
        match *self {
            Self::Stiffness { force_n, pitch_deg }
            | Self::PeakOverMean { force_n, pitch_deg }
            | Self::HertzModulus { force_n, pitch_deg } => Some((pitch_deg, force_n)),
            Self::Stiffening { to_n, pitch_deg, .. }
            | Self::Exponential { to_n, pitch_deg }
            | Self::AreaRatio { to_n, pitch_deg, .. }
            | Self::VolumeLost { to_n, pitch_deg } => Some((pitch_deg, to_n)),
            Self::RelaxationTime { .. } | Self::EnergyLost { .. } => None,
        }
    }

    /// The same at forces of at most `most_n`, N.
    #[must_use]
    pub(crate) fn at_most_n(&self, most_n: f64) -> Self {
        let mut less = *self;
        match &mut less {
            Self::Stiffness { force_n, .. }
            | Self::PeakOverMean { force_n, .. }
            | Self::HertzModulus { force_n, .. }
            | Self::Exponential { to_n: force_n, .. }
            | Self::VolumeLost { to_n: force_n, .. } => *force_n = force_n.min(most_n),
            Self::Stiffening { from_n, to_n, .. } | Self::AreaRatio { from_n, to_n, .. } => {
                *from_n = from_n.min(most_n);
                *to_n = to_n.min(most_n);
            }
            Self::RelaxationTime { .. } | Self::EnergyLost { .. } => {}
        }
        less
    }

    fn validate(&self, at: &str) -> Result<(), PeopleError> {
        if let Some((pitch_deg, force_n)) = self.plate() {
            force(force_n, at)?;
            let name = format!("{at}.pitch_deg");
            require((0.0..=60.0).contains(&pitch_deg), &name, "has to be 0 to 60", &pitch_deg)?;
        }
        match *self {
            Self::Stiffening { from_n, to_n, .. } | Self::AreaRatio { from_n, to_n, .. } => {
                let name = format!("{at}.from_n");
                require(from_n > 0.0 && from_n < to_n, &name, "has to be 0 to to_n", &from_n)
            }
            Self::RelaxationTime { rank } => {
                require(rank >= 1, &format!("{at}.rank"), "has to be 1 or more", &rank)
            }
            Self::EnergyLost { depth_mm, time_s } => {
                let name = format!("{at}.depth_mm");
                let deep = (0.1..=4.0).contains(&depth_mm);
                require(deep, &name, "has to be 0.1 to 4 mm", &depth_mm)?;
                let name = format!("{at}.time_s");
                require((1e-4..=1e3).contains(&time_s), &name, "has to be 1e-4 to 1e3 s", &time_s)
            }
            _ => Ok(()),
        }
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
