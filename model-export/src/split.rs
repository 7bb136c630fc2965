//! The option `--split`: which part of a dataset a model is evaluated on.

use papilla_dataset::Split;
use std::{fmt, str::FromStr};

/// Which indentations of a dataset are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SplitOrAll {
    /// Those of a split.
    Split(Split),
    /// All of them: where none was learnt, a split says nothing.
    All,
}

impl From<Split> for SplitOrAll {
    fn from(split: Split) -> Self {
        Self::Split(split)
    }
}

impl fmt::Display for SplitOrAll {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Split(split) => split.fmt(f),
            Self::All => f.write_str("all"),
        }
    }
}

/// There is no such split.
#[derive(Clone, Debug, thiserror::Error)]
#[error("no split '{0}'; there are 'train', 'test' and 'all'")]
pub struct UnknownSplit(String);

impl FromStr for SplitOrAll {
    type Err = UnknownSplit;

    fn from_str(name: &str) -> Result<Self, UnknownSplit> {
        if name == "all" {
            return Ok(Self::All);
        }
        name.parse().map(Self::Split).map_err(|_| UnknownSplit(name.to_owned()))
    }
}
