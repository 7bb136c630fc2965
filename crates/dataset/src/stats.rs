//! What is in a dataset: ranges, worst checks, a table per depth.

use super::{
    Dataset, DatasetError, DroppedSample, FailedIndentation, IndentationEntry, Shard,
    contact_sheet, worst_checks,
};
use crate::record::Checks;
use papilla_atlas::{Atlas, Patch};
use papilla_output::OutputError;
use papilla_vector::{cross, minus, norm};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Spread of a quantity over samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Range {
    /// Smallest.
    pub min: f64,
    /// Middle (lower one of two).
    pub median: f64,
    /// Largest.
    pub max: f64,
}

impl Range {
    /// The spread of some values; `None` without any.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let (&min, &max) = (values.first()?, values.last()?);
        Some(Self { min, median: values[(values.len() - 1) / 2], max })
    }
}

/// All samples of one depth.
#[derive(Clone, Debug, Serialize)]
pub struct DepthStats {
    /// Depth, mm.
    pub depth_mm: f64,
    /// Samples.
    pub samples: usize,
    /// Magnitude of the plate's force, N.
    pub force_n: Range,
    /// Largest pressure of a sample, Pa.
    pub pressure_peak_pa: Range,
    /// Largest SED of a sample on the dermis side, J/m3.
    pub sed_dermis_peak_j_per_m3: Range,
    /// Largest SED of a sample on the epidermis side, J/m3.
    pub sed_epidermis_peak_j_per_m3: Range,
    /// Undeformed skin area under pressure, mm2 (each vertex with its share).
    pub contact_area_mm2: Range,
}

/// The report of `dataset stats`.
#[derive(Clone, Debug, Serialize)]
pub struct StatsReport {
    /// The dataset's folder.
    pub folder: PathBuf,
    /// Program that wrote it.
    pub software: String,
    /// Hash of the atlas.
    pub atlas_hash: String,
    /// Hash of the dataset.
    pub dataset_sha256: String,
    /// Vertices of each patch.
    pub vertex_count: usize,
    /// Indentations with a shard.
    pub presses: usize,
    /// Samples in all.
    pub samples: usize,
    /// Samples for training.
    pub samples_train: usize,
    /// Samples held out.
    pub samples_test: usize,
    /// Bytes of all shards.
    pub shard_bytes: u64,
    /// Indentations by name of the indenter.
    pub indenters: BTreeMap<String, usize>,
    /// Pitch over the indentations, degrees.
    pub pitch_deg: Range,
    /// Roll over the indentations, degrees.
    pub roll_deg: Range,
    /// Yaw over the indentations, degrees.
    pub yaw_deg: Range,
    /// Largest pressure, Pa.
    pub pressure_max_pa: f64,
    /// Largest SED on the dermis side, J/m3.
    pub sed_max_j_per_m3: f64,
    /// One entry per depth, rising.
    pub depths: Vec<DepthStats>,
    /// The worst of each check over all samples.
    pub worst_checks: Checks,
    /// Indentations that failed.
    pub failed: Vec<FailedIndentation>,
    /// Samples that were left out.
    pub dropped: Vec<DroppedSample>,
    /// Where the contact sheet was written, if one was asked for.
    pub contact_sheet: Option<PathBuf>,
}

/// Most depths that get a line of their own.
const DEPTHS_MAX: usize = 40;

/// The values of one sample that the table shows.
struct Row {
    force_n: f64,
    pressure_pa: f64,
    dermis: f64,
    epidermis: f64,
    area_mm2: f64,
}

/// Reads every shard of the dataset in `folder` (checking hashes) and sums it
/// up; writes a contact sheet PNG to `sheet` if given.
///
/// # Errors
/// [`DatasetError`] when the dataset is damaged or the sheet cannot be written.
pub fn stats(folder: &Path, sheet: Option<&Path>) -> Result<StatsReport, DatasetError> {
    let dataset = Dataset::open(folder)?;
    let area_mm2 = vertex_areas_mm2(dataset.atlas());
    let mut depths: BTreeMap<i64, Vec<Row>> = BTreeMap::new();
    let mut shard_bytes = 0;
    for press in &dataset.manifest().presses {
        let path = folder.join(&press.file);
        shard_bytes += std::fs::metadata(&path).map_err(OutputError::io("read", &path))?.len();
        let shard = dataset.shard(press)?;
        for sample in 0..shard.len() {
            // Depths are stored in f32: group them by the nearest nanometre.
            let key = (f64::from(shard.depth_mm[sample]) * 1e6).round() as i64;
            depths.entry(key).or_default().push(row(&shard, sample, &area_mm2));
        }
    }
    let depths = grouped(depths);
    if let Some(path) = sheet {
        contact_sheet(&dataset, path)?;
    }
    let depths = depths.into_iter().filter_map(|(key, rows)| depth_stats(key, &rows)).collect();
    report(&dataset, depths, shard_bytes, sheet)
}

/// Depths that differ from one indentation to the next would make a line a sample: those are
/// grouped by the nearest quarter of a millimetre.
fn grouped(depths: BTreeMap<i64, Vec<Row>>) -> BTreeMap<i64, Vec<Row>> {
    if depths.len() <= DEPTHS_MAX {
        return depths;
    }
    let mut groups: BTreeMap<i64, Vec<Row>> = BTreeMap::new();
    for (key, rows) in depths {
        let group = (key as f64 / 0.25e6).round() as i64 * 250_000;
        groups.entry(group).or_default().extend(rows);
    }
    groups
}

fn report(
    dataset: &Dataset,
    depths: Vec<DepthStats>,
    shard_bytes: u64,
    sheet: Option<&Path>,
) -> Result<StatsReport, DatasetError> {
    let m = dataset.manifest();
    let empty = || DatasetError::Empty { path: dataset.folder().join("manifest.json") };
    let range = |value: fn(&IndentationEntry) -> f64| {
        Range::of(m.presses.iter().map(value).collect()).ok_or_else(empty)
    };
    let samples =
        |split| -> usize { m.presses.iter().filter(|p| p.split == split).map(|p| p.samples).sum() };
    let (samples_train, samples_test) = (samples(super::Split::Train), samples(super::Split::Test));
    Ok(StatsReport {
        folder: dataset.folder().to_path_buf(),
        software: m.software.clone(),
        atlas_hash: m.atlas_hash.clone(),
        dataset_sha256: m.dataset_sha256.clone(),
        vertex_count: m.vertex_count,
        presses: m.presses.len(),
        samples: samples_train + samples_test,
        samples_train,
        samples_test,
        shard_bytes,
        indenters: m.presses.iter().fold(BTreeMap::new(), |mut count, p| {
            *count.entry(p.indenter.clone()).or_default() += 1;
            count
        }),
        pitch_deg: range(|p| p.pose.pitch_deg)?,
        roll_deg: range(|p| p.pose.roll_deg)?,
        yaw_deg: range(|p| p.pose.yaw_deg)?,
        pressure_max_pa: m.pressure_max_pa,
        sed_max_j_per_m3: m.sed_max_j_per_m3,
        depths,
        worst_checks: worst_checks(m.presses.iter().map(|p| &p.checks)).ok_or_else(empty)?,
        failed: m.failed.clone(),
        dropped: m.dropped.clone(),
        contact_sheet: sheet.map(Path::to_path_buf),
    })
}

fn row(shard: &Shard, sample: usize, area_mm2: &[f64]) -> Row {
    let peak = |field: &ndarray::Array2<f32>| {
        field.row(sample).iter().fold(0.0, |a: f64, b| a.max(f64::from(*b)))
    };
    let pressure = shard.pressure_pa.row(sample);
    let loaded = pressure.iter().zip(area_mm2).filter(|(p, _)| **p > 0.0);
    Row {
        force_n: shard
            .force_n
            .row(sample)
            .iter()
            .map(|f| f64::from(*f).powi(2))
            .sum::<f64>()
            .sqrt(),
        pressure_pa: peak(&shard.pressure_pa),
        dermis: peak(&shard.sed_dermis_j_per_m3),
        epidermis: peak(&shard.sed_epidermis_j_per_m3),
        area_mm2: loaded.map(|(_, area)| area).sum(),
    }
}

fn depth_stats(key: i64, rows: &[Row]) -> Option<DepthStats> {
    let range = |value: fn(&Row) -> f64| Range::of(rows.iter().map(value).collect());
    Some(DepthStats {
        depth_mm: key as f64 / 1e6,
        samples: rows.len(),
        force_n: range(|r| r.force_n)?,
        pressure_peak_pa: range(|r| r.pressure_pa)?,
        sed_dermis_peak_j_per_m3: range(|r| r.dermis)?,
        sed_epidermis_peak_j_per_m3: range(|r| r.epidermis)?,
        contact_area_mm2: range(|r| r.area_mm2)?,
    })
}

/// A third of the area of each triangle goes to each of its vertices.
fn vertex_areas_mm2(atlas: &Atlas) -> Vec<f64> {
    let positions = &atlas.patch(Patch::Skin).positions_mm;
    let mut areas = vec![0.0; positions.len()];
    for triangle in atlas.triangles() {
        let [a, b, c] = triangle.map(|i| positions[i as usize].map(f64::from));
        let area = 0.5 * norm(cross(minus(b, a), minus(c, a)));
        for vertex in triangle {
            areas[*vertex as usize] += area / 3.0;
        }
    }
    areas
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::atlas;

    #[test]
    fn vertex_areas_sum_to_the_patch() {
        // The test atlas is a square of 184 px at 0.1 mm.
        let total: f64 = vertex_areas_mm2(&atlas(5)).iter().sum();
        assert!((total - 18.4 * 18.4).abs() < 1e-3, "{total}");
    }

    #[test]
    fn a_range_needs_values() {
        assert_eq!(Range::of(vec![]), None);
        let range = Range::of(vec![3.0, 1.0, 2.0, 9.0]).unwrap();
        assert_eq!(range, Range { min: 1.0, median: 2.0, max: 9.0 });
    }
}
