//! One fidelity level's finger, and one indentation of it.

use super::store::{Part, Record};
use super::{FidelityError, FidelityLevel, Strain};
use crate::acceptance::fault;
use crate::processor;
use papilla_fem::mesh::nearest::NearestPoints;
use papilla_fem::mesh::recovery::SedRecovery;
use papilla_fem::solve::Options;
use papilla_fingertip::campaign::{CampaignSpec, Indentation};
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_fingertip::scene::{EffectName, Geometry, Scene};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::{Body, SimulationError};
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::fields::PA_PER_MPA;
use papilla_fingertip::simulation::record::{Checks, IncrementRecord};
use papilla_fingertip::tissue::{NoTissue, Tissue};

/// Where every field is read.
pub(super) struct Target {
    pub atlas_hash: String,
    body: Body,
    /// Undeformed vertices of skin and interface, mm.
    skin: Vec<[f64; 3]>,
    interface: Vec<[f64; 3]>,
}

impl Target {
    /// Vertices of the atlas of a density.
    pub(super) fn new(spec: &CampaignSpec, density: Density) -> Result<Self, FidelityError> {
        let level = FidelityLevel::new(density, Order::Linear, Strain::Finite);
        let body = setup(spec, level)?.body;
        let no_patch = || FidelityError::NoPatch { level: level.name() };
        let (atlas, _) = body.atlas().ok_or_else(no_patch)??;
        let (skin, interface, _) = surfaces(&body).ok_or_else(no_patch)?;
        Ok(Self { atlas_hash: atlas.hash().to_owned(), body, skin, interface })
    }

    pub(super) fn vertices(&self) -> usize {
        self.skin.len()
    }
}

/// Vertices of skin and interface, and their triangles.
type Surfaces = (Vec<[f64; 3]>, Vec<[f64; 3]>, Vec<[u32; 3]>);

fn surfaces(body: &Body) -> Option<Surfaces> {
    let patch = &body.patch.as_ref()?.patch;
    let (skin, interface) = patch.places_mm(&body.problem.mesh);
    Some((skin, interface, patch.triangles.clone()))
}

/// The campaign's finger as a fidelity level has it.
fn setup(spec: &CampaignSpec, level: FidelityLevel) -> Result<Simulation, FidelityError> {
    let failed = |source: SimulationError| FidelityError::FidelityLevel {
        level: level.name(),
        source: Box::new(source),
    };
    let candidates = spec.candidates();
    let Some(first) = candidates.first() else {
        return Err(failed(SimulationError::Empty));
    };
    let scene = spec.scene(first);
    let geometry = match scene.geometry {
        Geometry::Fingertip { shape, .. } => {
            Geometry::Fingertip { density: level.density, order: level.order, shape }
        }
        other => other,
    };
    let finite = EffectName::named("finite_strain");
    let mut effects: Vec<_> =
        scene.effects.iter().copied().filter(|e| Some(*e) != finite).collect();
    if level.kinematics == Strain::Finite {
        effects.extend(finite);
    }
    let scene = Scene { geometry, effects, ..scene };
    scene.validate().map_err(|e| failed(e.into()))?;
    Simulation::new(&scene).map_err(failed)
}

/// A fidelity level's finger, ready to be pressed.
pub(super) struct Prepared {
    name: String,
    body: Body,
    friction: f64,
    dermis: SedRecovery,
    skin: NearestPoints,
    interface: NearestPoints,
    setup_s: f64,
}

impl Prepared {
    pub(super) fn new(
        spec: &CampaignSpec,
        level: FidelityLevel,
        target: &Target,
    ) -> Result<Self, FidelityError> {
        let begun_s = processor::thread_s();
        let Simulation { body, plan, .. } = setup(spec, level)?;
        let setup_s = processor::thread_s() - begun_s;
        let name = level.name();
        let Some((skin, interface, triangles)) = surfaces(&body) else {
            return Err(FidelityError::NoPatch { level: name });
        };
        let nodes = &body.patch.as_ref().map_or(&[][..], |p| &p.patch.interface);
        let dermis = SedRecovery::by_quarters(
            &body.problem.mesh,
            "interface",
            Tissue::Dermis.region(),
            nodes,
        )
        .map_err(|e| FidelityError::FidelityLevel {
            level: level.name(),
            source: Box::new(NoTissue::from(e).into()),
        })?;
        Ok(Self {
            dermis,
            skin: NearestPoints::new(&skin, &triangles, &target.skin),
            interface: NearestPoints::new(&interface, &triangles, &target.interface),
            name,
            body,
            friction: plan.friction,
            setup_s,
        })
    }

    /// Presses; a state that finds no equilibrium ends the part and is told of in it.
    pub(super) fn part(
        &self,
        spec: &CampaignSpec,
        press: &Indentation,
        target: &Target,
    ) -> Result<Part, FidelityError> {
        let candidate = &spec.candidates()[press.candidate];
        let approach = Approach {
            shape: candidate.indenter.build(&spec.folder).map_err(IndenterError::from)?,
            top_mm: candidate.indenter.top_mm(),
            pose: press.pose,
            offset_mm: press.offset_mm,
            friction: self.friction,
            contact: None,
        };
        let mut part = Part {
            record: Record {
                press: press.clone(),
                unknowns: self.body.problem.system.dofs.count,
                factor_entries: self.body.problem.system.factor_entries(),
                setup_seconds: self.setup_s,
                distance_mm_max: self.skin.distance_mm_max().max(self.interface.distance_mm_max()),
                ..Record::default()
            },
            ..Part::default()
        };
        let failed = |e: SimulationError| FidelityError::FidelityLevel {
            level: self.name.clone(),
            source: Box::new(e),
        };
        let (approach, depths_mm) =
            self.in_place(approach, &press.depths_mm, target).map_err(failed)?;
        part.record.depth_shift_mm = depths_mm[0] - press.depths_mm[0];
        part.record.offset_shift_mm =
            std::array::from_fn(|i| approach.offset_mm[i] - press.offset_mm[i]);
        let begun_s = processor::thread_s();
        let pressed = self.press(depths_mm, &approach, &mut |record| {
            let seconds = processor::thread_s() - begun_s;
            self.keep(&mut part, record, seconds);
        });
        if let Err(error) = pressed {
            tracing::warn!(level = self.name, press = press.id, %error, "indentation failed");
            part.record.error = Some(error.to_string());
        }
        tracing::info!(
            level = self.name,
            press = press.id,
            seconds = processor::thread_s() - begun_s,
            "indentation solved"
        );
        Ok(part)
    }

    /// The approach and depths that put the indenter where the target's body has it.
    ///
    /// A pose is told from the first skin node that a plate touches and depth from first
    /// touch, and both depend on the mesh: unmoved, a fidelity level would press another spot.
    fn in_place(
        &self,
        mut approach: Approach,
        depths_mm: &[f64],
        target: &Target,
    ) -> Result<(Approach, Vec<f64>), SimulationError> {
        let drive = Drive::Depths(depths_mm.to_vec());
        let wanted = target.body.indenter(&approach, &drive)?.start.origin_mm;
        let rotation = self.body.rotation(approach.pose);
        let mut off = [0.0; 3];
        for _ in 0..2 {
            let found = self.body.indenter(&approach, &drive)?.start.origin_mm;
            off = std::array::from_fn(|k| {
                (0..3).map(|i| rotation[i][k] * (wanted[i] - found[i])).sum()
            });
            approach.offset_mm[0] += off[0];
            approach.offset_mm[1] += off[1];
        }
        Ok((approach, depths_mm.iter().map(|d| d + off[2]).collect()))
    }

    fn press(
        &self,
        depths_mm: Vec<f64>,
        approach: &Approach,
        keep: &mut dyn FnMut(&IncrementRecord),
    ) -> Result<(), SimulationError> {
        let mut solver = self.body.solver(Options::default())?;
        let drive = Drive::Depths(depths_mm);
        let mut read = Ok(());
        self.body.press(&mut solver, approach, &drive, 1, &mut |solver, record, _| {
            let history = |block, element| solver.history_of(block, element);
            match self.dermis.sed_mpa(&self.body.deformed(solver, &history)) {
                Ok(sed_dermis_mpa) => keep(&IncrementRecord { sed_dermis_mpa, ..record.clone() }),
                Err(error) => read = Err(error),
            }
        })?;
        Ok(read?)
    }

    fn keep(&self, part: &mut Part, record: &IncrementRecord, seconds: f64) {
        let pa = |values: Vec<f64>| values.into_iter().map(|v| (PA_PER_MPA * v) as f32);
        part.pressure_pa.extend(pa(self.skin.read(&record.pressure_mpa)));
        part.sed_j_per_m3.extend(pa(self.interface.read(&record.sed_dermis_mpa)));
        part.force_n.extend(record.force_n.map(|f| f as f32));
        // Energy against work says how fine the path is, not how good the state: a
        // campaign takes an indentation that fails it again on a finer path.
        let checks = Checks { energy_vs_work: 0.0, ..record.checks };
        let judged = IncrementRecord { checks, ..record.clone() };
        part.record.seconds.push(seconds);
        part.record.checks.push(record.checks);
        part.record.faults.push(fault(&judged, record.pressure_mpa.len()));
    }
}
