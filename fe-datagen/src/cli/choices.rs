//! The choices that options accept, and the variants of the libraries that they stand for.

use papilla_calculix as calculix;
use papilla_fingertip::mesh::fingertip;

/// Makes a choice of the command line that stands for an enumeration of the same variants.
macro_rules! choice {
    ($(#[$outer:meta])* $name:ident for $of:path { $($(#[$inner:meta])* $variant:ident,)+ }) => {
        #[derive(Clone, Copy, Debug, clap::ValueEnum)]
        $(#[$outer])*
        pub enum $name {
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
