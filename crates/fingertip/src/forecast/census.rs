//! Counts what a scene makes the solver assemble and store: fills in its [`Census`].

use crate::scene::effects::Law;
use crate::scene::{Census, Scene};
use crate::simulation::Simulation;
use crate::tissue::Tissue;

/// Counts what `setup` made of `scene`.
#[must_use]
pub fn census(scene: &Scene, setup: &Simulation) -> Census {
    let problem = &setup.body.problem;
    let contact_nodes = problem.contact.as_ref().map_or(0, |c| c.nodes().len());
    let pressure_unknowns = problem.fluid.as_ref().map_or(0, |f| f.unknowns());
    let mut census = Census {
        unknowns: problem.system.dofs.count + pressure_unknowns,
        pressure_unknowns,
        tangent_entries: problem
            .fluid
            .as_ref()
            .map_or(problem.system.row.len(), |f| f.system.entries()),
        contact_nodes,
        history_numbers: problem.history_layout.as_ref().map_or(0, |m| m.len),
        friction_states: if setup.approach.friction > 0.0 { contact_nodes } else { 0 },
        ..Census::default()
    };
    for (block, geometry) in problem.mesh.blocks.iter().zip(&problem.geometry) {
        for &region in &block.region {
            add(&mut census, scene, setup, Tissue::of(region), geometry.points);
        }
        if block.kind.is_planar() {
            census.plane_elements += block.len();
        }
    }
    census
}

fn add(census: &mut Census, scene: &Scene, setup: &Simulation, tissue: Tissue, points: usize) {
    census.elements += 1;
    census.points += points;
    if setup.body.problem.materials[tissue.region()].is_finite_strain() {
        census.finite_strain_points += points;
    }
    let source = setup.plan.tissues[tissue.index()];
    if setup.plan.law == Law::Ogden && scene.materials.of(source).ogden.is_some() {
        census.ogden_points += points;
    }
    match tissue {
        Tissue::Epidermis | Tissue::Dermis if source == tissue => census.layered_elements += 1,
        Tissue::Bone => census.bone_elements += 1,
        Tissue::Nail => census.nail_elements += 1,
        _ => {}
    }
}
