//! Contact of the skin with a rigid indenter; friction is in [`friction`].
//!
//! Augmented Lagrangian at points of the contact surface ([`ContactRule`]) with their
//! share of the area as weight. The potential, per undeformed area,
//!
//! `1/(2 eps) (t^2 - lambda^2)`,  `t = max(0, lambda - eps gap)`,
//!
//! has the traction `t` along the indenter's normal as its derivative by the point's
//! place and a symmetric tangent.

pub mod friction;
pub mod points;

pub use friction::{FrictionPoint, FrictionTrial, PointFriction};
pub use points::{ContactPoints, ContactRule, Support};

use crate::mesh::Surface;
use papilla_sdf::Distance;
use std::collections::BTreeMap;

/// Nodes that may touch, with their share of the undeformed area, `integral N_a dA`.
#[derive(Clone, Debug)]
pub struct ContactSurface {
    nodal: ContactPoints,
    gauss: ContactPoints,
    gauss_order_3: ContactPoints,
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
        let (nodes, area_mm2) = by_node.into_iter().unzip();
        let nodal = ContactPoints::nodes(nodes, area_mm2);
        let within = |rule: &[_]| ContactPoints::faces(surface, rule, positions, &nodal.node);
        let gauss = within(&surface.kind.contact_points());
        let gauss_order_3 = within(&surface.kind.quadrature());
        Self { nodal, gauss, gauss_order_3 }
    }

    /// Mesh nodes, sorted.
    #[must_use]
    pub fn nodes(&self) -> &[u32] {
        &self.nodal.node
    }

    /// Nodal area, mm2.
    #[must_use]
    pub fn area_mm2(&self) -> &[f64] {
        &self.nodal.area_mm2
    }

    /// Distance of neighbours, mm: the side of the square of a node's mean area.
    #[must_use]
    pub fn spacing_mm(&self) -> f64 {
        let area = self.area_mm2();
        let mean_area = area.iter().sum::<f64>() / area.len().max(1) as f64;
        mean_area.sqrt()
    }

    /// Pressure per deformed area at each node, MPa, of the tractions at points (MPa per
    /// undeformed area) where `surface` is at the positions `x`.
    #[must_use]
    pub(crate) fn pressure_mpa(
        &self,
        rule: ContactRule,
        traction_mpa: &[f64],
        surface: &Surface,
        x: &[[f64; 3]],
    ) -> Vec<f64> {
        let points = self.points(rule);
        let Some(deformed) = self.deformed_points(rule, surface, x) else {
            return self.nodal_pressure_mpa(traction_mpa, surface, x);
        };
        let force_and_area = points.shared_out(
            |q| [traction_mpa[q] * points.area_mm2[q], deformed.area_mm2[q]],
            self.nodes(),
        );
        force_and_area.iter().map(|[f, a]| if *a > 0.0 { f / a } else { 0.0 }).collect()
    }

    /// The Gauss points of a rule where `surface` is at the positions `x`; `None` at nodes.
    #[must_use]
    pub(crate) fn deformed_points(
        &self,
        rule: ContactRule,
        surface: &Surface,
        x: &[[f64; 3]],
    ) -> Option<ContactPoints> {
        let places = match rule {
            ContactRule::Nodal => return None,
            ContactRule::Gauss => surface.kind.contact_points(),
            ContactRule::GaussOrder3 => surface.kind.quadrature(),
        };
        Some(ContactPoints::faces(surface, &places, x, self.nodes()))
    }

    fn nodal_pressure_mpa(
        &self,
        traction_mpa: &[f64],
        surface: &Surface,
        x: &[[f64; 3]],
    ) -> Vec<f64> {
        let mut deformed = vec![0.0; x.len()];
        surface.add_nodal_areas(&|n| x[n as usize], &mut deformed);
        let nodes = self.nodes().iter().zip(self.area_mm2()).zip(traction_mpa);
        nodes.map(|((&n, &area), t)| t * area / deformed[n as usize]).collect()
    }

    /// Where contact is found.
    #[must_use]
    pub const fn points(&self, rule: ContactRule) -> &ContactPoints {
        match rule {
            ContactRule::Nodal => &self.nodal,
            ContactRule::Gauss => &self.gauss,
            ContactRule::GaussOrder3 => &self.gauss_order_3,
        }
    }
}

/// Energy, force and tangent of one contact point.
#[derive(Clone, Copy, Debug)]
pub struct PointContact {
    /// Augmented potential, mJ.
    pub energy_mj: f64,
    /// Nominal normal traction, MPa per undeformed area; zero when apart.
    pub traction_mpa: f64,
    /// Derivative of the potential by the point's place, N.
    pub force_n: [f64; 3],
    /// Second derivative, N/mm.
    pub stiffness: [[f64; 3]; 3],
    /// What the indenter's curvature takes from it, N/mm: a point on a convex edge
    /// is pushed off it. `None` on a flat or hollow side.
    pub curvature: Option<[[f64; 3]; 3]>,
}

impl PointContact {
    /// Contact of one point; `None` when it is apart and its multiplier is zero.
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
