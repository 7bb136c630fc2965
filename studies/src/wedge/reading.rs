//! What of the paper can be read in more than one way.

use papilla_fingertip::materials::{Moduli, OgdenSpec, PronySpec};
use papilla_fingertip::scene::Scene;
use serde::Serialize;

/// A reading of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
pub enum Reading {
    /// Second set of Table 2 for the dermis, first for fat, nu 0.48, `tau_1` as
    /// printed, instantaneous moduli.
    Taken,
    /// nu 0.40, as Table 2 prints it.
    AsPublished,
    /// First set for the dermis, second for fat.
    SetsSwapped,
    /// Second set for both: 'for the skin' taken at its word.
    OneSet,
    /// `tau_1` of the first set a tenth of what is printed.
    Tau1Shorter,
    /// `tau_1` of the first set ten times what is printed.
    Tau1Longer,
    /// Table 2's moduli are those of a strain held for ever.
    LongTerm,
}

impl Reading {
    /// Every reading, the one taken first.
    pub const ALL: [Self; 7] = [
        Self::Taken,
        Self::AsPublished,
        Self::SetsSwapped,
        Self::OneSet,
        Self::Tau1Shorter,
        Self::Tau1Longer,
        Self::LongTerm,
    ];

    /// Name on the command line and in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Taken => "taken",
            Self::AsPublished => "as_published",
            Self::SetsSwapped => "sets_swapped",
            Self::OneSet => "one_set",
            Self::Tau1Shorter => "tau1_shorter",
            Self::Tau1Longer => "tau1_longer",
            Self::LongTerm => "long_term",
        }
    }

    /// Changes a scene's materials accordingly.
    pub(super) fn apply(self, scene: &mut Scene) {
        let (dermis, fat) = (&mut scene.materials.dermis, &mut scene.materials.subcutaneous);
        let both = [&mut *dermis, &mut *fat];
        match self {
            Self::Taken => {}
            Self::AsPublished => {
                both.into_iter().flat_map(|m| &mut m.ogden).for_each(|o| o.poissons_ratio = 0.40);
            }
            Self::SetsSwapped => {
                std::mem::swap(&mut dermis.ogden, &mut fat.ogden);
                std::mem::swap(&mut dermis.prony, &mut fat.prony);
            }
            Self::OneSet => {
                fat.ogden = Some(OgdenSpec::skin());
                fat.prony = Some(PronySpec::skin());
            }
            Self::Tau1Shorter | Self::Tau1Longer => {
                let factor = if self == Self::Tau1Shorter { 0.1 } else { 10.0 };
                fat.prony.iter_mut().for_each(|p| p.time_s[0] *= factor);
            }
            Self::LongTerm => {
                let prony = both.into_iter().flat_map(|m| &mut m.prony);
                prony.for_each(|p| p.moduli = Moduli::LongTerm);
            }
        }
    }
}
