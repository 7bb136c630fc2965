//! Files the service is made of: embedded in the binary, or read from a folder.

use std::{borrow::Cow, fs, io, path::Path};

use sha2::{Digest, Sha256};

use crate::{StartError, config::Config};

/// The shipped models, cards, atlas and replay, as they were when the binary was built.
const MODELS: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/models.rs"));

/// The page, likewise.
pub(crate) const PAGE: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/page.rs"));

/// SHA-256 of `bytes`, 64 lower-case hexadecimal digits.
pub(crate) fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The files of a model folder by name.
#[derive(Debug)]
pub(crate) struct Assets {
    /// Where they are from, for messages.
    pub(crate) origin: String,
    files: Vec<(String, Cow<'static, [u8]>)>,
}

impl Assets {
    /// The files that `config` names: its folder's, or else those built into the binary.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub(crate) fn of(config: &Config) -> Result<Self, StartError> {
        match &config.models {
            Some(folder) => Self::from_folder(folder)
                .map_err(|source| StartError::Folder { folder: folder.clone(), source }),
            None => Ok(Self::embedded()),
        }
    }

    /// The files built into the binary.
    fn embedded() -> Self {
        let files = MODELS.iter().map(|&(name, bytes)| (name.to_owned(), Cow::Borrowed(bytes)));
        Self { origin: "the binary".to_owned(), files: files.collect() }
    }

    /// The `.onnx` and `.json` files of `folder`.
    ///
    /// # Errors
    /// The folder or one of its files cannot be read.
    fn from_folder(folder: &Path) -> io::Result<Self> {
        let mut files = Vec::new();
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            let wanted = path.extension().is_some_and(|e| e == "onnx" || e == "json");
            if let (true, Some(name)) = (wanted, path.file_name().and_then(|n| n.to_str())) {
                files.push((name.to_owned(), Cow::Owned(fs::read(&path)?)));
            }
        }
        Ok(Self { origin: folder.display().to_string(), files })
    }

    /// The bytes of the file called `name`.
    pub(crate) fn get(&self, name: &str) -> Option<&[u8]> {
        self.files.iter().find(|(n, _)| n == name).map(|(_, bytes)| bytes.as_ref())
    }
}
