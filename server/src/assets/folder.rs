//! Reading a folder of models that may hold anything: within a time and a size, on a thread of its
//! own, which a drive that never answers may keep.

use std::{
    borrow::Cow,
    collections::HashSet,
    fs::{self, File, FileType, Metadata},
    io::{self, Read},
    path::Path,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::{Duration, Instant},
};

use papilla_engine::card::Index;

use super::Files;
use crate::StartError;

/// Most bytes of one file.
const FILE_BYTES_MAX: u64 = 256 << 20;
/// Most bytes of all files that are read.
const FOLDER_BYTES_MAX: u64 = 1 << 30;
/// Longest time for reading the folder.
const PATIENCE: Duration = Duration::from_secs(20);
/// How often whoever waits looks whether to go on.
const LOOK_AROUND: Duration = Duration::from_millis(50);
/// Most readings that have been given up and hang still; then the folder is not read again.
const STRANDED_MAX: usize = 4;

/// The files of every service; an index names the models beside them.
const BASE: [&str; 4] = ["index.json", "atlas.json", "replay.json", "ladder.json"];

/// The files of `folder` that a service is made of: [`BASE`] and those of the models that its index
/// names. Strangers that cannot be read are named in the log. None: it was to stop.
///
/// # Errors
/// The folder or one of these files cannot be read, is no file, too large, or not read in time.
pub(super) fn read(
    folder: &Path,
    is_to_stop: &dyn Fn() -> bool,
) -> Result<Option<Files>, StartError> {
    let unreadable = |source| StartError::Folder { folder: folder.to_owned(), source };
    let at = Arc::new(Mutex::new(None));
    let (place, progress) = (folder.to_owned(), Arc::clone(&at));
    let reading = move || {
        Folder { path: &place, left: FOLDER_BYTES_MAX, at: &progress, files: Vec::new() }.read()
    };
    match apart(reading, PATIENCE, is_to_stop) {
        Ok(result) => result.map(Some),
        Err(Apart::Stopped) => Ok(None),
        Err(Apart::Late) => {
            let seconds = PATIENCE.as_secs();
            match at.lock().unwrap_or_else(PoisonError::into_inner).take() {
                Some(file) => {
                    let reason = format!("it could not be read within {seconds} s");
                    Err(unusable(folder, file, reason))
                }
                None => Err(unreadable(io::Error::other(format!("no answer within {seconds} s")))),
            }
        }
        Err(Apart::Stranded) => {
            let message = format!("{STRANDED_MAX} earlier readings hang still");
            Err(unreadable(io::Error::other(message)))
        }
        Err(Apart::Broken(source)) => Err(unreadable(source)),
    }
}

/// Why work apart came to nothing.
#[derive(Debug)]
enum Apart {
    Stopped,
    Late,
    Stranded,
    Broken(io::Error),
}

/// Readings that were given up and hang still.
static STRANDED: AtomicUsize = AtomicUsize::new(0);

/// Does `work` on a thread of its own and waits for it, but not beyond `patience` or once it is to
/// stop. What is given up then goes on by itself; the end of the process does not wait for it.
fn apart<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
    patience: Duration,
    is_to_stop: &dyn Fn() -> bool,
) -> Result<T, Apart> {
    if STRANDED.load(Ordering::Relaxed) >= STRANDED_MAX {
        return Err(Apart::Stranded);
    }
    let (done, result) = mpsc::sync_channel(1);
    let over = Arc::new(AtomicBool::new(false));
    let end = End(Arc::clone(&over));
    let begun = Instant::now();
    let thread = thread::Builder::new().name("papilla-read".to_owned()).spawn(move || {
        let _end = end;
        // Err: nobody waits any more.
        let _ = done.send(work());
    });
    thread.map_err(Apart::Broken)?;
    let fault = loop {
        match result.recv_timeout(LOOK_AROUND) {
            Ok(value) => return Ok(value),
            Err(RecvTimeoutError::Disconnected) => {
                return Err(Apart::Broken(io::Error::other("the reading panicked")));
            }
            Err(RecvTimeoutError::Timeout) if is_to_stop() => break Apart::Stopped,
            Err(RecvTimeoutError::Timeout) if begun.elapsed() >= patience => break Apart::Late,
            Err(RecvTimeoutError::Timeout) => {}
        }
    };
    STRANDED.fetch_add(1, Ordering::Relaxed);
    take_off(&over);
    Err(fault)
}

/// The end of a reading's thread, however it comes.
struct End(Arc<AtomicBool>);

impl Drop for End {
    fn drop(&mut self) {
        take_off(&self.0);
    }
}

/// Called by the thread that ends and by whoever gives it up and has counted it: the second of the
/// two takes it off the count.
fn take_off(over: &AtomicBool) {
    if over.swap(true, Ordering::AcqRel) {
        STRANDED.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A folder that is being read.
struct Folder<'a> {
    path: &'a Path,
    /// Bytes that may still be read.
    left: u64,
    /// The file that is being read.
    at: &'a Mutex<Option<String>>,
    files: Files,
}

impl Folder<'_> {
    fn read(mut self) -> Result<Files, StartError> {
        let listed = names(self.path)
            .map_err(|source| StartError::Folder { folder: self.path.to_owned(), source })?;
        let mut wanted: HashSet<String> = BASE.map(str::to_owned).into();
        for name in BASE {
            self.take(name, &listed)?;
        }
        for name in self.models() {
            for file in [format!("{name}.onnx"), format!("{name}.json")] {
                if wanted.insert(file.clone()) {
                    self.take(&file, &listed)?;
                }
            }
        }
        for stranger in listed.iter().filter(|name| !wanted.contains(*name)) {
            if let Err(reason) = open(&self.path.join(stranger)) {
                tracing::warn!(file = stranger, reason, "passed over: no model's file");
            }
        }
        Ok(self.files)
    }

    /// The models that the index names; none if it is missing or damaged, which is found later.
    fn models(&self) -> Vec<String> {
        let index = self.files.iter().find(|(name, _)| name == "index.json");
        index
            .and_then(|(_, bytes)| std::str::from_utf8(bytes).ok())
            .and_then(|text| Index::from_json(text).ok())
            .map_or_else(Vec::new, |index| index.models)
    }

    /// Reads the file called `name` if the folder has it.
    fn take(&mut self, name: &str, listed: &HashSet<String>) -> Result<(), StartError> {
        let path = self.path.join(name);
        *self.at.lock().unwrap_or_else(PoisonError::into_inner) = Some(name.to_owned());
        // A link to nothing is a file that is missing.
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
        let most = FILE_BYTES_MAX.min(self.left);
        let too_large = |bytes: u64| {
            format!(
                "it has {} MiB; {} MiB of a file and {} of a folder are read",
                bytes.div_ceil(1 << 20),
                FILE_BYTES_MAX >> 20,
                FOLDER_BYTES_MAX >> 20,
            )
        };
        if data.len() > most {
            return Err(too_large(data.len()));
        }
        let mut bytes = Vec::with_capacity(usize::try_from(data.len()).unwrap_or_default());
        // It may grow meanwhile.
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

/// The names of the `.onnx` and `.json` files of `folder`.
fn names(folder: &Path) -> io::Result<HashSet<String>> {
    let mut names = HashSet::new();
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name();
        let wanted = Path::new(&name).extension().is_some_and(|e| e == "onnx" || e == "json");
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

/// Opens a file that is one; what else lies there could keep whoever opens it for ever.
fn open(path: &Path) -> Result<(File, Metadata), String> {
    let data = fs::metadata(path).map_err(|error| error.to_string())?;
    if !data.is_file() {
        return Err(format!("it is {}, no file", kind(data.file_type())));
    }
    let file = File::open(path).map_err(|error| error.to_string())?;
    let data = file.metadata().map_err(|error| error.to_string())?;
    // Something else may have taken its place.
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
    fn what_never_ends_is_given_up_and_blocks_what_comes_later_only_in_numbers() {
        let never = || false;
        assert_eq!(apart(|| 7, PATIENCE, &never).unwrap(), 7);
        let panicked = apart(|| assert_eq!(1, 2), PATIENCE, &never);
        assert!(matches!(panicked, Err(Apart::Broken(_))), "{panicked:?}");
        let mut held = Vec::new();
        for turn in 0..STRANDED_MAX {
            let (end, ended) = mpsc::channel::<()>();
            let work = move || {
                let _ = ended.recv();
            };
            let fault = if turn == 0 {
                apart(work, PATIENCE, &|| true)
            } else {
                apart(work, Duration::ZERO, &never)
            };
            let due = if turn == 0 { "Stopped" } else { "Late" };
            assert_eq!(format!("{:?}", fault.unwrap_err()), due);
            if turn + 1 < STRANDED_MAX {
                assert_eq!(apart(|| 7, PATIENCE, &never).unwrap(), 7, "a later one is blocked");
            }
            held.push(end);
        }
        let refused = apart(|| 7, PATIENCE, &never);
        assert!(matches!(refused, Err(Apart::Stranded)), "{refused:?}");
        // The drive answers at last.
        drop(held);
        let begun = Instant::now();
        while apart(|| 7, PATIENCE, &never).is_err() {
            assert!(begun.elapsed() < Duration::from_secs(60), "they are counted for ever");
            thread::sleep(Duration::from_millis(5));
        }
    }

    #[test]
    fn models_of_an_index_do_not_leave_the_folder() {
        let above = tempfile::tempdir().unwrap();
        let folder = above.path().join("models");
        fs::create_dir(&folder).unwrap();
        fs::write(above.path().join("x.onnx"), b"outside").unwrap();
        fs::write(folder.join("in.onnx"), b"inside").unwrap();
        let index = r#"{"default": "in", "models": ["in", "../x"]}"#;
        fs::write(folder.join("index.json"), index).unwrap();
        let files = read(&folder, &|| false).unwrap().unwrap();
        let names: Vec<_> = files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["index.json", "in.onnx"]);
        assert!(read(&folder, &|| true).unwrap().is_none_or(|files| files.len() == 2));
    }
}
