//! The influence operator against the solver that makes datasets, and against itself.

use super::*;
use crate::scene::Pose;
use crate::simulation::drive::{Approach, Drive};
use crate::simulation::record::{IncrementRecord, relative_l2};
use crate::tissue::Tissue;
use papilla_atlas::PA_PER_MPA;
use papilla_fem::mesh::recovery::SedRecovery;
use papilla_fem::solve::{Loading, Options};
use std::collections::HashMap;
use std::sync::OnceLock;

fn finger() -> &'static (Body, InfluenceOperator) {
    static FINGER: OnceLock<(Body, InfluenceOperator)> = OnceLock::new();
    FINGER.get_or_init(|| {
        let body =
            body(&Default::default(), Density::Coarse, Order::Linear, &TissueTable::default())
                .unwrap();
        let operator = build(&body, &mut |_| ()).unwrap();
        (body, operator)
    })
}

fn skin(body: &Body) -> Vec<[f64; 3]> {
    let patch = &body.patch.as_ref().unwrap().patch;
    patch.skin.iter().map(|&n| body.problem.mesh.nodes[n as usize]).collect()
}

#[test]
fn systems_are_solved_and_work_is_reciprocal() {
    let (_, operator) = finger();
    assert!(operator.quality.residual_relative < 1e-10, "{:?}", operator.quality);
    assert!(operator.quality.reciprocity_relative < 1e-10, "{:?}", operator.quality);
    assert!(operator.g.iter().all(|g| g.is_finite()));
    assert!(operator.area_mm2.iter().all(|a| *a > 0.0));
}

/// Pressure spread over the pad, put on the body as dead forces and solved by the solver
/// of indentations: the influence operator's displacements are its, and what is left between
/// the two is how strain or SED is averaged from faces to vertices.
#[test]
fn a_smooth_pressure_gives_the_sed_that_the_solver_gives() {
    let (body, operator) = finger();
    let (x, patch) = (skin(body), &body.patch.as_ref().unwrap().patch);
    let lowest = x.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    let bottom = x.iter().find(|p| p[2] <= lowest).unwrap();
    // 1 kPa, a Gaussian 4 mm wide.
    let square = |p: &[f64; 3]| (0..3).map(|i| (p[i] - bottom[i]).powi(2)).sum::<f64>();
    let pressure_pa: Vec<f64> = x.iter().map(|p| 1e3 * (-square(p) / 32.0).exp()).collect();
    let surface = &body.problem.mesh.surfaces[&body.contact];
    let loads = super::build::loads(&body.problem, surface, &patch.skin);
    let mut dead_n = vec![[0.0; 3]; body.problem.mesh.nodes.len()];
    for (load, p) in loads.iter().zip(&pressure_pa) {
        dead_n[load.node as usize] = load.force_n.map(|f| f * p / PA_PER_MPA);
    }
    let options = Options { residual_tolerance: 1e-10, ..Options::default() };
    let mut solver = body.solver(options).unwrap();
    solver.start(Loading { dead_n, ..Loading::default() });
    solver.advance_to(1.0).unwrap();
    let strain = strain::StrainMap::new(&body.problem, &patch.interface).unwrap();
    let averaged = strain.average(&strain.apply(|n| solver.displacement_mm()[n as usize]));
    let mesh = &body.problem.mesh;
    let recovery =
        SedRecovery::new(mesh, "interface", Tissue::Dermis.region(), &patch.interface).unwrap();
    let history = |b, e| solver.history_of(b, e);
    let recorded: Vec<f64> = recovery
        .sed_mpa(&body.deformed(&solver, &history))
        .unwrap()
        .into_iter()
        .map(|s| s * PA_PER_MPA)
        .collect();
    let square = |strain: &strain::Weighted| strain.iter().map(|s| s * s).sum::<f64>();
    let from_strain: Vec<f64> = averaged.iter().map(|s| PA_PER_MPA * square(s)).collect();
    let found = operator.sed_j_per_m3(&pressure_pa).unwrap();
    let by_face = operator.recorded_sed_j_per_m3(&pressure_pa).unwrap();
    let [same, exact] =
        [(&found, &from_strain), (&by_face, &recorded)].map(|(a, b)| relative_l2(a, b));
    let recovered = relative_l2(&found, &recorded);
    println!(
        "solver's strain {same:.1e}, recorded SED by face {exact:.1e}, by vertex {recovered:.4}"
    );
    assert!(same < 1e-5 && exact < 1e-5, "f32 storage and the solver's tolerance: {same} {exact}");
    assert!(recovered < 0.1, "averaging strain instead of SED: {recovered}");
    // A mean's square is at most the mean of squares.
    assert!(found.iter().zip(&recorded).all(|(f, r)| *f <= r * (1.0 + 1e-4)));
}

/// A real indentation at small strain: pressure and SED as a dataset records them. What is left
/// by face is where its forces point: along the plate's normal, to which the skin has
/// turned, not along the skin's at rest. That recorded pressure is per deformed area
/// matters little: the nominal traction does no better.
#[test]
fn a_press_of_small_strain_is_reproduced() {
    let (body, operator) = finger();
    for (depth_mm, accepted) in [(0.02, 0.03), (0.1, 0.03), (1.0, 0.45)] {
        let (record, nominal_mpa) = press(body, depth_mm);
        let pa = |v: &[f64]| v.iter().map(|x| x * PA_PER_MPA).collect::<Vec<_>>();
        let (recorded, pressure) = (pa(&record.sed_dermis_mpa), pa(&record.pressure_mpa));
        let by_face = operator.recorded_sed_j_per_m3(&pressure).unwrap();
        let by_vertex = operator.sed_j_per_m3(&pressure).unwrap();
        let by_nominal = operator.recorded_sed_j_per_m3(&pa(&nominal_mpa)).unwrap();
        let [difference, averaged, nominal] =
            [by_face, by_vertex, by_nominal].map(|s| relative_l2(&s, &recorded));
        println!(
            "plate at {depth_mm} mm: by face {difference:.4}, with nominal traction {nominal:.4}; \
             by vertex {averaged:.4}"
        );
        assert!(averaged >= difference);
        assert!(
            difference < accepted && nominal < accepted,
            "{depth_mm} mm: {difference} {nominal}"
        );
    }
}

/// The record of a tilted indentation and its traction per undeformed area at the skin's vertices.
fn press(body: &Body, depth_mm: f64) -> (IncrementRecord, Vec<f64>) {
    let mut solver = body.solver(Options::default()).unwrap();
    let pose = Pose { pitch_deg: 15.0, ..Pose::default() };
    let (approach, drive) = (Approach::plate(pose), Drive::Depths(vec![depth_mm]));
    let mut last = None;
    let keep = &mut |_: &papilla_fem::solve::Solver<'_>, r: &IncrementRecord, _: &_| {
        last = Some(r.clone());
    };
    body.press(&mut solver, &approach, &drive, 1, keep).unwrap();
    let contact = body.problem.contact.as_ref().unwrap();
    let of_node: HashMap<u32, f64> =
        contact.nodes().iter().copied().zip(solver.traction_mpa().iter().copied()).collect();
    let skin = &body.patch.as_ref().unwrap().patch.skin;
    (last.unwrap(), skin.iter().map(|n| of_node.get(n).copied().unwrap_or(0.0)).collect())
}

#[test]
fn mirrored_pressure_gives_mirrored_sed() {
    let (body, operator) = finger();
    let x = skin(body);
    let key = |p: &[f64; 3], sign: f64| [p[0], sign * p[1] + 0.0, p[2]].map(f64::to_bits);
    let at: HashMap<_, _> = x.iter().enumerate().map(|(i, p)| (key(p, 1.0), i)).collect();
    let twin: Vec<usize> = x.iter().map(|p| at[&key(p, -1.0)]).collect();
    let pressure: Vec<f64> = (0..x.len()).map(|j| 1e3 * (j % 7) as f64).collect();
    let mirrored: Vec<f64> = twin.iter().map(|&j| pressure[j]).collect();
    let a = operator.sed_j_per_m3(&pressure).unwrap();
    let b = operator.sed_j_per_m3(&mirrored).unwrap();
    let b: Vec<f64> = twin.iter().map(|&j| b[j]).collect();
    assert!(relative_l2(&a, &b) < 1e-5, "{}", relative_l2(&a, &b));
}

#[test]
fn zero_pressure_gives_zero_and_twice_the_pressure_four_times_the_sed() {
    let (_, operator) = finger();
    let v = operator.vertices();
    assert!(operator.sed_j_per_m3(&vec![0.0; v]).unwrap().iter().all(|s| *s == 0.0));
    let [once, twice] = [1e3, 2e3].map(|p| operator.sed_j_per_m3(&vec![p; v]).unwrap());
    assert!(once.iter().zip(&twice).all(|(a, b)| (4.0 * a - b).abs() <= 1e-12 * b && *a > 0.0));
    let error = operator.sed_j_per_m3(&[1.0]).unwrap_err();
    assert!(matches!(error, InfluenceError::Pressures { found: 1, .. }), "{error}");
}

#[test]
fn what_is_not_linear_is_refused() {
    let finite = Body::usual(Density::Coarse).unwrap();
    let error = build(&finite, &mut |_| ()).unwrap_err();
    assert!(matches!(error, InfluenceError::FiniteStrain), "{error}");
}

/// Gaussian pressure on the pad as dead forces on the finger of finite strain. What compliance
/// and second order leave of the solver's displacement is of third order: a tenth of the load
/// leaves some thousandth of it.
#[test]
fn displacement_is_that_of_the_solver_to_second_order() {
    let rest = &finger().0;
    let compliance = compliance(rest, &mut |_| ()).unwrap();
    let x = skin(rest);
    let bottom = x.iter().min_by(|a, b| a[2].total_cmp(&b[2])).unwrap();
    let square = |p: &[f64; 3]| (0..3).map(|i| (p[i] - bottom[i]).powi(2)).sum::<f64>();
    let load: Load = (0..x.len())
        .filter(|&i| square(&x[i]) < 16.0)
        .map(|i| (i as u32, [0.0, 0.0, 0.02 * (-square(&x[i]) / 8.0).exp()]))
        .collect();
    let body = Body::usual(Density::Coarse).unwrap();
    let loads = [load.clone()];
    let second = second_order(&body, &compliance, &loads, [1, 1], &mut |_| ()).unwrap();
    assert_eq!((second.modes, second.outputs), (1, 1));
    let patch = &body.patch.as_ref().unwrap().patch;
    let left = |part: f64| {
        let scaled: Load = load.iter().map(|(v, f)| (*v, f.map(|f| part * f))).collect();
        let mut dead_n = vec![[0.0; 3]; body.problem.mesh.nodes.len()];
        let mut z = 0.0;
        for (v, f) in &scaled {
            dead_n[patch.skin[*v as usize] as usize] = *f;
            z += (0..3)
                .map(|i| f[i] * f64::from(second.projection[3 * *v as usize + i]))
                .sum::<f64>();
        }
        let options = Options { residual_tolerance: 1e-10, ..Options::default() };
        let mut solver = body.solver(options).unwrap();
        solver.start(Loading { dead_n, ..Loading::default() });
        solver.advance_to(1.0).unwrap();
        let found: Vec<f64> =
            patch.skin.iter().flat_map(|&n| solver.displacement_mm()[n as usize]).collect();
        let first = compliance.displacement(&scaled);
        let c = z * z * f64::from(second.products[0]);
        let both: Vec<f64> =
            first.iter().zip(&second.displacements).map(|(u, d)| u + c * f64::from(*d)).collect();
        let miss =
            |a: &[f64]| a.iter().zip(&found).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        (miss(&first), miss(&both))
    };
    let ((first, both), (first_of_tenth, of_tenth)) = (left(1.0), left(0.1));
    println!(
        "left by first order {first:.3e} {first_of_tenth:.3e}, second {both:.3e} {of_tenth:.3e}"
    );
    assert!((80.0..125.0).contains(&(first / first_of_tenth)), "second order is quadratic");
    assert!(both < 0.3 * first && of_tenth < 0.03 * first_of_tenth, "{both} {of_tenth}");
}

#[test]
fn compliance_is_symmetric_and_gives_way_to_a_push() {
    let (body, operator) = finger();
    let found = compliance(body, &mut |_| ()).unwrap();
    assert_eq!(found.atlas_hash, operator.atlas_hash);
    let size = 3 * found.area_mm2.len();
    let largest = found.mm_per_n.iter().copied().fold(0.0, f32::max);
    for i in 0..size {
        assert!(found.mm_per_n[i * size + i] >= 0.0);
        for k in 0..i {
            let [a, b] = [found.mm_per_n[i * size + k], found.mm_per_n[k * size + i]];
            assert!((a - b).abs() <= 1e-6 * largest, "{i} {k}: {a} {b}");
        }
    }
    let unit = |n: &[f32; 3]| (n.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-5;
    assert!(found.normal.iter().all(unit));
}
