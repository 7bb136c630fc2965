//! The folder of one finger: its atlas, and what finds contact.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use papilla_contact::{ContactModel, InterfaceSkin, PixelSkin, finger_file_sha256};
use papilla_proto::{
    atlas::{Atlas, Patch, Raster},
    contact::ContactErrors,
};
use papilla_render::SkinPixels;
use papilla_session_contact::{Skin, contact_errors, model_sha256};

use crate::{
    LoadError,
    folder::{read, read_text},
};

/// File of the contact model in a bundle.
const CONTACT: &str = "finger.contact";

/// A finger that sessions share.
pub struct Bundle {
    /// Which point of the finger each pixel is.
    pub atlas: Atlas,
    /// The skin of the atlas as a map.
    pub raster: Arc<Raster>,
    /// What finds pressure from poses and gaps.
    pub contact: Option<Arc<ContactModel>>,
    pub(crate) pixels: SkinPixels,
    pub(crate) contact_errors: Option<ContactErrors>,
    /// SHA-256 of the contact model's file.
    contact_sha256: Option<String>,
    pixel_skin: Option<Arc<PixelSkin>>,
    interface_skin: Option<Arc<InterfaceSkin>>,
}

impl std::fmt::Debug for Bundle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bundle").field("atlas", &self.atlas.hash()).finish_non_exhaustive()
    }
}

impl Bundle {
    /// Reads a finger that is to be touched: `atlas.json`, `finger.contact`, and `contact.json` if it
    /// is there. No network is needed.
    ///
    /// # Errors
    /// A file is missing or damaged, or the contact model is of another atlas.
    pub fn load(folder: &Path) -> Result<Self, LoadError> {
        let contact = folder.join(CONTACT);
        Self::read(folder, Some(&contact), None)
    }

    /// Reads the atlas of a folder alone.
    ///
    /// # Errors
    /// It is missing or damaged.
    pub fn without_contact(folder: &Path) -> Result<Self, LoadError> {
        Self::read(folder, None, None)
    }

    /// Reads the atlas of a folder, which has to have this hash, and the contact model that is named.
    pub(crate) fn read(
        folder: &Path,
        contact: Option<&Path>,
        hash: Option<&str>,
    ) -> Result<Self, LoadError> {
        let (file, json) = read_text(folder.join("atlas.json"))?;
        let atlas = Atlas::from_json(&json)
            .and_then(|atlas| hash.map_or(Ok(()), |hash| atlas.require_hash(hash)).map(|()| atlas))
            .map_err(|source| LoadError::Atlas { file, source })?;
        let contact = contact.map(|file| read_contact(file.to_owned(), &atlas)).transpose()?;
        let ReadContact { contact, contact_errors, contact_sha256 } = contact.unwrap_or_default();
        let raster = Arc::new(Raster::new(&atlas, Patch::Skin));
        let pixels = SkinPixels::from(&*raster);
        let pixel_skin = contact.as_ref().and_then(|m| PixelSkin::new(m, &atlas, raster.clone()));
        let of_interface = |m| InterfaceSkin::new(m, &atlas, raster.clone()).map(Arc::new);
        let interface_skin = contact.as_deref().and_then(of_interface);
        Ok(Self {
            pixel_skin: pixel_skin.map(Arc::new),
            interface_skin,
            contact_errors,
            contact_sha256,
            atlas,
            raster,
            contact,
            pixels,
        })
    }

    /// What a hand is made of.
    pub(crate) fn skin(&self) -> Skin<'_> {
        Skin {
            atlas: &self.atlas,
            raster: &self.raster,
            model: self.contact.as_ref(),
            pixels: self.pixel_skin.as_ref(),
            interface: self.interface_skin.as_ref(),
            errors: self.contact_errors.as_ref(),
            model_sha256: self.contact_sha256.as_deref(),
        }
    }
}

/// A contact model, and what methods err with it if a file beside it tells that.
#[derive(Default)]
struct ReadContact {
    contact: Option<Arc<ContactModel>>,
    contact_errors: Option<ContactErrors>,
    contact_sha256: Option<String>,
}

/// Refuses a contact model of a folder's finger that was described otherwise when it was made. A model
/// of another name is not that folder's.
fn require_finger(model: &ContactModel, file: &Path) -> Result<(), LoadError> {
    let described = file.with_file_name("finger.toml");
    if model.header().finger_file_sha256.is_empty()
        || file.file_name().is_none_or(|name| name != CONTACT)
        || !described.exists()
    {
        return Ok(());
    }
    let (described, text) = read_text(described)?;
    let skin = |name: &str| fs::read(file.with_file_name(Path::new(name).file_name()?)).ok();
    let sha256 = finger_file_sha256(&text, skin)
        .map_err(|source| LoadError::Finger { file: described, source })?;
    model
        .require_finger_file(&sha256)
        .map_err(|source| LoadError::Contact { file: file.to_owned(), source })
}

fn read_contact(file: PathBuf, atlas: &Atlas) -> Result<ReadContact, LoadError> {
    let (file, bytes) = read(file)?;
    let beside = file.with_file_name("contact.json");
    let model = ContactModel::read(&bytes)
        .and_then(|model| model.require_atlas(atlas.hash()).map(|()| model))
        .map_err(|source| LoadError::Contact { file: file.clone(), source })?;
    require_finger(&model, &file)?;
    let sha256 = model_sha256(&bytes);
    let contact_errors = if beside.exists() {
        let (file, json) = read(beside)?;
        contact_errors(&json, &sha256).map_err(|source| LoadError::Errors { file, source })?
    } else {
        None
    };
    Ok(ReadContact { contact: Some(Arc::new(model)), contact_errors, contact_sha256: Some(sha256) })
}
