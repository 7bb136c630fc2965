//! Scenes: one indentation, described in TOML.
//!
//! A scene names a geometry, materials, an indenter, a motion and the effects
//! it wants. What it does not name is not simulated.

pub(crate) mod biphasic;
mod census;
pub(crate) mod cure;
pub mod effects;
pub(crate) mod error;
pub mod finger;
mod geometry;
mod materials;
mod motion;
mod origin;
mod outputs;
mod pressure;
#[cfg(test)]
mod tests;
mod told;

pub use biphasic::{Biphasic, SkinFlow};
pub use census::Census;
pub use effects::{EffectName, Plan};
pub use error::SceneError;
pub use finger::{Finger, FingerError};
pub use geometry::{Geometry, Layer};
pub use materials::{MaterialSet, TissueError, TissueTable};
pub use motion::{Motion, PathPoint, Pose};
pub use origin::{Located, Origin, Place};
pub use outputs::Output;
pub use pressure::Pressure;

use crate::geometry::fingertip::FingertipShape;
use crate::indenter::IndenterError;
use crate::mesh::fingertip::{Density, Order};
use error::require;
use papilla_fem::contact::ContactRule;
use papilla_sdf::IndenterSpec;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A scene file.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// What is pressed.
    pub geometry: Geometry,
    /// What tissues are made of; the design's table where not given.
    #[serde(default)]
    pub materials: TissueTable,
    /// What presses; the 20 mm plate of the surface-pressure study if not given.
    #[serde(default)]
    pub indenter: IndenterSpec,
    /// How it moves.
    #[serde(default, skip_serializing_if = "Motion::is_still")]
    pub motion: Motion,
    /// Pressure on the skin in place of an indenter and its motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pressure: Option<Pressure>,
    /// Friction, for the effect of that name.
    #[serde(default)]
    pub friction: Friction,
    /// Where fluid leaves, for the effect `biphasic`.
    #[serde(default, skip_serializing_if = "Biphasic::is_default")]
    pub biphasic: Biphasic,
    /// Where on the skin contact is found; by the indenter's width and the mesh if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<String>")]
    pub contact: Option<ContactRule>,
    /// What the scene asks for; the surface-pressure study's analysis if not given.
    #[serde(default = "effects::usual")]
    pub effects: Vec<EffectName>,
    /// What `solve` writes beside `summary.json`; all that the geometry has if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outputs: Option<Vec<Output>>,
    /// Where the file was: paths in it are relative to this folder.
    #[serde(skip)]
    pub folder: PathBuf,
    /// What the file said, for errors that point at a line.
    #[serde(skip)]
    pub origin: Origin,
}

/// Coulomb friction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Friction {
    /// Coefficient.
    pub coefficient: f64,
}

/// JSON schema of scene files (draft 2020-12), from the types that read them.
#[must_use]
pub fn schema() -> schemars::Schema {
    schemars::schema_for!(Scene)
}

/// Largest coefficient of friction that is believed; dry skin on glass reaches 3.
const FRICTION_MAX: f64 = 10.0;

/// Whether a TOML file has this key at its top.
pub(crate) fn has_key(text: &str, key: &str) -> bool {
    text.parse::<toml::Table>().is_ok_and(|table| table.contains_key(key))
}

impl Scene {
    /// The default finger on the coarse even mesh and the 20 mm plate that presses it by 1 mm, with the
    /// surface-pressure study's analysis: quick, and SED is half wrong.
    #[must_use]
    pub fn usual() -> Self {
        Self {
            geometry: Geometry::Fingertip {
                density: Density::Coarse,
                order: Order::Linear,
                shape: FingertipShape::default(),
                finger: None,
            },
            materials: TissueTable::default(),
            indenter: IndenterSpec::default(),
            motion: Motion::to_depth(1.0, 1, Pose::default()),
            pressure: None,
            friction: Friction::default(),
            biphasic: Biphasic::default(),
            contact: None,
            effects: effects::usual(),
            outputs: None,
            folder: PathBuf::new(),
            origin: Origin::default(),
        }
    }

    /// Reads and checks a scene file.
    ///
    /// # Errors
    /// [`SceneError`] names the file and line, or the field and its rule.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let text = papilla_json::read_text(path)
            .map_err(|source| SceneError::Read { path: path.into(), source })?;
        Self::parse(path, text)
    }

    /// Reads and checks the text of a scene; `path` is where it would stand.
    ///
    /// # Errors
    /// [`SceneError`] names the file and line, or the field and its rule.
    pub fn parse(path: &Path, text: String) -> Result<Self, SceneError> {
        Self::parse_under(path, text, None)
    }

    /// The same, of a scene that is pressed by a map (224 x 224, Pa) which the program has.
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn parse_under(
        path: &Path,
        text: String,
        map_pa: Option<Arc<Vec<f32>>>,
    ) -> Result<Self, SceneError> {
        let origin = Origin::new(path, text);
        if has_key(origin.text(), "presses") {
            let message = "is a campaign, not a scene: `fe-datagen explain` and `generate` take it";
            return Err(SceneError::Incomplete { path: path.into(), message: message.into() });
        }
        let parsed = toml::from_str::<Self>(origin.text());
        let mut scene = parsed.map_err(|e| SceneError::parse(&origin, &e))?;
        scene.folder = path.parent().unwrap_or(Path::new("")).into();
        scene.origin = origin;
        match scene.take(map_pa) {
            Ok(()) => Ok(scene),
            Err(e) => Err(e.at(&scene)),
        }
    }

    /// Checks it, and reads the files that it names.
    fn take(&mut self, map_pa: Option<Arc<Vec<f32>>>) -> Result<(), SceneError> {
        if let Some(map_pa) = map_pa {
            self.take_map(map_pa)?;
        }
        self.take_finger()?;
        if !self.origin.has("effects") {
            effects::add_needed(&mut self.effects, &self.materials);
        }
        self.take_meshes()?;
        self.validate()?;
        self.take_pressure()
    }

    /// Reads the finger that the geometry names; its tissues stand where the file gives none.
    fn take_finger(&mut self) -> Result<(), SceneError> {
        let Geometry::Fingertip { shape, finger: Some(name), .. } = &mut self.geometry else {
            return Ok(());
        };
        if self.origin.has("geometry.shape") {
            let rule = "and geometry.finger both give dimensions: name one of the two";
            return Err(SceneError::Fields { field: "geometry.shape", rule });
        }
        let found = Finger::find(name, &self.folder)?;
        *shape = found.shape;
        if !self.origin.has("materials") {
            self.materials = found.tissue;
        }
        Ok(())
    }

    /// Reads the files of meshes that press.
    fn take_meshes(&mut self) -> Result<(), SceneError> {
        self.indenter.validate().map_err(IndenterError::from)?;
        Ok(self.indenter.load(&self.folder).map_err(IndenterError::from)?)
    }

    /// Where the file says what `field` is; `None` for a scene made by a program or
    /// a field that the file leaves to its default.
    #[must_use]
    pub fn place(&self, field: &str) -> Option<Place> {
        let name = field.strip_prefix("effects[").and_then(|f| f.strip_suffix(']'));
        match name.and_then(|n| self.effects.iter().position(|e| e.as_str() == n)) {
            Some(i) => self.origin.find(&format!("effects[{i}]")),
            None => self.origin.find(field),
        }
    }

    /// Checks what the type system cannot.
    ///
    /// # Errors
    /// [`SceneError`] for the first field that makes no sense.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.geometry.validate()?;
        self.validate_pressure()?;
        self.indenter.validate().map_err(IndenterError::from)?;
        let c = self.friction.coefficient;
        require(
            (0.0..=FRICTION_MAX).contains(&c),
            "friction.coefficient",
            &c,
            "has to be 0 to 10",
        )?;
        for (i, e) in self.effects.iter().enumerate() {
            let twice = self.effects[..i].contains(e);
            require(!twice, format!("effects[{i}]"), &e.as_str(), "is named twice: name it once")?;
        }
        if matches!(self.geometry, Geometry::Section { .. }) && !self.has("plane_strain") {
            return Err(SceneError::Fields {
                field: "effects",
                rule: "geometry.kind = \"section\" is plane: name the effect \"plane_strain\"",
            });
        }
        self.materials.validate()?;
        for name in &self.materials.needs {
            let rule = "is no effect: `fe-datagen explain` lists them";
            require(EffectName::named(name).is_some(), "materials.needs", name, rule)?;
        }
        self.validate_tension()?;
        if self.has("biphasic") {
            self.biphasic.validate(&self.materials)?;
        }
        self.validate_outputs()?;
        self.plan().map(drop)
    }

    /// Refuses tension of the skin where nothing is skin, and with what it was not made for.
    fn validate_tension(&self) -> Result<(), SceneError> {
        const FIELD: &str = "materials.skin_tension_n_per_mm";
        if self.materials.skin_tension_n_per_mm.is_none() {
            return Ok(());
        }
        let refuse = |rule| Err(SceneError::Fields { field: FIELD, rule });
        match &self.geometry {
            Geometry::Block { .. } => refuse("a block has no skin: leave the tension out"),
            _ if self.has("biphasic") => refuse(
                "cannot be combined with the effect \"biphasic\", of which it was not tested \
                 whether its energy and work agree: leave one of the two out",
            ),
            _ => Ok(()),
        }
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
