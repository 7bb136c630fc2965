//! A map of pressure in place of an indenter.

use super::error::require;
use super::{Motion, Scene, SceneError};
use ndarray_npy::{NpzReader, ReadNpyError, ReadNpyExt as _};
use papilla_atlas::{DOUBTED_BELOW_PA, MAP_LEN, MAP_SIDE_PX};
use papilla_sdf::IndenterSpec;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Pressure on the skin, which presses in place of an indenter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pressure {
    /// File of a map on the atlas, Pa: `.npy`, or `.npz` with an `array`. It has 224 rows and columns,
    /// or is several such maps one behind the other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Name of the array in an `.npz`.
    #[serde(default = "pressure_pa")]
    pub array: String,
    /// Which of several maps, from 0; the last if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<usize>,
    /// Equal shares of the pressure at which the state is stored.
    #[serde(default = "one")]
    pub increments: usize,
    /// The map, Pa, once the file was read, or as a program gives it in place of a file.
    #[serde(skip)]
    pub map_pa: Option<Arc<Vec<f32>>>,
}

impl Default for Pressure {
    fn default() -> Self {
        Self { file: None, array: pressure_pa(), frame: None, increments: one(), map_pa: None }
    }
}

fn pressure_pa() -> String {
    "pressure_pa".into()
}

fn one() -> usize {
    1
}

/// Most stored increments.
const INCREMENTS_MAX: usize = 1000;
/// Beyond it a pressure in Pa must have been meant in another unit.
const PRESSURE_MAX_PA: f32 = 1e7;
/// Largest file that is read.
const FILE_BYTES_MAX: u64 = 1 << 30;

const ONE_MAP: &str = "give one map: in a file, or by the program that runs the scene";

/// A file that cannot be read.
fn refused(message: String) -> SceneError {
    SceneError::Pressure { field: "pressure.file", message }
}

impl Scene {
    /// Takes the map that a program gives in place of a file.
    pub(super) fn take_map(&mut self, map_pa: Arc<Vec<f32>>) -> Result<(), SceneError> {
        let pressure = self.pressure.get_or_insert_default();
        if pressure.file.is_some() {
            return Err(SceneError::Fields { field: "pressure", rule: ONE_MAP });
        }
        pressure.map_pa = Some(map_pa);
        Ok(())
    }

    /// Reads the file of pressure, once for all that is done with the scene.
    pub(super) fn take_pressure(&mut self) -> Result<(), SceneError> {
        if let Some(pressure) = &mut self.pressure {
            pressure.map_pa = Some(pressure.map_pa(&self.folder)?);
        }
        Ok(())
    }

    /// Whether pressure goes with the rest of the scene.
    pub(super) fn validate_pressure(&self) -> Result<(), SceneError> {
        let Some(pressure) = &self.pressure else { return self.motion.validate() };
        let fields = |field, rule| Err(SceneError::Fields { field, rule });
        if !self.motion.is_still() {
            return fields(
                "motion",
                "pressure takes an indenter's place, and does not move: leave motion out",
            );
        }
        if self.indenter != IndenterSpec::default() {
            return fields("indenter", "pressure takes its place: give one of the two");
        }
        if self.has("friction") || self.contact.is_some() {
            let field = if self.has("friction") { "effects" } else { "contact" };
            return fields(field, "pressure has no indenter that could touch or rub: leave it out");
        }
        if !matches!(self.geometry, super::Geometry::Fingertip { .. }) {
            return fields("pressure", "needs an atlas: geometry.kind \"fingertip\"");
        }
        if pressure.file.is_none() && pressure.map_pa.is_none() {
            return fields("pressure", ONE_MAP);
        }
        if let Some(map) = &pressure.map_pa {
            pressure.checked(map)?;
        }
        require(
            (1..=INCREMENTS_MAX).contains(&pressure.increments),
            "pressure.increments",
            &pressure.increments,
            "has to be 1 to 1000",
        )
    }
}

impl Motion {
    /// Whether nothing is said of a motion.
    pub(crate) fn is_still(&self) -> bool {
        *self == Self::default()
    }
}

impl Pressure {
    /// The map, 224 x 224, Pa; `folder` is the scene's.
    ///
    /// # Errors
    /// [`SceneError::Pressure`] for a file that cannot be read or holds no pressure.
    pub fn map_pa(&self, folder: &Path) -> Result<Arc<Vec<f32>>, SceneError> {
        let map = match (&self.map_pa, &self.file) {
            (Some(map), _) => Arc::clone(map),
            (None, Some(file)) => Arc::new(self.read(&folder.join(file))?),
            (None, None) => return Err(refused("no map is given".into())),
        };
        self.checked(&map)?;
        Ok(map)
    }

    /// The map cannot press: `message` says why.
    pub(crate) fn cannot(&self, message: String) -> SceneError {
        let field = if self.file.is_some() { "pressure.file" } else { "pressure" };
        SceneError::Pressure { field, message }
    }

    /// Whether a map is one that can press.
    fn checked(&self, map: &[f32]) -> Result<(), SceneError> {
        if map.len() != MAP_LEN {
            let values = map.len();
            let message = format!("{values} values; {MAP_LEN} of 224 x 224 pixels are due");
            return Err(self.cannot(message));
        }
        let at = |i: usize| format!("row {}, column {}", i / MAP_SIDE_PX, i % MAP_SIDE_PX);
        if let Some(i) = map.iter().position(|p| !(p.is_finite() && *p >= 0.0)) {
            let message = format!("{} Pa at {}; skin is pressed, never pulled", map[i], at(i));
            return Err(self.cannot(message));
        }
        let most = map.iter().copied().fold(0.0, f32::max);
        if most <= 0.0 {
            return Err(self.cannot("no pressure anywhere".into()));
        }
        if most > PRESSURE_MAX_PA {
            let message = format!("{most:e} Pa; were Pa meant? {PRESSURE_MAX_PA:e} at most");
            return Err(self.cannot(message));
        }
        Ok(())
    }

    /// The greatest pressure of a map, if it is so small that it was probably given in kPa or MPa.
    #[must_use]
    pub(crate) fn tiny_pa(map: &[f32]) -> Option<f32> {
        let most = map.iter().copied().fold(0.0, f32::max);
        (most < DOUBTED_BELOW_PA).then_some(most)
    }

    fn read(&self, path: &Path) -> Result<Vec<f32>, SceneError> {
        let name = path.display();
        let bad = |why: &dyn std::fmt::Display| refused(format!("{name}: {why}"));
        let file = File::open(path).map_err(|e| bad(&e))?;
        let bytes = file.metadata().map_err(|e| bad(&e))?.len();
        if bytes > FILE_BYTES_MAX {
            return Err(bad(&format!("{bytes} bytes; {FILE_BYTES_MAX} at most are read")));
        }
        let is_npz = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npz"));
        let array = if is_npz {
            let mut npz = NpzReader::new(BufReader::new(file)).map_err(|e| bad(&e))?;
            let names = npz.names().map_err(|e| bad(&e))?;
            let plain = |n: &String| n.strip_suffix(".npy").unwrap_or(n) == self.array;
            let Some(member) = names.iter().find(|n| plain(n)).cloned() else {
                let known = names.join(", ");
                return Err(bad(&format!("no array '{}'; there are: {known}", self.array)));
            };
            match npz.by_name::<ndarray::OwnedRepr<f32>, ndarray::IxDyn>(&member) {
                Ok(array) => array,
                Err(ndarray_npy::ReadNpzError::Npy(ReadNpyError::WrongDescriptor(_))) => {
                    let wide = npz.by_name::<ndarray::OwnedRepr<f64>, ndarray::IxDyn>(&member);
                    wide.map_err(|e| bad(&e))?.mapv(|v| v as f32)
                }
                Err(e) => return Err(bad(&e)),
            }
        } else {
            match ndarray::ArrayD::<f32>::read_npy(BufReader::new(file)) {
                Ok(array) => array,
                Err(ReadNpyError::WrongDescriptor(_)) => {
                    let again = File::open(path).map_err(|e| bad(&e))?;
                    let wide = ndarray::ArrayD::<f64>::read_npy(BufReader::new(again));
                    wide.map_err(|e| bad(&e))?.mapv(|v| v as f32)
                }
                Err(e) => return Err(bad(&e)),
            }
        };
        let shape = array.shape().to_vec();
        let is_map = |of: &[usize]| *of == [MAP_SIDE_PX; 2];
        let values: Vec<f32> = array.iter().copied().collect();
        match &shape[..] {
            map if is_map(map) => match self.frame {
                None | Some(0) => Ok(values),
                Some(frame) => Err(bad(&format!("no map {frame}: it holds a single one"))),
            },
            [maps, rest @ ..] if is_map(rest) && *maps > 0 => {
                let frame = self.frame.unwrap_or(maps - 1);
                let map = values.chunks_exact(MAP_LEN).nth(frame).map(<[f32]>::to_vec);
                map.ok_or_else(|| bad(&format!("no map {frame}; it holds {maps}, from 0")))
            }
            _ => Err(bad(&format!(
                "an array of shape {shape:?}; [224, 224] or [n, 224, 224] is due"
            ))),
        }
    }
}
