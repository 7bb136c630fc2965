//! The wedge indentation of Chen, Shuai & Zhu, 'Preliminary Study on SED Distribution
//! of Tactile Sensation in Fingertip', and what they say of it.
//!
//! Their figure 2(a) is SED along the depth line under the wedge, 2(b) and 3 are
//! SED against x at three depths. [`findings`] holds what they state as checks.

pub mod findings;
pub mod lines;
pub mod reading;
pub mod report;

use lines::{DepthPoint, LateralLine, Lines, Read};
use papilla_fem::element::Inverted;
use papilla_fem::mesh::probe::ProbeError;
use papilla_fem::solve::{Effort, Options, Solver, StepReport};
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::scene::{Geometry, Scene, SceneError};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::{Body, SimulationError};
use papilla_fingertip::simulation::record::IncrementRecord;
use reading::Reading;
use std::time::Instant;

/// The scene, as the file in `scenes/` has it.
pub const SCENE: &str = include_str!("../../../scenes/s2-wedge.toml");

/// Why the indentation could not be reproduced.
#[derive(Debug, thiserror::Error)]
pub enum WedgeError {
    /// The scene file is not the one that this code knows.
    #[error("scenes/s2-wedge.toml: {0}")]
    Scene(String),
    /// The scene contradicts itself.
    #[error(transparent)]
    Invalid(#[from] SceneError),
    /// No equilibrium.
    #[error(transparent)]
    Press(#[from] SimulationError),
    /// A line leaves the section.
    #[error(transparent)]
    Probe(#[from] ProbeError),
    /// An element is inside out where SED is wanted.
    #[error(transparent)]
    Inverted(#[from] Inverted),
}

/// SED along the lines of the figures, at one time.
#[derive(Clone, Debug)]
pub struct State {
    /// Time since first touch, s.
    pub time_s: f64,
    /// Force on the whole finger per mm of length, N.
    pub force_n_per_mm: f64,
    /// Farthest to the side that the skin touches the wedge, mm, deformed; 0 without contact.
    pub contact_half_width_mm: f64,
    /// Figure 2(a), from A to the bone.
    pub depth_line: Vec<DepthPoint>,
    /// Points of it left out: there the tip crushes the mesh.
    pub left_out: usize,
    /// Figures 2(b) and 3.
    pub lateral: Vec<LateralLine>,
    /// Checks and vertex values.
    pub record: IncrementRecord,
}

/// One run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What of the paper was read how.
    pub reading: Reading,
    /// Unknowns.
    pub unknowns: usize,
    /// Elements.
    pub elements: usize,
    /// Depth of the bone under the pad's lowest point, mm.
    pub bone_depth_mm: f64,
    /// Stored states, from the end of the ramp to the end of the hold.
    pub states: Vec<State>,
    /// Work.
    pub effort: Effort,
    /// Mesh, ordering, symbolic factorization, s.
    pub setup_s: f64,
    /// Ramp and hold, s.
    pub solve_s: f64,
}

/// The scene under a reading.
///
/// # Errors
/// [`WedgeError`] if the file is not a section's.
pub fn scene(reading: Reading, density: Density) -> Result<Scene, WedgeError> {
    let mut scene: Scene = toml::from_str(SCENE).map_err(|e| WedgeError::Scene(e.to_string()))?;
    if let Geometry::Section { density: d, .. } = &mut scene.geometry {
        *d = density;
    }
    reading.apply(&mut scene);
    scene.validate()?;
    Ok(scene)
}

/// See [`State::contact_half_width_mm`].
fn contact_half_width_mm(body: &Body, solver: &Solver<'_>) -> f64 {
    let pressure = solver.pressure_mpa(&body.problem.mesh.surfaces[&body.contact]);
    let touching = solver.deformed().into_iter().zip(pressure).filter(|(_, p)| *p > 0.0);
    touching.map(|(x, _)| x[0].abs()).fold(0.0, f64::max)
}

/// Presses and reads the figures' lines.
///
/// # Errors
/// [`WedgeError`] says what failed.
pub fn run(reading: Reading, density: Density) -> Result<Outcome, WedgeError> {
    let scene = scene(reading, density)?;
    let Geometry::Section { shape, .. } = &scene.geometry else {
        return Err(WedgeError::Scene("geometry.kind has to be \"section\"".into()));
    };
    let clock = Instant::now();
    let setup = Simulation::new(&scene)?;
    let body = &setup.body;
    // Nodes at the tip's edges press ten times stiffer tissue than the penalty is made for.
    let options = Options { augmentations_max: 40, ..Options::default() };
    let mut solver = body.solver(options)?;
    let setup_s = clock.elapsed().as_secs_f64();
    let lines = Lines::new(shape, body)?;
    let (mut states, mut effort) = (Vec::new(), Effort::default());
    let mut failed = Ok(());
    let clock = Instant::now();
    let visit = &mut |s: &Solver<'_>, record: &IncrementRecord, report: &StepReport| {
        effort = effort.plus(&report.effort);
        match lines.read(body, s) {
            Ok(Read { depth_line, left_out, lateral }) => states.push(State {
                time_s: record.time_s,
                // The other half carries as much.
                force_n_per_mm: 2.0 * record.force_n[1].abs(),
                contact_half_width_mm: contact_half_width_mm(body, s),
                depth_line,
                left_out,
                lateral,
                record: record.clone(),
            }),
            Err(e) => failed = Err(e),
        }
    };
    body.press(&mut solver, &setup.approach, &setup.drive, 1, visit)?;
    failed?;
    Ok(Outcome {
        reading,
        unknowns: body.problem.system.dofs.count,
        elements: body.problem.mesh.element_count(),
        bone_depth_mm: shape.bone(0.0)[1] - shape.skin(0.0)[1],
        states,
        effort,
        setup_s,
        solve_s: clock.elapsed().as_secs_f64(),
    })
}
