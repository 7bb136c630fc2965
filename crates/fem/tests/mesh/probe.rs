//! Points found in elements, and what is read there.

use papilla_fem::element::ElementKind;
use papilla_fem::mesh::block::{BlockLattice, build, even};
use papilla_fem::mesh::probe::{Probe, ProbeError, line};
use papilla_fem::mesh::sample::Sample;
use papilla_fem::mesh::{Mesh, Region};
use papilla_fem::testing::LATTICE_KINDS;
use proptest::prelude::*;

fn bent(kind: ElementKind) -> Mesh {
    let axis = || even(1.0, 4 * kind.order());
    let third = if kind.is_planar() { vec![0.0] } else { axis() };
    let layers = [Region(2), Region(2), Region(1), Region(0)];
    let lattice = BlockLattice { axes: [axis(), axis(), third], layers: layers.into(), kind };
    build(&lattice, |[x, y, z]| [x + 0.15 * (3.0 * y).sin(), y + 0.1 * x * x, z + 0.1 * x * y * z])
}

proptest! {
    /// A point given by an element and reference coordinates is found there
    /// again, and a linear field and its gradient are read off exactly.
    #[test]
    fn points_are_found_where_they_are(
        element in 0usize..16, xi in prop::array::uniform3(-0.99f64..0.99),
    ) {
        for kind in LATTICE_KINDS {
            let mesh = bent(kind);
            let mut xi = xi;
            if kind.is_planar() {
                xi[2] = 0.0;
            }
            let there = Sample::new(&mesh, 0, element, xi);
            let p = there.interpolate(&mesh, &mesh.nodes);
            let probe = Probe::new(&mesh, &[p]).unwrap();
            let [found] = probe.samples()[0].as_slice() else {
                return Err(TestCaseError::fail("in one element"));
            };
            prop_assert_eq!(found.element, element);
            for i in 0..3 {
                prop_assert!((found.xi[i] - xi[i]).abs() < 1e-9, "{:?}", kind);
            }
            let h = [[0.3, -0.2, 0.0], [0.1, 0.4, 0.0], [0.0; 3]];
            let u: Vec<[f64; 3]> = mesh.nodes.iter()
                .map(|x| std::array::from_fn(|i| (0..3).map(|j| h[i][j] * x[j]).sum()))
                .collect();
            let gradient = found.displacement_gradient(&mesh, &u);
            for i in 0..3 {
                for j in 0..3 {
                    prop_assert!((gradient[i][j] - h[i][j]).abs() < 1e-12);
                }
            }
        }
    }
}

#[test]
fn a_point_on_an_interface_has_both_sides() {
    for kind in LATTICE_KINDS {
        let mesh = bent(kind);
        let up = kind.dimension() - 1;
        // In the middle of a side between dermis and epidermis, then inside.
        let e = (0..mesh.blocks[0].len()).find(|&e| mesh.blocks[0].region[e] == Region(0)).unwrap();
        let mut xi = [0.3, 0.2, 0.1];
        xi[2] = if kind.is_planar() { 0.0 } else { xi[2] };
        let inside = Sample::new(&mesh, 0, e, xi).interpolate(&mesh, &mesh.nodes);
        xi[up] = -1.0;
        let on = Sample::new(&mesh, 0, e, xi).interpolate(&mesh, &mesh.nodes);
        let probe = Probe::new(&mesh, &[on, inside]).unwrap();
        let by: Result<_, ProbeError> =
            probe.by_region(&mesh, |s| Ok(s.interpolate(&mesh, &mesh.nodes)[0]));
        let by = by.unwrap();
        let regions = |k: usize| by[k].iter().map(|(t, _)| *t).collect::<Vec<_>>();
        assert_eq!(regions(0), [Region(0), Region(1)], "{kind:?}");
        assert_eq!(regions(1), [Region(0)], "{kind:?}");
        assert!(by[0].iter().all(|(_, x)| (x - on[0]).abs() < 1e-9));
    }
}

#[test]
fn a_node_belongs_to_every_element_around_it_and_outside_is_an_error() {
    let mesh = bent(ElementKind::Quad9);
    let inner = mesh.nodes.iter().position(|p| p[0] > 0.6 && p[1] > 0.5).unwrap();
    let at_node = |p: [f64; 3]| Probe::new(&mesh, &[p]).unwrap().samples()[0].len();
    assert!((1..=4).contains(&at_node(mesh.nodes[inner])));
    let corner_of_four = mesh.blocks[0].element(0)[2] as usize;
    assert_eq!(at_node(mesh.nodes[corner_of_four]), 4);
    let error = Probe::new(&mesh, &[mesh.nodes[0], [5.0, 0.0, 0.0]]).unwrap_err();
    assert!(matches!(error, ProbeError::Outside { index: 1, .. }));
    assert!(Probe::new(&mesh, &[[0.5, 0.5, 0.1]]).is_err(), "off the plane");
}

#[test]
fn a_line_ends_exactly_where_asked() {
    let points = line([0.1, 0.7, 0.0], [0.3, -0.9, 1.0], 7);
    assert_eq!((points.len(), points[0], points[7]), (8, [0.1, 0.7, 0.0], [0.3, -0.9, 1.0]));
}
