//! The tangent of a biphasic body against differences of its residuals.

use super::*;
use crate::element::{BlockGeometry, Elastic, ElementKind, Materials};
use crate::linear::{SymbolicSystem, SymmetricMatrix};
use crate::mesh::Mesh;
use crate::mesh::lattice::cube;
use papilla_solid::{LinearElastic, NeoHookean};

struct Setting {
    mesh: Mesh,
    geometry: Vec<BlockGeometry>,
    materials: Materials,
    system: SymbolicSystem,
    phase: FluidPhase,
    start_mm: Vec<[f64; 3]>,
    older_mm: Vec<[f64; 3]>,
}

/// Numbers in [-1, 1) that repeat.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 1u64;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

impl Setting {
    fn new(kind: ElementKind, finite: bool) -> Self {
        let mesh = cube(kind, 1, |[x, y, z]| [x + 0.1 * x * y, y - 0.1 * z * y, z + 0.05 * x]);
        let mesh = if kind.is_planar() { cube(kind, 2, |p| p) } else { mesh };
        let mut fixed = vec![false; 3 * mesh.nodes.len()];
        mesh.hold_out_of_plane(&mut fixed);
        let geometry = mesh
            .blocks
            .iter()
            .map(|b| BlockGeometry::new(b.kind, &mesh.nodes, &b.connectivity).unwrap())
            .collect();
        let model = match finite {
            true => Elastic::shared(NeoHookean { mu_mpa: 0.1 }, 0.3),
            false => Elastic::shared(LinearElastic { mu_mpa: 0.1 }, 0.3),
        };
        let system = SymbolicSystem::new(&mesh, &fixed).unwrap();
        let strain = Some(HolmesMow { solid_share: 0.2, power: 1.0, exponent: 2.0 });
        let permeability = vec![Some(Permeability { at_rest_mm4_per_n_s: 0.4, strain })];
        let drained = Some("y_max".into());
        let phase = FluidPhase::new(&mesh, &system, FluidSpec { permeability, drained }).unwrap();
        let plane = kind.is_planar();
        let mut next = numbers();
        let mut field = |size: f64| -> Vec<[f64; 3]> {
            let one = |_: &[f64; 3]| [next(), next(), if plane { 0.0 } else { next() }];
            mesh.nodes.iter().map(one).map(|v| v.map(|c| size * c)).collect()
        };
        let (start_mm, older_mm) = (field(0.03), field(0.03));
        let materials = Materials::new(vec![model]);
        Self { mesh, geometry, materials, system, phase, start_mm, older_mm }
    }

    /// Residual, and the fluid's tangent, at unknowns `x`.
    fn at(&self, x: &[f64], matrix: Option<&mut SymmetricMatrix>) -> Vec<f64> {
        let mut u = vec![[0.0; 3]; self.mesh.nodes.len()];
        let displacements = self.system.dofs.count;
        for (v, &e) in u.as_flattened_mut().iter_mut().zip(&self.system.dofs.of_dof) {
            *v = x.get(e as usize).copied().unwrap_or(0.0);
        }
        let flow = Flow {
            pressure_mpa: &x[displacements..],
            start_mm: &self.start_mm,
            older: Some(Older { start_mm: &self.older_mm, ratio: 1.3 }),
        };
        let solid =
            Solid { mesh: &self.mesh, geometry: &self.geometry, materials: &self.materials };
        let (mut force, mut surplus) = (vec![0.0; 3 * u.len()], Vec::new());
        let mut own = self.system.zeros();
        let forces = FluidForces {
            force_n: &mut force,
            surplus_mm3: &mut surplus,
            tangent: matrix.is_some().then_some((&self.system, &mut own)),
        };
        self.phase.add(solid, &u, flow, 0.7, forces).unwrap();
        if let Some(m) = matrix {
            self.phase.assemble(solid, &u, flow, 0.7, (&self.system, &own), m).unwrap();
        }
        let mut residual = vec![0.0; x.len()];
        for (f, &e) in force.iter().zip(&self.system.dofs.of_dof) {
            if let Some(r) = residual.get_mut(e as usize) {
                *r = *f;
            }
        }
        residual[displacements..].copy_from_slice(&surplus);
        residual
    }
}

#[test]
fn the_tangent_is_the_derivative_of_both_residuals() {
    let kinds = [ElementKind::Hex27, ElementKind::Hex20, ElementKind::Tet10, ElementKind::Quad9];
    for kind in kinds {
        for finite in [true, false] {
            let setting = Setting::new(kind, finite);
            let n = setting.phase.system.len();
            assert_eq!(n, setting.system.dofs.count + setting.phase.unknowns());
            let mut next = numbers();
            let x: Vec<f64> = (0..n).map(|_| 0.03 * next()).collect();
            let d: Vec<f64> = (0..n).map(|_| next()).collect();
            let mut matrix = setting.phase.system.zeros();
            setting.at(&x, Some(&mut matrix));
            let mut product = vec![0.0; n];
            // 0 - A d.
            setting.phase.system.residual(&matrix, &vec![0.0; n], &d, &mut product);
            let h = 1e-6;
            let moved = |s: f64| {
                let to: Vec<f64> = x.iter().zip(&d).map(|(x, d)| x + s * h * d).collect();
                setting.at(&to, None)
            };
            let (plus, minus) = (moved(1.0), moved(-1.0));
            let size = product.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            for (e, p) in product.iter().enumerate() {
                let difference = (plus[e] - minus[e]) / (2.0 * h);
                let miss = (difference + p).abs() / size;
                assert!(miss < 1e-7, "{kind:?}, finite {finite}: {e} {difference} {p}");
            }
        }
    }
}
