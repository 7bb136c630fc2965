//! What options name, and what they stand for in the libraries.

use papilla_fingertip::mesh::fingertip;
use papilla_people::study;
use papilla_validation::{calculix, wedge};

/// Makes a choice of the command line that stands for an enumeration of the same variants.
macro_rules! choice {
    ($(#[$outer:meta])* $name:ident for $of:path { $($(#[$inner:meta])* $variant:ident,)+ }) => {
        #[derive(Clone, Copy, Debug, clap::ValueEnum)]
        $(#[$outer])*
        pub(super) enum $name {
            $($(#[$inner])* $variant,)+
        }

        impl From<$name> for $of {
            fn from(choice: $name) -> Self {
                match choice {
                    $($name::$variant => Self::$variant,)+
                }
            }
        }
    };
}

choice! {
    /// Named mesh densities.
    Density for fingertip::Density {
        /// About 12 thousand unknowns: for tests and a first look.
        Coarse,
        /// About 54 thousand unknowns: the campaigns' density.
        Medium,
        /// About 185 thousand unknowns: the reference.
        Fine,
    }
}

choice! {
    /// Laws and constants of the tissues.
    Materials for study::Materials {
        /// Neo-Hookean with the moduli of Maeno 1998 and Chen, Shuai & Zhu.
        NeoHookean,
        /// Ogden's law of Chen, Shuai & Zhu for dermis and fat.
        Ogden,
        /// The set `people`, fitted to people's fingers.
        People,
    }
}

choice! {
    /// A CalculiX type with eight nodes.
    LinearHex for calculix::LinearHex {
        /// Fully integrated displacement element; locks as nu nears 0.5.
        C3d8,
        /// With incompatible modes: bends and keeps its volume better.
        C3d8i,
        /// One point and hourglass control.
        C3d8r,
    }
}

choice! {
    /// A CalculiX type with twenty nodes, or eight in the plane.
    QuadraticHex for calculix::QuadraticHex {
        /// Eight points (`CPE8R` in the plane): hardly locks. The one to compare with.
        C3d20r,
        /// 27 points (`CPE8`): locks as nu nears 0.5.
        C3d20,
    }
}

choice! {
    /// A reading of the paper.
    #[value(rename_all = "snake_case")]
    Reading for wedge::reading::Reading {
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
}
