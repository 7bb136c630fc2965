//! Makes the dataset from what the slices of a campaign have left in a folder.

use crate::assemble::manifest;
use crate::state::{Found, Workspace};
use crate::{CampaignError, CampaignReport};
use papilla_fingertip::campaign::{CampaignSpec, indentations};
use papilla_output::atomic;
use std::path::Path;

/// Indentations that are named where some are missing.
const NAMED: usize = 5;

/// Writes the manifest of a campaign whose every indentation is solved, or failed, into its
/// folder: a dataset of the same bytes whoever solved what.
///
/// # Errors
/// [`CampaignError`] when the folder is of no campaign or of another, an indentation has no
/// record, a shard is not what its record vouches for, every indentation failed, or the manifest
/// cannot be written. Nothing has been changed then.
pub fn merge(spec: &CampaignSpec, folder: &Path) -> Result<CampaignReport, CampaignError> {
    spec.validate()?;
    let (workspace, atlas) = Workspace::begun(folder, spec)?;
    let (mut states, mut missing, mut named) = (Vec::new(), 0, Vec::new());
    for press in indentations(spec) {
        let why = match workspace.load(&press) {
            Found::Vouched(state) => {
                states.push(*state);
                continue;
            }
            Found::Absent => "not solved".to_owned(),
            Found::Untrusted(why) => why,
        };
        missing += 1;
        if named.len() < NAMED {
            named.push(format!("{} ({why})", press.id));
        }
    }
    if missing > 0 {
        let (presses, first) = (spec.presses, named.join(", "));
        return Err(CampaignError::Holes { missing, presses, first });
    }
    let manifest = manifest(spec, &atlas, &states)?;
    atomic::write_json(&workspace.folder().join("manifest.json"), &manifest)?;
    workspace.remove_partial()?;
    Ok(CampaignReport {
        name: spec.name.clone(),
        folder: folder.to_path_buf(),
        presses: spec.presses,
        samples: manifest.presses.iter().map(|p| p.samples).sum(),
        samples_due: spec.samples(),
        failed: manifest.failed,
        dropped: manifest.dropped,
        pressure_max_pa: manifest.pressure_max_pa,
        sed_max_j_per_m3: manifest.sed_max_j_per_m3,
        dataset_sha256: manifest.dataset_sha256,
        solver_seconds: states.iter().map(|s| s.seconds).sum(),
    })
}
