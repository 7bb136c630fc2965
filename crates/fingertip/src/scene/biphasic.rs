//! The table `[biphasic]` of a scene: where the fluid of a body may leave.

use super::error::{SceneError, require};
use super::materials::TissueTable;
use crate::tissue::Tissue;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The body's fluid, for the effect of that name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Biphasic {
    /// Whether fluid leaves through the surface that may be touched.
    pub skin: SkinFlow,
}

/// What the skin does to fluid; every other surface is sealed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SkinFlow {
    /// Nothing passes.
    #[default]
    Sealed,
    /// Fluid leaves freely, touched or not: its pressure there is 0.
    Drained,
}

impl Biphasic {
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Refuses tissue that nothing flows through behind a skin through which all may leave.
    pub(super) fn validate(self, materials: &TissueTable) -> Result<(), SceneError> {
        for tissue in Tissue::ALL.into_iter().filter(|_| self.skin == SkinFlow::Drained) {
            let Some(fluid) = &materials.of(tissue).biphasic else { continue };
            let k = fluid.permeability_mm4_per_n_s;
            require(
                k > 0.0,
                format!("materials.{}.biphasic.permeability_mm4_per_n_s", tissue.name()),
                &k,
                "has to be above 0 mm4/(N s) behind biphasic.skin = \"drained\": fluid cannot get \
                 out of what lets none through; give a permeability or seal the skin",
            )?;
        }
        Ok(())
    }
}
