//! A problem and kinds of elements that tests of this crate and of others share.

use crate::element::{Elastic, ElementKind, Materials};
use crate::mesh::block::even;
use crate::mesh::lattice::{REGION, intervals, lattice};
use crate::mesh::supports::hold;
use crate::solve::{Loading, MovingIndenter, Problem, ProblemError};
use papilla_sdf::{Placement, RoundedPlate};
use papilla_solid::{NeoHookean, moduli};
use std::sync::Arc;

/// Elements that a lattice is made of.
pub const LATTICE_KINDS: [ElementKind; 6] = [
    ElementKind::Hex8,
    ElementKind::Hex20,
    ElementKind::Hex27,
    ElementKind::Quad4,
    ElementKind::Quad8,
    ElementKind::Quad9,
];

/// A quarter of a 10 x 10 x 5 mm block (E 0.1 MPa), bonded below and squeezed by 0.75 mm with a
/// smooth plate; of planar elements half of a 10 x 5 mm section, 1 mm long. The number is the axis
/// of the squeeze.
///
/// # Errors
/// As [`Problem::new`].
pub fn squeezed_block(
    kind: ElementKind,
    cells: usize,
    nu: f64,
) -> Result<(Problem, Loading, usize), ProblemError> {
    let n = intervals(kind) * cells;
    let mesh = lattice(kind, [even(5.0, n), even(5.0, n), even(5.0, n)], |p| p);
    let up = kind.dimension() - 1;
    let (held, touched) = [("y_min", "y_max"), ("z_min", "z_max")][up - 1];
    let mut sides = vec![("x_min", [true, false, false]), (held, [true; 3])];
    // Upside down: the plate presses with its local +z face.
    let rotation = if kind.is_planar() {
        [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    } else {
        sides.push(("y_min", [false, true, false]));
        [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]
    };
    let fixed = hold(&mesh, &sides);
    let [mu_mpa, bulk_mpa] = moduli(0.1, nu);
    let model = Elastic::shared(NeoHookean { mu_mpa }, bulk_mpa);
    let materials = Materials::new(vec![model; REGION.index() + 1]);
    let problem = Problem::new(mesh, materials, fixed, Some(touched))?;
    let plate = Arc::new(RoundedPlate { half_mm: [20.0, 20.0, 2.0], edge_radius_mm: 0.5 });
    let along = |v: f64| std::array::from_fn(|i| if i == up { v } else { 0.0 });
    let start = Placement { rotation, origin_mm: along(7.0) };
    let indenter = MovingIndenter::straight(plate, start, along(-0.75));
    Ok((problem, Loading { indenter: Some(indenter), ..Loading::default() }, up))
}
