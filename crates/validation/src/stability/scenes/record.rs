//! The file that scenes are added to: a head, then a line a scene as soon as it is solved. Lines
//! are never taken out: a scene that failed and was solved again has one for each time.

use super::ScenesError;
use super::ending::SceneRecord;
use papilla_fingertip::mesh::fingertip::Density;
use papilla_output::OutputError;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// The record's first line: which scenes it is of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// Name of the campaign.
    pub campaign: String,
    /// Seed of the draw.
    pub seed: u64,
    /// Mesh.
    pub density: Density,
    /// First scenes that the solver was mended on, whose first lines are lost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mended_on: Option<MendedOn>,
}

/// Scenes that prove nothing: the solver was mended on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MendedOn {
    /// How many, from the first.
    pub scenes: usize,
    /// How many of them failed when first run.
    pub failed: usize,
}

impl Head {
    /// Whether the scenes are the same.
    fn is_of(&self, other: &Self) -> bool {
        let Self { campaign, seed, density, .. } = self;
        (campaign, seed, density) == (&other.campaign, &other.seed, &other.density)
    }
}

impl std::fmt::Display for Head {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{}, seed {}, {} mesh",
            self.campaign,
            self.seed,
            format!("{:?}", self.density).to_lowercase()
        )
    }
}

/// The file, open and locked.
pub(super) struct Record {
    path: PathBuf,
    file: Mutex<File>,
}

/// What a record says.
#[derive(Debug)]
pub(super) struct Contents {
    pub head: Head,
    /// Every line, in order.
    pub lines: Vec<SceneRecord>,
}

impl Record {
    /// Opens the record in `folder` and reads what it has; a last line that a kill has torn is
    /// dropped.
    pub(super) fn open(folder: &Path, wanted: &Head) -> Result<(Self, Contents), ScenesError> {
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
        let contents = read(&path, &text[..whole])?;
        if let Some(Contents { head, .. }) = &contents
            && !head.is_of(wanted)
        {
            let (found, wanted) = (head.to_string(), wanted.to_string());
            return Err(ScenesError::Other { path, found, wanted });
        }
        file.set_len(whole as u64).map_err(failed("write"))?;
        let contents = match contents {
            Some(contents) => contents,
            None => {
                write_line(&mut file, wanted).map_err(failed("write"))?;
                Contents { head: wanted.clone(), lines: Vec::new() }
            }
        };
        Ok((Self { path, file: Mutex::new(file) }, contents))
    }

    pub(super) fn add(&self, record: &SceneRecord) -> Result<(), ScenesError> {
        let mut file = self.file.lock().unwrap_or_else(|p| p.into_inner());
        Ok(write_line(&mut file, record).map_err(OutputError::io("write", &self.path))?)
    }
}

/// Head and lines of a record's text; `None` of an empty one.
pub(super) fn read(path: &Path, text: &str) -> Result<Option<Contents>, ScenesError> {
    let unreadable = |line: usize| {
        let path = path.to_path_buf();
        move |source| ScenesError::Unreadable { path, line, source }
    };
    let mut lines = text.lines();
    let Some(head) = lines.next() else { return Ok(None) };
    let head = serde_json::from_str(head).map_err(unreadable(1))?;
    let lines = lines
        .enumerate()
        .map(|(i, line)| serde_json::from_str(line).map_err(unreadable(i + 2)))
        .collect::<Result<_, _>>()?;
    Ok(Some(Contents { head, lines }))
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
    use super::super::report::tests::{head, record};
    use super::*;

    #[test]
    fn a_record_goes_on_where_it_was_torn() {
        let folder = tempfile::tempdir().unwrap();
        let (first, found) = Record::open(folder.path(), &head(5)).unwrap();
        assert!(found.lines.is_empty());
        let one = record(0, Ending::Balanced);
        first.add(&one).unwrap();
        assert!(matches!(Record::open(folder.path(), &head(5)), Err(ScenesError::Busy(_))));
        drop(first);
        let path = folder.path().join("scenes.jsonl");
        let torn = std::fs::read_to_string(&path).unwrap() + "{\"press\":{\"id\":1,";
        std::fs::write(&path, torn).unwrap();
        let (again, found) = Record::open(folder.path(), &head(5)).unwrap();
        assert_eq!(found.lines, [one]);
        let two = record(1, Ending::Refused("x".into()));
        again.add(&two).unwrap();
        drop(again);
        let (_, found) = Record::open(folder.path(), &head(5)).unwrap();
        assert_eq!(found.lines.len(), 2);
        let other = Record::open(folder.path(), &head(6)).map(drop);
        assert!(matches!(other, Err(ScenesError::Other { .. })));
    }

    #[test]
    fn a_line_that_cannot_be_read_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let (record_of, _) = Record::open(folder.path(), &head(5)).unwrap();
        record_of.add(&record(0, Ending::Balanced)).unwrap();
        drop(record_of);
        let path = folder.path().join("scenes.jsonl");
        let good = std::fs::read_to_string(&path).unwrap();
        for (from, to) in [("\"ending\"", "\"end\""), ("{\"press", "{press"), ("7", "-7")] {
            let bad = good.replacen(from, to, 1);
            assert_ne!(bad, good);
            std::fs::write(&path, &bad).unwrap();
            let found = Record::open(folder.path(), &head(5)).map(drop);
            let Err(error @ ScenesError::Unreadable { line: 2, .. }) = found else {
                panic!("{from} was read")
            };
            assert!(error.to_string().contains("scenes.jsonl:2"), "{error}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), bad, "and left as it is");
        }
    }
}
