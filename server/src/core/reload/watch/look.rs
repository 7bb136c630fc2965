//! Whether a folder of models, or of fingers, has changed, as its entries show without being read.

use std::{
    fs::{self, Metadata},
    io,
    path::{Path, PathBuf},
    time::SystemTime,
};

/// What a folder held at one moment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Look {
    /// The path with symbolic links resolved.
    pub(super) folder: PathBuf,
    /// The entries of the folder and of the folders directly in it, sorted by path.
    files: Vec<File>,
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct File {
    path: PathBuf,
    bytes: u64,
    modified: Option<SystemTime>,
    /// Numbers of device and inode, which tell another file under the same name.
    place: (u64, u64),
}

impl Look {
    /// Looks at the folder that `path` leads to now. Symbolic links inside it count as what they
    /// lead to.
    ///
    /// # Errors
    /// There is no such folder, or it cannot be read.
    pub(super) fn at(path: &Path) -> io::Result<Self> {
        let folder = fs::canonicalize(path)?;
        let mut files = Vec::new();
        let inner = look_into(&folder, &mut files)?;
        for folder in inner {
            // A folder in it that has gone meanwhile, or cannot be read, is left out.
            let _ = look_into(&folder, &mut files);
        }
        files.sort_unstable();
        Ok(Self { folder, files })
    }
}

/// Adds the entries of a folder to `files`. Returns the folders among them.
fn look_into(folder: &Path, files: &mut Vec<File>) -> io::Result<Vec<PathBuf>> {
    let mut inner = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        // A dangling symbolic link counts as a missing file.
        let Ok(data) = fs::metadata(&path) else { continue };
        if data.is_dir() {
            inner.push(path.clone());
        }
        let (bytes, modified) = (data.len(), data.modified().ok());
        files.push(File { path, bytes, modified, place: place(&data) });
    }
    Ok(inner)
}

#[cfg(unix)]
fn place(data: &Metadata) -> (u64, u64) {
    use std::os::unix::fs::MetadataExt;
    (data.dev(), data.ino())
}

#[cfg(not(unix))]
fn place(_: &Metadata) -> (u64, u64) {
    (0, 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn a_link_that_is_turned_and_a_file_that_is_replaced_are_seen() {
        use std::os::unix::fs::symlink;
        let root = tempfile::tempdir().unwrap();
        let [v1, v2, link, between] =
            ["v1", "v2", "current", "stable"].map(|name| root.path().join(name));
        for folder in [&v1, &v2] {
            fs::create_dir(folder).unwrap();
            fs::write(folder.join("index.json"), "{}").unwrap();
        }
        symlink(&v1, &between).unwrap();
        symlink(&between, &link).unwrap();
        let first = Look::at(&link).unwrap();
        assert_eq!(Look::at(&link).unwrap(), first);
        // A link behind the link.
        fs::remove_file(&between).unwrap();
        symlink(&v2, &between).unwrap();
        let second = Look::at(&link).unwrap();
        assert_ne!(second, first);
        assert_eq!(second.folder, fs::canonicalize(&v2).unwrap());
        // The same name, length and time, by a rename.
        let time = fs::metadata(v2.join("index.json")).unwrap().modified().unwrap();
        fs::write(v2.join("new"), "[]").unwrap();
        fs::File::options().append(true).open(v2.join("new")).unwrap().set_modified(time).unwrap();
        fs::rename(v2.join("new"), v2.join("index.json")).unwrap();
        assert_ne!(Look::at(&link).unwrap(), second);
        // What a link inside leads to.
        symlink(root.path().join("model"), v2.join("a.onnx")).unwrap();
        let third = Look::at(&link).unwrap();
        fs::write(root.path().join("model"), "model").unwrap();
        assert_ne!(Look::at(&link).unwrap(), third);
        // A file of a finger.
        fs::create_dir(v2.join("thumb")).unwrap();
        fs::write(v2.join("thumb/index.json"), "{}").unwrap();
        let fourth = Look::at(&link).unwrap();
        fs::write(v2.join("thumb/index.json"), "{ }").unwrap();
        assert_ne!(Look::at(&link).unwrap(), fourth);
        fs::remove_dir_all(&v2).unwrap();
        assert!(Look::at(&link).is_err());
    }
}
