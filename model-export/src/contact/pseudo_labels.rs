//! Pseudo-labels: the SED that one network answers to pressures that no simulation has solved, for
//! another network to learn.
//!
//! A simulation with finite elements takes half a minute, contact on pixels and a network take some
//! milliseconds. So there can be far more of these pairs than of simulated ones, at poses and depths
//! in between.

use super::maps::settles_from_nothing;
use super::{Models, Placed, Rung};
use crate::ExportError;
use papilla_contact::{Contact, PixelContact, PixelSkin, PixelSpacing};
use papilla_engine::{MAP_LEN, MAP_SIDE_PX, Session};
use papilla_fingertip::campaign::{CampaignSpec, Indentation, indentations};
use papilla_fingertip::simulation::drive::Approach;
use papilla_output::{OutputError, npz::NpzBuilder};
use papilla_proto::atlas::{Atlas, Patch, Raster};
use std::path::Path;
use std::sync::Arc;

/// Maps of pressure, and the SED that a network answers to each.
#[derive(Debug, Default)]
pub struct PseudoLabels {
    /// Pressure that contact on pixels finds, Pa; `[N, 224, 224]`, row by row.
    pub pressure_pa: Vec<f32>,
    /// What the network answers, J/m3; as `pressure_pa`.
    pub sed_j_per_m3: Vec<f32>,
    /// States left out: unsettled, out of range, never touched.
    pub left_out: usize,
}

impl PseudoLabels {
    /// How many pairs there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.pressure_pa.len() / MAP_LEN
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pressure_pa.is_empty()
    }

    /// The archive: `pressure_pa` and `sed_j_per_m3`, both f32 `[N, 224, 224]`, `atlas_hash` and
    /// `network` (u8, the text's bytes).
    ///
    /// # Errors
    /// [`OutputError`] of an archive past the format's limits.
    pub fn npz(&self, atlas_hash: &str, network: &str) -> Result<Vec<u8>, OutputError> {
        let shape = [self.len(), MAP_SIDE_PX, MAP_SIDE_PX];
        let mut npz = NpzBuilder::new();
        npz.add_slice("atlas_hash", &[atlas_hash.len()], atlas_hash.as_bytes())?;
        npz.add_slice("network", &[network.len()], network.as_bytes())?;
        npz.add_slice("pressure_pa", &shape, &self.pressure_pa)?;
        npz.add_slice("sed_j_per_m3", &shape, &self.sed_j_per_m3)?;
        npz.finish()
    }
}

/// Finds the pressure of a campaign's indentations by contact on pixels, without a simulation.
pub struct Labeller<'a> {
    solver: papilla_contact::Solver,
    pixels: PixelContact,
    contact: Contact,
    network: Box<dyn Session + 'a>,
    path: &'a Path,
}

impl<'a> Labeller<'a> {
    /// Of a contact model, the atlas beside it, and a network that was read from `path`.
    ///
    /// # Errors
    /// [`ExportError`] if atlas and contact model do not go together.
    pub fn new(
        models: &Models,
        atlas: (&Path, &Atlas),
        network: Box<dyn Session + 'a>,
        path: &'a Path,
    ) -> Result<Self, ExportError> {
        let (atlas_path, atlas) = atlas;
        let refused = |source| ExportError::Contact { path: atlas_path.to_owned(), source };
        models.finger.require_atlas(atlas.hash()).map_err(refused)?;
        let raster = Arc::new(Raster::new(atlas, Patch::Skin));
        let skin = PixelSkin::new(&models.finger, atlas, raster);
        let (Some(skin), Some(solver)) = (skin, models.solver(Rung::Pixels)) else {
            let reason = "the contact model has no layers, so it knows no pixels; write it anew \
                with `fe-datagen contact` (skin under tension has no layers)";
            let path = atlas_path.to_owned();
            return Err(ExportError::DatasetFile { path, reason: reason.to_owned() });
        };
        let pixels = PixelContact::new(Arc::new(skin), &models.finger, PixelSpacing::One);
        Ok(Self { solver, pixels, contact: Contact::new(models.finger.vertices()), network, path })
    }

    /// Solves every state of the campaign's indentations, each from nothing, and asks the network.
    ///
    /// # Errors
    /// [`ExportError`] of an indenter that cannot be built, or of the network.
    pub fn label(
        &mut self,
        spec: &CampaignSpec,
        labels: &mut PseudoLabels,
        mut done: impl FnMut(),
    ) -> Result<(), ExportError> {
        let candidates = spec.candidates();
        for indentation in indentations(spec) {
            let indenter = &candidates[indentation.candidate].indenter;
            let bad = |error: papilla_fingertip::indenter::IndenterError| {
                ExportError::DatasetFile { path: spec.folder.clone(), reason: error.to_string() }
            };
            let straight = Approach::straight(indenter, indentation.pose).map_err(bad)?;
            let approach = Approach { offset_mm: indentation.offset_mm, ..straight };
            self.label_one(&indentation, Placed::on_skin(approach, &spec.shape).as_ref(), labels)?;
            done();
        }
        Ok(())
    }

    fn label_one(
        &mut self,
        indentation: &Indentation,
        placed: Option<&Placed>,
        labels: &mut PseudoLabels,
    ) -> Result<(), ExportError> {
        for (depth_mm, slide_mm) in indentation.states() {
            let object = placed.map(|placed| placed.at(depth_mm, slide_mm));
            let parts = (&mut self.solver, &mut self.pixels, &mut self.contact);
            if !settles_from_nothing(object, parts) {
                labels.left_out += 1;
                continue;
            }
            let start = labels.sed_j_per_m3.len();
            labels.pressure_pa.extend_from_slice(self.pixels.map_pa());
            labels.sed_j_per_m3.resize(start + MAP_LEN, 0.0);
            self.network
                .infer(self.pixels.map_pa(), &mut labels.sed_j_per_m3[start..])
                .map_err(ExportError::engine(self.path))?;
        }
        Ok(())
    }
}
