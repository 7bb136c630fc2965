//! The fingers of a service: the default one, to which the models belong, and those of a folder.
//! Each of the latter is loaded when a client first names it.
//!
//! **Invariant:** a finger keeps its place for the life of the process, as a tier keeps its own in
//! its catalogue. Jobs and sessions name a tier by a number that is made of both places.

mod bundle;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use papilla_proto::{ErrorCode, Problem, contact::DEFAULT_FINGER, error::shortened};
use papilla_session_contact::ContactAssets;

pub(crate) use self::bundle::{Bundle, BundleError};
use crate::{
    StartError,
    config::Config,
    core::catalogue::{Catalogue, assets::Assets},
};

/// Longest name of a finger, bytes.
const NAME_MAX: usize = 64;
/// The most names of fingers that an error message lists.
const NAMES_TOLD_MAX: usize = 20;

/// A finger as it is served at one moment.
#[derive(Clone)]
pub(crate) struct Loaded {
    pub(crate) catalogue: Arc<Catalogue>,
    /// Its contact model, if it has one.
    pub(crate) contact: Option<Arc<ContactAssets>>,
}

/// A finger of the folder that was loaded.
#[derive(Clone)]
pub(crate) struct Named {
    pub(crate) loaded: Loaded,
    /// The memory that it takes.
    pub(crate) memory: Memory,
    /// A reload found its folder gone. Open sessions go on with it, and new ones cannot name it.
    pub(crate) retired: bool,
}

/// The memory that a finger takes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Memory {
    /// Size of the files that were read, bytes.
    pub(crate) files_bytes: u64,
    /// Growth of the process' resident memory while it was loaded, bytes; None if the system does
    /// not tell.
    pub(crate) grown_bytes: Option<u64>,
}

/// Why a finger is not served.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FingerError {
    #[error("no finger '{name}'; there are {known}")]
    Unknown { name: String, known: String },
    #[error(
        "no finger '{name}': this service has '{DEFAULT_FINGER}' alone; start it with --fingers DIR, \
         where {name} is a folder in DIR"
    )]
    NoFolder { name: String },
    #[error(
        "finger '{name}' is not loaded, since {most} are, which is the most: {loaded}; name one of \
         these, or start the service with a greater --max-loaded-fingers"
    )]
    TooMany { name: String, most: usize, loaded: String },
    #[error("finger '{name}' cannot be served: {source}")]
    Unusable { name: String, source: Box<BundleError> },
    #[error("the server drains")]
    Draining,
}

impl From<FingerError> for Problem {
    fn from(error: FingerError) -> Self {
        let code = match error {
            FingerError::Unknown { .. } | FingerError::NoFolder { .. } => ErrorCode::NotFound,
            FingerError::TooMany { .. } => ErrorCode::Overloaded,
            FingerError::Unusable { .. } => ErrorCode::BadModel,
            FingerError::Draining => ErrorCode::ShuttingDown,
        };
        Self::new(code, error.to_string())
    }
}

/// Whether a finger can have this name. Such a name is one plain component of a path, so it never
/// leads out of the folder of fingers.
pub(crate) fn is_name(name: &str) -> bool {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_';
    (1..=NAME_MAX).contains(&name.len()) && name.bytes().all(is_plain) && name != DEFAULT_FINGER
}

/// The folder of the finger called `name`.
///
/// # Errors
/// The service has no folder of fingers, the folder cannot be read, or no finger in it has this
/// name.
pub(crate) fn folder(config: &Config, name: &str) -> Result<PathBuf, FingerError> {
    let told = || shortened(name);
    let Some(fingers) = &config.fingers else {
        return Err(FingerError::NoFolder { name: told() });
    };
    let folder = fingers.join(name);
    // A string that is no valid name is never used as a path.
    if is_name(name) && folder.is_dir() {
        return Ok(folder);
    }
    let unreadable = |source: StartError| FingerError::Unusable {
        name: told(),
        source: Box::new(source.into()),
    };
    Err(FingerError::Unknown { name: told(), known: known(&names(fingers).map_err(unreadable)?) })
}

/// The names of the fingers in a folder. Folders whose names a client cannot send are left out.
///
/// # Errors
/// The folder cannot be read.
pub(crate) fn names(fingers: &Path) -> Result<Vec<String>, StartError> {
    let mut names = Assets::fingers(fingers)?;
    names.retain(|name| is_name(name));
    Ok(names)
}

/// The list of names for an error message, the default finger first.
fn known(names: &[String]) -> String {
    let told = names.iter().take(NAMES_TOLD_MAX).map(String::as_str);
    let rest = names.len().saturating_sub(NAMES_TOLD_MAX);
    let rest = (rest > 0).then(|| format!("{rest} more"));
    let all: Vec<&str> = [DEFAULT_FINGER].into_iter().chain(told).chain(rest.as_deref()).collect();
    all.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_leads_out_of_the_folder() {
        for name in ["thumb", "a", "index-2", "s_1"] {
            assert!(is_name(name), "{name}");
        }
        let long = "x".repeat(NAME_MAX + 1);
        for name in ["", ".", "..", "../models", "a/b", "/etc", "a\0", "a b", "default", "é", &long]
        {
            assert!(!is_name(name), "{name}");
        }
    }

    #[test]
    fn a_message_names_some_of_many() {
        assert_eq!(known(&["thumb".to_owned()]), "default, thumb");
        let many: Vec<String> = (0..30).map(|number| format!("f{number}")).collect();
        assert!(known(&many).ends_with(", f19, 10 more"), "{}", known(&many));
    }
}
