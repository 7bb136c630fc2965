//! The file that scenes are added to: a head, then a line a scene as soon as it is solved. Lines
//! are never taken out: a scene that failed and was solved again has one for each time.

use super::ScenesError;
use super::ending::SceneRecord;
use papilla_fingertip::campaign::Slice;
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
    /// Opens the record of a slice in `folder`, that of all where the slice is all, and reads what
    /// is known of its scenes; a last line that a kill has torn is dropped. A slice knows the lines
    /// of the record of all, which takes over those of all slices.
    pub(super) fn open(
        folder: &Path,
        wanted: &Head,
        slice: Slice,
    ) -> Result<(Self, Contents), ScenesError> {
        let (record, mut contents) = Self::open_own(folder, wanted, slice)?;
        if slice.is_whole() {
            for path in slices(folder)? {
                for line in read_of(&path, wanted)?.lines {
                    if !contents.lines.contains(&line) {
                        record.add(&line)?;
                        contents.lines.push(line);
                    }
                }
            }
        } else if folder.join(WHOLE).exists() {
            let mut all = read_of(&folder.join(WHOLE), wanted)?;
            all.lines.append(&mut contents.lines);
            contents = all;
        }
        Ok((record, contents))
    }

    fn open_own(
        folder: &Path,
        wanted: &Head,
        slice: Slice,
    ) -> Result<(Self, Contents), ScenesError> {
        std::fs::create_dir_all(folder).map_err(OutputError::io("create", folder))?;
        let path = folder.join(file_name(slice));
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
        if let Some(Contents { head, .. }) = &contents {
            require(&path, head, wanted)?;
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

/// The record of all scenes.
const WHOLE: &str = "scenes.jsonl";

fn file_name(slice: Slice) -> String {
    let (index, count) = (slice.index(), slice.count());
    if slice.is_whole() { WHOLE.into() } else { format!("scenes-{index:05}-of-{count:05}.jsonl") }
}

/// The records of slices in a folder.
fn slices(folder: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let entries = std::fs::read_dir(folder).map_err(OutputError::io("list", folder))?;
    let mut paths = Vec::new();
    for entry in entries {
        let path = entry.map_err(OutputError::io("list", folder))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("scenes-") && name.ends_with(".jsonl") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

fn require(path: &Path, head: &Head, wanted: &Head) -> Result<(), ScenesError> {
    if head.is_of(wanted) {
        return Ok(());
    }
    let (found, wanted) = (head.to_string(), wanted.to_string());
    Err(ScenesError::Other { path: path.into(), found, wanted })
}

/// What a record that another process may be writing says so far.
fn read_of(path: &Path, wanted: &Head) -> Result<Contents, ScenesError> {
    let text = std::fs::read_to_string(path).map_err(OutputError::io("read", path))?;
    let whole = text.rfind('\n').map_or(0, |i| i + 1);
    let Some(contents) = read(path, &text[..whole])? else {
        return Ok(Contents { head: wanted.clone(), lines: Vec::new() });
    };
    require(path, &contents.head, wanted)?;
    Ok(contents)
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
        let (first, found) = Record::open(folder.path(), &head(5), Slice::WHOLE).unwrap();
        assert!(found.lines.is_empty());
        let one = record(0, Ending::Balanced);
        first.add(&one).unwrap();
        assert!(matches!(
            Record::open(folder.path(), &head(5), Slice::WHOLE),
            Err(ScenesError::Busy(_))
        ));
        drop(first);
        let path = folder.path().join("scenes.jsonl");
        let torn = std::fs::read_to_string(&path).unwrap() + "{\"press\":{\"id\":1,";
        std::fs::write(&path, torn).unwrap();
        let (again, found) = Record::open(folder.path(), &head(5), Slice::WHOLE).unwrap();
        assert_eq!(found.lines, [one]);
        let two = record(1, Ending::Refused("x".into()));
        again.add(&two).unwrap();
        drop(again);
        let (_, found) = Record::open(folder.path(), &head(5), Slice::WHOLE).unwrap();
        assert_eq!(found.lines.len(), 2);
        let other = Record::open(folder.path(), &head(6), Slice::WHOLE).map(drop);
        assert!(matches!(other, Err(ScenesError::Other { .. })));
    }

    /// Slices write beside each other; the whole takes over what they have, once.
    #[test]
    fn the_record_of_all_takes_over_those_of_slices() {
        let folder = tempfile::tempdir().unwrap();
        let open = |index, count| {
            Record::open(folder.path(), &head(5), Slice::new(index, count).unwrap()).unwrap()
        };
        let ((one, _), (two, _)) = (open(1, 2), open(2, 2));
        two.add(&record(1, Ending::Balanced)).unwrap();
        one.add(&record(0, Ending::Balanced)).unwrap();
        for _ in 0..2 {
            let (_, found) = open(1, 1);
            assert_eq!(found.lines.iter().map(|l| l.press.id).collect::<Vec<_>>(), [0, 1]);
        }
        // A slice of another division knows them too.
        assert_eq!(open(3, 3).1.lines.len(), 2);
        let other = Record::open(folder.path(), &head(6), Slice::new(1, 3).unwrap()).map(drop);
        assert!(matches!(other, Err(ScenesError::Other { .. })));
    }

    #[test]
    fn a_line_that_cannot_be_read_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let (record_of, _) = Record::open(folder.path(), &head(5), Slice::WHOLE).unwrap();
        record_of.add(&record(0, Ending::Balanced)).unwrap();
        drop(record_of);
        let path = folder.path().join("scenes.jsonl");
        let good = std::fs::read_to_string(&path).unwrap();
        for (from, to) in [("\"ending\"", "\"end\""), ("{\"press", "{press"), ("7", "-7")] {
            let bad = good.replacen(from, to, 1);
            assert_ne!(bad, good);
            std::fs::write(&path, &bad).unwrap();
            let found = Record::open(folder.path(), &head(5), Slice::WHOLE).map(drop);
            let Err(error @ ScenesError::Unreadable { line: 2, .. }) = found else {
                panic!("{from} was read")
            };
            assert!(error.to_string().contains("scenes.jsonl:2"), "{error}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), bad, "and left as it is");
        }
    }
}
