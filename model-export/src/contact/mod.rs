//! The contact ladder: errors of pressure, force and SED of each contact method against FE, given
//! the pose of the indenter, and the time that the method takes.

mod maps;
mod placed;
mod pseudo_labels;

pub use self::maps::ContactMaps;
pub(crate) use self::placed::Placed;
pub use self::pseudo_labels::{Labeller, PseudoLabels};
use crate::dataset::Dataset;
use crate::metrics::{SampleMetrics, quantile, relative_l2};
use crate::split::SplitOrAll;
use crate::{ExportError, read};
use papilla_contact::{
    Contact, ContactModel, Gaps, Method, Object, PixelContact, PixelSkin, PixelSpacing, Scene,
    Settings, Solver,
};
use papilla_dataset::{IndentationEntry, Shard, sha256_hex};
use papilla_engine::{MAP_LEN, Session};
use papilla_processor::thread_s;
use papilla_proto::atlas::Patch;
use papilla_proto::contact::{ContactErrors, ContactMethod, MethodError, MethodErrors, Spread};
use papilla_vector::norm;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;

/// Frames of a warm path: to and fro by 10 um, which is 0.9 mm/s at 90 frames a second.
const WARM: usize = 10;
/// How far the warm path goes, mm.
const STEP_MM: f64 = 0.01;

/// Frames of the path sideways, and how far each goes, mm.
const SIDEWAYS: usize = 10;
const SIDE_STEP_MM: f64 = 1e-3;

/// A way from poses to pressure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rung {
    /// A spring for each vertex.
    Springs,
    /// A half-space whose modulus fits the finger's own compliance.
    HalfSpace,
    /// The finger's compliance at small strain.
    SmallStrain,
    /// The same with the second order, told gaps at the vertices in place of the object.
    Gaps,
    /// The same, told the object.
    SecondOrder,
    /// The same, then on every second pixel.
    CoarsePixels,
    /// The same, then on pixels.
    Pixels,
}

impl Rung {
    /// All of them, from fast and rough to slow and exact.
    pub const ALL: [Self; 7] = [
        Self::Springs,
        Self::HalfSpace,
        Self::SmallStrain,
        Self::Gaps,
        Self::SecondOrder,
        Self::CoarsePixels,
        Self::Pixels,
    ];

    pub(crate) const fn pixel_spacing(self) -> Option<PixelSpacing> {
        match self {
            Self::CoarsePixels => Some(PixelSpacing::Two),
            Self::Pixels => Some(PixelSpacing::One),
            _ => None,
        }
    }

    /// The method of a session; none that a session may name.
    pub(crate) const fn method(self) -> Option<ContactMethod> {
        match self {
            Self::Springs => Some(ContactMethod::Springs),
            Self::SmallStrain => Some(ContactMethod::SmallStrain),
            Self::SecondOrder => Some(ContactMethod::SecondOrder),
            Self::CoarsePixels => Some(ContactMethod::CoarsePixels),
            Self::Pixels => Some(ContactMethod::Pixels),
            Self::HalfSpace | Self::Gaps => None,
        }
    }

    /// Name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Springs => "springs",
            Self::HalfSpace => "half-space",
            Self::SmallStrain => "small strain",
            Self::Gaps => "second order, gaps",
            Self::SecondOrder => "second order",
            Self::CoarsePixels => "second order, coarse pixels",
            Self::Pixels => "second order, pixels",
        }
    }
}

/// Figures of a rung on a dataset; pairs are median and 95th percentile.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the rung.
    pub rung: &'static str,
    /// Campaign.
    pub set: String,
    /// Relative L2 of the pressure map.
    pub pressure: [f64; 2],
    /// Relative error of the size of the force.
    pub force: [f64; 2],
    /// The part of the force that is across the due one, over its size.
    pub across: [f64; 2],
    /// Relative L2 of the SED map that a network makes of the pressure, with a network.
    pub sed: Option<[f64; 2]>,
    /// Processor time of a frame from nothing, us.
    pub cold_us: [f64; 2],
    /// Processor time of a frame that moved by 10 um, us.
    pub warm_us: [f64; 2],
    /// Relative L2 by which a step of 1 um sideways changes the pressure; median and the largest.
    pub side_step: [f64; 2],
    /// Answers told to be unsettled, and out of range, of all.
    pub told: [usize; 3],
}

/// What the methods of sessions err, for `contact.json`: the rows in their order, by method.
#[must_use]
pub fn errors_of(model: &[u8], network: Option<String>, rows: &[Row]) -> ContactErrors {
    let spread = |[median, p95]: [f64; 2]| Spread { median, p95 };
    let error = |row: &Row| MethodError {
        set: row.set.clone(),
        states: row.told[2] as u32,
        pressure_relative_l2: spread(row.pressure),
        force_relative: spread(row.force),
        sed_relative_l2: row.sed.map(spread),
    };
    let of = |rung: Rung| rows.iter().filter(move |row| row.rung == rung.name()).map(error);
    let method =
        |rung: Rung| Some(MethodErrors { name: rung.method()?, errors: of(rung).collect() });
    ContactErrors {
        contact_sha256: sha256_hex(model),
        network,
        methods: Rung::ALL.into_iter().filter_map(method).collect(),
    }
}

/// The two models that rungs are of.
pub struct Models {
    pub(crate) finger: Arc<ContactModel>,
    half_space: Arc<ContactModel>,
}

impl Models {
    /// Reads a file of `fe-datagen contact`.
    ///
    /// # Errors
    /// [`ExportError::Io`], [`ExportError::Contact`].
    pub fn read(path: &Path) -> Result<Self, ExportError> {
        let refused = |source| ExportError::Contact { path: path.to_owned(), source };
        let finger = ContactModel::read(&read(path)?).map_err(refused)?;
        let half_space = Arc::new(finger.on_half_space().map_err(refused)?);
        Ok(Self { finger: Arc::new(finger), half_space })
    }

    pub(crate) fn finger(&self) -> &ContactModel {
        &self.finger
    }

    /// Refuses a dataset of another atlas, or of another finger with the same atlas, which does
    /// not depend on bone and tissues.
    ///
    /// # Errors
    /// [`ExportError::Contact`] or [`ExportError::Finger`], with the dataset's path.
    pub fn require_atlas(&self, dataset: &Dataset, path: &Path) -> Result<(), ExportError> {
        let refused = |source| ExportError::Contact { path: path.to_owned(), source };
        self.finger.require_atlas(dataset.atlas().hash()).map_err(refused)?;
        let (own, due) = (&self.finger.header().finger_sha256, dataset.finger_sha256());
        if let Some(due) = due.filter(|due| !own.is_empty() && own != due) {
            let reason = format!(
                "was solved on the finger {due}, and the contact model is of {own}: make it anew \
                 with `fe-datagen finger build`"
            );
            return Err(ExportError::Finger { path: path.to_owned(), reason });
        }
        Ok(())
    }

    pub(crate) fn solver(&self, rung: Rung) -> Option<Solver> {
        let (model, method) = match rung {
            Rung::Springs => (&self.finger, Method::Springs),
            Rung::HalfSpace => (&self.half_space, Method::SmallStrain),
            Rung::SmallStrain => (&self.finger, Method::SmallStrain),
            Rung::Gaps | Rung::SecondOrder | Rung::CoarsePixels | Rung::Pixels => {
                (&self.finger, Method::SecondOrder)
            }
        };
        Solver::new(Arc::clone(model), Settings { method, ..Settings::default() }).ok()
    }
}

/// Measures a rung on a part of a dataset, every `every`th state.
///
/// # Errors
/// [`ExportError`] of the dataset or the network.
pub fn measure(
    models: &Models,
    rung: Rung,
    dataset: &Dataset,
    network: Option<&mut (dyn Session + '_)>,
    (part, every): (SplitOrAll, usize),
) -> Result<Row, ExportError> {
    let mut network = network;
    let mut figures = Figures::default();
    let Some(mut solver) = models.solver(rung) else {
        return Ok(figures.row(rung, dataset.name()));
    };
    if let Some(spacing) = rung.pixel_spacing() {
        figures.pixels = pixel_contact(models, dataset, spacing);
        if figures.pixels.is_none() {
            return Ok(figures.row(rung, dataset.name()));
        }
    }
    let mut out = Contact::new(models.finger.vertices());
    let mut count = 0;
    for indentation in dataset.indentations(part)? {
        let shard = dataset.shard(indentation)?;
        let placed = Placed::at_first_touch(dataset, indentation, &shard)?;
        for state in 0..indentation.samples {
            count += 1;
            if (count - 1) % every.max(1) != 0 {
                continue;
            }
            let Some(placed) = &placed else { continue };
            let object = placed.at(f64::from(shard.depth_mm[state]), shard.slid_mm(state));
            solver.reset();
            figures.pixels.iter_mut().for_each(PixelContact::reset);
            let cold = figures.frame(rung, &mut solver, &object, dataset, &mut out);
            figures.cold_us.push(cold);
            figures.compare(dataset, indentation, &shard, state, &out, &mut network)?;
            let mut moved = object;
            let up = [0, 1, 2].map(|i| moved.placement.rotation[i][2]);
            for frame in 0..WARM {
                let by = if frame % 2 == 0 { STEP_MM } else { -STEP_MM };
                for (at, up) in moved.placement.origin_mm.iter_mut().zip(up) {
                    *at += by * up;
                }
                let warm = figures.frame(rung, &mut solver, &moved, dataset, &mut out);
                figures.warm_us.push(warm);
            }
            figures.last_pa.clear();
            figures.note_change(&out);
            let side = [0, 1, 2].map(|i| moved.placement.rotation[i][0]);
            for _ in 0..SIDEWAYS {
                for (at, side) in moved.placement.origin_mm.iter_mut().zip(side) {
                    *at += SIDE_STEP_MM * side;
                }
                figures.frame(rung, &mut solver, &moved, dataset, &mut out);
                figures.note_change(&out);
            }
        }
    }
    Ok(figures.row(rung, dataset.name()))
}

/// Contact on the pixels of a dataset's maps; `None` if the model holds none of the finger's skin.
pub(crate) fn pixel_contact(
    models: &Models,
    dataset: &Dataset,
    spacing: PixelSpacing,
) -> Option<PixelContact> {
    let raster = Arc::new(dataset.maps.raster(Patch::Skin).clone());
    let skin = PixelSkin::new(&models.finger, dataset.atlas(), raster)?;
    Some(PixelContact::new(Arc::new(skin), &models.finger, spacing))
}

/// Figures of all states.
#[derive(Default)]
struct Figures {
    pressure: Vec<f64>,
    force: Vec<f64>,
    across: Vec<f64>,
    sed: Vec<f64>,
    cold_us: Vec<f64>,
    warm_us: Vec<f64>,
    side_step: Vec<f64>,
    last_pa: Vec<f32>,
    told: [usize; 3],
    depth_mm: Vec<f32>,
    pixels: Option<PixelContact>,
}

impl Figures {
    /// Solves a frame; its time, us. Gaps are the engine's to find, so that is not counted.
    fn frame(
        &mut self,
        rung: Rung,
        solver: &mut Solver,
        object: &Object,
        dataset: &Dataset,
        out: &mut Contact,
    ) -> f64 {
        let objects = std::slice::from_ref(object);
        let scene = if rung == Rung::Gaps {
            let skin = &dataset.atlas().patch(Patch::Skin).positions_mm;
            let depth = |p: &[f32; 3]| {
                -object.placement.distance(object.shape.as_ref(), p.map(f64::from)).gap_mm as f32
            };
            self.depth_mm.clear();
            self.depth_mm.extend(skin.iter().map(depth));
            let depth_mm = &self.depth_mm;
            Scene::Gaps(Gaps::rigid(depth_mm))
        } else {
            Scene::Objects(objects)
        };
        let clock = thread_s();
        let solved = match &mut self.pixels {
            Some(pixels) => solver.solve_on_pixels(objects, pixels, out),
            None => solver.solve(scene, out),
        };
        let us = (thread_s() - clock) * 1e6;
        self.told[0] += usize::from(solved.is_err());
        us
    }

    /// Notes by how much the pressure is another than before.
    fn note_change(&mut self, out: &Contact) {
        let now_pa = self.pixels.as_ref().map_or(&out.pressure_pa[..], PixelContact::map_pa);
        self.side_step.extend(relative_l2(now_pa, &self.last_pa));
        self.last_pa.clear();
        self.last_pa.extend_from_slice(now_pa);
    }

    /// Holds an answer against FE.
    fn compare(
        &mut self,
        dataset: &Dataset,
        indentation: &IndentationEntry,
        shard: &Shard,
        state: usize,
        out: &Contact,
        network: &mut Option<&mut (dyn Session + '_)>,
    ) -> Result<(), ExportError> {
        let [mut pressure_pa, mut sed, mut truth] = [0, 1, 2].map(|_| vec![0.0; MAP_LEN]);
        let path = dataset.shard_path(indentation);
        let refused = |source| ExportError::Atlas { path: path.clone(), source };
        let skin = dataset.maps.raster(Patch::Skin);
        match &self.pixels {
            Some(pixels) => pressure_pa.copy_from_slice(pixels.map_pa()),
            None => skin.rasterise(&out.pressure_pa, &mut pressure_pa).map_err(refused)?,
        }
        dataset.draw_pressure(indentation, shard, state, &mut truth)?;
        self.pressure.extend(relative_l2(&pressure_pa, &truth));
        let due_n = [0, 1, 2].map(|i| f64::from(shard.force_n[[state, i]]));
        let due = norm(due_n);
        self.force.push((norm(out.force_n) / due - 1.0).abs());
        let along: f64 = (0..3).map(|i| out.force_n[i] * due_n[i]).sum::<f64>() / due.powi(2);
        let across = norm([0, 1, 2].map(|i| out.force_n[i] - along * due_n[i])) / due;
        self.across.push(across);
        self.told[0] += usize::from(!out.quality.settled);
        self.told[1] += usize::from(out.quality.out_of_range);
        self.told[2] += 1;
        let Some(network) = network else { return Ok(()) };
        let failed = |source| ExportError::Engine { path: path.clone(), source };
        network.infer(&pressure_pa, &mut sed).map_err(failed)?;
        dataset.draw_sed(indentation, shard, state, &mut truth)?;
        let sample = SampleMetrics::measure(&sed, &truth, &dataset.ground);
        self.sed.extend(sample.map(|sample| sample.relative_l2));
        Ok(())
    }

    fn row(self, rung: Rung, set: &str) -> Row {
        let both = |values: &[f64]| [0.5, 0.95].map(|q| quantile(values, q).unwrap_or(f64::NAN));
        Row {
            rung: rung.name(),
            set: set.to_owned(),
            pressure: both(&self.pressure),
            force: both(&self.force),
            across: both(&self.across),
            sed: (!self.sed.is_empty()).then(|| both(&self.sed)),
            cold_us: both(&self.cold_us),
            warm_us: both(&self.warm_us),
            side_step: [0.5, 1.0].map(|q| quantile(&self.side_step, q).unwrap_or(f64::NAN)),
            told: self.told,
        }
    }
}
