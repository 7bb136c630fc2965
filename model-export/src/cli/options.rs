//! Options that several commands have.

use papilla_engine::Backend;
use std::path::PathBuf;

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
