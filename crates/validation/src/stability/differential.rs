//! Random small problems solved in every way there is.

use super::lab::{scene, tight};
use super::{Hardness, Line, Suite};
use crate::verify::bodies::noise;
use crate::verify::{CaseError, Check};
use papilla_fem::linear::{Elimination, SymbolicSystem};
use papilla_fem::solve::{Effort, Loading, Options, Problem, StepReport};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::record::relative_l2;

/// A repeatable draw of a problem.
struct Draw {
    seed: u64,
    count: u64,
}

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.count += 1;
        let unit = 0.5 * (1.0 + noise(self.seed.wrapping_mul(1 << 20).wrapping_add(self.count)));
        low + (high - low) * unit
    }
}

/// Difference in force, relative, up to which linear and quadratic elements on the coarse mesh
/// agree; where they do not, a mesh of half the size has to bring them together.
const ORDERS_APART: f64 = 0.08;
/// By this factor at least.
const ORDERS_CLOSER: f64 = 0.7;

/// A layered block under a sphere, a plate or a cylinder, at an angle and aside; `per` times as many
/// elements each way as the coarse mesh.
fn random_scene(seed: u64, order: &str, per: u32) -> String {
    let mut d = Draw { seed, count: 0 };
    let size = [d.between(4.0, 8.0), d.between(4.0, 8.0)];
    let thickness = [d.between(0.5, 1.5), d.between(1.0, 3.0)];
    let moduli = [d.between(0.05, 0.3), d.between(0.01, 0.1)];
    let ratios = [d.between(0.3, 0.49), d.between(0.3, 0.49)];
    // The same nodes: a quadratic element has those of eight linear ones.
    let per = if order == "linear" { 2 * per } else { per };
    let radius = d.between(3.0, 8.0);
    let indenter = match seed % 3 {
        0 => format!("shape = \"sphere\"\nradius_mm = {radius:?}"),
        1 => format!("shape = \"cylinder\"\nradius_mm = {radius:?}\nlength_mm = 30.0"),
        _ => "shape = \"plate\"\nsize_mm = [20.0, 20.0]".into(),
    };
    let tilt = if seed % 3 == 2 { 0.3 } else { 1.0 };
    let (pitch, roll) = (d.between(-15.0, 15.0) * tilt, d.between(-15.0, 15.0) * tilt);
    let depth = d.between(0.1, 0.25) * (thickness[0] + thickness[1]);
    format!(
        "[geometry]
        kind = \"block\"
        order = \"{order}\"
        size_mm = {size:?}
        elements = {:?}
        layers = [{{ tissue = \"dermis\", thickness_mm = {:?}, elements = {} }},
                  {{ tissue = \"subcutaneous\", thickness_mm = {:?}, elements = {} }}]
        [materials.dermis]
        youngs_modulus_mpa = {:?}
        poissons_ratio = {:?}
        [materials.subcutaneous]
        youngs_modulus_mpa = {:?}
        poissons_ratio = {:?}
        [indenter]
        {indenter}
        [motion]
        depth_mm = {depth:?}
        pitch_deg = {pitch:?}
        roll_deg = {roll:?}",
        [4 * per, 4 * per],
        thickness[0],
        per,
        thickness[1],
        2 * per,
        moduli[0],
        ratios[0],
        moduli[1],
        ratios[1],
    )
}

/// What one way of solving found.
struct Found {
    u: Vec<f64>,
    force_n: [f64; 3],
    report: StepReport,
}

impl Found {
    /// Relative L2 difference of displacements, and of force if that is larger.
    fn from(&self, other: &Self) -> f64 {
        let force = relative_l2(&self.force_n, &other.force_n);
        let u = relative_l2(&self.u, &other.u);
        if force.is_nan() || force > u { force } else { u }
    }

    fn bits(&self) -> Vec<u64> {
        self.u.iter().chain(&self.force_n).map(|v| v.to_bits()).collect()
    }
}

fn find(
    body: &Body,
    approach: &Approach,
    drive: &Drive,
    options: Options,
    steps: u32,
) -> Result<Found, CaseError> {
    let indenter = body.indenter(approach, drive)?;
    let loading = Loading { indenter: Some(indenter), ..Loading::default() };
    let (solver, report) = super::lab::solve(&body.problem, loading, options, steps)?;
    Ok(Found {
        u: solver.displacement_mm().as_flattened().to_vec(),
        force_n: solver.balance().contact_force_n,
        report,
    })
}

/// The same body with another elimination order.
fn eliminated(seed: u64, elimination: Elimination) -> Result<Simulation, CaseError> {
    let mut setup = Simulation::new(&scene(&random_scene(seed, "linear", 1))?)?;
    let Problem { mesh, fixed, .. } = &setup.body.problem;
    setup.body.problem.system = SymbolicSystem::eliminated(mesh, fixed, elimination)?;
    Ok(setup)
}

pub(super) fn run(suite: &Suite) -> Result<Vec<Line>, CaseError> {
    let seeds: Vec<u64> = (0..if suite.long() { 60 } else { 6 }).collect();
    let mut lines = Vec::new();
    let mut alone = Vec::new();
    for &seed in &seeds {
        let (line, bits) = one(seed)?;
        lines.push(line);
        alone.push(bits);
    }
    lines.push(threads(&seeds, &alone)?);
    Ok(lines)
}

fn one(seed: u64) -> Result<(Line, Vec<u64>), CaseError> {
    let Simulation { body, approach, drive, .. } =
        Simulation::new(&scene(&random_scene(seed, "linear", 1))?)?;
    let usual = find(&body, &approach, &drive, Options::default(), 1)?;
    let again = find(&body, &approach, &drive, Options::default(), 1)?;
    let exact = find(&body, &approach, &drive, tight(), 1)?;
    let many = find(&body, &approach, &drive, tight(), 7)?;
    let mut checks = vec![
        Check::vanishes("usual tolerances", usual.from(&exact), 2e-3, "tight tolerances"),
        Check::vanishes("seven increments", many.from(&exact), 1e-6, "one increment"),
        Check::vanishes(
            "bits of a second run",
            f64::from(u8::from(usual.bits() != again.bits())),
            0.5,
            "the first run",
        ),
    ];
    for (name, elimination) in
        [("Cuthill-McKee", Elimination::CuthillMckee), ("natural order", Elimination::Natural)]
    {
        let Simulation { body, approach, drive, .. } = eliminated(seed, elimination)?;
        let other = find(&body, &approach, &drive, tight(), 1)?;
        checks.push(Check::vanishes(name, other.from(&exact), 1e-6, "nested dissection"));
    }
    let force = relative_l2(&exact.force_n, &force_n(seed, "quadratic", 1)?);
    checks.push(if force <= ORDERS_APART {
        Check::vanishes("force of Hex8", force, ORDERS_APART, "Hex27 on the same nodes")
    } else {
        let finer = relative_l2(&force_n(seed, "linear", 2)?, &force_n(seed, "quadratic", 2)?);
        let name = "Hex8 less Hex27, half the mesh size";
        Check::vanishes(name, finer / force, ORDERS_CLOSER, "the whole")
    });
    let effort =
        [&usual, &exact, &many].iter().fold(Effort::default(), |sum, f| sum.plus(&f.report.effort));
    let hard = Hardness::from(&StepReport { effort, ..exact.report });
    Ok((Line::converged(format!("problem {seed}"), hard, checks), usual.bits()))
}

/// Contact force of a problem, to tight tolerances, N.
fn force_n(seed: u64, order: &str, per: u32) -> Result<[f64; 3], CaseError> {
    let Simulation { body, approach, drive, .. } =
        Simulation::new(&scene(&random_scene(seed, order, per))?)?;
    Ok(find(&body, &approach, &drive, tight(), 1)?.force_n)
}

/// All problems by two threads at once: set-up (METIS has one generator a process), solve,
/// bits.
fn threads(seeds: &[u64], alone: &[Vec<u64>]) -> Result<Line, CaseError> {
    let solve = |seed: u64| -> Result<Vec<u64>, CaseError> {
        let Simulation { body, approach, drive, .. } =
            Simulation::new(&scene(&random_scene(seed, "linear", 1))?)?;
        Ok(find(&body, &approach, &drive, Options::default(), 1)?.bits())
    };
    let (even, odd): (Vec<_>, Vec<_>) = seeds.iter().copied().partition(|s| s % 2 == 0);
    let work = |own: &[u64]| {
        own.iter().map(|&s| Ok((s, solve(s)?))).collect::<Result<Vec<_>, CaseError>>()
    };
    let (first, second) = std::thread::scope(|scope| {
        let other = scope.spawn(|| work(&odd));
        let first = work(&even);
        (first, other.join())
    });
    let second = second.map_err(|_| "a thread panicked")?;
    let mut differing = 0u32;
    for (seed, bits) in first?.into_iter().chain(second?) {
        differing +=
            u32::from(seeds.iter().position(|s| *s == seed).is_none_or(|i| alone[i] != bits));
    }
    let check =
        Check::vanishes("problems that differ in a bit", f64::from(differing), 0.5, "one thread");
    Ok(Line::evaluated("two threads", vec![check]))
}
