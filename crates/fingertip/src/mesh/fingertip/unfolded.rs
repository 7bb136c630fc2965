//! Graded meshes without folded elements.
//!
//! Where a large cell borders on small ones, their middle nodes on its edge lie on the parabola
//! through its nodes, in every layer from skin to bone. Where the bone narrows behind its tuft
//! within the length of a large cell, the parabola leaves the bone. Small cells there are narrow,
//! since the bone is thin: a middle node then passes the nodes beside it, and its element folds. Halved
//! cells follow the bone more closely.

use super::{FingertipMesh, FingertipShapeError, Order, Parts, Resolution};
use crate::geometry::fingertip::FingertipShape;
use crate::mesh::refined::Refined;
use papilla_fem::element::geometry;
use std::collections::BTreeSet;

/// Times that cells are halved, and the mesh is made anew, before folds are left as they are.
const ROUNDS_MAX: usize = 8;

/// A graded mesh; cells of its grid are halved until no element of soft tissue or bone is folded. One
/// without folds is that of [`super::layered`]. Folds that stay are for [`super::blame()`] to explain.
pub(super) fn layered(
    shape: &FingertipShape,
    resolution: &Resolution,
    parts: Parts,
    refined: Refined,
) -> Result<FingertipMesh, FingertipShapeError> {
    let mut finger = super::layered(shape, resolution, Order::Graded, parts, Some(refined))?;
    for _ in 0..ROUNDS_MAX {
        let folded = folded(&finger);
        let refined = finger.refined.as_ref().filter(|_| !folded.is_empty());
        let Some(halved) = refined.and_then(|r| r.halved(shape, &folded)) else { break };
        finger = super::layered(shape, resolution, Order::Graded, parts, Some(halved))?;
    }
    Ok(finger)
}

/// Cells of the grid below which an element is folded.
pub(super) fn folded(finger: &FingertipMesh) -> BTreeSet<usize> {
    let cells = finger.refined.as_ref().map_or(0, |r| r.grid.cells.len());
    // A nail plate is the block behind it.
    let Some(block) = finger.mesh.blocks.first().filter(|_| cells > 0) else {
        return BTreeSet::new();
    };
    // Elements lie layer by layer below the cells.
    let folded = geometry::folded(block.kind, &finger.mesh.nodes, &block.connectivity);
    folded.into_iter().map(|e| e % cells).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::fingertip::{Density, build, build_guide, check_elements};
    use crate::mesh::grading::{Coming, Contact, Spacing};
    use papilla_sdf::{IndenterSpec, Placement};
    use std::path::Path;

    /// Numbers that were fitted to a hand model's index finger. Its bone narrows within 2.1 mm, where
    /// the default finger's does within 4.7 mm.
    fn with_a_short_neck() -> FingertipShape {
        FingertipShape {
            length_mm: 20.19,
            width_mm: 14.06,
            height_mm: 12.17,
            cap_length_mm: 11.95,
            cap_exponent: 2.195,
            crease_depth_mm: 0.0,
            epidermis_mm: 0.173,
            dermis_mm: 0.867,
            bone_tip_mm: 3.72,
            bone_cap_mm: 5.31,
            bone_offset_mm: 1.86,
            bone_tuft_mm: [6.05, 2.8],
            bone_waist_mm: [4.43, 3.73],
            bone_base_mm: [8.06, 6.06],
            nail_mm: [8.87, 12.74],
            nail_tip_mm: 2.12,
            ..FingertipShape::default()
        }
    }

    fn pressed(
        shape: &FingertipShape,
        indenter: &str,
        [pitch, roll, yaw]: [f64; 3],
        offset_mm: [f64; 2],
    ) -> Contact {
        let spec: IndenterSpec = toml::from_str(indenter).unwrap();
        let coming = Coming {
            shape: &spec.build(Path::new("")).unwrap(),
            rotation: Placement::turned(pitch, roll, yaw, [0.0; 3]).rotation,
            top_mm: spec.top_mm(),
            offset_mm,
            depths_mm: vec![0.4, 0.8],
            slides_mm: Vec::new(),
        };
        Contact::new(shape, &coming).unwrap()
    }

    const EDGE: &str = "shape = 'plate'\nsize_mm = [1.0, 8.0]\nedge_radius_mm = 0.2";
    const PLATE: &str = "shape = 'plate'\nsize_mm = [20.0, 20.0]\nedge_radius_mm = 1.0";

    #[test]
    fn cells_that_fold_are_halved_until_none_does() {
        let shape = with_a_short_neck();
        check_elements(&shape).unwrap();
        let (density, parts) = (Density::Medium, Parts::default());
        let resolution = density.resolution(Order::Graded);
        let mut folding = 0;
        for (indenter, angles, offset_mm) in [
            (EDGE, [8.28, 22.92, 81.32], [1.36, -1.14]),
            (PLATE, [7.21, 20.15, -13.89], [0.0; 2]),
            (PLATE, [0.25, -12.09, -50.17], [0.0; 2]),
        ] {
            let contact = pressed(&shape, indenter, angles, offset_mm);
            let spacing = Spacing::new(&shape, &contact, density.closeness());
            for spacing in [spacing.clone(), spacing.with(Density::Coarse.closeness())] {
                let refined = Refined::new(&shape, Some(spacing));
                let cells = refined.grid.cells.len();
                let as_wanted = super::super::layered(
                    &shape,
                    &resolution,
                    Order::Graded,
                    parts,
                    Some(refined.clone()),
                );
                let before = folded(&as_wanted.unwrap()).len();
                let finger = layered(&shape, &resolution, parts, refined).unwrap();
                let more = finger.refined.as_ref().unwrap().grid.cells.len() - cells;
                println!(
                    "{indenter:?}: {before} of {cells} cells fold; {more} more, and none does"
                );
                assert!(folded(&finger).is_empty(), "{indenter:?} {angles:?}");
                assert_eq!(before > 0, more > 0, "cells are halved only where some fold");
                assert!(more <= 8 * before, "{more} cells more for {before} that fold");
                folding += before;
            }
            let finger = build(&shape, density, Order::Graded, parts, Some(&contact)).unwrap();
            assert!(folded(&finger).is_empty());
            let (guide, _) = build_guide(&shape, density, parts, &finger).unwrap().unwrap();
            assert!(folded(&guide).is_empty());
        }
        assert!(folding > 1, "without halving some of these meshes fold");
    }
}
