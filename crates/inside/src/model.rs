//! A folder of models: atlas, one network, and the contact model if there is one.

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::Arc,
};

use papilla_contact::{ContactModel, InterfaceSkin, PixelSkin};
use papilla_engine::{Card, EngineError, card::Index};
use papilla_proto::{
    atlas::{Atlas, AtlasError, Patch, Raster},
    contact::ContactErrors,
};
use papilla_render::SkinPixels;
use papilla_session_contact::{AssetsError, contact_errors};
use papilla_session_effects as effects;

/// Why a folder cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// A file cannot be read.
    #[error(
        "{}: {source}; a folder of models holds index.json, atlas.json, NAME.onnx and NAME.json",
        .file.display()
    )]
    File {
        /// Which.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The index does not list the model.
    #[error("no tier '{name}'; {} lists {known}", .file.display())]
    Unknown {
        /// The index.
        file: PathBuf,
        /// The model that was asked for.
        name: String,
        /// Those that there are.
        known: String,
    },
    /// The network, its card or the index is no good.
    #[error("{}: {source}", .file.display())]
    Engine {
        /// Which.
        file: PathBuf,
        /// Why.
        source: EngineError,
    },
    /// The atlas is no good, or another one than the network's.
    #[error("{}: {source}", .file.display())]
    Atlas {
        /// The file that does not fit.
        file: PathBuf,
        /// Why.
        source: AtlasError,
    },
    /// The contact model is no good, or of another atlas.
    #[error("{}: {source}", .file.display())]
    Contact {
        /// Which.
        file: PathBuf,
        /// Why.
        source: papilla_contact::ModelError,
    },
    /// What the contact model's methods err cannot be read.
    #[error("{}: {source}", .file.display())]
    Errors {
        /// The file.
        file: PathBuf,
        /// Why.
        source: AssetsError,
    },
}

/// A model that sessions share.
pub struct Model {
    /// Which point of the finger each pixel is.
    pub atlas: Atlas,
    /// The skin of the atlas as a map.
    pub skin: Arc<Raster>,
    pub(crate) interface: Raster,
    pub(crate) pixels: SkinPixels,
    pub(crate) shared: effects::Shared,
    /// The network.
    pub network: Arc<dyn papilla_engine::Model>,
    /// What is known of the network.
    pub card: Card,
    /// What finds pressure from poses and gaps.
    pub contact: Option<Arc<ContactModel>>,
    pub(crate) contact_errors: Option<ContactErrors>,
    pub(crate) pixel_skin: Option<Arc<PixelSkin>>,
    pub(crate) interface_skin: Option<Arc<InterfaceSkin>>,
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Model").field("name", &self.card.name).finish_non_exhaustive()
    }
}

fn read(file: PathBuf) -> Result<(PathBuf, Vec<u8>), LoadError> {
    match fs::read(&file) {
        Ok(bytes) => Ok((file, bytes)),
        Err(source) => Err(LoadError::File { file, source }),
    }
}

fn read_text(file: PathBuf) -> Result<(PathBuf, String), LoadError> {
    match papilla_proto::json::read_text(&file) {
        Ok(text) => Ok((file, text)),
        Err(source) => Err(LoadError::File { file, source }),
    }
}

impl Model {
    /// Reads a network of a folder, the index's default without a name, and a contact model.
    /// Everything is checked as the service does it; the network runs once.
    ///
    /// # Errors
    /// A file is missing, damaged, or of another atlas.
    pub fn load(
        folder: &Path,
        tier: Option<&str>,
        contact: Option<&Path>,
    ) -> Result<Self, LoadError> {
        let (file, json) = read_text(folder.join("index.json"))?;
        let index = match Index::from_json(&json) {
            Ok(index) => index,
            Err(source) => return Err(LoadError::Engine { file, source }),
        };
        let name = tier.unwrap_or(&index.default);
        if !index.models.iter().any(|listed| listed == name) {
            let known = index.models.join(", ");
            return Err(LoadError::Unknown { file, name: name.to_owned(), known });
        }
        let (file, json) = read_text(folder.join(format!("{name}.json")))?;
        let card = Card::from_json(&json).map_err(|source| LoadError::Engine { file, source })?;
        let (file, onnx) = read(folder.join(format!("{name}.onnx")))?;
        let network = papilla_engine::load(&onnx, Some(&card))
            .map_err(|source| LoadError::Engine { file, source })?;
        let (file, json) = read_text(folder.join("atlas.json"))?;
        let atlas = Atlas::from_json(&json)
            .and_then(|atlas| atlas.require_hash(&network.info().atlas_hash).map(|()| atlas))
            .map_err(|source| LoadError::Atlas { file, source })?;
        let contact = contact.map(|file| read_contact(file, &atlas)).transpose()?;
        let (contact, contact_errors) = contact.unzip();
        let contact_errors = contact_errors.flatten();
        let [skin, interface] = [Patch::Skin, Patch::Interface].map(|p| Raster::new(&atlas, p));
        let pixels = SkinPixels::from(&skin);
        let shared = effects::Shared::default();
        let skin = Arc::new(skin);
        let pixel_skin = contact.as_ref().and_then(|m| PixelSkin::new(m, &atlas, skin.clone()));
        let pixel_skin = pixel_skin.map(Arc::new);
        let of_interface = |m| InterfaceSkin::new(m, &atlas, skin.clone()).map(Arc::new);
        let interface_skin = contact.as_deref().and_then(of_interface);
        Ok(Self {
            atlas,
            skin,
            interface,
            pixels,
            shared,
            network,
            card,
            contact,
            contact_errors,
            pixel_skin,
            interface_skin,
        })
    }

    /// Draws values at the vertices of the skin as a map.
    ///
    /// # Errors
    /// Another number of values than vertices, or of pixels than 224 x 224.
    pub fn rasterise(&self, values: &[f32], map: &mut [f32]) -> Result<(), AtlasError> {
        self.skin.rasterise(values, map)
    }
}

/// A contact model, and what methods err with it if a file beside it tells that.
fn read_contact(
    file: &Path,
    atlas: &Atlas,
) -> Result<(Arc<ContactModel>, Option<ContactErrors>), LoadError> {
    let (file, bytes) = read(file.to_owned())?;
    let beside = file.with_file_name("contact.json");
    let model = ContactModel::read(&bytes)
        .and_then(|model| model.require_atlas(atlas.hash()).map(|()| model))
        .map_err(|source| LoadError::Contact { file, source })?;
    let errors = if beside.exists() {
        let (file, json) = read(beside)?;
        contact_errors(&json, &bytes).map_err(|source| LoadError::Errors { file, source })?
    } else {
        None
    };
    Ok((Arc::new(model), errors))
}
