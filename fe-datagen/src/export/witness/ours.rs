//! Our side of a comparison: what our solver finds where CalculiX prints.

use crate::element::geometry::jacobian;
use crate::element::kernel::{displacement_gradient, evaluate};
use crate::element::{ElementKind, Inverted};
use crate::export::{ElementTypes, MaterialCard};
use crate::material::{Kinematics, Material, NeoHookean};
use crate::mesh::Tissue;
use crate::solve::Problem;

/// The card's law in our solver; `None` if it has none like it.
pub(super) fn law(card: &MaterialCard) -> Option<Material> {
    match card {
        MaterialCard::NeoHookean { mu_mpa, bulk_mpa } => Some(Material {
            isochoric: NeoHookean { mu_mpa: *mu_mpa },
            bulk_mpa: *bulk_mpa,
        }),
        MaterialCard::Ogden { .. } | MaterialCard::Linear { .. } => None,
    }
}

/// Laws by tissue for a [`Problem`]; a tissue without a card takes the first one.
pub(super) fn laws(cards: &[Option<MaterialCard>; Tissue::ALL.len()]) -> Option<[Material; 5]> {
    let first = cards.iter().flatten().next().and_then(law)?;
    let mut all = [first; Tissue::ALL.len()];
    for (m, card) in all.iter_mut().zip(cards) {
        if let Some(card) = card {
            *m = law(card)?;
        }
    }
    Some(all)
}

/// SED, MPa, at the points where CalculiX prints strain, for every element of
/// the mesh in its numbering. From the strain, with the element's own dilatation.
pub(super) fn sed_mpa(
    problem: &Problem,
    types: ElementTypes,
    u: &[[f64; 3]],
) -> Result<Vec<Vec<f64>>, Inverted> {
    let mut all = Vec::with_capacity(problem.mesh.element_count());
    for (block, geometry) in problem.mesh.blocks.iter().zip(&problem.geometry) {
        let points = types.of(block.kind).points();
        let mut force = vec![[0.0; 3]; block.kind.nodes()];
        for e in 0..block.len() {
            let nodes = block.element(e);
            let local: Vec<_> = nodes.iter().map(|&n| u[n as usize]).collect();
            let x: Vec<_> = nodes.iter().map(|&n| problem.mesh.nodes[n as usize]).collect();
            let material = &problem.materials[block.tissue[e].index()];
            let state = evaluate(geometry.element(e), material, &local, &mut force, None)?;
            let sed = points.iter().map(|&xi| {
                let basis = block.kind.dilatation_basis(xi);
                let theta: f64 = basis.iter().zip(state.theta_minus_1).map(|(b, t)| b * t).sum();
                material.energy(&kinematics(block.kind, xi, &x, &local), theta)
            });
            all.push(sed.collect());
        }
    }
    Ok(all)
}

/// Deformation at the reference point `xi` of an element.
fn kinematics(kind: ElementKind, xi: [f64; 3], x: &[[f64; 3]], u: &[[f64; 3]]) -> Kinematics {
    let (mut value, mut reference) = (vec![0.0; x.len()], vec![[0.0; 3]; x.len()]);
    kind.shape(xi, &mut value, &mut reference);
    let (inverse, _) = jacobian(x.iter().copied(), &reference);
    let gradients: Vec<[f64; 3]> = reference
        .iter()
        .map(|d| std::array::from_fn(|i| (0..3).map(|k| d[k] * inverse[k][i]).sum()))
        .collect();
    Kinematics::new(displacement_gradient(u, &gradients))
}
