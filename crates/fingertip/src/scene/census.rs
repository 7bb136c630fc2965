//! The census of a scene: how much of each kind the solver assembles and stores. It is counted in
//! `forecast/census.rs`; effects name the count that is theirs.

use serde::Serialize;

/// Counts of one body and one indentation. What no effect asked for counts 0.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Census {
    /// Degrees of freedom that are solved for.
    pub unknowns: usize,
    /// Elements, each evaluated once whenever forces are.
    pub elements: usize,
    /// Quadrature points of all elements.
    pub points: usize,
    /// Entries of the tangent's lower triangle.
    pub tangent_entries: usize,
    /// Nodes that the indenter may touch; each has one normal multiplier.
    pub contact_nodes: usize,
    /// Points whose law is of finite strain, with its geometric stiffness.
    pub finite_strain_points: usize,
    /// Points with Ogden's law.
    pub ogden_points: usize,
    /// Elements of epidermis and dermis with constants of their own.
    pub layered_elements: usize,
    /// Numbers that materials with memory keep from step to step.
    pub history_numbers: usize,
    /// Unknowns of fluid pressure.
    pub pressure_unknowns: usize,
    /// Contact nodes with a tangential multiplier, bound, plane and anchor.
    pub friction_states: usize,
    /// Elements of bone.
    pub bone_elements: usize,
    /// Elements of the nail plate.
    pub nail_elements: usize,
    /// Elements in a plane.
    pub plane_elements: usize,
}
