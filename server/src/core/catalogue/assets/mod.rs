//! The files of the service: models, atlas, contact model. They are embedded in the binary, or read
//! from a folder.

mod detached;
mod folder;

use std::{
    borrow::Cow,
    path::{Path, PathBuf},
};

use papilla_session_contact::{AssetsError, ContactAssets};

use crate::{StartError, config::Config};

/// The contact model's file among the others.
pub(crate) const CONTACT: &str = "finger.contact";
/// What a finger is made of; the file by which its folder is known.
pub(crate) const FINGER: &str = "finger.toml";
/// Most bytes of all files of a finger's folder that are read.
pub(crate) const FINGER_FILES_BYTES_MAX: u64 = 256 << 20;
/// The offset of its skin from the template, if it has one.
pub(crate) const SKIN: &str = "skin.json";
/// What methods err with it.
pub(crate) const CONTACT_ERRORS: &str = "contact.json";

/// By what the errors of answers are told.
pub(crate) const ERROR_LAWS: &str = "errors.json";

/// The shipped models, cards, atlas, replay and contact model, as they were when the binary was built.
const MODELS: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/models.rs"));

/// The origin of those.
const EMBEDDED: &str = "the binary";

const FINGER_ADVICE: &str = "the folder of a finger holds finger.toml, index.json, atlas.json, and \
    NAME.onnx and NAME.json of every model in the index; copy it anew if a copy broke off";

/// Files by name.
type Files = Vec<(String, Cow<'static, [u8]>)>;

/// The files of a model folder by name.
#[derive(Debug)]
pub(crate) struct Assets {
    /// Where they are from, for messages.
    pub(crate) origin: String,
    /// What to do if one is missing.
    advice: &'static str,
    files: Files,
    /// The folder, and names of files there that were not read: of models to be loaded on demand.
    unread: Option<(PathBuf, Vec<String>)>,
}

impl Assets {
    /// The files that `config` names: its folder's, or else those built into the binary.
    ///
    /// # Errors
    /// The folder or one of its files cannot be read.
    pub(crate) fn of(config: &Config) -> Result<Self, StartError> {
        // Never stopped, so there always are some.
        Self::of_unless(config, &|| false).map(|assets| assets.unwrap_or_else(Self::embedded))
    }

    /// The same, given up once it is to stop: None then.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub(crate) fn of_unless(
        config: &Config,
        is_to_stop: &dyn Fn() -> bool,
    ) -> Result<Option<Self>, StartError> {
        let Some(folder) = &config.models else { return Ok(Some(Self::embedded())) };
        let read = folder::read(folder, folder::FOLDER_BYTES_MAX, is_to_stop)?;
        Ok(read.map(|folder::Found { files, unread }| Self::of_folder(folder, files, unread)))
    }

    /// The files of a finger's folder; given up once it is to stop: None then.
    ///
    /// # Errors
    /// The folder or one of its files cannot be read.
    pub(crate) fn of_finger(
        folder: &Path,
        is_to_stop: &dyn Fn() -> bool,
    ) -> Result<Option<Self>, StartError> {
        let read = folder::read(folder, FINGER_FILES_BYTES_MAX, is_to_stop)?;
        let assets =
            read.map(|folder::Found { files, unread }| Self::of_folder(folder, files, unread));
        Ok(assets.map(|assets| Self { advice: FINGER_ADVICE, ..assets }))
    }

    /// The names of the fingers in a folder: of each folder in it that holds [`FINGER`].
    ///
    /// # Errors
    /// It cannot be read.
    pub(crate) fn fingers(folder: &Path) -> Result<Vec<String>, StartError> {
        folder::fingers(folder)
    }

    /// Bytes of the files that were read.
    pub(crate) fn bytes(&self) -> u64 {
        self.files.iter().map(|(_, bytes)| bytes.len() as u64).sum()
    }

    /// One file of a folder, or else of those built into the binary, without the others.
    ///
    /// # Errors
    /// There is none, or it cannot be read.
    pub(crate) fn one(folder: Option<&Path>, file: &str) -> Result<Cow<'static, [u8]>, StartError> {
        let assets = match folder {
            Some(folder) => Self::of_folder(folder, Vec::new(), vec![file.to_owned()]),
            None => Self::embedded(),
        };
        assets.model(file).map(|bytes| Cow::Owned(bytes.into_owned()))
    }

    /// Where the files are from that `config` names, for messages.
    pub(crate) fn origin(config: &Config) -> String {
        match &config.models {
            Some(folder) => folder.display().to_string(),
            None => EMBEDDED.to_owned(),
        }
    }

    fn of_folder(folder: &Path, files: Files, unread: Vec<String>) -> Self {
        Self {
            origin: folder.display().to_string(),
            advice: "a folder of models holds index.json, atlas.json, and NAME.onnx and NAME.json \
                     of every model in the index",
            files,
            unread: Some((folder.to_owned(), unread)),
        }
    }

    /// The files built into the binary.
    fn embedded() -> Self {
        let files = MODELS.iter().map(|&(name, bytes)| (name.to_owned(), Cow::Borrowed(bytes)));
        Self {
            origin: EMBEDDED.to_owned(),
            advice: "build with the shipped files in models/, or name a folder of models with \
                     --models DIR",
            files: files.collect(),
            unread: None,
        }
    }

    /// Requires that there is a file called `name`, read or not.
    ///
    /// # Errors
    /// There is none.
    pub(crate) fn require_there(&self, name: &str) -> Result<(), StartError> {
        let is_unread =
            self.unread.iter().any(|(_, unread)| unread.iter().any(|unread| unread == name));
        if is_unread { Ok(()) } else { self.require(name).map(|_| ()) }
    }

    /// The bytes of a model's file; one that was not read is read now.
    ///
    /// # Errors
    /// There is none, or it cannot be read.
    pub(crate) fn model(&self, name: &str) -> Result<Cow<'_, [u8]>, StartError> {
        if let Some((folder, unread)) = &self.unread
            && unread.iter().any(|unread| unread == name)
            && let Some(bytes) = folder::read_one(folder, name)?
        {
            return Ok(Cow::Owned(bytes));
        }
        self.require(name).map(Cow::Borrowed)
    }

    /// Refuses a contact model that was made before the finger's description in this folder was changed:
    /// its atlas may be the same, since bone and tissues do not show there. Without a description there
    /// is nothing to compare with.
    ///
    /// # Errors
    /// [`AssetsError`].
    pub(crate) fn require_finger_of(&self, contact: &ContactAssets) -> Result<(), AssetsError> {
        let Some(text) = self.get(FINGER) else { return Ok(()) };
        let skin = |name: &str| self.get(name).map(<[u8]>::to_vec);
        contact.require_finger_file(&String::from_utf8_lossy(text), skin)
    }

    /// The bytes of the file called `name`.
    ///
    /// # Errors
    /// There is none.
    pub(crate) fn require(&self, name: &str) -> Result<&[u8], StartError> {
        self.get(name).ok_or_else(|| StartError::Missing {
            file: name.to_owned(),
            origin: self.origin.clone(),
            advice: self.advice,
        })
    }

    /// The bytes of the file called `name`.
    pub(crate) fn get(&self, name: &str) -> Option<&[u8]> {
        self.files.iter().find(|(n, _)| n == name).map(|(_, bytes)| bytes.as_ref())
    }
}
