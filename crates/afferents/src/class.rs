//! The three classes of units, and what differs between them.

use std::{f64::consts::PI, fmt};

/// What a unit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Class {
    /// Slowly adapting type 1 (Merkel): fires while skin is held.
    Sa1,
    /// Rapidly adapting type 1 (Meissner): fires while skin moves.
    Ra,
    /// Pacinian: fires at vibration, from all over the finger.
    Pc,
}

impl Class {
    /// All of them, in the order in which placed units are numbered.
    pub const ALL: [Self; 3] = [Self::Sa1, Self::Ra, Self::Pc];

    /// The name on the wire and in files.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Sa1 => "sa1",
            Self::Ra => "ra",
            Self::Pc => "pc",
        }
    }

    /// Units per cm2 of a fingertip (Johansson & Vallbo 1979).
    #[must_use]
    pub const fn per_cm2(self) -> f64 {
        match self {
            Self::Sa1 => 70.0,
            Self::Ra => 140.0,
            Self::Pc => 21.0,
        }
    }

    /// Depth of the receptor in TouchSim, mm.
    #[must_use]
    pub const fn depth_mm(self) -> f64 {
        match self {
            Self::Sa1 => 0.3,
            Self::Ra => 1.6,
            Self::Pc => 2.0,
        }
    }

    /// Dynamic drive of a rate of stress at the interface, N/(s mm3) per MPa/s: what TouchSim's
    /// own mechanics give this class under a pin of 1 mm radius whose stress at the depth of SA1
    /// receptors changes at that rate. Under its axis stress is `F f / (2 pi R^2)` with
    /// `f = (1 + 3 x^2) / (1 + x^2)^2`, `x = z / R` (Sneddon 1946), the drive `dF/dt / (2 R z^2)`.
    #[must_use]
    pub fn drive_per_stress_rate(self) -> f64 {
        const RADIUS_MM: f64 = 1.0;
        let squared = (Self::Sa1.depth_mm() / RADIUS_MM).powi(2);
        let on_axis = (1.0 + 3.0 * squared) / (1.0 + squared).powi(2);
        PI * RADIUS_MM / (on_axis * self.depth_mm().powi(2))
    }
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
