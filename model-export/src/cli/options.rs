//! Options that several commands have.

use papilla_engine::Backend;
use papilla_model_export::ExportError;
use papilla_model_export::dataset::Dataset;
use std::path::{Path, PathBuf};

/// Where the measured states and models are.
#[derive(Debug, clap::Args)]
pub(super) struct Folders {
    /// Folder of the datasets; sets that are not there are left out.
    #[arg(long, default_value = "data", value_name = "FOLDER")]
    pub(super) data: PathBuf,
    #[command(flatten)]
    pub(super) shipped: ModelsFolder,
}

/// Where the models are.
#[derive(Debug, clap::Args)]
pub(super) struct ModelsFolder {
    /// Folder of the models, with index.json, atlas.json and finger.contact.
    #[arg(long, default_value = "models", value_name = "FOLDER")]
    pub(super) models: PathBuf,
}

/// Contact, and the states that it is asked about.
#[derive(Debug, clap::Args)]
pub(super) struct ContactOf {
    /// The contact model, a file of `fe-datagen contact`.
    pub(super) model: PathBuf,
    /// Datasets of the same finger.
    #[arg(required = true)]
    pub(super) datasets: Vec<PathBuf>,
    /// Folder of the finger, if it is not the default one.
    #[arg(long, value_name = "FINGER")]
    pub(super) finger: Option<PathBuf>,
}

impl ContactOf {
    /// Opens one of the datasets, on its finger.
    pub(super) fn open(&self, dataset: &Path) -> Result<Dataset, ExportError> {
        let dataset = Dataset::open(dataset)?;
        match &self.finger {
            Some(finger) => dataset.on_finger(finger),
            None => Ok(dataset),
        }
    }
}

/// A model, and what runs it.
#[derive(Debug, clap::Args)]
pub(super) struct RunModel {
    /// The model, an `.onnx` file.
    pub(super) model: PathBuf,
    /// What runs the model: `tract`, or `ort` in programs built with `--features ort`.
    #[arg(long, default_value_t, value_name = "ENGINE")]
    pub(super) backend: Backend,
}
