//! The campaign that a command is about.

use papilla_fingertip::campaign::CampaignSpec;
use papilla_fingertip::mesh::named::MESHES;
use std::path::PathBuf;

/// A campaign file, and the mesh if it is not the file's own.
#[derive(clap::Args)]
pub(super) struct CampaignFile {
    /// Campaign file (see campaigns/ and docs/reference/dataset.md).
    campaign: PathBuf,
    /// Its presses on another mesh, one of `convergence`: what a mesh costs and errs.
    #[arg(long, value_name = "NAME")]
    mesh: Option<String>,
}

impl CampaignFile {
    /// Reads it.
    pub(super) fn read(&self) -> anyhow::Result<CampaignSpec> {
        super::refuse_unknown(self.mesh.as_slice(), &MESHES.map(|mesh| mesh.name))?;
        let mut spec = CampaignSpec::read(&self.campaign)?;
        if let Some(mesh) = MESHES.iter().find(|mesh| self.mesh.as_deref() == Some(mesh.name)) {
            (spec.density, spec.order) = (mesh.density, mesh.order);
        }
        Ok(spec)
    }
}
