//! What is measured of a finger, and how it was pressed for it.

use super::{CURVATURE_MAX_PER_M, force, require};
use crate::people::PeopleError;
use serde::{Deserialize, Serialize};

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
    /// Share of the skin's strain energy that lies outside of contact, while a plate that rubs moves
    /// along the finger.
    EnergyOutside {
        /// Force of the plate before it moves, N.
        force_n: f64,
        /// How far it moves towards the base, mm.
        shift_mm: f64,
        /// Coefficient of friction.
        friction: f64,
    },
    /// Turn of the profile of SA1 rates under a cylinder, degrees: the mean size under the cylinder
    /// turned by `turn_deg` and by `-turn_deg`.
    ProfileTurn {
        /// Curvature of the cylinder, 1/m.
        curvature_per_m: f64,
        /// Its turn from across the finger, degrees.
        turn_deg: f64,
        /// Force, N.
        force_n: f64,
    },
    /// Vertical over horizontal shear in the epidermis of skin that is in contact, as a plate presses
    /// from one force to another.
    ShearRatio {
        /// Smaller force, N.
        from_n: f64,
        /// Larger force, N.
        to_n: f64,
    },
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
            _ => None,
        }
    }

    pub(super) fn validate(&self, at: &str) -> Result<(), PeopleError> {
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
            Self::EnergyOutside { force_n, shift_mm, friction } => {
                force(force_n, at)?;
                let name = format!("{at}.shift_mm");
                require(
                    (0.1..=5.0).contains(&shift_mm),
                    &name,
                    "has to be 0.1 to 5 mm",
                    &shift_mm,
                )?;
                let name = format!("{at}.friction");
                require((0.05..=3.0).contains(&friction), &name, "has to be 0.05 to 3", &friction)
            }
            Self::ProfileTurn { curvature_per_m, turn_deg, force_n } => {
                force(force_n, at)?;
                let name = format!("{at}.curvature_per_m");
                let sane = (50.0..=CURVATURE_MAX_PER_M).contains(&curvature_per_m);
                require(sane, &name, "has to be 50 to 2000 1/m", &curvature_per_m)?;
                let name = format!("{at}.turn_deg");
                require((0.0..=45.0).contains(&turn_deg), &name, "has to be 0 to 45", &turn_deg)
            }
            Self::ShearRatio { from_n, to_n } => {
                force(to_n, at)?;
                let name = format!("{at}.from_n");
                require(from_n > 0.0 && from_n < to_n, &name, "has to be 0 to to_n", &from_n)
            }
            _ => Ok(()),
        }
    }
}
