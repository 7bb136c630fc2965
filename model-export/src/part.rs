//! The option `--split`: which part of a dataset a model is evaluated on.

use papilla_dataset::Split;
use std::{fmt, str::FromStr};

/// Which indentations of a dataset are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Those of a split.
    Split(Split),
    /// All of them: where none was learnt, a split says nothing.
    All,
}

impl From<Split> for Part {
    fn from(split: Split) -> Self {
        Self::Split(split)
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Split(split) => split.fmt(f),
            Self::All => f.write_str("all"),
        }
    }
}

/// There is no such part.
#[derive(Clone, Debug, thiserror::Error)]
#[error("no part '{0}'; there are 'train', 'test' and 'all'")]
pub struct UnknownPart(String);

impl FromStr for Part {
    type Err = UnknownPart;

    fn from_str(name: &str) -> Result<Self, UnknownPart> {
        if name == "all" {
            return Ok(Self::All);
        }
        name.parse().map(Self::Split).map_err(|_| UnknownPart(name.to_owned()))
    }
}
