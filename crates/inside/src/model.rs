//! A folder of models: a finger, and the network for it.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use papilla_engine::{
    Card,
    card::{self, Index},
    error_law::ErrorLaws,
    ladder::Kind,
};
use papilla_proto::{
    Warning,
    atlas::{AtlasError, Patch, Raster},
    contact::Input,
};
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
    network: Arc<Network>,
    for_pressure: Arc<Network>,
    /// The cards of the folder's defaults, for poses and for pressure, as far as they are there.
    defaults: [Option<Card>; 2],
    /// By what the errors of answers are told; none: the folder has no `errors.json`.
    pub(crate) error_laws: Option<ErrorLaws>,
}

/// A network, and what is known of it.
pub struct Network {
    /// Runs it.
    pub model: Arc<dyn papilla_engine::Model>,
    /// Its card.
    pub card: Card,
}

fn suits(card: &Card, input: Input) -> bool {
    Kind::of_network(&card.network).suits(card.learnt(), input)
}

fn read_card(folder: &Path, name: &str) -> Result<Card, LoadError> {
    let (file, json) = read_text(folder.join(format!("{name}.json")))?;
    Card::from_json(&json).map_err(|source| LoadError::Engine { file, source })
}

impl Network {
    fn read(folder: &Path, name: &str) -> Result<Self, LoadError> {
        let card = read_card(folder, name)?;
        let (file, onnx) = read(folder.join(format!("{name}.onnx")))?;
        let model = papilla_engine::load(&onnx, Some(&card))
            .map_err(|source| LoadError::Engine { file, source })?;
        Ok(Self { model, card })
    }
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Model").field("name", &self.network.card.name).finish_non_exhaustive()
    }
}

impl Model {
    /// Reads a network of a folder and a contact model. Without a name these are the networks that a
    /// service takes for a client who names none: the index's default, and its default for pressure.
    /// Everything is checked as the service does it; each network runs once.
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
        let network = Arc::new(Network::read(folder, name)?);
        let for_pressure = tier.unwrap_or_else(|| index.default_for_pressure());
        let for_pressure = if for_pressure == name {
            Arc::clone(&network)
        } else {
            Arc::new(Network::read(folder, for_pressure)?)
        };
        let defaults = [&index.default, index.default_for_pressure()].map(|default| {
            let mut loaded = [&network, &for_pressure].into_iter();
            match loaded.find(|loaded| loaded.card.name == default) {
                Some(loaded) => Some(loaded.card.clone()),
                None => read_card(folder, default).ok(),
            }
        });
        let hash = &network.model.info().atlas_hash;
        let bundle = Arc::new(Bundle::read(folder, contact, Some(hash))?);
        let interface = Raster::new(&bundle.atlas, Patch::Interface);
        let error_laws = read_error_laws(folder.join("errors.json"), hash)?;
        let shared = effects::Shared::default();
        Ok(Self { bundle, interface, shared, network, for_pressure, defaults, error_laws })
    }

    /// The network for frames that hold this.
    #[must_use]
    pub fn network_for(&self, input: Input) -> &Arc<Network> {
        match input {
            Input::Pressure => &self.for_pressure,
            Input::Gaps | Input::Objects => &self.network,
        }
    }

    /// The warning about a network that did not learn what frames give, where the default did.
    pub(crate) fn unlearnt(&self, network: &Network, input: Input) -> Option<Warning> {
        let [for_poses, for_pressure] = &self.defaults;
        let default = match input {
            Input::Pressure => for_pressure,
            Input::Gaps | Input::Objects => for_poses,
        };
        let default = default.as_ref()?;
        let is_worse = !suits(&network.card, input) && suits(default, input);
        is_worse.then(|| card::unlearnt(input, &network.card.name, &default.name))
    }

    /// The networks that were loaded, each once.
    pub fn networks(&self) -> impl Iterator<Item = &Arc<Network>> {
        let is_other = !Arc::ptr_eq(&self.network, &self.for_pressure);
        std::iter::once(&self.network).chain(is_other.then_some(&self.for_pressure))
    }

    /// The network on the terms of a hello: the one that it names, or else the one for its frames.
    /// None: it names another.
    pub(crate) fn chosen(&self, tier: Option<&str>, input: Input) -> Option<&Arc<Network>> {
        match tier {
            None => Some(self.network_for(input)),
            Some(name) => self.networks().find(|network| network.card.name == name),
        }
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
