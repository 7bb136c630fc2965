//! What `solve` writes of a scene.

use super::error::require;
use super::{Geometry, Scene, SceneError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Files beside `summary.json`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// `series.pvd` and a `.vtu` a state, for ParaView.
    Fields,
    /// Numbers on the atlas (`maps.npz`, `atlas.json`) or, of a section, along the
    /// skin (`lines.npz`).
    Maps,
    /// Images of the maps (`.png`) or plots of the lines (`.svg`).
    Pictures,
}

impl Output {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Fields, Self::Maps, Self::Pictures];

    /// Name in scenes.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Fields => "fields",
            Self::Maps => "maps",
            Self::Pictures => "pictures",
        }
    }

    /// Whether a geometry has it: blocks and meshes from files have no atlas.
    fn fits(self, geometry: &Geometry) -> bool {
        let flat = matches!(geometry, Geometry::Fingertip { .. } | Geometry::Section { .. });
        flat || self == Self::Fields
    }
}

impl Scene {
    /// Whether `solve` is to write something: what the scene names, or, if it names
    /// nothing, all that its geometry has.
    #[must_use]
    pub fn writes(&self, output: Output) -> bool {
        match &self.outputs {
            Some(named) => named.contains(&output),
            None => output.fits(&self.geometry),
        }
    }

    pub(super) fn validate_outputs(&self) -> Result<(), SceneError> {
        let named = self.outputs.as_deref().unwrap_or_default();
        for (i, output) in named.iter().enumerate() {
            let (field, name) = (format!("outputs[{i}]"), output.as_str());
            let twice = named[..i].contains(output);
            require(!twice, field.clone(), &name, "is named twice: name it once")?;
            let rule = "needs an atlas: geometry.kind \"fingertip\" or \"section\"; take it out";
            require(output.fits(&self.geometry), field, &name, rule)?;
        }
        Ok(())
    }
}
