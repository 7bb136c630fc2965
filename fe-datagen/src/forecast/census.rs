//! What a scene makes the solver assemble and store, counted.

use crate::mesh::Tissue;
use crate::press::setup::Setup;
use crate::scene::Scene;
use crate::scene::effects::Law;
use serde::Serialize;

/// Counts of one body and one press. What no effect asked for counts 0.
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
    /// Contact nodes with a tangential multiplier, bound, plane and anchor.
    pub friction_states: usize,
    /// Elements of bone.
    pub bone_elements: usize,
    /// Elements of the nail plate.
    pub nail_elements: usize,
    /// Elements in a plane.
    pub plane_elements: usize,
}

impl Census {
    /// Counts what `setup` made of `scene`.
    #[must_use]
    pub fn new(scene: &Scene, setup: &Setup) -> Self {
        let problem = &setup.body.problem;
        let contact_nodes = problem.contact.as_ref().map_or(0, |c| c.nodes().len());
        let mut census = Self {
            unknowns: problem.structure.equations.count,
            tangent_entries: problem.structure.row.len(),
            contact_nodes,
            history_numbers: problem.memory.as_ref().map_or(0, |m| m.len),
            friction_states: if setup.approach.friction > 0.0 { contact_nodes } else { 0 },
            ..Self::default()
        };
        for (block, geometry) in problem.mesh.blocks.iter().zip(&problem.geometry) {
            for &tissue in &block.tissue {
                census.add(scene, setup, tissue, geometry.points);
            }
            if block.kind.is_planar() {
                census.plane_elements += block.len();
            }
        }
        census
    }

    fn add(&mut self, scene: &Scene, setup: &Setup, tissue: Tissue, points: usize) {
        self.elements += 1;
        self.points += points;
        if setup.body.problem.materials[tissue.index()].is_finite_strain() {
            self.finite_strain_points += points;
        }
        let source = setup.plan.tissues[tissue.index()];
        if setup.plan.law == Law::Ogden && scene.materials.of(source).ogden.is_some() {
            self.ogden_points += points;
        }
        match tissue {
            Tissue::Epidermis | Tissue::Dermis if source == tissue => self.layered_elements += 1,
            Tissue::Bone => self.bone_elements += 1,
            Tissue::Nail => self.nail_elements += 1,
            _ => {}
        }
    }
}
