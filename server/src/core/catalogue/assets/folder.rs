//! Reads a folder of models, whatever it holds, within limits of time and size.

use std::{
    borrow::Cow,
    collections::HashSet,
    fs::{self, File, FileType, Metadata},
    io::{self, Read},
    path::Path,
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

use papilla_engine::card::Index;
use papilla_proto::json;

use super::{
    CONTACT, CONTACT_ERRORS, ERROR_LAWS, FINGER, Files, SKIN,
    detached::{STRANDED_MAX, Unfinished, detached},
};
use crate::StartError;

/// Largest file that is read, bytes.
const FILE_BYTES_MAX: u64 = 256 << 20;
/// The most that is read of one folder of models, bytes.
pub(super) const FOLDER_BYTES_MAX: u64 = 1 << 30;
/// Longest time for reading the folder.
const WAIT_MAX: Duration = Duration::from_secs(20);

/// Files that are read if the folder has them. `index.json` names the models that are read beside
/// them.
const BASE: [&str; 9] = [
    "index.json",
    "atlas.json",
    "replay.json",
    "ladder.json",
    CONTACT,
    CONTACT_ERRORS,
    ERROR_LAWS,
    FINGER,
    SKIN,
];

/// What was found in a folder.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) files: Files,
    /// Names of files that were left unread: networks that are loaded on demand.
    pub(super) unread: Vec<String>,
}

/// Reads the files of `folder` that a service needs: [`BASE`], and the cards and networks of the
/// models that its index names. Networks that are loaded on demand are listed and not read. A file
/// that belongs to no model and cannot be opened is named in the log. None: `is_to_stop` became
/// true.
///
/// # Errors
/// The folder or one of these files cannot be read, is not a regular file, or is not read in time;
/// or all of them together have more than `bytes_max`.
pub(super) fn read(
    folder: &Path,
    bytes_max: u64,
    is_to_stop: &dyn Fn() -> bool,
) -> Result<Option<Found>, StartError> {
    in_time(folder, bytes_max, is_to_stop, |folder| folder.read())
}

/// The names, sorted, of the folders within `folder` that hold a file called [`FINGER`]. Names that
/// are not UTF-8 are left out.
///
/// # Errors
/// The folder cannot be read, or not in time.
pub(super) fn fingers(folder: &Path) -> Result<Vec<String>, StartError> {
    let list = |folder: Folder<'_>| {
        let unreadable = |source| StartError::Folder { folder: folder.path.to_owned(), source };
        let mut names = Vec::new();
        for entry in fs::read_dir(folder.path).map_err(unreadable)? {
            let entry = entry.map_err(unreadable)?;
            if let Ok(name) = entry.file_name().into_string()
                && entry.path().join(FINGER).is_file()
            {
                names.push(name);
            }
        }
        names.sort_unstable();
        Ok(names)
    };
    // Nothing stops it, so there always is a list.
    in_time(folder, 0, &|| false, list).map(Option::unwrap_or_default)
}

/// The bytes of one file of `folder`. None: the folder has no such file.
///
/// # Errors
/// The file cannot be read, is not a regular file, is too large, or is not read in time.
pub(super) fn read_one(folder: &Path, name: &str) -> Result<Option<Vec<u8>>, StartError> {
    let name = name.to_owned();
    let one = move |mut folder: Folder<'_>| {
        folder.take(&name, &HashSet::from([name.clone()]))?;
        Ok(folder.files.pop().map(|(_, bytes)| bytes.into_owned()))
    };
    in_time(folder, FILE_BYTES_MAX, &|| false, one).map(Option::flatten)
}

/// Reads from a folder within [`WAIT_MAX`]. None: `is_to_stop` became true.
fn in_time<T: Send + 'static>(
    folder: &Path,
    bytes_max: u64,
    is_to_stop: &dyn Fn() -> bool,
    read: impl FnOnce(Folder<'_>) -> Result<T, StartError> + Send + 'static,
) -> Result<Option<T>, StartError> {
    let unreadable = |source| StartError::Folder { folder: folder.to_owned(), source };
    let at = Arc::new(Mutex::new(None));
    let (place, progress) = (folder.to_owned(), Arc::clone(&at));
    let reading = move || {
        // The path is resolved once: if a symbolic link is changed meanwhile, files of two folders
        // must not be mixed.
        let place = fs::canonicalize(&place)
            .map_err(|source| StartError::Folder { folder: place.clone(), source })?;
        read(Folder { path: &place, bytes_max, left: bytes_max, at: &progress, files: Vec::new() })
    };
    match detached(reading, WAIT_MAX, is_to_stop) {
        Ok(result) => result.map(Some),
        Err(Unfinished::Stopped) => Ok(None),
        Err(Unfinished::Late) => {
            let seconds = WAIT_MAX.as_secs();
            match at.lock().unwrap_or_else(PoisonError::into_inner).take() {
                Some(file) => {
                    let reason = format!("it could not be read within {seconds} s");
                    Err(unusable(folder, file, reason))
                }
                None => Err(unreadable(io::Error::other(format!("no answer within {seconds} s")))),
            }
        }
        Err(Unfinished::Stranded) => {
            let message = format!("{STRANDED_MAX} earlier readings hang still");
            Err(unreadable(io::Error::other(message)))
        }
        Err(Unfinished::Broken(source)) => Err(unreadable(source)),
    }
}

/// A folder that is being read.
struct Folder<'a> {
    path: &'a Path,
    /// The most that all its files together may have, bytes.
    bytes_max: u64,
    /// Bytes that may still be read.
    left: u64,
    /// The file that is being read, for the message if that takes too long.
    at: &'a Mutex<Option<String>>,
    files: Files,
}

impl Folder<'_> {
    fn read(mut self) -> Result<Found, StartError> {
        let mut unread = Vec::new();
        let listed = names(self.path)
            .map_err(|source| StartError::Folder { folder: self.path.to_owned(), source })?;
        let mut wanted: HashSet<String> = BASE.map(str::to_owned).into();
        for name in BASE {
            self.take(name, &listed)?;
        }
        let Some(index) = self.index() else { return Ok(Found { files: self.files, unread }) };
        for name in &index.models {
            let (onnx, card) = (format!("{name}.onnx"), format!("{name}.json"));
            if wanted.insert(card.clone()) {
                self.take(&card, &listed)?;
            }
            if !wanted.insert(onnx.clone()) {
                continue;
            }
            if !index.on_demand.contains(name) {
                self.take(&onnx, &listed)?;
            } else if listed.contains(&onnx) {
                unread.push(onnx);
            }
        }
        for stranger in listed.iter().filter(|name| !wanted.contains(*name)) {
            if let Err(reason) = open(&self.path.join(stranger)) {
                tracing::warn!(file = stranger, reason, "passed over: no model's file");
            }
        }
        Ok(Found { files: self.files, unread })
    }

    /// The index. None: it is missing or damaged, which loading reports later.
    fn index(&self) -> Option<Index> {
        let (_, bytes) = self.files.iter().find(|(name, _)| name == "index.json")?;
        Index::from_json(json::text(bytes).ok()?).ok()
    }

    /// Reads the file called `name` if the folder has it.
    fn take(&mut self, name: &str, listed: &HashSet<String>) -> Result<(), StartError> {
        let path = self.path.join(name);
        *self.at.lock().unwrap_or_else(PoisonError::into_inner) = Some(name.to_owned());
        // A dangling symbolic link counts as a missing file.
        if !listed.contains(name) || matches!(path.try_exists(), Ok(false)) {
            return Ok(());
        }
        let bytes = self.contents(&path);
        let bytes = bytes.map_err(|reason| unusable(self.path, name.to_owned(), reason))?;
        self.files.push((name.to_owned(), Cow::Owned(bytes)));
        Ok(())
    }

    fn contents(&mut self, path: &Path) -> Result<Vec<u8>, String> {
        let (file, data) = open(path)?;
        let (most, folder_max) = (FILE_BYTES_MAX.min(self.left), self.bytes_max);
        let too_large = |bytes: u64| {
            format!(
                "it has {} MiB; {} MiB of a file and {} of a folder are read",
                bytes.div_ceil(1 << 20),
                FILE_BYTES_MAX.min(folder_max) >> 20,
                folder_max >> 20,
            )
        };
        if data.len() > most {
            return Err(too_large(data.len()));
        }
        let mut bytes = Vec::with_capacity(usize::try_from(data.len()).unwrap_or_default());
        // The file may grow while it is read.
        file.take(most + 1).read_to_end(&mut bytes).map_err(|error| error.to_string())?;
        if bytes.len() as u64 > most {
            return Err(too_large(bytes.len() as u64));
        }
        self.left -= bytes.len() as u64;
        Ok(bytes)
    }
}

fn unusable(folder: &Path, file: String, reason: String) -> StartError {
    StartError::Unusable { file, origin: folder.display().to_string(), reason }
}

/// The names of the `.onnx`, `.json`, `.contact` and `.toml` files of `folder`.
fn names(folder: &Path) -> io::Result<HashSet<String>> {
    let mut names = HashSet::new();
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name();
        let ending = Path::new(&name).extension().and_then(|e| e.to_str());
        let wanted = matches!(ending, Some("onnx" | "json" | "contact" | "toml"));
        match (wanted, name.into_string()) {
            (true, Ok(name)) => {
                names.insert(name);
            }
            (true, Err(name)) => {
                tracing::warn!(file = ?name, "passed over: its name is not UTF-8");
            }
            (false, _) => {}
        }
    }
    Ok(names)
}

/// Opens a regular file. Anything else is refused before it is opened, since opening a named pipe,
/// for example, may never return.
fn open(path: &Path) -> Result<(File, Metadata), String> {
    let data = fs::metadata(path).map_err(|error| error.to_string())?;
    if !data.is_file() {
        return Err(format!("it is {}, no file", kind(data.file_type())));
    }
    let file = File::open(path).map_err(|error| error.to_string())?;
    let data = file.metadata().map_err(|error| error.to_string())?;
    // Something else may have taken its place since.
    if !data.is_file() {
        return Err(format!("it is {}, no file", kind(data.file_type())));
    }
    Ok((file, data))
}

#[cfg(unix)]
fn kind(of: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    if of.is_dir() {
        "a folder"
    } else if of.is_fifo() {
        "a named pipe"
    } else if of.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(not(unix))]
fn kind(of: FileType) -> &'static str {
    if of.is_dir() { "a folder" } else { "a device" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_of_an_index_do_not_leave_the_folder() {
        let above = tempfile::tempdir().unwrap();
        let folder = above.path().join("models");
        fs::create_dir(&folder).unwrap();
        fs::write(above.path().join("x.onnx"), b"outside").unwrap();
        fs::write(folder.join("in.onnx"), b"inside").unwrap();
        let index = r#"{"default": "in", "models": ["in", "../x"]}"#;
        fs::write(folder.join("index.json"), index).unwrap();
        let files = read(&folder, FOLDER_BYTES_MAX, &|| false).unwrap().unwrap().files;
        let names: Vec<_> = files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["index.json", "in.onnx"]);
        assert!(
            read(&folder, FOLDER_BYTES_MAX, &|| true)
                .unwrap()
                .is_none_or(|read| read.files.len() == 2)
        );
    }
}
