//! Input decks of CalculiX, a finite-element program of others.
//!
//! [`Deck`] is plain data and knows no scene; [`Deck::to_text`] writes what CalculiX 2.20 reads,
//! and [`SceneDeck`] makes one of a scene. What to know of CalculiX stands in
//! docs/reference/calculix.md.
//!
//! ```
//! use papilla_calculix::{ElementTypes, SceneDeck};
//! use papilla_fingertip::scene::Scene;
//!
//! let text = r#"
//!     [geometry]
//!     kind = "block"
//!     size_mm = [6.0, 6.0]
//!     elements = [4, 4]
//!     layers = [{ tissue = "dermis", thickness_mm = 2.0, elements = 2 }]
//!     [indenter]
//!     shape = "sphere"
//!     radius_mm = 4.0
//!     [motion]
//!     depth_mm = 0.3
//! "#;
//! let scene = SceneDeck::new(&Scene::parse("scene.toml".as_ref(), text.into())?)?;
//! let deck = scene.deck("a block under a sphere", ElementTypes::default()).to_text()?;
//! assert!(deck.contains("*ELEMENT, TYPE=C3D8"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

// Determinism is tested: the same bits, not nearly the same.
#![cfg_attr(test, allow(clippy::float_cmp))]

pub mod deck;
mod elements;
mod hanging;
mod lines;
mod material;
mod rigid;
mod scene;

pub use deck::{Deck, Indentation, StepControl};
pub use elements::{CcxElement, ElementTypes, LinearHex, QuadraticHex};
pub use material::MaterialCard;
pub use rigid::{RigidIndenter, RigidShape};
pub use scene::SceneDeck;

use papilla_fingertip::scene::Scene;

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
    /// Skin that is stretched at rest.
    #[error(
        "a deck has no tension of the skin: leave out materials.skin_tension_n_per_mm to export"
    )]
    Tension,
    /// A motion that needs an unknown of its own.
    #[error(
        "CalculiX cannot express motion.force_n: a deck prescribes where the indenter is. Give \
         motion.depth_mm; `fe-datagen solve` prints the depth that a force takes"
    )]
    Force,
    /// Pressure that follows the skin.
    #[error(
        "a deck presses with an indenter; the scene has a table [pressure] in its place, which \
         `fe-datagen solve` takes"
    )]
    Pressure,
    /// A shape that no rigid surface here stands for.
    #[error("no deck for the indenter '{shape}': plates, spheres and cylinders can be exported")]
    Indenter {
        /// Shape as scenes name it.
        shape: &'static str,
    },
    /// Reduced integration without geometric stiffness.
    #[error(
        "CPE8R has modes without energy in a geometrically linear step: CalculiX finds forces \
         several times too small. Take CPE8 (--quadratic c3d20)"
    )]
    ZeroEnergy,
    /// A cylinder's ends are not in a deck.
    #[error(
        "skin lies {beyond_mm:.2} mm beyond an end of the cylinder, and a deck leaves its ends \
         open: make indenter.length_mm larger"
    )]
    Ends {
        /// How far the contact surface goes beyond the straight part, mm.
        beyond_mm: f64,
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
    /// Nodes hang beside elements whose faces have other functions than those that they follow.
    #[error(
        "the mesh has nodes that hang, which a deck holds between C3D20 or C3D20R alone, and \
         elements of {element}"
    )]
    Hanging {
        /// CalculiX' type.
        element: &'static str,
    },
    /// Nodes that follow each other in a circle.
    #[error("node {node} follows nodes that follow it")]
    HangingCircle {
        /// Its number in the deck.
        node: usize,
    },
    /// A node cannot follow others and be where it is told.
    #[error("node {node} follows others, so its displacement cannot be prescribed")]
    HangingPrescribed {
        /// Its number in the deck.
        node: usize,
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
    #[error(
        "{shape:?} is not a shape: sizes have to be positive, edges no rounder than half a side"
    )]
    Shape {
        /// The shape.
        shape: RigidShape,
    },
}

/// What a deck cannot hold, as scenes name it, and what CalculiX 2.20 does instead.
const INEXPRESSIBLE: [(&str, &str); 3] = [
    ("viscoelastic", "it reads *VISCOELASTIC and ignores it"),
    (
        "friction",
        "its penalty friction sticks by a spring that slips in any load step, so the force depends \
         on increments and on a stiffness that is not a property of skin",
    ),
    ("biphasic", "it has no elements with pore pressure"),
];

/// Refuses a scene's effect that a deck cannot express.
fn refuse_inexpressible(scene: &Scene) -> Result<(), ExportError> {
    if scene.materials.skin_tension_n_per_mm.is_some() {
        return Err(ExportError::Tension);
    }
    match INEXPRESSIBLE.iter().find(|(effect, _)| scene.has(effect)) {
        Some(&(effect, why)) => Err(ExportError::Effect { effect, why }),
        None => Ok(()),
    }
}

/// A number in at most the 20 characters that CalculiX reads of a field.
fn number(v: f64) -> String {
    format!("{v:.12E}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Under a name that no effect has, nothing would be refused.
    #[test]
    fn what_a_deck_cannot_hold_is_an_effect() {
        for (effect, _) in INEXPRESSIBLE {
            assert!(papilla_fingertip::scene::EffectName::named(effect).is_some(), "{effect}");
        }
    }

    #[test]
    fn tense_skin_is_refused() {
        let mut scene = Scene::usual();
        assert_eq!(refuse_inexpressible(&scene), Ok(()));
        scene.materials.skin_tension_n_per_mm = Some(0.01);
        assert_eq!(refuse_inexpressible(&scene), Err(ExportError::Tension));
    }

    #[test]
    fn numbers_fit_their_field() {
        for v in [-1.0 / 3.0e123, 2.0 / 3.0e-123, -0.0, 1e20] {
            let text = number(v);
            assert!(text.len() <= 20, "{text}");
            let back: f64 = text.parse().unwrap();
            assert!((back - v).abs() <= 1e-12 * v.abs(), "{text}");
        }
    }
}
