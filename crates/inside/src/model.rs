//! A folder of models: a finger and one network.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use papilla_engine::{Card, card::Index, error_law::ErrorLaws};
use papilla_proto::atlas::{AtlasError, Patch, Raster};
use papilla_session_effects as effects;

use crate::{
    Bundle, LoadError,
    folder::{read, read_text},
};

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
        let error_laws = read_error_laws(folder.join("errors.json"), hash)?;
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

/// The laws of errors, if the folder has those of this atlas.
fn read_error_laws(file: PathBuf, atlas_hash: &str) -> Result<Option<ErrorLaws>, LoadError> {
    if !file.exists() {
        return Ok(None);
    }
    let (file, json) = read_text(file)?;
    let laws = ErrorLaws::from_json(&json).map_err(|source| LoadError::Engine { file, source })?;
    Ok(Some(laws).filter(|laws| laws.atlas_hash == atlas_hash))
}
