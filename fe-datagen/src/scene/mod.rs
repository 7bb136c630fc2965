//! Scenes: one press, described in TOML.
//!
//! A scene names a geometry, materials, an indenter, a motion and the effects
//! it wants. What it does not name is not simulated.

pub mod effects;
mod error;
mod geometry;
mod materials;
mod motion;

pub use effects::{EffectName, Plan};
pub use error::SceneError;
pub use geometry::{Geometry, Layer};
pub use materials::{TissueError, TissueTable};
pub use motion::{Motion, PathPoint};

use crate::indenter::IndenterSpec;
use error::require;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A scene file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// What is pressed.
    pub geometry: Geometry,
    /// What tissues are made of; the design's table where not given.
    #[serde(default)]
    pub materials: TissueTable,
    /// What presses; S1's plate if not given.
    #[serde(default)]
    pub indenter: IndenterSpec,
    /// How it moves.
    pub motion: Motion,
    /// Friction, for the effect of that name.
    #[serde(default)]
    pub friction: Friction,
    /// What the scene asks for; S1's analysis if not given.
    #[serde(default = "effects::usual")]
    pub effects: Vec<EffectName>,
    /// Where the file was: paths in it are relative to this folder.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// Coulomb friction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Friction {
    /// Coefficient.
    pub coefficient: f64,
}

/// Largest coefficient of friction that is believed; dry skin on glass reaches 3.
const FRICTION_MAX: f64 = 10.0;

impl Scene {
    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// [`SceneError`] names the file and line, or the field and its rule.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| SceneError::Read { path: path.into(), source })?;
        let mut scene: Self = toml::from_str(&text)
            .map_err(|e| SceneError::Parse { path: path.into(), message: e.to_string() })?;
        scene.folder = path.parent().unwrap_or(Path::new("")).into();
        scene.validate()?;
        Ok(scene)
    }

    /// Checks what the type system cannot.
    ///
    /// # Errors
    /// [`SceneError`] for the first field that makes no sense.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.geometry.validate()?;
        self.motion.validate()?;
        self.indenter.validate()?;
        let c = self.friction.coefficient;
        require(
            (0.0..=FRICTION_MAX).contains(&c),
            "friction.coefficient",
            &c,
            "has to be 0 to 10",
        )?;
        for (i, e) in self.effects.iter().enumerate() {
            let twice = self.effects[..i].contains(e);
            require(!twice, "effects", &e.as_str(), "is named twice")?;
        }
        if matches!(self.geometry, Geometry::Section { .. }) && !self.has("plane_strain") {
            return Err(SceneError::Fields {
                field: "effects",
                rule: "geometry.kind = \"section\" is plane: name the effect \"plane_strain\"",
            });
        }
        self.materials.validate()?;
        self.plan().map(drop)
    }

    /// Whether an effect is named.
    #[must_use]
    pub fn has(&self, effect: &str) -> bool {
        self.effects.iter().any(|e| e.as_str() == effect)
    }

    /// What is going to be simulated.
    ///
    /// # Errors
    /// [`SceneError::Effect`] for an effect that the scene cannot have.
    pub fn plan(&self) -> Result<Plan, SceneError> {
        Plan::new(self)
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
        assert_eq!(scene.effects, effects::usual());
        assert_eq!(scene.materials, TissueTable::default());
        assert_eq!(scene.indenter, IndenterSpec::default());
        let plan = scene.plan().unwrap();
        assert!(!plan.relaxes && plan.friction == 0.0 && !plan.plane_strain);
    }

    #[test]
    fn bad_scenes_name_the_field_and_the_cure() {
        let with = |effects: &str| format!("effects = {effects}\n{FINGER}");
        let section =
            |e: &str| with(&format!("[\"layers\", \"{e}\"]")).replace("fingertip", "section");
        let cases = [
            (FINGER.replace("depth_mm = 1.0", "depth_mm = -1.0"), "motion.depth_mm"),
            (FINGER.replace("depth_mm = 1.0", ""), "exactly one of depth_mm"),
            (FINGER.replace("increments = 4", "increments = 0"), "motion.increments"),
            (FINGER.replace("coarse", "huge"), "huge"),
            (FINGER.replace("depth_mm", "depth"), "line 5"),
            (with("[\"sound\"]"), "unknown effect 'sound'; there are: finite_strain"),
            (with("[\"hyperelastic\"]"), "needs 'finite_strain'"),
            (with("[\"viscoelastic\"]"), "motion.path"),
            (with("[\"plane_strain\"]"), "section"),
            (section("finite_strain"), "name the effect"),
            (section("plane_strain\", \"nail") + "pitch_deg = 3.0\n", "extent = \"whole\""),
            (section("plane_strain") + "yaw_deg = 3.0\n", "motion.roll_deg, yaw_deg"),
            (
                section("plane_strain") + "[geometry.shape]\ndermis_mm = -1.0\n",
                "geometry.shape.dermis_mm = -1 mm",
            ),
            (with("[\"friction\"]"), "friction.coefficient"),
            (with("[\"layers\", \"layers\"]"), "twice"),
            (
                format!(
                    "{FINGER}[materials.dermis]\nyoungs_modulus_mpa = 0.08\npoissons_ratio = 0.5\n"
                ),
                "materials.dermis: Poisson's ratio 0.5",
            ),
            (
                format!(
                    "{FINGER}[materials.dermis]\nyoungs_modulus_mpa = 8e7\npoissons_ratio = 0.4\n"
                ),
                "was Pa meant",
            ),
        ];
        for (text, word) in cases {
            let error = parse(&text).unwrap_err();
            assert!(error.contains(word), "{error} should name {word}");
        }
    }
}
