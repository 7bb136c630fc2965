//! Bodies that cannot be full of fluid.

use crate::bodies::rectangle;
use papilla_fem::biphasic::{FluidError, FluidSpec, Permeability, PermeabilityError};
use papilla_fem::element::{Elastic, ElementKind, Materials, Region};
use papilla_fem::mesh::Mesh;
use papilla_fem::mesh::lattice::cube;
use papilla_fem::mesh::supports::hold;
use papilla_fem::solve::{Problem, ProblemError};
use papilla_solid::LinearElastic;

fn with(mesh: Mesh, permeability: Option<f64>, drained: Option<&str>) -> Result<(), FluidError> {
    let fixed = hold(&mesh, &[("y_min", [true; 3])]);
    let law = LinearElastic { mu_mpa: 0.1 };
    let materials = Materials::new(vec![Elastic::shared(law, 0.2)]);
    let spec = FluidSpec {
        permeability: vec![permeability.map(Permeability::constant)],
        drained: drained.map(Into::into),
    };
    match Problem::new(mesh, materials, fixed, None).unwrap().with_fluid(spec) {
        Ok(_) => Ok(()),
        Err(ProblemError::Fluid(e)) => Err(e),
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn a_body_that_cannot_be_full_of_fluid_is_refused() {
    let mesh = || rectangle([1.0, 1.0], [2, 2]);
    assert!(with(mesh(), Some(0.0), None).is_ok(), "shut and sealed is undrained");
    assert!(matches!(
        with(mesh(), Some(0.0), Some("y_max")),
        Err(FluidError::ShutBehindDrain { region: Region(0) })
    ));
    assert!(matches!(
        with(mesh(), Some(-1.0), None),
        Err(FluidError::Permeability { source: PermeabilityError::Value(-1.0), .. })
    ));
    assert!(matches!(with(mesh(), None, None), Err(FluidError::NoFluid)));
    assert!(matches!(with(mesh(), Some(1.0), Some("skin")), Err(FluidError::Missing(_))));
    let linear = cube(ElementKind::Hex8, 2, |p| p);
    assert!(matches!(
        with(linear, Some(1.0), None),
        Err(FluidError::Linear { kind: ElementKind::Hex8 })
    ));
}
