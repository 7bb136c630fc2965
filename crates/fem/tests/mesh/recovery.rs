//! Strain energy density on either side of an interface.

use papilla_fem::element::{BlockGeometry, ConstitutiveModel, Elastic, ElementKind, Materials};
use papilla_fem::mesh::FaceKind;
use papilla_fem::mesh::block::{BlockLattice, build, even};
use papilla_fem::mesh::recovery::SedRecovery;
use papilla_fem::mesh::sample::Deformed;
use papilla_fem::mesh::{Mesh, Region, Surface};
use papilla_fem::testing::LATTICE_KINDS;
use papilla_solid::NeoHookean;
use papilla_solid::tensor::Kinematics;
use std::sync::Arc;

/// Poisson's ratio 0.45.
fn material(e_mpa: f64) -> Arc<dyn ConstitutiveModel> {
    Elastic::shared(NeoHookean { mu_mpa: e_mpa / 2.9 }, e_mpa / 0.3)
}

/// A unit cube or square of two layers, the interface half way, edges curved.
fn layered(kind: ElementKind, elements: usize) -> Mesh {
    let axis = || even(1.0, elements * kind.order());
    let third = if kind.is_planar() { vec![0.0] } else { axis() };
    let layers =
        (0..elements).map(|l| if 2 * l < elements { Region(1) } else { Region(0) }).collect();
    let up = kind.dimension() - 1;
    let mut mesh = build(&BlockLattice { axes: [axis(), axis(), third], layers, kind }, |mut p| {
        p[up] *= 1.0 + 0.1 * (2.0 * p[0]).sin();
        p
    });
    // The upper sides of the lower layer's top elements.
    let b = &mesh.blocks[0];
    let top = if kind.is_planar() { 2 } else { 5 };
    let per_layer = b.len() / elements;
    let connectivity = (0..per_layer)
        .flat_map(|e| {
            let nodes = b.element(per_layer * (elements / 2 - 1) + e);
            papilla_fem::mesh::surface::side_nodes(kind, top).into_iter().map(|a| nodes[a])
        })
        .collect();
    let surface = Surface { kind: FaceKind::of(kind), connectivity };
    mesh.surfaces.insert("interface".into(), surface);
    mesh
}

fn recover(mesh: &Mesh, region: Region, u: &[[f64; 3]]) -> (Vec<u32>, Vec<f64>) {
    let nodes = mesh.surfaces["interface"].nodes();
    let recovery = SedRecovery::new(mesh, "interface", region, &nodes).unwrap();
    let sed = read(mesh, &recovery, u);
    (nodes, sed)
}

fn read(mesh: &Mesh, recovery: &SedRecovery, u: &[[f64; 3]]) -> Vec<f64> {
    let b = &mesh.blocks[0];
    let geometry = [BlockGeometry::new(b.kind, &mesh.nodes, &b.connectivity).unwrap()];
    let materials = Materials::new([2.0, 1.0, 1.0, 1.0, 1.0].map(material).into());
    recovery
        .sed_mpa(&Deformed {
            mesh,
            geometry: &geometry,
            materials: &materials,
            u,
            history: &|_, _| &[],
        })
        .unwrap()
}

/// Even strain: both sides exact, with the jump of the moduli between them.
#[test]
fn sed_of_an_even_strain_is_exact_on_both_sides() {
    let h = [[0.1, 0.05, 0.0], [-0.02, -0.08, 0.0], [0.0; 3]];
    let exact = |e| {
        let k = Kinematics::new(h);
        material(e).stored_mpa(&k, k.j_minus_1, &[])
    };
    for kind in LATTICE_KINDS {
        let mesh = layered(kind, 4);
        let u: Vec<[f64; 3]> = mesh
            .nodes
            .iter()
            .map(|x| std::array::from_fn(|i| (0..3).map(|j| h[i][j] * x[j]).sum()))
            .collect();
        for (region, e) in [(Region(1), 1.0), (Region(0), 2.0)] {
            for sed in recover(&mesh, region, &u).1 {
                assert!((sed / exact(e) - 1.0).abs() < 1e-12, "{kind:?} {region:?}");
            }
        }
    }
}

/// On a smooth displacement errors fall with the mesh: `Hex27` and `Quad9` by
/// the square of its size; the others at least in proportion to it.
#[test]
fn sed_converges_at_the_interface() {
    let field = |x: [f64; 3]| [0.1 * (1.7 * x[1]).sin(), 0.1 * (1.3 * x[0] + x[1]).cos(), 0.0];
    let gradient = |x: [f64; 3]| {
        let s = -0.1 * (1.3 * x[0] + x[1]).sin();
        [[0.0, 0.17 * (1.7 * x[1]).cos(), 0.0], [1.3 * s, s, 0.0], [0.0; 3]]
    };
    for kind in LATTICE_KINDS {
        let error = |elements: usize| {
            let mesh = layered(kind, elements);
            let u: Vec<_> = mesh.nodes.iter().map(|&x| field(x)).collect();
            let (nodes, sed) = recover(&mesh, Region(1), &u);
            let mut worst = 0.0f64;
            for (&n, found) in nodes.iter().zip(sed) {
                let k = Kinematics::new(gradient(mesh.nodes[n as usize]));
                let exact = material(1.0).stored_mpa(&k, k.j_minus_1, &[]);
                worst = worst.max((found - exact).abs());
            }
            worst
        };
        let (coarse, fine) = (error(6), error(12));
        let order = (coarse / fine).log2();
        let least = if kind.dilatation_functions() > 1 { 1.7 } else { 0.8 };
        assert!(order > least, "{kind:?}: order {order}, error {fine}");
    }
}

/// The displacement of a manufactured field that varies in depth, solved for: elements have the
/// strain of its best approximation, not of its interpolant, which is what Gauss points are
/// better at. Here the nodal interpolant stands for it; fits still are of higher order than
/// readings at nodes, at the interface and not below it.
#[test]
fn fits_are_closer_than_readings_at_nodes() {
    let field = |x: [f64; 3]| {
        let wave = (4.0 * x[0]).sin() * (3.0 * x[1]).cos() * (-2.0 * x[2]).exp();
        [0.03 * wave, -0.02 * wave, 0.04 * wave]
    };
    let gradient = |x: [f64; 3]| {
        let (s, c) = (4.0 * x[0]).sin_cos();
        let (t, d) = (3.0 * x[1]).sin_cos();
        let e = (-2.0 * x[2]).exp();
        let g = [4.0 * c * d * e, -3.0 * s * t * e, -2.0 * s * d * e];
        [0.03, -0.02, 0.04].map(|a| g.map(|v| a * v))
    };
    let error = |elements: usize, fitted: bool| {
        let mesh = layered(ElementKind::Hex27, elements);
        let u: Vec<_> = mesh.nodes.iter().map(|&x| field(x)).collect();
        let nodes = mesh.surfaces["interface"].nodes();
        let recovery = if fitted {
            SedRecovery::fitted(&mesh, "interface", Region(1), &nodes)
        } else {
            SedRecovery::new(&mesh, "interface", Region(1), &nodes)
        };
        let sed = read(&mesh, &recovery.unwrap(), &u);
        let (mut miss, mut size) = (0.0, 0.0);
        for (&n, found) in nodes.iter().zip(sed) {
            let k = Kinematics::new(gradient(mesh.nodes[n as usize]));
            let exact = material(1.0).stored_mpa(&k, k.j_minus_1, &[]);
            miss += (found - exact).powi(2);
            size += exact * exact;
        }
        f64::sqrt(miss / size)
    };
    let (nodes, coarse, fine) = (error(6, false), error(4, true), error(6, true));
    assert!(fine < nodes, "fits {fine}, nodes {nodes}");
    let order = (coarse / fine).ln() / 1.5f64.ln();
    assert!(order > 2.0, "order {order}: {coarse} {fine}");
}

#[test]
fn a_layer_that_does_not_reach_the_surface_is_an_error() {
    let mesh = layered(ElementKind::Quad4, 4);
    let nodes = mesh.surfaces["interface"].nodes();
    let error = SedRecovery::new(&mesh, "interface", Region(4), &nodes).unwrap_err();
    assert_eq!(error.region, Region(4));
}
