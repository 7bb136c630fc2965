//! The engines that can run a network.

use std::{fmt, str::FromStr};

/// What runs the network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Backend {
    /// tract: pure Rust, always available.
    #[default]
    Tract,
    /// ONNX Runtime: needs the cargo feature `ort` and the shared library that
    /// `ORT_DYLIB_PATH` names.
    Ort,
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Tract => "tract",
            Self::Ort => "ort",
        })
    }
}

impl FromStr for Backend {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "tract" => Ok(Self::Tract),
            "ort" => Ok(Self::Ort),
            _ => Err(format!("no backend is called '{text}'; there are 'tract' and 'ort'")),
        }
    }
}
