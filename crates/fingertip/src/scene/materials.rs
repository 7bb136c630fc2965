//! What each tissue may be made of.

use crate::materials::{MaterialError, MaterialSpec, OgdenSpec, PronySpec};
use crate::tissue::Tissue;
use papilla_fem::material::Isochoric as _;
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

/// Young's moduli that are believed of a tissue, MPa. The softest tissues have a few
/// hundred Pa; dry horn has thousands of MPa, a collagen bundle tens, cancellous bone
/// from fifty.
const fn believed_mpa(tissue: Tissue) -> [f64; 2] {
    match tissue {
        Tissue::Epidermis => [2e-4, 1e4],
        Tissue::Dermis => [2e-4, 50.0],
        Tissue::Subcutaneous => [2e-4, 10.0],
        Tissue::Nail => [1.0, 2e4],
        Tissue::Bone => [50.0, 2e6],
    }
}

fn check(spec: &MaterialSpec, tissue: Tissue) -> Result<(), MaterialError> {
    spec.constants().moduli_mpa()?;
    let ([low, high], value) = (believed_mpa(tissue), spec.youngs_modulus_mpa);
    if value < low || value > high {
        return Err(MaterialError::Units { value, low, high });
    }
    if let Some(ogden) = &spec.ogden {
        let (law, _) = ogden.law()?;
        let mu0 = law.shear_modulus_mpa();
        if 3.0 * mu0 > high {
            return Err(MaterialError::OgdenUnits(mu0));
        }
    }
    if let Some(fluid) = &spec.biphasic {
        fluid.validate()?;
    }
    spec.prony.as_ref().map_or(Ok(()), |p| p.series().map(drop))
}
