//! What each tissue may be made of.

use crate::material::spec::{MaterialError, MaterialSpec, OgdenSpec, PronySpec};
use crate::mesh::Tissue;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Constants of every tissue; the design's table where a scene gives none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TissueTable {
    /// Epidermis: Chen, Shuai & Zhu.
    pub epidermis: MaterialSpec,
    /// Dermis: Maeno 1998; Ogden and Prony from Chen, Shuai & Zhu.
    pub dermis: MaterialSpec,
    /// Subcutaneous tissue: Maeno 1998; Ogden and Prony from Chen, Shuai & Zhu.
    pub subcutaneous: MaterialSpec,
    /// Nail plate: Chen, Shuai & Zhu.
    pub nail: MaterialSpec,
    /// Bone: Chen, Shuai & Zhu.
    pub bone: MaterialSpec,
}

impl Default for TissueTable {
    fn default() -> Self {
        let elastic = MaterialSpec::elastic;
        Self {
            epidermis: elastic(0.136, 0.48),
            dermis: MaterialSpec {
                ogden: Some(OgdenSpec::skin()),
                prony: Some(PronySpec::skin()),
                ..elastic(0.080, 0.48)
            },
            subcutaneous: MaterialSpec {
                ogden: Some(OgdenSpec::subcutaneous()),
                prony: Some(PronySpec::subcutaneous()),
                ..elastic(0.034, 0.48)
            },
            nail: elastic(170.0, 0.30),
            bone: elastic(17_000.0, 0.30),
        }
    }
}

/// Why a tissue's material was refused.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
#[error("materials.{tissue}: {source}")]
pub struct TissueError {
    /// Tissue.
    pub tissue: &'static str,
    /// What is wrong.
    pub source: MaterialError,
}

impl TissueTable {
    /// Entry of a tissue.
    #[must_use]
    pub fn of(&self, tissue: Tissue) -> &MaterialSpec {
        match tissue {
            Tissue::Epidermis => &self.epidermis,
            Tissue::Dermis => &self.dermis,
            Tissue::Subcutaneous => &self.subcutaneous,
            Tissue::Nail => &self.nail,
            Tissue::Bone => &self.bone,
        }
    }

    /// Checks every entry, used or not.
    ///
    /// # Errors
    /// [`TissueError`] names the tissue and what is out of range.
    pub(super) fn validate(&self) -> Result<(), TissueError> {
        for tissue in Tissue::ALL {
            check(self.of(tissue), tissue)
                .map_err(|source| TissueError { tissue: tissue.name(), source })?;
        }
        Ok(())
    }
}

/// Dry horn has a few thousand MPa: beyond it a soft tissue's modulus must have
/// been meant in another unit.
const SOFT_MAX_MPA: f64 = 1e4;

fn check(spec: &MaterialSpec, tissue: Tissue) -> Result<(), MaterialError> {
    spec.constants().moduli_mpa()?;
    let soft = tissue != Tissue::Nail && tissue != Tissue::Bone;
    if soft && spec.youngs_modulus_mpa > SOFT_MAX_MPA {
        return Err(MaterialError::Units(spec.youngs_modulus_mpa));
    }
    spec.ogden.as_ref().map_or(Ok(()), |o| o.law().map(drop))?;
    spec.prony.as_ref().map_or(Ok(()), |p| p.series().map(drop))
}
