//! Contact of the skin with a rigid indenter; friction is in [`friction`].
//!
//! Augmented Lagrangian at the nodes of the contact surface with their share
//! of the area, `integral N_a dA`, as weight: one multiplier a node is what the
//! displacement space can control, so pressure does not oscillate.
//! The potential, per undeformed area,
//!
//! `1/(2 eps) (t^2 - lambda^2)`,  `t = max(0, lambda - eps gap)`,
//!
//! has the traction `t` along the indenter's normal as its derivative and a
//! symmetric tangent on the node's own diagonal block.

pub mod friction;

pub use friction::{FrictionNode, FrictionTrial, NodeFriction};

use crate::indenter::Distance;
use crate::mesh::Surface;
use std::collections::BTreeMap;

/// Nodes that may touch, with their share of the undeformed area.
#[derive(Clone, Debug)]
pub struct ContactSurface {
    /// Mesh nodes, sorted.
    pub nodes: Vec<u32>,
    /// Nodal area, mm2.
    pub area_mm2: Vec<f64>,
}

impl ContactSurface {
    /// Contact nodes of `surface` on the undeformed `positions`, but those of
    /// which every degree of freedom is prescribed.
    #[must_use]
    pub fn new(surface: &Surface, positions: &[[f64; 3]], fixed: &[bool]) -> Self {
        let mut area = vec![0.0; positions.len()];
        surface.add_nodal_areas(&|n| positions[n as usize], &mut area);
        let by_node: BTreeMap<u32, f64> = surface
            .nodes()
            .into_iter()
            .filter(|&n| (0..3).any(|i| !fixed[3 * n as usize + i]))
            .map(|n| (n, area[n as usize]))
            .filter(|&(_, a)| a > 0.0)
            .collect();
        Self { nodes: by_node.keys().copied().collect(), area_mm2: by_node.into_values().collect() }
    }
}

/// Energy, force and tangent of one contact node.
#[derive(Clone, Copy, Debug)]
pub struct NodeContact {
    /// Augmented potential, mJ.
    pub energy_mj: f64,
    /// Nominal normal traction, MPa per undeformed area; zero when apart.
    pub traction_mpa: f64,
    /// Derivative of the potential by the node's position, N.
    pub force_n: [f64; 3],
    /// Second derivative, N/mm.
    pub stiffness: [[f64; 3]; 3],
    /// What the indenter's curvature takes from it, N/mm: a node on a convex edge
    /// is pushed off it. `None` on a flat or hollow side.
    pub curvature: Option<[[f64; 3]; 3]>,
}

impl NodeContact {
    /// Contact of one node; `None` when it is apart and its multiplier is zero.
    #[must_use]
    pub fn new(d: &Distance, area: f64, multiplier_mpa: f64, penalty: f64) -> Option<Self> {
        let t = multiplier_mpa - penalty * d.gap_mm;
        if t <= 0.0 {
            if multiplier_mpa == 0.0 {
                return None;
            }
            return Some(Self {
                energy_mj: -0.5 * area * multiplier_mpa * multiplier_mpa / penalty,
                traction_mpa: 0.0,
                force_n: [0.0; 3],
                stiffness: [[0.0; 3]; 3],
                curvature: None,
            });
        }
        let n = d.normal;
        let convex = (0..3).map(|i| d.hessian[i][i]).sum::<f64>() > 0.0;
        Some(Self {
            energy_mj: 0.5 * area * (t * t - multiplier_mpa * multiplier_mpa) / penalty,
            traction_mpa: t,
            force_n: n.map(|v| -area * t * v),
            stiffness: std::array::from_fn(|i| {
                std::array::from_fn(|j| area * (penalty * n[i] * n[j] - t * d.hessian[i][j]))
            }),
            curvature: convex.then(|| d.hessian.map(|row| row.map(|h| area * t * h))),
        })
    }
}
