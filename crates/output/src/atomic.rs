//! Files that are either whole or absent.

use super::OutputError;
use serde::Serialize;
#[cfg(unix)]
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::Path;
use tempfile::NamedTempFile;

/// Prefix of files that are still being written; a kill can leave them behind.
pub const PARTIAL_PREFIX: &str = ".partial-";

/// Writes `bytes` to `path`: a reader sees the old file or the whole new one.
///
/// The bytes go to a temporary file in the same folder, are synced to disk and
/// renamed; the folder is synced after, so that a power cut keeps the name too.
///
/// # Errors
/// [`OutputError::Io`] when the folder is not writable or the disk is full; the
/// old file is then untouched.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let failed = || OutputError::io("write", path);
    partial(path, bytes)?.persist(path).map_err(|e| failed()(e.error))?;
    sync_folder(path)
}

/// As [`write`], but a file that is there stays as it is: of many processes that write at once, on
/// a network file system too, one is first. Whether this was the one.
///
/// # Errors
/// As [`write`].
pub fn write_first(path: &Path, bytes: &[u8]) -> Result<bool, OutputError> {
    match partial(path, bytes)?.persist_noclobber(path) {
        Ok(_) => sync_folder(path).map(|()| true),
        Err(e) if e.error.kind() == ErrorKind::AlreadyExists => Ok(false),
        Err(e) => Err(OutputError::io("write", path)(e.error)),
    }
}

/// As [`write`], unless the file has these bytes already.
///
/// # Errors
/// As [`write`].
pub fn write_changed(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    match std::fs::read(path) {
        Ok(found) if found == bytes => Ok(()),
        _ => write(path, bytes),
    }
}

/// The folder of a file.
fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// The bytes on disk, not yet under their name.
fn partial(path: &Path, bytes: &[u8]) -> Result<NamedTempFile, OutputError> {
    let failed = || OutputError::io("write", path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(PARTIAL_PREFIX);
    #[cfg(unix)]
    {
        // A dataset is to be shared: the umask decides, not tempfile's 0600.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder(path)).map_err(failed())?;
    file.write_all(bytes).map_err(failed())?;
    file.as_file().sync_all().map_err(failed())?;
    Ok(file)
}

#[cfg_attr(not(unix), allow(clippy::unnecessary_wraps))]
fn sync_folder(path: &Path) -> Result<(), OutputError> {
    #[cfg(unix)]
    File::open(folder(path)).and_then(|f| f.sync_all()).map_err(OutputError::io("write", path))?;
    Ok(())
}

/// Writes `value` as indented JSON with a final newline, atomically.
///
/// # Errors
/// [`OutputError::Encode`] when the value has no JSON form, else as [`write`].
pub fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<(), OutputError> {
    let mut bytes = serde_json::to_vec_pretty(value)
        .map_err(|e| OutputError::Encode { what: "JSON", message: e.to_string() })?;
    bytes.push(b'\n');
    write(path, &bytes)
}

/// Reads a JSON file.
///
/// # Errors
/// [`OutputError::Io`] when it cannot be read, [`OutputError::Malformed`] when
/// it is not the JSON that is expected.
pub fn read_json<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, OutputError> {
    let bytes = std::fs::read(path).map_err(OutputError::io("read", path))?;
    let json = papilla_json::plain(&bytes).map_err(|e| OutputError::malformed(path, &e))?;
    serde_json::from_slice(json).map_err(|e| OutputError::malformed(path, &e))
}

/// Creates a folder and its parents, and finds out that files can be made there: whoever works for
/// hours on what goes into it wants to know before.
///
/// # Errors
/// [`OutputError::Io`] when the system refuses.
pub fn create_folder(path: &Path) -> Result<(), OutputError> {
    std::fs::create_dir_all(path).map_err(OutputError::io("create the folder", path))?;
    let probe = tempfile::Builder::new().prefix(PARTIAL_PREFIX).tempfile_in(path);
    probe.map(drop).map_err(OutputError::io("make a file in", path))
}

/// Removes what a killed run left half-written in `folder`.
///
/// # Errors
/// [`OutputError::Io`] when the folder cannot be listed.
pub fn remove_partial(folder: &Path) -> Result<(), OutputError> {
    let entries = std::fs::read_dir(folder).map_err(OutputError::io("list", folder))?;
    for entry in entries {
        let entry = entry.map_err(OutputError::io("list", folder))?;
        if entry.file_name().to_string_lossy().starts_with(PARTIAL_PREFIX) {
            let path = entry.path();
            std::fs::remove_file(&path).map_err(OutputError::io("remove", &path))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_write_replaces_the_whole_file_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write(&path, b"long first content").unwrap();
        write(&path, b"second").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn the_first_of_many_writers_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("owner.json");
        let write = |n: u8| write_first(&path, &[n; 1000]).unwrap();
        let first: Vec<bool> = std::thread::scope(|scope| {
            let all: Vec<_> = (0..8).map(|n| scope.spawn(move || write(n))).collect();
            all.into_iter().map(|one| one.join().unwrap()).collect()
        });
        let winner = first.iter().position(|f| *f).unwrap();
        assert_eq!(first.iter().filter(|f| **f).count(), 1);
        assert_eq!(std::fs::read(&path).unwrap(), [winner as u8; 1000]);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent/a.bin");
        let text = write(&path, b"x").unwrap_err().to_string();
        assert!(text.contains("absent/a.bin"), "{text}");
    }

    #[test]
    fn only_partial_files_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(".partial-xyz"), b"half").unwrap();
        std::fs::write(folder.path().join("whole"), b"whole").unwrap();
        remove_partial(folder.path()).unwrap();
        assert!(folder.path().join("whole").exists());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
