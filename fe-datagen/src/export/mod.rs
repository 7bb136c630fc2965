//! CalculiX as an independent witness: decks out, results back in.
//!
//! [`Deck`] is plain data and knows no scene; [`Deck::to_text`] writes what
//! CalculiX 2.20 reads, [`Ccx`] runs it and [`Dat`] reads what it prints. The
//! cases that compare both codes are in [`witness`]. What to know of CalculiX
//! stands in docs/calculix.md.

mod dat;
mod deck;
mod elements;
mod material;
mod rigid;
mod run;
pub mod witness;

pub use dat::{Dat, DatError, Quantity, Table};
pub use deck::{Deck, Press, StepControl};
pub use elements::{CcxElement, ElementTypes, LinearHex, QuadraticHex};
pub use material::MaterialCard;
pub use rigid::{RigidIndenter, RigidShape};
pub use run::{Ccx, CcxError, CpuClock, Run};

/// Why a body cannot be written as a CalculiX deck.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum ExportError {
    /// CalculiX would leave the effect out, or solve something else in its place.
    #[error("CalculiX cannot express the effect '{effect}': {why}. Switch it off to export")]
    Effect {
        /// Effect as scenes name it.
        effect: &'static str,
        /// What CalculiX does with it.
        why: &'static str,
    },
    /// A material would be misread.
    #[error("material of {tissue}: {why}")]
    Material {
        /// Tissue.
        tissue: &'static str,
        /// What is wrong.
        why: String,
    },
    /// Elements are made of a tissue without a material.
    #[error("the mesh has elements of {tissue}, which has no material")]
    NoMaterial {
        /// Tissue.
        tissue: &'static str,
    },
    /// The contact surface is missing.
    #[error("the mesh has no surface named '{name}'; it has: {known}")]
    NoSurface {
        /// Name that was asked for.
        name: String,
        /// Names that exist.
        known: String,
    },
    /// A face of the contact surface is no face of an element.
    #[error("the face with nodes {nodes:?} of surface '{name}' belongs to no element")]
    LooseFace {
        /// Surface.
        name: String,
        /// Its nodes, from 0.
        nodes: Vec<u32>,
    },
    /// The indenter has no size, or its edges are rounder than it is thick.
    #[error("{shape:?} is no shape: sizes have to be positive, edges no rounder than half a side")]
    Shape {
        /// The shape.
        shape: RigidShape,
    },
}

/// Effects that a deck cannot hold, as scenes name them, and what CalculiX
/// 2.20 does instead.
const INEXPRESSIBLE: [(&str, &str); 3] = [
    ("viscoelastic", "it reads *VISCOELASTIC and ignores it"),
    (
        "friction",
        "its penalty friction sticks by a spring that slips in any load step, so the force depends \
         on increments and on a stiffness that is no property of skin",
    ),
    ("poroelastic", "it has no elements with pore pressure"),
];

/// Refuses the first of `effects` (names as in scenes) that CalculiX cannot express.
///
/// # Errors
/// [`ExportError::Effect`] names it and says what CalculiX would do.
pub fn refuse_inexpressible<'a>(
    effects: impl IntoIterator<Item = &'a str>,
) -> Result<(), ExportError> {
    for name in effects {
        if let Some(&(effect, why)) = INEXPRESSIBLE.iter().find(|(effect, _)| *effect == name) {
            return Err(ExportError::Effect { effect, why });
        }
    }
    Ok(())
}

/// A number in at most the 20 characters that CalculiX reads of a field.
fn number(v: f64) -> String {
    format!("{v:.12E}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_fit_their_field() {
        for v in [-1.0 / 3.0e123, 2.0 / 3.0e-123, -0.0, 1e20] {
            let text = number(v);
            assert!(text.len() <= 20, "{text}");
            let back: f64 = text.parse().unwrap();
            assert!((back - v).abs() <= 1e-12 * v.abs(), "{text}");
        }
    }

    #[test]
    fn an_effect_that_calculix_ignores_is_named() {
        assert_eq!(refuse_inexpressible(["finite_strain", "layers"]), Ok(()));
        let refused = refuse_inexpressible(["layers", "viscoelastic"]).unwrap_err();
        assert!(matches!(refused, ExportError::Effect { effect: "viscoelastic", .. }));
        assert!(refused.to_string().contains("ignores"), "{refused}");
    }
}
