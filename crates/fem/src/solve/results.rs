//! What can be asked of a solver at an equilibrium.

use super::evaluate::Balance;
use super::problem::Problem;
use super::stepping::Solver;
use crate::contact::ContactRule;
use crate::linear::DofMap;
use papilla_sdf::Distance;

impl<'a> Solver<'a> {
    /// Displacement, mm, one a mesh node.
    #[must_use]
    pub fn displacement_mm(&self) -> &[[f64; 3]] {
        &self.state.u
    }

    /// The problem being solved.
    #[must_use]
    pub fn problem(&self) -> &'a Problem {
        self.newton.problem
    }

    /// Where on the skin contact is found.
    #[must_use]
    pub fn contact_rule(&self) -> ContactRule {
        self.loading.contact()
    }

    /// Pressure of the fluid at the nodes, MPa: 0 where there is none or it leaves; empty of a body
    /// without.
    #[must_use]
    pub fn fluid_pressure_mpa(&self) -> Vec<f64> {
        match (&self.newton.problem.fluid, &self.state.fluid) {
            (Some(phase), Some(fluid)) => {
                phase.at_nodes_mpa(&self.newton.problem.mesh, &fluid.pressure_mpa)
            }
            _ => Vec::new(),
        }
    }

    /// Nominal traction of each contact node, MPa per undeformed area.
    #[must_use]
    pub fn traction_mpa(&self) -> Vec<f64> {
        let found = self.newton.current.traction_mpa.iter().map(|&t| [t]);
        self.at_contact_nodes(found.collect()).into_iter().map(|[t]| t).collect()
    }

    /// What contact points carry, as tractions of the contact nodes with the same force.
    fn at_contact_nodes<const N: usize>(&self, found: Vec<[f64; N]>) -> Vec<[f64; N]> {
        let rule = self.contact_rule();
        match &self.newton.problem.contact {
            Some(c) if rule.is_gauss() => c.points(rule).to_nodes(&found, c.nodes(), c.area_mm2()),
            _ => found,
        }
    }

    /// Contact force along a straight path, N.
    #[must_use]
    pub fn force_along_path_n(&self) -> f64 {
        let force = self.newton.current.contact_force_n;
        let travel = self.loading.indenter.as_ref().and_then(|m| m.straight_travel());
        travel.map_or(0.0, |(_, direction)| (0..3).map(|i| force[i] * direction[i]).sum())
    }

    /// Distance of the point `x` (mm) to the indenter where it is now; `None` without one.
    #[must_use]
    pub fn distance(&self, x: [f64; 3]) -> Option<Distance> {
        Some(self.loading.indenter.as_ref()?.distance(self.state.fraction, x))
    }

    /// Load fraction reached.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        self.state.fraction
    }

    /// Work of the indenter so far, mJ.
    #[must_use]
    pub fn indenter_work_mj(&self) -> f64 {
        self.loading.indenter.as_ref().map_or(0.0, |m| self.work.total_mj(m))
    }

    /// Work of pressure so far, mJ, on straight ways of the nodes from equilibrium to equilibrium.
    #[must_use]
    pub fn pressure_work_mj(&self) -> f64 {
        self.work.pressure_mj
    }

    /// Largest amount of the indenter's work at an equilibrium so far, mJ: what energies are
    /// small against once the indenter has given its work back.
    #[must_use]
    pub fn indenter_work_mj_max(&self) -> f64 {
        self.indenter_work_mj().abs().max(self.work.largest_mj)
    }

    /// History of an element's quadrature points at the equilibrium; empty for
    /// elastic materials.
    #[must_use]
    pub fn history_of(&self, block: usize, element: usize) -> &[f64] {
        let layout = self.newton.problem.history_layout.as_ref();
        layout.map_or(&[], |m| &self.state.history[m.range(block, element)])
    }

    /// Tangential traction of the indenter on each contact node, MPa per
    /// undeformed area; empty without friction.
    #[must_use]
    pub fn shear_traction_mpa(&self) -> Vec<[f64; 3]> {
        let found = &self.newton.current.friction;
        if found.is_empty() {
            return Vec::new();
        }
        self.at_contact_nodes(found.iter().map(|t| t.map(|v| -v)).collect())
    }

    /// Forces of indenter and supports, and the integral of true pressure.
    #[must_use]
    pub fn balance(&self) -> Balance {
        let problem = self.newton.problem;
        let e = &self.newton.current;
        let mut balance = Balance {
            contact_force_n: e.contact_force_n,
            normal_force_n: e.normal_force_n,
            ..Balance::default()
        };
        for (dof, &eq) in problem.system.dofs.of_dof.iter().enumerate() {
            if eq == DofMap::FIXED {
                balance.support_force_n[dof % 3] += e.residual_n[dof];
            }
        }
        balance
    }

    /// True (Cauchy) pressure at every mesh node, MPa: the nominal traction
    /// times undeformed over deformed area.
    #[must_use]
    pub fn pressure_mpa(&self, surface: &crate::mesh::Surface) -> Vec<f64> {
        let problem = self.newton.problem;
        let x = self.deformed();
        let mut pressure = vec![0.0; x.len()];
        if let Some(contact) = &problem.contact {
            let traction = &self.newton.current.traction_mpa;
            let found = contact.pressure_mpa(self.contact_rule(), traction, surface, &x);
            for (&n, p) in contact.nodes().iter().zip(found) {
                pressure[n as usize] = p;
            }
        }
        pressure
    }

    /// Force that a nodal pressure (MPa) exerts on the deformed surface, N, along the indenter's
    /// normal: at the points of contact, or by Gauss quadrature where these are the nodes.
    #[must_use]
    pub fn force_of_pressure_n(
        &self,
        surface: &crate::mesh::Surface,
        pressure: &[f64],
    ) -> [f64; 3] {
        let x = self.deformed();
        let normal = |x| self.distance(x).map_or([0.0; 3], |d| d.normal);
        let mut total = [0.0; 3];
        let contact = self.newton.problem.contact.as_ref();
        let rule = self.contact_rule();
        if let Some(points) = contact.and_then(|c| c.deformed_points(rule, surface, &x)) {
            // The direction at a node is the mean of those at points around it, by their forces
            // (shorter than 1 where they differ).
            let tractions = &self.newton.current.traction_mpa;
            let push = |q: usize| {
                let force_n = tractions[q] * contact.map_or(0.0, |c| c.points(rule).area_mm2[q]);
                let direction = if force_n > 0.0 {
                    normal(points.support(q).of(|n| x[n])).map(|v| v * force_n)
                } else {
                    [0.0; 3]
                };
                [points.area_mm2[q], force_n, direction[0], direction[1], direction[2]]
            };
            let nodes = contact.map_or(&[][..], |c| c.nodes());
            for (&n, [area, force_n, d @ ..]) in nodes.iter().zip(points.shared_out(push, nodes)) {
                if force_n > 0.0 {
                    let scale = pressure[n as usize] * area / force_n;
                    total = std::array::from_fn(|i| total[i] + scale * d[i]);
                }
            }
            return total;
        }
        let mut traction = vec![[0.0; 3]; x.len()];
        for n in surface.nodes().into_iter().map(|n| n as usize).filter(|&n| pressure[n] > 0.0) {
            traction[n] = normal(x[n]).map(|v| v * pressure[n]);
        }
        let rule = surface.kind.quadrature();
        surface.integrate(&rule, &|n| x[n as usize], &mut |face, value, area| {
            let area = papilla_vector::norm(area);
            for (&n, v) in face.iter().zip(value) {
                for i in 0..3 {
                    total[i] += v * area * traction[n as usize][i];
                }
            }
        });
        total
    }

    /// Deformed node positions, mm.
    #[must_use]
    pub fn deformed(&self) -> Vec<[f64; 3]> {
        let nodes = &self.newton.problem.mesh.nodes;
        nodes.iter().zip(&self.state.u).map(|(x, u)| std::array::from_fn(|i| x[i] + u[i])).collect()
    }
}
