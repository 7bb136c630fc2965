//! A folder of models: a finger and one network.

use std::{
    fs, io,
    path::{Path, PathBuf},
    sync::Arc,
};

use papilla_engine::{Card, EngineError, card::Index, error_law::ErrorLaws};
use papilla_proto::atlas::{AtlasError, Patch, Raster};
use papilla_session_contact::AssetsError;
use papilla_session_effects as effects;

use crate::Bundle;

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
    /// The finger.
    pub bundle: Arc<Bundle>,
    pub(crate) interface: Raster,
    pub(crate) shared: effects::Shared,
    /// The network.
    pub network: Arc<dyn papilla_engine::Model>,
    /// What is known of the network.
    pub card: Card,
    /// By what the errors of answers are told; none: the folder has no `errors.json`.
    pub(crate) error_laws: Option<ErrorLaws>,
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Model").field("name", &self.card.name).finish_non_exhaustive()
    }
}

pub(crate) fn read(file: PathBuf) -> Result<(PathBuf, Vec<u8>), LoadError> {
    match fs::read(&file) {
        Ok(bytes) => Ok((file, bytes)),
        Err(source) => Err(LoadError::File { file, source }),
    }
}

pub(crate) fn read_text(file: PathBuf) -> Result<(PathBuf, String), LoadError> {
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
        let hash = &network.info().atlas_hash;
        let bundle = Arc::new(Bundle::read(folder, contact, Some(hash))?);
        let interface = Raster::new(&bundle.atlas, Patch::Interface);
        let error_laws = read_error_laws(folder.join("errors.json"))?;
        let shared = effects::Shared::default();
        Ok(Self { bundle, interface, shared, network, card, error_laws })
    }

    /// Draws values at the vertices of the skin as a map.
    ///
    /// # Errors
    /// Another number of values than vertices, or of pixels than 224 x 224.
    pub fn rasterise(&self, values: &[f32], map: &mut [f32]) -> Result<(), AtlasError> {
        self.bundle.raster.rasterise(values, map)
    }
}

/// The laws of errors, if the folder has any.
fn read_error_laws(file: PathBuf) -> Result<Option<ErrorLaws>, LoadError> {
    if !file.exists() {
        return Ok(None);
    }
    let (file, json) = read_text(file)?;
    ErrorLaws::from_json(&json).map(Some).map_err(|source| LoadError::Engine { file, source })
}
