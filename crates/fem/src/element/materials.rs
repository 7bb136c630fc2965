//! Regions of a body and what each is made of.

use super::ConstitutiveModel;
use std::ops::Index;
use std::sync::Arc;

/// Number of a region of a mesh: elements of one material, as the caller counts them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Region(pub u8);

impl Region {
    /// The number as an index.
    #[inline]
    #[must_use]
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// Constitutive model of each region, and the tension of a surface.
#[derive(Clone)]
pub struct Materials {
    models: Vec<Arc<dyn ConstitutiveModel>>,
    stiff: Vec<bool>,
    /// Surface under tension at rest, N/mm.
    tension: Option<(String, f64)>,
}

impl Materials {
    /// `models` by [`Region::index`].
    #[must_use]
    pub fn new(models: Vec<Arc<dyn ConstitutiveModel>>) -> Self {
        let stiff = vec![false; models.len()];
        Self { models, stiff, tension: None }
    }

    /// Marks regions as so much stiffer than the others that they are as good as held: the
    /// contact penalty and the size of forces are measured by the others, if the mesh has any.
    ///
    /// # Panics
    /// If a region has no model: a programming error.
    #[must_use]
    pub fn with_stiff(mut self, regions: &[Region]) -> Self {
        for r in regions {
            self.stiff[r.index()] = true;
        }
        self
    }

    /// With a named surface of the body under tension at rest, N/mm, in every direction along it.
    #[must_use]
    pub fn with_tension(self, surface: &str, n_per_mm: f64) -> Self {
        Self { tension: Some((surface.to_owned(), n_per_mm)), ..self }
    }

    /// The surface under tension at rest and its tension, N/mm.
    #[must_use]
    pub fn tension(&self) -> Option<(&str, f64)> {
        self.tension.as_ref().map(|(surface, n_per_mm)| (surface.as_str(), *n_per_mm))
    }

    /// The models by region.
    pub fn models(&self) -> impl Iterator<Item = &dyn ConstitutiveModel> {
        self.models.iter().map(AsRef::as_ref)
    }

    /// Number of regions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.models.len()
    }

    /// Whether there is no region.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.models.is_empty()
    }

    /// Largest shear modulus, MPa, of those regions of `used` that are not marked as stiff; of
    /// all of them if every one is.
    pub(crate) fn reference_modulus_mpa(&self, used: impl Fn(Region) -> bool) -> f64 {
        let regions = (0..self.models.len()).map(|r| Region(r as u8));
        let (stiff, soft): (Vec<_>, Vec<_>) =
            regions.filter(|&r| used(r)).partition(|r| self.stiff[r.index()]);
        let of = |regions: &[Region]| {
            regions.iter().map(|&r| self[r].shear_modulus_mpa()).fold(0.0, f64::max)
        };
        if soft.is_empty() { of(&stiff) } else { of(&soft) }
    }
}

impl Index<Region> for Materials {
    type Output = dyn ConstitutiveModel;

    #[inline]
    fn index(&self, region: Region) -> &Self::Output {
        self.models[region.index()].as_ref()
    }
}
