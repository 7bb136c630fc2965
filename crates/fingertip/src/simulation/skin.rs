//! What a stored state says beyond pressure and SED, where a scene gives rise to it.

use super::body::Body;
use papilla_fem::element::geometry::displacement_gradient;
use papilla_fem::solve::Solver;
use papilla_solid::tensor::Kinematics;

impl Body {
    /// True (Cauchy) shear traction of the indenter on the skin at `nodes`, MPa per
    /// deformed area; empty without friction.
    pub(super) fn shear_mpa(&self, solver: &Solver<'_>, nodes: &[u32]) -> Vec<[f64; 3]> {
        let nominal = solver.shear_traction_mpa();
        let (Some(contact), false) = (&self.problem.contact, nominal.is_empty()) else {
            return Vec::new();
        };
        let x = solver.deformed();
        let mut deformed = vec![0.0; x.len()];
        let surface = &self.problem.mesh.surfaces[&self.contact];
        surface.add_nodal_areas(&|n| x[n as usize], &mut deformed);
        let mut shear = vec![[0.0; 3]; x.len()];
        for ((&n, &area), t) in contact.nodes().iter().zip(contact.area_mm2()).zip(nominal) {
            shear[n as usize] = t.map(|v| v * area / deformed[n as usize]);
        }
        nodes.iter().map(|&n| shear[n as usize]).collect()
    }

    /// Share of the undeformed volume that has left the stretches to which its law was
    /// fitted; 0 for laws that hold anywhere.
    pub(super) fn outside_calibration(&self, solver: &Solver<'_>) -> f64 {
        let (problem, u) = (&self.problem, solver.displacement_mm());
        let (mut outside, mut all) = (0.0, 0.0);
        for (block, geometry) in problem.mesh.blocks.iter().zip(&problem.geometry) {
            let n = block.kind.nodes();
            for e in 0..block.len() {
                let solid = &problem.materials[block.region[e]];
                let local: Vec<_> = block.element(e).iter().map(|&a| u[a as usize]).collect();
                let shape = geometry.element(e);
                for (gradients, weight) in shape.gradients.chunks_exact(n).zip(shape.weights) {
                    let k = Kinematics::new(displacement_gradient(&local, gradients));
                    all += weight;
                    if solid.outside_calibration(&k) {
                        outside += weight;
                    }
                }
            }
        }
        outside / all
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::Scene;
    use crate::simulation::Simulation;
    use crate::simulation::record::IncrementRecord;
    use papilla_fem::contact::ContactRule;
    use papilla_fem::solve::{Options, Solver, StepReport};
    use std::path::Path;

    /// A block of skin, pressed and dragged.
    fn scene(extra: &str) -> Scene {
        let text = format!(
            "{extra}
            [geometry]
            kind = \"block\"
            size_mm = [6.0, 6.0]
            elements = [8, 8]
            layers = [{{ tissue = \"dermis\", thickness_mm = 2.0, elements = 3 }}]
            [indenter]
            shape = \"sphere\"
            radius_mm = 4.0
            [motion]
            path = [{{ time_s = 1.0, depth_mm = 0.5 }},
                    {{ time_s = 2.0, depth_mm = 0.5, shift_mm = [0.4, 0.1] }}]"
        );
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.toml");
        std::fs::write(&path, text).unwrap();
        Scene::read(Path::new(&path)).unwrap()
    }

    /// At nodes, and within faces under a bar 1.5 mm wide.
    #[test]
    fn shear_traction_carries_the_tangential_force() {
        let friction = "effects = [\"finite_strain\", \"friction\"]\nfriction.coefficient = 0.4";
        let ball = scene(friction);
        let mut bar = ball.clone();
        bar.indenter =
            toml::from_str("shape = \"plate\"\nsize_mm = [1.5, 4.0]\nedge_radius_mm = 0.5")
                .unwrap();
        for (scene, rule) in [(ball, ContactRule::Nodal), (bar, ContactRule::Gauss)] {
            shear_carries_the_drag(&scene, rule);
        }
    }

    fn shear_carries_the_drag(scene: &Scene, rule: ContactRule) {
        let Simulation { body, approach, drive, .. } = Simulation::new(scene).unwrap();
        assert_eq!(body.indenter(&approach, &drive).unwrap().contact, rule);
        let mut solver = body.solver(Options::default()).unwrap();
        body.press(&mut solver, &approach, &drive, 1, &mut |_, _, _| ()).unwrap();
        let surface = &body.problem.mesh.surfaces[&body.contact];
        let nodes = surface.nodes();
        let shear = body.shear_mpa(&solver, &nodes);
        let x = solver.deformed();
        let mut area = vec![0.0; x.len()];
        surface.add_nodal_areas(&|n| x[n as usize], &mut area);
        let balance = solver.balance();
        for i in 0..3 {
            let sum: f64 = nodes.iter().zip(&shear).map(|(&n, s)| area[n as usize] * s[i]).sum();
            let due = balance.contact_force_n[i] - balance.normal_force_n[i];
            let size = balance.contact_force_n[2].abs();
            assert!((sum - due).abs() < 1e-9 * size, "{i}: {sum} against {due}");
        }
        // The indenter drags the skin along, and no node rubs more than it is pressed.
        let drag = balance.contact_force_n[0] - balance.normal_force_n[0];
        assert!(drag > 0.1 * balance.contact_force_n[2], "{drag}");
        // Bounds settle to a part of the largest.
        let pressure = solver.pressure_mpa(surface);
        let slack = 5e-3 * 0.4 * pressure.iter().copied().fold(0.0, f64::max);
        for (&n, s) in nodes.iter().zip(&shear) {
            let size = papilla_vector::norm(*s);
            assert!(size <= 0.4 * pressure[n as usize] + slack, "{size}");
        }
    }

    #[test]
    fn without_friction_and_limits_there_is_nothing_to_say() {
        let Simulation { body, approach, drive, .. } = Simulation::new(&scene("")).unwrap();
        let mut solver = body.solver(Options::default()).unwrap();
        body.press(&mut solver, &approach, &drive, 1, &mut |_, _, _| ()).unwrap();
        assert!(body.shear_mpa(&solver, &[0, 1]).is_empty());
        assert!(body.outside_calibration(&solver).abs() < f64::MIN_POSITIVE);
    }

    #[test]
    fn what_leaves_its_calibration_is_flagged() {
        // Chen, Shuai & Zhu's skin, squeezed to half its thickness by a small ball.
        let mut deep = scene("effects = [\"finite_strain\", \"layers\", \"hyperelastic\"]");
        deep.indenter = toml::from_str("shape = \"sphere\"\nradius_mm = 1.5").unwrap();
        deep.motion.path = None;
        deep.motion.depth_mm = Some(1.0);
        deep.motion.increments = 5;
        let mut shallow = deep.clone();
        shallow.motion.depth_mm = Some(0.05);
        let [little, much] = [shallow, deep].map(|scene| {
            let Simulation { body, approach, drive, .. } = Simulation::new(&scene).unwrap();
            let mut solver = body.solver(Options::default()).unwrap();
            let mut flags = Vec::new();
            let keep = &mut |_: &Solver<'_>, r: &IncrementRecord, _: &StepReport| {
                flags.push(r.outside_calibration);
            };
            body.press(&mut solver, &approach, &drive, 1, keep).unwrap();
            *flags.last().unwrap()
        });
        assert!(little.abs() < f64::MIN_POSITIVE, "{little}");
        assert!(much > 0.0 && much < 0.5, "{much}");
    }
}
