//! All maps of a dataset as NumPy arrays, for whoever reads them without this crate.

use super::{Dataset, DatasetError, Field, Maps, ShardMaps, sha256_hex};
use ndarray::{Array1, ArrayBase, ArrayView2, Data, Dimension};
use ndarray_npy::{WritableElement, WriteNpyExt as _, write_zeroed_npy};
use papilla_atlas::{MAP_LEN, MAP_SIDE_PX, Patch};
use papilla_output::OutputError;
use serde::Serialize;
use std::fs::{self, File};
use std::io::{BufWriter, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

/// Of `maps.json`; raised when the arrays, or how maps are drawn, change.
const FORMAT: u32 = 1;

/// What was written, and where; also in the folder, as `maps.json`.
#[derive(Clone, Debug, Serialize)]
pub struct ArraysReport {
    /// Raised when the arrays, or how maps are drawn, change.
    pub format: u32,
    /// SHA-256 of the dataset's `manifest.json`: with another one, the maps are of another dataset
    /// or other splits.
    pub manifest_sha256: String,
    /// Hash of the dataset that the maps were drawn from.
    pub dataset_sha256: String,
    /// Hash of the atlas.
    pub atlas_hash: String,
    /// States, which is the length of every array.
    pub states: usize,
    /// Where they were written.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// Draws the maps of all states into `out`, a new folder, which appears whole or not at all:
///
/// | file | type, shape | |
/// |---|---|---|
/// | `pressure_pa.npy` | f32 `[N, 224, 224]` | pressure on the skin, Pa |
/// | `sed_j_per_m3.npy` | f32 `[N, 224, 224]` | SED on the dermis side of the interface, J/m3 |
/// | `press.npy`, `state.npy` | i64 `[N]` | id of the simulation, and which of its states |
/// | `depth_mm.npy` | f32 `[N]` | depth after first touch, mm |
/// | `skin.npy`, `interface.npy` | bool `[224, 224]` | the pixels of both patches |
/// | `maps.json` | | [`ArraysReport`] |
///
/// Simulations follow one another as in the manifest, and states as in their shard. Maps are
/// written one by one, so that memory does not grow with the dataset.
///
/// # Errors
/// [`DatasetError`] when the dataset is damaged, or `out` exists or is not writable.
pub fn arrays(folder: &Path, out: &Path) -> Result<ArraysReport, DatasetError> {
    let dataset = Dataset::open(folder)?;
    if out.exists() {
        let exists = std::io::Error::from(std::io::ErrorKind::AlreadyExists);
        return Err(OutputError::io("write", out)(exists).into());
    }
    let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty());
    let parent = parent.unwrap_or(Path::new("."));
    fs::create_dir_all(parent).map_err(OutputError::io("create", parent))?;
    let partial = tempfile::Builder::new()
        .prefix(papilla_output::atomic::PARTIAL_PREFIX)
        .tempdir_in(parent)
        .map_err(OutputError::io("write in", parent))?;
    let report = draw(&dataset, folder, partial.path(), out)?;
    fs::rename(partial.keep(), out).map_err(OutputError::io("write", out))?;
    Ok(report)
}

fn draw(
    dataset: &Dataset,
    folder: &Path,
    into: &Path,
    out: &Path,
) -> Result<ArraysReport, DatasetError> {
    let path = folder.join("manifest.json");
    let manifest = fs::read(&path).map_err(OutputError::io("read", &path))?;
    let maps = Maps::read(folder, dataset.atlas())?;
    let states = dataset.manifest().presses.iter().map(|press| press.samples).sum();
    let mut pressure = MapFile::new(&into.join("pressure_pa.npy"), states)?;
    let mut sed = MapFile::new(&into.join("sed_j_per_m3.npy"), states)?;
    let (mut ids, mut of_press, mut depth_mm) = (Vec::new(), Vec::new(), Vec::new());
    for press in &dataset.manifest().presses {
        let shard = dataset.shard(press)?;
        let of_shard = maps.of(&shard);
        for state in 0..shard.len() {
            pressure.write(&of_shard, Field::Pressure, state)?;
            sed.write(&of_shard, Field::SedDermis, state)?;
            ids.push(press.id as i64);
            of_press.push(state as i64);
            depth_mm.push(shard.depth_mm[state]);
        }
    }
    pressure.finish()?;
    sed.finish()?;
    for patch in Patch::ALL {
        let mask = maps.raster(patch).mask();
        let mask = ArrayView2::from_shape((MAP_SIDE_PX, MAP_SIDE_PX), mask).expect("a map");
        save(&into.join(format!("{}.npy", patch.name())), &mask)?;
    }
    save(&into.join("press.npy"), &Array1::from(ids))?;
    save(&into.join("state.npy"), &Array1::from(of_press))?;
    save(&into.join("depth_mm.npy"), &Array1::from(depth_mm))?;
    let report = ArraysReport {
        format: FORMAT,
        manifest_sha256: sha256_hex(&manifest),
        dataset_sha256: dataset.manifest().dataset_sha256.clone(),
        atlas_hash: dataset.manifest().atlas_hash.clone(),
        states,
        folder: out.to_owned(),
    };
    let text = serde_json::to_vec_pretty(&report)
        .map_err(|e| OutputError::Encode { what: "JSON", message: e.to_string() })?;
    let path = into.join("maps.json");
    fs::write(&path, text).map_err(OutputError::io("write", &path))?;
    Ok(report)
}

fn save<S, D>(path: &Path, array: &ArrayBase<S, D>) -> Result<(), OutputError>
where
    S: Data,
    S::Elem: WritableElement,
    D: Dimension,
{
    let file = File::create(path).map_err(OutputError::io("write", path))?;
    array
        .write_npy(BufWriter::new(file))
        .map_err(|e| OutputError::Encode { what: "npy", message: e.to_string() })
}

/// An array of maps that are written one after another.
struct MapFile {
    path: PathBuf,
    file: BufWriter<File>,
    map: Vec<f32>,
}

impl MapFile {
    fn new(path: &Path, states: usize) -> Result<Self, OutputError> {
        let failed = |source| OutputError::io("write", path)(source);
        let mut file = File::create_new(path).map_err(failed)?;
        write_zeroed_npy::<f32, _>(&file, (states, MAP_SIDE_PX, MAP_SIDE_PX))
            .map_err(|e| OutputError::Encode { what: "npy", message: e.to_string() })?;
        // The maps follow the header, which is all that is not maps.
        let maps = (states * MAP_LEN * size_of::<f32>()) as u64;
        let header = file.metadata().map_err(failed)?.len() - maps;
        file.seek(SeekFrom::Start(header)).map_err(failed)?;
        Ok(Self { path: path.to_owned(), file: BufWriter::new(file), map: vec![0.0; MAP_LEN] })
    }

    fn write(
        &mut self,
        maps: &ShardMaps<'_>,
        field: Field,
        state: usize,
    ) -> Result<(), DatasetError> {
        maps.draw(field, state, &mut self.map)?;
        for value in &self.map {
            let failed = OutputError::io("write", &self.path);
            self.file.write_all(&value.to_ne_bytes()).map_err(failed)?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<(), OutputError> {
        self.file.flush().map_err(OutputError::io("write", &self.path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, Array3};
    use ndarray_npy::read_npy;

    #[test]
    fn arrays_hold_what_the_maps_are() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let folder = root.join("data/final");
        let target = tempfile::tempdir().unwrap();
        let out = target.path().join("new/maps");
        let report = arrays(&folder, &out).unwrap();
        let dataset = Dataset::open(&folder).unwrap();
        let manifest = fs::read(folder.join("manifest.json")).unwrap();
        assert_eq!(report.manifest_sha256, sha256_hex(&manifest));
        let maps = Maps::read(&folder, dataset.atlas()).unwrap();
        let pressure: Array3<f32> = read_npy(out.join("pressure_pa.npy")).unwrap();
        let sed: Array3<f32> = read_npy(out.join("sed_j_per_m3.npy")).unwrap();
        let press: Array1<i64> = read_npy(out.join("press.npy")).unwrap();
        let depth_mm: Array1<f32> = read_npy(out.join("depth_mm.npy")).unwrap();
        let interface: Array2<bool> = read_npy(out.join("interface.npy")).unwrap();
        assert_eq!(pressure.dim(), (report.states, MAP_SIDE_PX, MAP_SIDE_PX));
        let mut map = vec![0.0; MAP_LEN];
        let mut at = 0;
        for entry in &dataset.manifest().presses {
            let shard = dataset.shard(entry).unwrap();
            let of_shard = maps.of(&shard);
            for state in 0..shard.len() {
                assert_eq!((press[at], depth_mm[at]), (entry.id as i64, shard.depth_mm[state]));
                for (field, found) in [(Field::Pressure, &pressure), (Field::SedDermis, &sed)] {
                    of_shard.draw(field, state, &mut map).unwrap();
                    assert!(found.outer_iter().nth(at).unwrap().iter().eq(&map), "{field:?}");
                }
                assert!(map.iter().zip(&interface).all(|(&sed, &inside)| inside || sed == 0.0));
                at += 1;
            }
        }
        assert_eq!(at, report.states);
        // A folder that is there is left as it is, and nothing is left beside it.
        assert!(arrays(&folder, &out).is_err());
        assert_eq!(fs::read_dir(out.parent().unwrap()).unwrap().count(), 1);
    }
}
