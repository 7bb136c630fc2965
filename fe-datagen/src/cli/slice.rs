//! The option `--slice`: the part of a campaign that this process solves.

use papilla_fingertip::campaign::{Slice, SliceError};

/// Which slice of the work to do.
#[derive(clap::Args)]
pub(super) struct SliceOption {
    /// Solve part I of N [default: the task of a Slurm job array, else all].
    #[arg(long, value_name = "I/N")]
    slice: Option<Slice>,
}

impl SliceOption {
    /// Whether the flag is given.
    pub(super) fn is_given(&self) -> bool {
        self.slice.is_some()
    }

    /// The part that is asked for: by the flag, or by Slurm.
    pub(super) fn slice(&self) -> Result<Slice, SliceError> {
        let of_slurm = || Slice::of_slurm(|name| std::env::var(name).ok());
        match self.slice {
            Some(slice) => Ok(slice),
            None => Ok(of_slurm()?.unwrap_or(Slice::WHOLE)),
        }
    }
}
