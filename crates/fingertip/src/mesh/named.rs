//! Meshes of the finger that have a name on the command line.

use super::fingertip::{Density, Order};

/// One mesh of the finger.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshChoice {
    /// Its name on the command line.
    pub name: &'static str,
    /// Density.
    pub density: Density,
    /// Elements and layout.
    pub order: Order,
    /// What it is.
    pub about: &'static str,
}

/// Every mesh, from cheap to dear within a layout; the last is the reference.
pub const MESHES: [MeshChoice; 7] = [
    MeshChoice {
        name: "medium-linear",
        density: Density::Medium,
        order: Order::Linear,
        about: "even lattice, Hex8",
    },
    MeshChoice {
        name: "medium-quadratic",
        density: Density::Medium,
        order: Order::Quadratic,
        about: "even lattice, Hex27",
    },
    MeshChoice {
        name: "fine-linear",
        density: Density::Fine,
        order: Order::Linear,
        about: "even lattice, Hex8",
    },
    MeshChoice {
        name: "fine-quadratic",
        density: Density::Fine,
        order: Order::Quadratic,
        about: "even lattice, Hex27",
    },
    MeshChoice {
        name: "coarse-graded",
        density: Density::Coarse,
        order: Order::Graded,
        about: "cells split under the indenter, graded layers, Hex27",
    },
    MeshChoice {
        name: "medium-graded",
        density: Density::Medium,
        order: Order::Graded,
        about: "the same, nodes .14 mm apart under a radius of 1 mm: the teacher",
    },
    MeshChoice {
        name: "fine-graded",
        density: Density::Fine,
        order: Order::Graded,
        about: "the same, .075 mm apart, more layers: the reference",
    },
];
