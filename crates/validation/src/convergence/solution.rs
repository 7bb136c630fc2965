//! One case on one mesh, on disk between runs.

use super::target::Target;
use super::{Case, ConvergenceError};
use crate::stored;
use ndarray::Ix2;
use papilla_atlas::PA_PER_MPA;
use papilla_dataset::BALANCE_RELATIVE_MAX;
use papilla_fem::mesh::reader::SurfaceReader;
use papilla_fem::solve::{Options, Solver, StepReport};
use papilla_fingertip::mesh::named::MeshChoice;
use papilla_fingertip::scene::{Geometry, Scene};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::{Body, SimulationError};
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_fingertip::simulation::sample::fault;
use papilla_output::OutputError;
use papilla_output::npz::{NpzArrays, NpzBuilder};
use papilla_processor::thread_s;
use papilla_vector::norm;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Fields at the target's points, NaN where a mesh does not show them, and the price.
#[derive(Clone, Debug, Default)]
pub(super) struct Solution {
    /// `[state][point]`, Pa.
    pub pressure_pa: Vec<Vec<f32>>,
    /// `[state][point]`, J/m3.
    pub sed_j_per_m3: Vec<Vec<f32>>,
    pub record: Record,
}

/// What is told of a solution beside its fields.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// What it was solved from: another case, mesh or program has another.
    pub fingerprint: String,
    pub unknowns: usize,
    pub factor_entries: usize,
    /// Processor time of mesh and symbolic factorization, s.
    pub setup_s: f64,
    /// Processor time of the whole indentation, s.
    pub solve_s: f64,
    /// Depth of each state, mm.
    pub depth_mm: Vec<f64>,
    /// Force at each state, N.
    pub force_n: Vec<f64>,
    /// What is wrong with each state.
    pub faults: Vec<Option<String>>,
    /// Why states are missing.
    pub error: Option<String>,
}

impl Solution {
    pub(super) fn found_or_solved(
        case: &Case,
        mesh: MeshChoice,
        states: usize,
        target: &Target,
        folder: &Path,
    ) -> Result<Self, ConvergenceError> {
        let scene = scene(case, mesh, states, target);
        let fingerprint = stored::fingerprint(&(&scene, env!("CARGO_PKG_VERSION")))?;
        let stem = folder.join(format!("{}-{}", case.name, mesh.name));
        let (arrays, record) = (stem.with_extension("npz"), stem.with_extension("json"));
        let found: Option<Record> = stored::read_json(&record)?;
        if let Some(found) = found.filter(|found| found.fingerprint == fingerprint) {
            return Self::read(&arrays, found);
        }
        let mut solution = Self::default();
        solution.record.fingerprint = fingerprint;
        if let Err(e) = solution.solve(&scene, target) {
            solution.record.error = Some(e.to_string());
        }
        solution.write(target, &arrays, &record)?;
        Ok(solution)
    }

    fn solve(&mut self, scene: &Scene, target: &Target) -> Result<(), SimulationError> {
        let begun_s = thread_s();
        let Simulation { mut body, approach, drive, .. } = Simulation::new(scene)?;
        body.first_touch = Some(target.contact.clone());
        body.read_at_nodes();
        self.record.setup_s = thread_s() - begun_s;
        self.record.unknowns = body.problem.system.dofs.count;
        self.record.factor_entries = body.problem.system.factor_entries();
        let readers = Readers::new(&body, target);
        let begun_s = thread_s();
        let mut solver = body.solver(Options::default())?;
        let mut keep = |state: usize, _: &Solver<'_>, found: &IncrementRecord, _: &StepReport| {
            if state == 0 {
                self.forget_states();
            }
            self.pressure_pa.push(readers.skin(&found.pressure_mpa));
            self.sed_j_per_m3.push(readers.interface(&found.sed_dermis_mpa));
            self.record.depth_mm.push(found.depth_mm);
            self.record.force_n.push(norm(found.force_n));
            self.record.faults.push(fault(found, found.pressure_mpa.len()));
        };
        let limit = BALANCE_RELATIVE_MAX;
        let pressed = body.press_balanced(&mut solver, &approach, &drive, limit, &mut keep).pressed;
        self.record.solve_s = thread_s() - begun_s;
        pressed
    }

    /// An indentation that is taken again tells its states again.
    fn forget_states(&mut self) {
        self.pressure_pa.clear();
        self.sed_j_per_m3.clear();
        self.record.depth_mm.clear();
        self.record.force_n.clear();
        self.record.faults.clear();
    }

    fn write(&self, target: &Target, arrays: &Path, record: &Path) -> Result<(), ConvergenceError> {
        let points = self.pressure_pa.first().map_or(0, Vec::len);
        let shape = [self.pressure_pa.len(), points];
        let mut npz = NpzBuilder::new();
        let place: Vec<f32> = target.place_mm.iter().flatten().map(|v| *v as f32).collect();
        npz.add_slice("place_mm", &[target.place_mm.len(), 2], &place)?;
        npz.add_slice("pressure_pa", &shape, &self.pressure_pa.concat())?;
        npz.add_slice("sed_j_per_m3", &shape, &self.sed_j_per_m3.concat())?;
        npz.write(arrays)?;
        // Last: it vouches for the arrays.
        Ok(papilla_output::atomic::write_json(record, &self.record)?)
    }

    fn read(arrays: &Path, record: Record) -> Result<Self, ConvergenceError> {
        let bytes = std::fs::read(arrays).map_err(OutputError::io("read", arrays))?;
        let mut npz = NpzArrays::new(arrays, &bytes)?;
        let mut rows = |name: &str| -> Result<Vec<Vec<f32>>, ConvergenceError> {
            let all = npz.get::<f32, Ix2>(name)?;
            Ok(all.outer_iter().map(|row| row.to_vec()).collect())
        };
        Ok(Self { pressure_pa: rows("pressure_pa")?, sed_j_per_m3: rows("sed_j_per_m3")?, record })
    }
}

fn scene(case: &Case, mesh: MeshChoice, states: usize, target: &Target) -> Scene {
    Scene {
        geometry: Geometry::Fingertip {
            density: mesh.density,
            order: mesh.order,
            shape: target.finger.clone(),
            finger: None,
        },
        indenter: target.indenter.clone(),
        motion: case.motion(states),
        ..Scene::usual()
    }
}

/// Where the target's points lie on a body's skin and interface.
struct Readers<'a> {
    body: &'a Body,
    skin: SurfaceReader,
    interface: SurfaceReader,
}

impl<'a> Readers<'a> {
    fn new(body: &'a Body, target: &Target) -> Self {
        let mesh = &body.problem.mesh;
        let [skin, interface] = ["skin", "interface"].map(|name| &mesh.surfaces[name]);
        Self {
            body,
            skin: SurfaceReader::linear(mesh, skin, &target.skin),
            interface: SurfaceReader::new(mesh, interface, &target.interface),
        }
    }

    fn skin(&self, pressure_mpa: &[f64]) -> Vec<f32> {
        let nodes = self.body.patch.as_ref().map_or(&[][..], |p| &p.patch.skin);
        self.read(&self.skin, nodes, pressure_mpa)
    }

    fn interface(&self, sed_mpa: &[f64]) -> Vec<f32> {
        let nodes = self.body.patch.as_ref().map_or(&[][..], |p| &p.patch.interface);
        self.read(&self.interface, nodes, sed_mpa)
    }

    fn read(&self, reader: &SurfaceReader, nodes: &[u32], values: &[f64]) -> Vec<f32> {
        let nodal = self.body.at_nodes(nodes, values);
        reader.read(|n| PA_PER_MPA * nodal[n as usize]).into_iter().map(|v| v as f32).collect()
    }
}
