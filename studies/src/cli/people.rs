//! What `fit` and `human` both take: measurements of people's fingers, and where to write what.

use papilla_progress::Progress;
use papilla_studies::people::{PeopleError, measured::Measured};
use std::path::PathBuf;

/// Measurements, and where results go.
#[derive(clap::Args)]
pub(super) struct OfPeople {
    /// Measurements in the place of those that come with the program.
    #[arg(long, value_name = "FILE")]
    measured: Option<PathBuf>,
    /// Folder for the report, the files beside it and what a restart needs.
    #[arg(long)]
    pub(super) out: PathBuf,
    /// Also write the page to this file, its plots into a folder in pictures beside it.
    #[arg(long, value_name = "FILE")]
    pub(super) markdown: Option<PathBuf>,
    /// Print the report as JSON.
    #[arg(long)]
    pub(super) json: bool,
}

impl OfPeople {
    /// The measurements that are named, or those that come with the program.
    pub(super) fn measured(&self) -> anyhow::Result<Measured> {
        Ok(match &self.measured {
            Some(file) => Measured::read(file)?,
            None => Measured::shipped()?,
        })
    }

    /// Does the work, which is given how to tell its progress: what it does, how many `units` are
    /// done, and how many there are, `all` at first.
    pub(super) fn told<T>(
        &self,
        units: &str,
        all: usize,
        work: impl FnOnce(&mut dyn FnMut(&str, usize, usize)) -> Result<T, PeopleError>,
    ) -> Result<T, PeopleError> {
        let progress = Progress::new(units, all, 0, self.json);
        work(&mut |what, done, all| {
            progress.set_length(all);
            progress.set_position(done);
            progress.set_message(what);
        })
    }
}
