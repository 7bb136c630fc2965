//! FE rungs: folders that `fe-datagen fidelity` wrote.
//!
//! `rungs.json` lists states and rungs; each rung's `.npz` holds `pressure_pa` and
//! `sed_dermis_j_per_m3`, float32 `[N, V]` on the vertices of the atlas. One rung of each
//! folder is the reference: its pressure is every model's input, its SED the truth.

use super::{Canvas, SampleSet, State};
use crate::dataset::read_array;
use crate::evaluate::require_same_atlas;
use crate::metrics::{SampleMetrics, quantile, summarise};
use crate::{ExportError, read, read_text};
use ndarray::{Array2, ArrayView1};
use ndarray_npy::{NpzReader, ReadNpzError};
use papilla_engine::MAP_LEN;
use papilla_engine::ladder::{Discretisation, Kind, Percentiles, Rung};
use papilla_proto::atlas::Raster;
use serde::Deserialize;
use std::io::Cursor;
use std::path::{Component, Path, PathBuf};

const FORMAT: u32 = 1;
/// The set that FE rungs are judged on.
const SET: &str = "reference";

#[derive(Debug, Deserialize)]
struct Listing {
    format: u32,
    atlas_hash: String,
    states: Vec<serde_json::Value>,
    rungs: Vec<Entry>,
}

#[derive(Debug, Deserialize)]
struct Entry {
    name: String,
    unknowns: u64,
    #[serde(default)]
    reference: bool,
    #[serde(default)]
    discretisation_error: Option<Discretisation>,
    seconds: Vec<f64>,
    file: String,
}

/// One rung of one folder.
struct Solved {
    entry: Entry,
    path: PathBuf,
    pressure_pa: Array2<f32>,
    sed_j_per_m3: Array2<f32>,
}

/// All folders; those of one name are one rung.
pub(super) struct Folders {
    /// Rungs of each folder, the reference first.
    folders: Vec<Vec<Solved>>,
}

impl Folders {
    pub(super) fn read(paths: &[PathBuf], canvas: &Canvas) -> Result<Self, ExportError> {
        let folders = paths.iter().map(|path| read_folder(path, canvas));
        Ok(Self { folders: folders.collect::<Result<_, _>>()? })
    }

    /// Inputs and truths of the reference.
    pub(super) fn reference_set(&self, canvas: &Canvas) -> SampleSet {
        let shown = |raster: &Raster, values: ArrayView1<'_, f32>| {
            let values = values.to_vec();
            raster.pixels().iter().map(|pixel| pixel.value(&values)).collect()
        };
        let mut set = SampleSet {
            name: SET,
            about: "not measured: no FE rungs were given".to_owned(),
            dataset_sha256: None,
            states: Vec::new(),
        };
        for solved in self.folders.iter().filter_map(|rungs| rungs.first()) {
            let name = &solved.entry.name;
            set.about = format!("states of the reference, {name}: its pressure, its SED");
            for index in 0..solved.sed_j_per_m3.nrows() {
                set.states.push(State {
                    origin: format!("{}, state {index}", solved.path.display()),
                    pressure_pa: shown(&canvas.skin, solved.pressure_pa.row(index)),
                    sed_j_per_m3: shown(&canvas.interface, solved.sed_j_per_m3.row(index)),
                });
            }
        }
        set
    }

    /// The greatest that the references own up to.
    pub(super) fn discretisation_error(&self) -> Option<Discretisation> {
        let errors = self.folders.iter().filter_map(|rungs| rungs.first());
        errors
            .filter_map(|solved| solved.entry.discretisation_error.clone())
            .max_by(|a, b| a.sed_relative_l2.total_cmp(&b.sed_relative_l2))
    }

    /// Judges every rung by the reference of its folder.
    pub(super) fn rungs(&self, canvas: &Canvas) -> Result<Vec<Rung>, ExportError> {
        let mut names: Vec<&str> = Vec::new();
        for solved in self.folders.iter().flatten() {
            if !names.contains(&solved.entry.name.as_str()) {
                names.push(&solved.entry.name);
            }
        }
        names.into_iter().map(|name| self.rung(name, canvas)).collect()
    }

    fn rung(&self, name: &str, canvas: &Canvas) -> Result<Rung, ExportError> {
        let (mut seconds, mut samples, mut refused) = (Vec::new(), Vec::new(), 0);
        let (mut unknowns, mut is_reference) = (0, false);
        for rungs in &self.folders {
            let Some(reference) = rungs.first() else { continue };
            for solved in rungs.iter().filter(|solved| solved.entry.name == name) {
                seconds.extend(&solved.entry.seconds);
                unknowns = solved.entry.unknowns;
                is_reference |= solved.entry.reference;
                let (judged, failed) = judge(solved, reference, canvas)?;
                samples.extend(judged);
                refused += failed;
            }
        }
        let at = |q| quantile(&seconds, q);
        let errors = summarise(SET, &samples).map(|metrics| (SET.to_owned(), metrics.into()));
        Ok(Rung {
            name: name.to_owned(),
            kind: Kind::Fe,
            model: None,
            onnx_sha256: None,
            bytes: None,
            load_ms: None,
            memory_mib: None,
            latency_ms: None,
            seconds: at(0.5).zip(at(0.99)).map(|(p50, p99)| Percentiles { p50, p99 }),
            unknowns: Some(unknowns),
            reference: is_reference,
            errors: errors.into_iter().collect(),
            refused,
            zero_answer: None,
            pareto: false,
        })
    }
}

/// Figures of each state, and how many states the rung has no SED for.
fn judge(
    solved: &Solved,
    reference: &Solved,
    canvas: &Canvas,
) -> Result<(Vec<SampleMetrics>, usize), ExportError> {
    let (mut samples, mut failed) = (Vec::new(), 0);
    let [mut own, mut truth] = [0, 1].map(|_| vec![0.0; MAP_LEN]);
    for index in 0..solved.sed_j_per_m3.nrows() {
        let row = solved.sed_j_per_m3.row(index).to_vec();
        if row.iter().any(|value| !value.is_finite()) {
            failed += 1;
            continue;
        }
        for (values, map) in
            [(&row, &mut own), (&reference.sed_j_per_m3.row(index).to_vec(), &mut truth)]
        {
            canvas
                .interface
                .rasterise(values, map)
                .map_err(|source| ExportError::Atlas { path: solved.path.clone(), source })?;
        }
        let metrics = SampleMetrics::measure(&own, &truth, &canvas.ground);
        let path = || reference.path.clone();
        samples.push(metrics.ok_or_else(|| ExportError::Truth {
            path: path(),
            sample: index,
            reason: "it is zero",
        })?);
    }
    Ok((samples, failed))
}

fn read_folder(folder: &Path, canvas: &Canvas) -> Result<Vec<Solved>, ExportError> {
    let path = folder.join("rungs.json");
    let bad = |reason: String| ExportError::Dataset { path: path.clone(), reason };
    let listing: Listing = serde_json::from_str(&read_text(&path)?)
        .map_err(|error| bad(format!("not a list of rungs: {error}")))?;
    if listing.format != FORMAT {
        return Err(bad(format!("format {}, this program reads {FORMAT}", listing.format)));
    }
    require_same_atlas(&path.display().to_string(), &listing.atlas_hash, &canvas.atlas_hash)?;
    let references = listing.rungs.iter().filter(|entry| entry.reference).count();
    if references != 1 {
        return Err(bad(format!("{references} rungs are marked as the reference, one must be")));
    }
    let (count, mut rungs) = (listing.states.len(), Vec::new());
    for entry in listing.rungs {
        rungs.push(read_rung(folder, entry, [count, canvas.vertex_count])?);
    }
    rungs.sort_by_key(|solved| !solved.entry.reference);
    let truth = &rungs[0];
    let finite = |array: &Array2<f32>| array.iter().all(|value| value.is_finite());
    if !finite(&truth.sed_j_per_m3) || !finite(&truth.pressure_pa) {
        return Err(bad(format!(
            "the reference {} has states that are not finite",
            truth.entry.name
        )));
    }
    Ok(rungs)
}

fn read_rung(folder: &Path, entry: Entry, expected: [usize; 2]) -> Result<Solved, ExportError> {
    let path = folder.join(&entry.file);
    let bad = |reason: String| ExportError::Dataset { path: path.clone(), reason };
    // A listing must not make the program read files elsewhere.
    if Path::new(&entry.file).components().any(|c| !matches!(c, Component::Normal(_))) {
        return Err(bad("it is no path inside the folder".to_owned()));
    }
    if entry.seconds.len() != expected[0] {
        return Err(bad(format!("{} times for {} states", entry.seconds.len(), expected[0])));
    }
    let unreadable = |error: ReadNpzError| bad(format!("unreadable: {error}"));
    let mut npz = NpzReader::new(Cursor::new(read(&path)?)).map_err(unreadable)?;
    let mut array = |name: &str| -> Result<Array2<f32>, ExportError> {
        let array: Array2<f32> = read_array(&mut npz, name).map_err(unreadable)?;
        if array.shape() != expected {
            return Err(bad(format!("{name} is {:?}, not {expected:?}", array.shape())));
        }
        Ok(array)
    };
    let (pressure_pa, sed_j_per_m3) = (array("pressure_pa")?, array("sed_dermis_j_per_m3")?);
    Ok(Solved { entry, path, pressure_pa, sed_j_per_m3 })
}
