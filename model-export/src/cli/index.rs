//! `model-export index`.

use super::{load_card, load_model, print_json};
use anyhow::{Context, bail};
use papilla_engine::{Backend, card::Index};
use papilla_model_export::evaluate::require_atlas;
use papilla_model_export::{ExportError, read_atlas, write};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Folder with NAME.onnx, NAME.json and atlas.json.
    folder: PathBuf,
    /// The model for clients that name none.
    #[arg(long, value_name = "NAME")]
    default: String,
    /// Another one for those of them that give pressure, not poses or gaps.
    #[arg(long, value_name = "NAME")]
    default_for_pressure: Option<String>,
    /// A model that the service loads when a client first names it, and that no budget picks; may
    /// be given several times.
    #[arg(long, value_name = "NAME")]
    on_demand: Vec<String>,
    /// The finger whose presses trained models whose atlas is not the one in the folder: they serve
    /// the folder's finger by similarity alone, which the service then says in every answer.
    #[arg(long, value_name = "FINGER")]
    trained_on: Option<String>,
}

pub(crate) fn run(options: &Options, json: bool) -> anyhow::Result<()> {
    let path = options.folder.join("atlas.json");
    if !path.exists() {
        bail!(
            "{} is not there: copy the atlas.json of the dataset that the models were trained on",
            path.display()
        );
    }
    let atlas = read_atlas(&path)?;
    let mut models = names(&options.folder)?;
    // From small to large: the order in which they are offered.
    models.sort_by_key(|(bytes, name)| (*bytes, name.clone()));
    let models: Vec<String> = models.into_iter().map(|(_, name)| name).collect();
    let defaults = || std::iter::once(&options.default).chain(&options.default_for_pressure);
    let named = defaults().chain(&options.on_demand);
    if let Some(stranger) = named.into_iter().find(|name| !models.contains(name)) {
        bail!("there is no model '{stranger}' in {}", options.folder.display());
    }
    if let Some(default) = defaults().find(|name| options.on_demand.contains(name)) {
        bail!("the default '{default}' has to be loaded at the start");
    }
    // In the order of the models.
    let on_demand =
        models.iter().filter(|name| options.on_demand.contains(name)).cloned().collect();
    for name in &models {
        let card = load_card(&options.folder.join(format!("{name}.json")))?;
        let path = options.folder.join(format!("{name}.onnx"));
        let model = load_model(&path, Backend::Tract, Some(&card))?;
        if model.info().name != *name {
            bail!("{} calls itself '{}'", path.display(), model.info().name);
        }
        if options.trained_on.is_none() {
            require_atlas("atlas.json", atlas.hash(), model.info())?;
        }
    }
    let (default, trained_on) = (options.default.clone(), options.trained_on.clone());
    let default_for_pressure = options.default_for_pressure.clone();
    let index = Index { default, default_for_pressure, models, on_demand, trained_on };
    let text = serde_json::to_string_pretty(&index)? + "\n";
    let path = options.folder.join("index.json");
    write(&path, text.as_bytes())?;
    if json {
        return print_json(&index);
    }
    let defaults = index.defaults().map(|(member, name)| format!("{member} {name}"));
    let defaults = defaults.collect::<Vec<_>>().join(", ");
    println!("{}: {} ({defaults})", path.display(), index.models.join(", "));
    Ok(())
}

/// Length and name of every `.onnx` file.
fn names(folder: &Path) -> anyhow::Result<Vec<(u64, String)>> {
    let failed = |source| ExportError::Io { action: "read", path: folder.to_owned(), source };
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let path = entry.path();
        if path.extension().is_some_and(|ending| ending == "onnx") {
            let name = path.file_stem().and_then(|name| name.to_str());
            let name = name.with_context(|| format!("{} is no UTF-8 name", path.display()))?;
            names.push((entry.metadata().map_err(failed)?.len(), name.to_owned()));
        }
    }
    Ok(names)
}
