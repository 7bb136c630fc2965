//! The file that scenes are added to.

use super::ScenesError;
use super::ending::SceneRecord;
use papilla_output::OutputError;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The record's first line.
#[derive(Serialize, Deserialize)]
struct Head {
    drawn_from: String,
}

/// The file, open and locked.
pub(super) struct Record {
    path: PathBuf,
    file: Mutex<File>,
}

impl Record {
    /// Opens the record in `folder` and reads the scenes it has; a last line that a kill has
    /// torn is dropped.
    pub(super) fn open(
        folder: &Path,
        drawn_from: &str,
    ) -> Result<(Self, Vec<SceneRecord>), ScenesError> {
        std::fs::create_dir_all(folder).map_err(OutputError::io("create", folder))?;
        let path = folder.join("scenes.jsonl");
        let failed = |what| OutputError::io(what, &path);
        let mut file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(&path)
            .map_err(failed("open"))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(ScenesError::Busy(path)),
            Err(TryLockError::Error(e)) => return Err(failed("lock")(e).into()),
        }
        let mut text = String::new();
        file.read_to_string(&mut text).map_err(failed("read"))?;
        let whole = text.rfind('\n').map_or(0, |i| i + 1);
        file.set_len(whole as u64).map_err(failed("write"))?;
        let mut lines = text[..whole].lines();
        match lines.next() {
            None => {
                let head = Head { drawn_from: drawn_from.into() };
                write_line(&mut file, &head).map_err(failed("write"))?;
            }
            Some(line) => {
                let found = serde_json::from_str::<Head>(line)
                    .map_or_else(|_| line.into(), |h| h.drawn_from);
                if found != drawn_from {
                    return Err(ScenesError::Other { path, found });
                }
            }
        }
        let known = lines.filter_map(|l| serde_json::from_str(l).ok()).collect();
        Ok((Self { path, file: Mutex::new(file) }, known))
    }

    pub(super) fn add(&self, record: &SceneRecord) -> Result<(), ScenesError> {
        let mut file = self.file.lock().unwrap_or_else(|p| p.into_inner());
        Ok(write_line(&mut file, record).map_err(OutputError::io("write", &self.path))?)
    }
}

/// One line in one write: what a kill leaves is a line or no line.
fn write_line<T: Serialize>(file: &mut File, value: &T) -> std::io::Result<()> {
    let mut line = serde_json::to_vec(value)?;
    line.push(b'\n');
    file.write_all(&line)
}

#[cfg(test)]
mod tests {
    use super::super::ending::Ending;
    use super::super::report::tests::record;
    use super::*;

    #[test]
    fn a_record_goes_on_where_it_was_torn() {
        let folder = tempfile::tempdir().unwrap();
        let (first, known) = Record::open(folder.path(), "broad, seed 5").unwrap();
        assert!(known.is_empty());
        let one = record(0, Ending::Balanced);
        first.add(&one).unwrap();
        assert!(matches!(Record::open(folder.path(), "broad, seed 5"), Err(ScenesError::Busy(_))));
        drop(first);
        let path = folder.path().join("scenes.jsonl");
        let torn = std::fs::read_to_string(&path).unwrap() + "{\"press\":{\"id\":1,";
        std::fs::write(&path, torn).unwrap();
        let (again, known) = Record::open(folder.path(), "broad, seed 5").unwrap();
        assert_eq!(known, [one]);
        let two = record(1, Ending::Refused("x".into()));
        again.add(&two).unwrap();
        drop(again);
        let (_, known) = Record::open(folder.path(), "broad, seed 5").unwrap();
        assert_eq!(known.len(), 2);
        let other = Record::open(folder.path(), "broad, seed 6").map(drop);
        assert!(matches!(other, Err(ScenesError::Other { .. })));
    }
}
