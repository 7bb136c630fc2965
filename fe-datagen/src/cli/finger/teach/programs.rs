//! The programs that do a part of the work, and how they are run.

use super::error::TeachError;
use serde::de::DeserializeOwned;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// How often it is looked whether a step has ended.
const LOOK: Duration = Duration::from_millis(50);

/// Says which of the trainer's packages Python lacks; importing them would take seconds.
const PACKAGES: &str = "\
import importlib.util, sys
names = ('torch', 'onnx', 'onnxruntime', 'papilla_trainer')
missing = [name for name in names if importlib.util.find_spec(name) is None]
sys.exit('it has no ' + ', '.join(missing) if missing else 0)";

/// Where the trainer's package lies in the repository.
const TRAINER: &str = "model-export/trainer";

/// This program, `model-export` and a Python with the trainer.
pub(super) struct Programs {
    own: PathBuf,
    model_export: PathBuf,
    python: PathBuf,
    python_path: Option<std::ffi::OsString>,
    stop: Arc<AtomicBool>,
}

impl Programs {
    /// Where they are: none is run.
    pub(super) fn new(stop: Arc<AtomicBool>) -> Self {
        let variable = |name: &str| std::env::var_os(name).map(PathBuf::from);
        let own = std::env::current_exe().unwrap_or_else(|_| PathBuf::from("fe-datagen"));
        let name = format!("model-export{}", std::env::consts::EXE_SUFFIX);
        let beside = own.with_file_name(&name);
        let model_export = variable("MODEL_EXPORT")
            .or_else(|| beside.is_file().then_some(beside))
            .unwrap_or_else(|| PathBuf::from(name));
        let python = variable("PYTHON").unwrap_or_else(|| PathBuf::from("python3"));
        let given = std::env::var_os("PYTHONPATH");
        let mut folders: Vec<PathBuf> = given.iter().flat_map(std::env::split_paths).collect();
        if Path::new(TRAINER).is_dir() {
            folders.push(PathBuf::from(TRAINER));
        }
        let python_path = std::env::join_paths(&folders).ok().filter(|path| !path.is_empty());
        Self { own, model_export, python, python_path, stop }
    }

    /// Asks each whether it works: before anything is solved.
    pub(super) fn check(&self) -> Result<(), TeachError> {
        self.require(
            "the program that measures networks",
            self.model_export(["--version"]),
            "build it with `cargo build --release -p papilla-model-export`, or name it by MODEL_EXPORT",
        )?;
        self.require(
            "Python with the trainer's packages",
            self.python(["-c", PACKAGES]),
            "install them as docs/guides/training.md says, and name the interpreter by PYTHON",
        )
    }

    fn require(
        &self,
        what: &'static str,
        mut command: Command,
        cure: &'static str,
    ) -> Result<(), TeachError> {
        let program = command.get_program().to_string_lossy().into_owned();
        let failed = |problem: String| TeachError::NoProgram { what, program, problem, cure };
        match command.stdin(Stdio::null()).output() {
            Err(error) => Err(failed(format!("cannot be run ({error})"))),
            Ok(done) if done.status.success() => Ok(()),
            Ok(done) => {
                let said = String::from_utf8_lossy(&done.stderr).trim().to_owned();
                let last = said.lines().last().unwrap_or("nothing").to_owned();
                Err(failed(format!("says: {last}")))
            }
        }
    }

    /// This program.
    pub(super) fn own<S: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Command {
        let mut command = Command::new(&self.own);
        command.args(arguments);
        command
    }

    /// `model-export`.
    pub(super) fn model_export<S: AsRef<OsStr>>(
        &self,
        arguments: impl IntoIterator<Item = S>,
    ) -> Command {
        let mut command = Command::new(&self.model_export);
        command.args(arguments);
        command
    }

    /// Python.
    fn python<S: AsRef<OsStr>>(&self, arguments: impl IntoIterator<Item = S>) -> Command {
        let mut command = Command::new(&self.python);
        command.args(arguments).env("FE_DATAGEN", &self.own);
        if let Some(path) = &self.python_path {
            command.env("PYTHONPATH", path);
        }
        command
    }

    /// The trainer.
    pub(super) fn trainer<S: AsRef<OsStr>>(
        &self,
        arguments: impl IntoIterator<Item = S>,
    ) -> Command {
        let mut command = self.python(["-m", "papilla_trainer"]);
        command.args(arguments);
        command
    }

    /// Runs a step, says its command line on standard error, and waits for its end. What it prints
    /// for people is seen there too.
    pub(super) fn run(&self, mut command: Command) -> Result<(), TeachError> {
        let status = self.wait(command.stdout(std::io::stderr()), false)?.0;
        self.require_success(&command, status)
    }

    /// As [`Self::run`]; whether it passed, or ended with `code`.
    pub(super) fn run_or(&self, mut command: Command, code: u8) -> Result<bool, TeachError> {
        let status = self.wait(command.stdout(std::io::stderr()), false)?.0;
        if status.code() == Some(code.into()) {
            return Ok(false);
        }
        self.require_success(&command, status).map(|()| true)
    }

    /// Runs a step that prints JSON.
    pub(super) fn ask<T: DeserializeOwned>(&self, mut command: Command) -> Result<T, TeachError> {
        let (status, said) = self.wait(command.stdout(Stdio::piped()), true)?;
        self.require_success(&command, status)?;
        serde_json::from_slice(&said).map_err(|error| TeachError::Said {
            command: line(&command),
            problem: error.to_string(),
        })
    }

    fn require_success(&self, command: &Command, status: ExitStatus) -> Result<(), TeachError> {
        match status.success() {
            true => Ok(()),
            false => Err(TeachError::Step { command: line(command), status: status.to_string() }),
        }
    }

    /// Waits for a step. If this process is asked to leave, the step is asked too, and what it has
    /// finished stays.
    fn wait(&self, command: &mut Command, keep: bool) -> Result<(ExitStatus, Vec<u8>), TeachError> {
        if self.stop.load(Ordering::Relaxed) {
            return Err(TeachError::Interrupted);
        }
        let text = line(command);
        eprintln!("+ {text}");
        let failed = |error: std::io::Error| TeachError::Step {
            command: text.clone(),
            status: error.to_string(),
        };
        let mut child = command.stdin(Stdio::null()).spawn().map_err(failed)?;
        // A full pipe would stop it.
        let reader = child.stdout.take().filter(|_| keep).map(|mut pipe| {
            std::thread::spawn(move || {
                let mut said = Vec::new();
                std::io::Read::read_to_end(&mut pipe, &mut said).map(|_| said)
            })
        });
        let mut asked = false;
        let status = loop {
            if let Some(status) = child.try_wait().map_err(failed)? {
                break status;
            }
            if self.stop.load(Ordering::Relaxed) && !std::mem::replace(&mut asked, true) {
                ask_to_leave(&mut child);
            }
            std::thread::sleep(LOOK);
        };
        let said = reader.and_then(|r| r.join().ok()).and_then(Result::ok).unwrap_or_default();
        if self.stop.load(Ordering::Relaxed) {
            return Err(TeachError::Interrupted);
        }
        Ok((status, said))
    }
}

/// `generate` stores where it stands; what else there is writes its files whole or not at all.
fn ask_to_leave(child: &mut std::process::Child) {
    #[cfg(unix)]
    if let Ok(id) = i32::try_from(child.id()) {
        use nix::sys::signal::{Signal, kill};
        let _ = kill(nix::unistd::Pid::from_raw(id), Signal::SIGTERM);
    }
    #[cfg(not(unix))]
    let _ = child.kill();
}

/// A command line, as one would type it.
fn line(command: &Command) -> String {
    let word = |word: &OsStr| {
        let word = word.to_string_lossy();
        let plain = |c: char| c.is_alphanumeric() || "-_./=:".contains(c);
        if word.chars().all(plain) { word.into_owned() } else { format!("'{word}'") }
    };
    let program = Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    std::iter::once(program).chain(command.get_args()).map(word).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn programs() -> Programs {
        let [own, model_export, python] = ["true", "true", "true"].map(PathBuf::from);
        Programs { own, model_export, python, python_path: None, stop: Arc::default() }
    }

    #[test]
    fn a_program_that_is_not_there_or_fails_is_told_with_its_cure() {
        let programs = programs();
        let told = |command| programs.require("it", command, "do this").unwrap_err().to_string();
        let absent = told(Command::new("/no/such/program"));
        assert!(absent.contains("/no/such/program cannot be run") && absent.ends_with("do this"));
        let mut failing = Command::new("sh");
        failing.args(["-c", "echo first >&2; echo no torch >&2; exit 1"]);
        assert!(told(failing).contains("says: no torch; do this"));
    }

    #[test]
    fn steps_end_with_their_status_and_what_they_print() {
        let programs = programs();
        let sh = |script: &str| {
            let mut command = Command::new("sh");
            command.args(["-c", script]);
            command
        };
        assert!(programs.run(sh("true")).is_ok());
        assert!(!programs.run_or(sh("exit 3"), 3).unwrap());
        let failed = programs.run(sh("exit 4")).unwrap_err().to_string();
        assert!(failed.contains("sh -c 'exit 4'") && failed.contains("4;"), "{failed}");
        assert_eq!(programs.ask::<Vec<u8>>(sh("echo '[1, 2]'")).unwrap(), [1, 2]);
        assert!(matches!(programs.ask::<u8>(sh("echo no")), Err(TeachError::Said { .. })));
        programs.stop.store(true, Ordering::Relaxed);
        assert!(matches!(programs.run(sh("true")), Err(TeachError::Interrupted)));
    }

    #[cfg(unix)]
    #[test]
    fn a_step_is_asked_to_leave_with_this_process() {
        let programs = programs();
        let stop = Arc::clone(&programs.stop);
        std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(200));
            stop.store(true, Ordering::Relaxed);
        });
        let mut long = Command::new("sleep");
        long.arg("60");
        let clock = std::time::Instant::now();
        assert!(matches!(programs.run(long), Err(TeachError::Interrupted)));
        assert!(clock.elapsed() < Duration::from_secs(30));
    }
}
