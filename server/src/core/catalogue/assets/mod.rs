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

/// File of the contact model.
pub(crate) const CONTACT: &str = "finger.contact";
/// Description of a finger. A folder that holds this file is a finger's.
pub(crate) const FINGER: &str = "finger.toml";
/// The most that is read of one finger's folder, bytes.
pub(crate) const FINGER_FILES_BYTES_MAX: u64 = 256 << 20;
/// Offset of the finger's skin from the template; optional.
pub(crate) const SKIN: &str = "skin.json";
/// Errors of the contact methods with this contact model.
pub(crate) const CONTACT_ERRORS: &str = "contact.json";

/// The laws by which the error of an answer is estimated.
pub(crate) const ERROR_LAWS: &str = "errors.json";

/// The shipped models, cards, atlas, replay and contact model, as they were when the binary was built.
const MODELS: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/models.rs"));

/// How messages name the origin of the embedded files.
const EMBEDDED: &str = "the binary";

const FINGER_ADVICE: &str = "the folder of a finger holds finger.toml, index.json, atlas.json, and \
    NAME.onnx and NAME.json of every model in the index; copy it anew if a copy broke off";

/// Files by name.
type Files = Vec<(String, Cow<'static, [u8]>)>;

/// The files of a model folder by name.
#[derive(Debug)]
pub(crate) struct Assets {
    /// Where the files are from, for messages.
    pub(crate) origin: String,
    /// What a message advises if a file is missing.
    advice: &'static str,
    files: Files,
    /// The folder, and the names of its files that were not read because they are loaded on demand.
    /// None: the files are embedded.
    unread: Option<(PathBuf, Vec<String>)>,
}

impl Assets {
    /// The files that `config` names: its folder's, or else those built into the binary.
    ///
    /// # Errors
    /// The folder or one of its files cannot be read.
    pub(crate) fn of(config: &Config) -> Result<Self, StartError> {
        // Nothing stops it, so there always is a result.
        Self::of_unless(config, &|| false).map(|assets| assets.unwrap_or_else(Self::embedded))
    }

    /// As [`of`](Self::of), but gives up once `is_to_stop` is true; the result is None then.
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

    /// The files of a finger's folder. None: `is_to_stop` became true.
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

    /// The names of the fingers in a folder: each folder in it that holds [`FINGER`] is one.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub(crate) fn fingers(folder: &Path) -> Result<Vec<String>, StartError> {
        folder::fingers(folder)
    }

    /// Bytes of the files that were read.
    pub(crate) fn bytes(&self) -> u64 {
        self.files.iter().map(|(_, bytes)| bytes.len() as u64).sum()
    }

    /// One file, read alone: from `folder`, or embedded if there is no folder.
    ///
    /// # Errors
    /// There is no such file, or it cannot be read.
    pub(crate) fn one(folder: Option<&Path>, file: &str) -> Result<Cow<'static, [u8]>, StartError> {
        let assets = match folder {
            Some(folder) => Self::of_folder(folder, Vec::new(), vec![file.to_owned()]),
            None => Self::embedded(),
        };
        assets.model(file).map(|bytes| Cow::Owned(bytes.into_owned()))
    }

    /// Where the files that `config` names are from, for messages.
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

    /// Requires that there is a file called `name`, whether it was read or not.
    ///
    /// # Errors
    /// There is no such file.
    pub(crate) fn require_there(&self, name: &str) -> Result<(), StartError> {
        let is_unread =
            self.unread.iter().any(|(_, unread)| unread.iter().any(|unread| unread == name));
        if is_unread { Ok(()) } else { self.require(name).map(|_| ()) }
    }

    /// The bytes of a model's file. If it was left unread, it is read now.
    ///
    /// # Errors
    /// There is no such file, or it cannot be read.
    pub(crate) fn model(&self, name: &str) -> Result<Cow<'_, [u8]>, StartError> {
        if let Some((folder, unread)) = &self.unread
            && unread.iter().any(|unread| unread == name)
            && let Some(bytes) = folder::read_one(folder, name)?
        {
            return Ok(Cow::Owned(bytes));
        }
        self.require(name).map(Cow::Borrowed)
    }

    /// Refuses a contact model that was made from another description of the finger than the one in
    /// this folder. The hash of the atlas cannot show this, since bone and tissues are not in the
    /// atlas. If the folder or the contact model has no description, there is nothing to compare,
    /// and the contact model is accepted.
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
    /// There is no such file.
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
