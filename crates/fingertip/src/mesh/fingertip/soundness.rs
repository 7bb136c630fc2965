//! Whether the elements of a finger's mesh are well shaped, and where not.

use super::{Density, FingertipShapeError, Order, Parts, build};
use crate::geometry::fingertip::offset::uv;
use crate::geometry::fingertip::{FingertipShape, SCALED_JACOBIAN_MIN};
use crate::mesh::half_cube::MEDIUM;
use crate::mesh::quality;
use crate::tissue::Tissue;

/// The least scaled Jacobian of the soft tissue, on the even mesh of medium density and on the base
/// of the graded one.
///
/// # Errors
/// [`FingertipShapeError::Distorted`] says which tissue is below [`SCALED_JACOBIAN_MIN`] and where;
/// others as [`build`].
pub fn check_elements(shape: &FingertipShape) -> Result<f64, FingertipShapeError> {
    let mut least = f64::INFINITY;
    for order in [Order::Linear, Order::Graded] {
        let finger = build(shape, Density::Medium, order, Parts::default(), None)?;
        let lattice;
        let parameters = match &finger.refined {
            Some(refined) => &refined.grid.parameters,
            None => {
                lattice = MEDIUM.build(1, &MEDIUM.body_fractions(shape));
                &lattice.parameters
            }
        };
        for tissue in [Tissue::Epidermis, Tissue::Dermis, Tissue::Subcutaneous] {
            let found = quality::of(&finger.mesh, tissue);
            least = least.min(found.scaled_jacobian_min);
            if !(found.scaled_jacobian_min > SCALED_JACOBIAN_MIN) {
                // Nodes lie layer by layer below those of the skin.
                let s = parameters[found.worst_node as usize % parameters.len()];
                let ([u, v], at_mm) = (uv(s), finger.mesh.nodes[found.worst_node as usize]);
                return Err(FingertipShapeError::Distorted {
                    tissue: tissue.name(),
                    region: shape.region(s),
                    u,
                    v,
                    at_mm,
                    scaled_jacobian: found.scaled_jacobian_min,
                });
            }
        }
    }
    Ok(least)
}
