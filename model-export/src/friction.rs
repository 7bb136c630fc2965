//! Errors of contact with friction against FE with friction: force, traction and SED, along the
//! path of the indenter.

use crate::ExportError;
use crate::contact::{Models, Placed, Rung, pixel_contact};
use crate::dataset::Dataset;
use crate::metrics::{SampleMetrics, quantile, relative_l2};
use crate::shear::traction;
use papilla_contact::{
    Contact, InterfaceSkin, Object, PixelContact, Settings, ShearEnergy, Solver,
};
use papilla_dataset::{IndentationEntry, Shard};
use papilla_engine::{MAP_LEN, Session};
use papilla_proto::atlas::{Patch, VertexSampler};
use papilla_vector::norm;
use serde::Serialize;
use std::sync::Arc;

/// Farthest that an indenter moves from one frame to the next on its way, mm.
const STEP_MM: f64 = 0.05;

/// Figures of a rung on a dataset with friction; pairs are median and 95th percentile.
#[derive(Clone, Debug, Serialize)]
pub struct Rubbed {
    /// Name of the rung.
    pub rung: &'static str,
    /// Campaign.
    pub set: String,
    /// States.
    pub states: usize,
    /// Of these, told to be unsettled.
    pub unsettled: usize,
    /// Relative L2 of the pressure map.
    pub pressure: [f64; 2],
    /// Size of the force's error over the size of the force.
    pub force: [f64; 2],
    /// Size of the error of the force's part across the indenter's way in, over the greatest pull: the coefficient
    /// of friction times FE's force along the way in.
    pub pull: [f64; 2],
    /// Relative L2 of the traction along the skin at the vertices.
    pub traction: [f64; 2],
    /// Relative L2 of the network's SED, without the effect `shear_energy` and with it.
    pub sed: [[f64; 2]; 2],
}

/// The rungs that know friction.
pub const RUBBING: [Rung; 3] = [Rung::SecondOrder, Rung::CoarsePixels, Rung::Pixels];

/// Measures a rung on all states of a dataset with friction, of whichever split: nothing learns from
/// it. Each indenter goes its simulation's way, from first touch, in small steps.
///
/// # Errors
/// [`ExportError`] of the dataset or the network, and of a dataset without friction or a contact
/// model without layers.
pub fn measure(
    models: &Models,
    rung: Rung,
    dataset: &Dataset,
    network: &mut (dyn Session + '_),
) -> Result<Rubbed, ExportError> {
    let mut rubbing = Rubbing::new(models, rung, dataset)?;
    for indentation in dataset.every_indentation() {
        let shard = dataset.shard(indentation)?;
        let Some(placed) = Placed::at_first_touch(dataset, indentation, &shard)? else { continue };
        rubbing.forget();
        let mut last = [0.0; 3];
        for state in 0..indentation.samples {
            let [x, y] = shard.slid_mm(state);
            let next = [f64::from(shard.depth_mm[state]), x, y];
            rubbing.go(&placed, last, next);
            rubbing.compare((indentation, &shard, state), placed.direction(), network)?;
            last = next;
        }
    }
    Ok(rubbing.row(rung))
}

/// A finger that something rubs, and what was found.
struct Rubbing<'a> {
    dataset: &'a Dataset,
    friction: f64,
    solver: Solver,
    pixels: Option<PixelContact>,
    out: Contact,
    sampler: VertexSampler,
    energy: ShearEnergy,
    unsettled: usize,
    pressure: Vec<f64>,
    force: Vec<f64>,
    pull: Vec<f64>,
    traction: Vec<f64>,
    sed: [Vec<f64>; 2],
}

impl<'a> Rubbing<'a> {
    fn new(models: &Models, rung: Rung, dataset: &'a Dataset) -> Result<Self, ExportError> {
        let bad = |reason: &str| {
            let (path, reason) = (dataset.folder().to_owned(), reason.to_owned());
            ExportError::DatasetFile { path, reason }
        };
        let friction = dataset
            .friction()
            .ok_or_else(|| bad("its campaign names no coefficient of friction"))?;
        let skin = Arc::new(dataset.maps.raster(Patch::Skin).clone());
        let sampler = VertexSampler::new(dataset.atlas(), &skin);
        let no_layers = || bad("the contact model names no layers");
        let interface =
            InterfaceSkin::new(models.finger(), dataset.atlas(), skin).ok_or_else(no_layers)?;
        let settings = Settings { friction: true, ..Settings::default() };
        let solver = Solver::new(Arc::clone(&models.finger), settings)
            .map_err(|error| bad(&error.to_string()))?;
        let pixels = rung
            .pixel_spacing()
            .map(|spacing| pixel_contact(models, dataset, spacing).ok_or_else(no_layers));
        Ok(Self {
            dataset,
            friction,
            solver,
            pixels: pixels.transpose()?,
            out: Contact::new(models.finger.vertices()),
            sampler,
            energy: ShearEnergy::new(Arc::new(interface)),
            unsettled: 0,
            pressure: Vec::new(),
            force: Vec::new(),
            pull: Vec::new(),
            traction: Vec::new(),
            sed: [Vec::new(), Vec::new()],
        })
    }

    fn forget(&mut self) {
        self.solver.reset();
        self.pixels.iter_mut().for_each(PixelContact::reset);
    }

    /// Frames from one depth and slide to the next, mm.
    fn go(&mut self, placed: &Placed, from: [f64; 3], to: [f64; 3]) {
        let way = [0, 1, 2].map(|i| to[i] - from[i]);
        let steps = (norm(way) / STEP_MM).ceil().max(1.0);
        for step in 1..=steps as usize {
            let [depth, x, y] = [0, 1, 2].map(|i| from[i] + step as f64 / steps * way[i]);
            let object = Object { friction: self.friction, ..placed.at(depth, [x, y]) };
            let objects = std::slice::from_ref(&object);
            let solved = match &mut self.pixels {
                Some(pixels) => self.solver.solve_on_pixels(objects, pixels, &mut self.out),
                None => self.solver.solve(objects, &mut self.out),
            };
            // What runs away counts as unsettled, with whatever is left of it.
            self.out.quality.settled &= solved.is_ok();
        }
    }

    /// Holds an answer against FE.
    fn compare(
        &mut self,
        (indentation, shard, state): (&IndentationEntry, &Shard, usize),
        way_in: [f64; 3],
        network: &mut (dyn Session + '_),
    ) -> Result<(), ExportError> {
        let path = self.dataset.shard_path(indentation);
        let [mut pressure_pa, mut sed, mut truth] = [0, 1, 2].map(|_| vec![0.0; MAP_LEN]);
        match &self.pixels {
            Some(pixels) => pressure_pa.copy_from_slice(pixels.map_pa()),
            None => {
                let refused = |source| ExportError::Atlas { path: path.clone(), source };
                let skin = self.dataset.maps.raster(Patch::Skin);
                skin.rasterise(&self.out.pressure_pa, &mut pressure_pa).map_err(refused)?;
            }
        }
        self.dataset.draw_pressure(indentation, shard, state, &mut truth)?;
        self.pressure.extend(relative_l2(&pressure_pa, &truth));
        let due = [0, 1, 2].map(|i| f64::from(shard.force_n[[state, i]]));
        let off = [0, 1, 2].map(|i| self.out.force_n[i] - due[i]);
        self.force.push(norm(off) / norm(due));
        let along = (0..3).map(|i| due[i] * way_in[i]).sum::<f64>().abs();
        self.pull.push(norm(across(off, way_in)) / (self.friction * along));
        let due =
            traction(self.dataset, indentation, shard, state, &self.sampler)?.ok_or_else(|| {
                let reason = "it holds no shear_pa: solve it with friction".to_owned();
                ExportError::DatasetFile { path: path.clone(), reason }
            })?;
        let traction = self.out.shear_pa.as_flattened();
        self.traction.extend(relative_l2(traction, due.as_flattened()));
        self.unsettled += usize::from(!self.out.quality.settled);
        let failed = |source| ExportError::Engine { path: path.clone(), source };
        network.infer(&pressure_pa, &mut sed).map_err(failed)?;
        self.dataset.draw_sed(indentation, shard, state, &mut truth)?;
        let ground = &self.dataset.ground;
        let error = |sed: &[f32]| {
            SampleMetrics::measure(sed, &truth, ground).map(|sample| sample.relative_l2)
        };
        self.sed[0].extend(error(&sed));
        self.energy.add(&pressure_pa, &self.out.shear_pa, 1.0, f32::INFINITY, &mut sed);
        self.sed[1].extend(error(&sed));
        Ok(())
    }

    fn row(self, rung: Rung) -> Rubbed {
        let both = |values: &[f64]| [0.5, 0.95].map(|q| quantile(values, q).unwrap_or(f64::NAN));
        Rubbed {
            rung: rung.name(),
            set: self.dataset.name().to_owned(),
            states: self.pressure.len(),
            unsettled: self.unsettled,
            pressure: both(&self.pressure),
            force: both(&self.force),
            pull: both(&self.pull),
            traction: both(&self.traction),
            sed: self.sed.each_ref().map(|sed| both(sed)),
        }
    }
}

/// The part of a vector across a unit vector.
fn across(v: [f64; 3], unit: [f64; 3]) -> [f64; 3] {
    let along: f64 = (0..3).map(|i| v[i] * unit[i]).sum();
    [0, 1, 2].map(|i| v[i] - along * unit[i])
}
