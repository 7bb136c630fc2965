//! Scenes: one press, described in TOML.
//!
//! A scene names a geometry, materials, an indenter, a motion and the effects
//! it wants. What it does not name is not simulated.

use crate::geometry::fingertip::FingertipShape;
use crate::mesh::Tissue;
use crate::mesh::fingertip::{Density, Order};
use crate::press::body::{PlateSpec, TissueConstants};
use crate::press::record::Pose;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// What is pressed.
    pub geometry: Geometry,
    /// Elastic constants by tissue; the design's table where not given.
    #[serde(default)]
    pub materials: TissueConstants,
    /// What presses: a rigid plate.
    #[serde(default)]
    pub plate: PlateSpec,
    /// How it moves.
    pub motion: Motion,
    /// Effects; the default is all that this version has.
    #[serde(default = "Effect::all")]
    pub effects: Vec<Effect>,
}

/// What is pressed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Geometry {
    /// The fingertip; bone and nail plate are rigid.
    Fingertip {
        /// Mesh density.
        density: Density,
        /// Element order.
        #[serde(default)]
        order: Order,
        /// Dimensions that differ from the default.
        #[serde(default)]
        shape: FingertipShape,
    },
    /// A block in layers, pressed from below (`z_min`) and held on top (`z_max`).
    Block {
        /// Lengths along x and y, mm; the layers give the height.
        size_mm: [f64; 2],
        /// Elements along x and y.
        elements: [usize; 2],
        /// Layers from the pressed side.
        layers: Vec<Layer>,
        /// Element order.
        #[serde(default)]
        order: Order,
    },
    /// A Gmsh 4.1 file with physical groups: volumes named by tissue, surfaces
    /// by what they are for.
    Mesh {
        /// The `.msh` file, relative to the scene.
        file: PathBuf,
        /// Surfaces whose nodes are held.
        fixed: Vec<String>,
        /// Surface that the indenter may touch.
        contact: String,
    },
}

/// One layer of a block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// What it is made of.
    pub tissue: Tissue,
    /// Its thickness, mm.
    pub thickness_mm: f64,
    /// Elements through it.
    pub elements: usize,
}

/// How the plate moves: straight along its normal from first touch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Depth from first touch, mm.
    pub depth_mm: f64,
    /// Equally spaced depths at which the state is stored.
    pub increments: usize,
    /// Pitch about y, degrees; tip first is positive.
    #[serde(default)]
    pub pitch_deg: f64,
    /// Roll about x, degrees.
    #[serde(default)]
    pub roll_deg: f64,
    /// Yaw about the plate's normal, degrees.
    #[serde(default)]
    pub yaw_deg: f64,
}

/// Effects of this version. Later ones switch on more physics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// Large displacements and strains (the only kinematics so far).
    FiniteStrain,
    /// Each tissue has its own constants; without it all are subcutaneous tissue.
    Layers,
}

impl Effect {
    fn all() -> Vec<Self> {
        vec![Self::FiniteStrain, Self::Layers]
    }
}

/// Most stored increments of one press.
const INCREMENTS_MAX: usize = 1000;
/// Most elements of a block along an axis or through a layer.
const ELEMENTS_MAX: usize = 1000;

/// Why a scene was refused.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not a scene; the text points at the line.
    #[error("{} is not a scene: {message}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Parser's message with line and column.
        message: String,
    },
    /// A value makes no sense.
    #[error("{field} = {value} {rule}")]
    Value {
        /// Field, dotted.
        field: &'static str,
        /// What was found.
        value: String,
        /// What it has to be.
        rule: &'static str,
    },
}

impl Scene {
    /// Reads and checks a scene file; a mesh file's path is made relative to it.
    ///
    /// # Errors
    /// [`SceneError`] names the file and line, or the field and its rule.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| SceneError::Read { path: path.into(), source })?;
        let mut scene: Self = toml::from_str(&text)
            .map_err(|e| SceneError::Parse { path: path.into(), message: e.to_string() })?;
        if let (Geometry::Mesh { file, .. }, Some(folder)) = (&mut scene.geometry, path.parent()) {
            *file = folder.join(&file);
        }
        scene.validate()?;
        Ok(scene)
    }

    /// Checks what the type system cannot.
    ///
    /// # Errors
    /// [`SceneError::Value`] for the first field that makes no sense.
    pub fn validate(&self) -> Result<(), SceneError> {
        let require = |ok: bool, field, value: &dyn std::fmt::Debug, rule| {
            if ok {
                Ok(())
            } else {
                Err(SceneError::Value { field, value: format!("{value:?}"), rule })
            }
        };
        let length = |v: f64| v.is_finite() && v > 0.0;
        let m = &self.motion;
        require(
            length(m.depth_mm),
            "motion.depth_mm",
            &m.depth_mm,
            "has to be positive and finite",
        )?;
        require(
            (1..=INCREMENTS_MAX).contains(&m.increments),
            "motion.increments",
            &m.increments,
            "has to be 1 to 1000",
        )?;
        let angles = [
            ("motion.pitch_deg", m.pitch_deg),
            ("motion.roll_deg", m.roll_deg),
            ("motion.yaw_deg", m.yaw_deg),
        ];
        for (field, value) in angles {
            require(value.abs() <= 180.0, field, &value, "has to be within -180 to 180")?;
        }
        let p = &self.plate;
        require(
            p.size_mm.iter().all(|&v| length(v)),
            "plate.size_mm",
            &p.size_mm,
            "has to be positive",
        )?;
        let radius_max = 0.5 * p.size_mm[0].min(p.size_mm[1]);
        require(
            p.edge_radius_mm >= 0.0 && p.edge_radius_mm <= radius_max,
            "plate.edge_radius_mm",
            &p.edge_radius_mm,
            "has to be 0 to half the shorter side",
        )?;
        require(
            self.effects.contains(&Effect::FiniteStrain),
            "effects",
            &self.effects,
            "has to name finite_strain: small strain is not part of this version",
        )?;
        if let Geometry::Block { size_mm, elements, layers, .. } = &self.geometry {
            require(
                size_mm.iter().all(|&v| length(v)),
                "geometry.size_mm",
                size_mm,
                "has to be positive",
            )?;
            let count = |n: usize| (1..=ELEMENTS_MAX).contains(&n);
            require(
                elements.iter().all(|&n| count(n)),
                "geometry.elements",
                elements,
                "has to be 1 to 1000",
            )?;
            let good = |l: &Layer| length(l.thickness_mm) && count(l.elements);
            require(
                !layers.is_empty() && layers.iter().all(good),
                "geometry.layers",
                layers,
                "has to list layers of positive thickness with 1 to 1000 elements",
            )?;
        }
        Ok(())
    }

    /// Pose of the plate.
    #[must_use]
    pub fn pose(&self) -> Pose {
        let m = &self.motion;
        Pose { pitch_deg: m.pitch_deg, roll_deg: m.roll_deg, yaw_deg: m.yaw_deg }
    }

    /// Stored depths, mm.
    #[must_use]
    pub fn depths_mm(&self) -> Vec<f64> {
        let n = self.motion.increments;
        (1..=n).map(|i| self.motion.depth_mm * i as f64 / n as f64).collect()
    }

    /// Elastic constants with the `layers` effect applied.
    #[must_use]
    pub fn constants(&self) -> TissueConstants {
        if self.effects.contains(&Effect::Layers) {
            self.materials
        } else {
            let c = self.materials.subcutaneous;
            TissueConstants { epidermis: c, dermis: c, subcutaneous: c }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Scene, String> {
        let scene: Scene = toml::from_str(text).map_err(|e| e.to_string())?;
        scene.validate().map_err(|e| e.to_string())?;
        Ok(scene)
    }

    const FINGER: &str = "[geometry]\nkind = \"fingertip\"\ndensity = \"coarse\"\n[motion]\ndepth_mm = 1.0\nincrements = 4\n";

    #[test]
    fn a_minimal_scene_takes_the_defaults() {
        let scene = parse(FINGER).unwrap();
        assert_eq!(scene.effects, [Effect::FiniteStrain, Effect::Layers]);
        assert_eq!(scene.depths_mm().len(), 4);
        assert_eq!(scene.constants(), TissueConstants::default());
    }

    #[test]
    fn bad_scenes_name_the_field_and_the_line() {
        let cases = [
            (FINGER.replace("depth_mm = 1.0", "depth_mm = -1.0"), "motion.depth_mm"),
            (FINGER.replace("increments = 4", "increments = 0"), "motion.increments"),
            (FINGER.replace("coarse", "huge"), "huge"),
            (FINGER.replace("depth_mm", "depth"), "line 5"),
            (format!("effects = [\"sound\"]\n{FINGER}"), "sound"),
            (format!("effects = [\"layers\"]\n{FINGER}"), "finite_strain"),
        ];
        for (text, word) in cases {
            let error = parse(&text).unwrap_err();
            assert!(error.contains(word), "{error} should name {word}");
        }
    }
}
