//! The table `[materials]` of a scene: the constants of each tissue.

use crate::materials::{MaterialError, MaterialSpec, Moduli, OgdenSpec, PronySpec};
use crate::tissue::Tissue;
use papilla_solid::Isochoric as _;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Constants of every tissue; those of a named set where a scene gives none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Given")]
pub struct TissueTable {
    /// Tension of the skin at rest, N/mm, in every direction along it; none if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin_tension_n_per_mm: Option<f64>,
    /// Effects with which the constants were fitted. A scene has to name them: without them the
    /// constants would mean another finger.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub needs: Vec<String>,
    /// Epidermis.
    pub epidermis: MaterialSpec,
    /// Dermis.
    pub dermis: MaterialSpec,
    /// Subcutaneous tissue.
    pub subcutaneous: MaterialSpec,
    /// Nail plate.
    pub nail: MaterialSpec,
    /// Bone.
    pub bone: MaterialSpec,
}

/// A set of constants for every tissue, by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MaterialSet {
    /// Maeno 1998 (Young's moduli of dermis and fat); Chen, Shuai & Zhu (everything else, Ogden and
    /// Prony series too).
    #[default]
    Papers,
    /// Soft tissues fitted to what was measured on people (studies/reports/fit.md), for the effects
    /// `hyperelastic` and `viscoelastic`.
    People,
}

/// What a file says of the tissues.
#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Given {
    /// The set that gives what no table here gives.
    set: MaterialSet,
    /// Tension of the skin at rest, N/mm, in every direction along it; none if not given.
    skin_tension_n_per_mm: Option<f64>,
    /// Effects with which the constants were fitted, and which a scene therefore has to name [those of
    /// the set].
    needs: Option<Vec<String>>,
    /// Epidermis.
    epidermis: Option<MaterialSpec>,
    /// Dermis.
    dermis: Option<MaterialSpec>,
    /// Subcutaneous tissue.
    subcutaneous: Option<MaterialSpec>,
    /// Nail plate.
    nail: Option<MaterialSpec>,
    /// Bone.
    bone: Option<MaterialSpec>,
}

impl From<Given> for TissueTable {
    fn from(given: Given) -> Self {
        let set = given.set.table();
        Self {
            // No tension is none: it costs nothing and changes no hash.
            skin_tension_n_per_mm: given.skin_tension_n_per_mm.filter(|t| *t != 0.0),
            needs: given.needs.unwrap_or(set.needs),
            epidermis: given.epidermis.unwrap_or(set.epidermis),
            dermis: given.dermis.unwrap_or(set.dermis),
            subcutaneous: given.subcutaneous.unwrap_or(set.subcutaneous),
            nail: given.nail.unwrap_or(set.nail),
            bone: given.bone.unwrap_or(set.bone),
        }
    }
}

impl MaterialSet {
    /// Its constants.
    #[must_use]
    pub fn table(self) -> TissueTable {
        let elastic = MaterialSpec::elastic;
        let papers = TissueTable {
            skin_tension_n_per_mm: None,
            needs: Vec::new(),
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
        };
        match self {
            Self::Papers => papers,
            Self::People => {
                let [epidermis, dermis, subcutaneous] = people();
                let needs = vec!["hyperelastic".into()];
                TissueTable { needs, epidermis, dermis, subcutaneous, ..papers }
            }
        }
    }
}

/// Epidermis, dermis and fat of [`MaterialSet::People`]: what `papilla-studies fit` writes, and the values
/// that it holds (studies/reports/fit.md).
fn people() -> [MaterialSpec; 3] {
    let prony = PronySpec {
        share: vec![0.925, 0.025, 0.025],
        time_s: vec![0.004, 0.070, 1.4],
        moduli: Moduli::LongTerm,
    };
    let epidermis = MaterialSpec::elastic(0.6, 0.495);
    let dermis = MaterialSpec::one_term(0.027, 9.0, 0.495);
    let subcutaneous = MaterialSpec::one_term(0.009451, 9.78, 0.495);
    [epidermis, dermis, subcutaneous]
        .map(|tissue| MaterialSpec { prony: Some(prony.clone()), ..tissue })
}

impl Default for TissueTable {
    fn default() -> Self {
        MaterialSet::default().table()
    }
}

/// Why the table of tissues was refused.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum TissueError {
    /// A tissue's material.
    #[error("materials.{tissue}: {source}")]
    Material {
        /// Tissue.
        tissue: &'static str,
        /// What is wrong.
        source: MaterialError,
    },
    /// The tension of the skin.
    #[error(
        "materials.skin_tension_n_per_mm = {0} has to be 0 to {TENSION_MAX_N_PER_MM} N/mm; skin of \
         people has some 0.01, which is 10 N/m"
    )]
    Tension(f64),
}

/// Largest tension of skin that is believed, N/mm: pre-stresses of up to 92 kPa were found in arms
/// (Flynn, Taberner & Nielsen 2011, abstract), in skin of some 1.2 mm.
const TENSION_MAX_N_PER_MM: f64 = 1.0;

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

    /// Whether the constants were fitted with the effect of this name.
    #[must_use]
    pub fn needs(&self, effect: &str) -> bool {
        self.needs.iter().any(|e| e == effect)
    }

    /// Checks every entry, used or not.
    ///
    /// # Errors
    /// [`TissueError`] names the tissue, or the tension, and what is out of range.
    pub(super) fn validate(&self) -> Result<(), TissueError> {
        if let Some(tension) = self.skin_tension_n_per_mm
            && !(0.0..=TENSION_MAX_N_PER_MM).contains(&tension)
        {
            return Err(TissueError::Tension(tension));
        }
        for tissue in Tissue::ALL {
            check(self.of(tissue), tissue)
                .map_err(|source| TissueError::Material { tissue: tissue.name(), source })?;
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
