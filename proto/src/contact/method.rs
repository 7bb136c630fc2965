//! The methods that find pressure from objects or gaps, and the error of each.

use std::fmt;

use serde::{Deserialize, Serialize};

/// How pressure is found. A hello that names none gets the most accurate one that can serve it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactMethod {
    /// A spring for each vertex: the baseline.
    Springs,
    /// The finger's compliance at small strain.
    SmallStrain,
    /// The same with the second order of finite strain.
    SecondOrder,
    /// The same, then on pixels of the map: what lies between vertices is felt. Of objects alone.
    Pixels,
    /// The same on every second pixel: in half the time, less accurate.
    CoarsePixels,
}

impl ContactMethod {
    /// All of them, from fast and rough to slow and accurate.
    pub const ALL: [Self; 5] =
        [Self::Springs, Self::SmallStrain, Self::SecondOrder, Self::CoarsePixels, Self::Pixels];

    /// The name in a hello.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Springs => "springs",
            Self::SmallStrain => "small_strain",
            Self::SecondOrder => "second_order",
            Self::Pixels => "pixels",
            Self::CoarsePixels => "coarse_pixels",
        }
    }

    /// Whether it solves for pixels; the others solve for vertices alone.
    #[must_use]
    pub const fn is_on_pixels(self) -> bool {
        matches!(self, Self::Pixels | Self::CoarsePixels)
    }
}

impl fmt::Display for ContactMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Median and 95th percentile.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Half of the states err less.
    pub median: f64,
    /// Nineteen of twenty states err less.
    pub p95: f64,
}

/// What a method errs against finite elements, on the held-out states of one dataset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodError {
    /// The dataset.
    pub set: String,
    /// How many states of it.
    pub states: u32,
    /// Relative L2 of the pressure map.
    pub pressure_relative_l2: Spread,
    /// Relative error of the size of the force.
    pub force_relative: Spread,
    /// Relative L2 of the SED map that a network makes of the pressure; none without a network.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sed_relative_l2: Option<Spread>,
}

/// What one method errs, set by set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MethodErrors {
    /// The method.
    pub name: ContactMethod,
    /// On each dataset that was measured; the first is the one that `ready` tells of.
    pub errors: Vec<MethodError>,
}

/// What the methods err with one contact model: the file `contact.json` beside it, as
/// `model-export contact --write` measured it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactErrors {
    /// SHA-256 of the contact model's file, in hexadecimal.
    pub contact_sha256: String,
    /// The network that made SED of the pressure; none: SED was not measured.
    pub network: Option<String>,
    /// Method by method.
    pub methods: Vec<MethodErrors>,
}

impl ContactErrors {
    /// What a method errs on the first set; none if nobody measured it.
    #[must_use]
    pub fn of(&self, method: ContactMethod) -> Option<&MethodError> {
        self.all_of(method).first()
    }

    /// What a method errs, set by set.
    #[must_use]
    pub fn all_of(&self, method: ContactMethod) -> &[MethodError] {
        let of = self.methods.iter().find(|of| of.name == method);
        of.map_or(&[], |of| &of.errors)
    }
}
