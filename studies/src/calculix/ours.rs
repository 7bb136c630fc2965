//! Our side of a comparison: what our solver finds where CalculiX prints.

use papilla_calculix::{ElementTypes, MaterialCard};
use papilla_fem::element::Inverted;
use papilla_fem::mesh::sample::{Deformed, Sample};
use papilla_fem::solve::{Materials, Problem};
use papilla_fingertip::tissue::Tissue;
use papilla_validation::verify::CaseError;

/// What CalculiX takes the tissues for.
pub(super) type Cards = [Option<MaterialCard>; Tissue::ALL.len()];

/// The cards' laws in our solver; a tissue without a card takes the first one.
pub(super) fn laws(cards: &Cards) -> Result<Materials, CaseError> {
    let first = cards.iter().flatten().next().ok_or("no material")?;
    let models = cards.iter().map(|c| c.as_ref().unwrap_or(first).solid()).collect();
    Ok(Materials::new(models).with_stiff(&Tissue::STIFF))
}

/// SED, MPa, at the points where CalculiX prints strain, for every element of
/// the mesh in its numbering. From the strain, with the element's own dilatation.
pub(super) fn sed_mpa(
    problem: &Problem,
    types: ElementTypes,
    u: &[[f64; 3]],
) -> Result<Vec<Vec<f64>>, Inverted> {
    let body = Deformed {
        mesh: &problem.mesh,
        geometry: &problem.geometry,
        materials: &problem.materials,
        u,
        history: &|_, _| &[],
    };
    let mut all = Vec::with_capacity(problem.mesh.element_count());
    for (b, block) in problem.mesh.blocks.iter().enumerate() {
        let points = types.of(block.kind).points();
        for e in 0..block.len() {
            let sed = points.iter().map(|&xi| Sample::new(&problem.mesh, b, e, xi).sed_mpa(&body));
            all.push(sed.collect::<Result<_, _>>()?);
        }
    }
    Ok(all)
}
