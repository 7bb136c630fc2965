//! Runs CalculiX and takes its CPU time.

use super::{Dat, DatError};
use papilla_output::{OutputError, atomic};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A CalculiX binary.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ccx {
    path: PathBuf,
}

/// One finished run.
#[derive(Clone, Debug)]
pub struct Run {
    /// What it printed.
    pub dat: Dat,
    /// CPU seconds, user and system; `None` where the system does not say.
    pub cpu_s: Option<f64>,
    /// Increments that converged.
    pub increments: usize,
    /// Equilibrium iterations of all increments, failed ones included.
    pub iterations: usize,
}

/// Why a run gave no result.
#[derive(Debug, thiserror::Error)]
pub enum CcxError {
    /// The deck cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The binary cannot be started.
    #[error("cannot run {}: {source}", path.display())]
    Start {
        /// The binary.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It took too long and was stopped.
    #[error("CalculiX was stopped after {seconds} s; its output is in {}", log.display())]
    TimeOut {
        /// Limit, s.
        seconds: u64,
        /// Its standard output.
        log: PathBuf,
    },
    /// It gave up.
    #[error("CalculiX gave up: {message}; its output is in {}", log.display())]
    Failed {
        /// Its last error message.
        message: String,
        /// Its standard output.
        log: PathBuf,
    },
    /// Its results cannot be read.
    #[error(transparent)]
    Dat(#[from] DatError),
}

/// Longest run, s.
const LIMIT_S: u64 = 4 * 3600;

impl Ccx {
    /// The binary at `path`, or `ccx` where programs are looked for; `None` if
    /// there is none.
    #[must_use]
    pub fn find(path: Option<&Path>) -> Option<Self> {
        if let Some(path) = path {
            return path.is_file().then(|| Self { path: path.into() });
        }
        let folders = std::env::var_os("PATH")?;
        let mut candidates = std::env::split_paths(&folders).map(|folder| folder.join("ccx"));
        candidates.find(|c| c.is_file()).map(|path| Self { path })
    }

    /// Writes `deck` to `folder/job.inp` and runs it on one core.
    ///
    /// # Errors
    /// [`CcxError`]; the log stays in the folder.
    pub fn run(&self, folder: &Path, job: &str, deck: &str) -> Result<Run, CcxError> {
        atomic::write(&folder.join(format!("{job}.inp")), deck.as_bytes())?;
        let log = folder.join(format!("{job}.log"));
        let started = |source| CcxError::Start { path: self.path.clone(), source };
        let file = std::fs::File::create(&log).map_err(started)?;
        let both = file.try_clone().map_err(started)?;
        let before_s = children_s();
        let mut child = Command::new(&self.path)
            .args(["-i", job])
            .current_dir(folder)
            .env("OMP_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .stdout(Stdio::from(file))
            .stderr(Stdio::from(both))
            .spawn()
            .map_err(started)?;
        let start = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().map_err(started)? {
                break status;
            }
            if start.elapsed() > Duration::from_secs(LIMIT_S) {
                // It may have ended just now; either way it is gone after this.
                let _ = child.kill();
                child.wait().map_err(started)?;
                return Err(CcxError::TimeOut { seconds: LIMIT_S, log });
            }
            std::thread::sleep(Duration::from_millis(10));
        };
        let cpu_s = children_s().zip(before_s).map(|(after, before)| after - before);
        let output = std::fs::read(&log).map_err(started)?;
        let output = String::from_utf8_lossy(&output);
        if let (false, _) | (_, Some(_)) = (status.success(), error_message(&output)) {
            let message = error_message(&output).unwrap_or_else(|| status.to_string());
            return Err(CcxError::Failed { message, log });
        }
        let dat = Dat::read(&folder.join(format!("{job}.dat")))?;
        let count =
            |text: &str| output.lines().filter(|l| l.trim_start().starts_with(text)).count();
        Ok(Run {
            dat,
            cpu_s,
            increments: count("convergence; new increment"),
            iterations: count("iteration "),
        })
    }
}

/// Processor time of all processes that this one has started and waited for, s; `None` where the system
/// does not say (it takes Linux).
fn children_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field, in brackets, may hold spaces; cutime and cstime are the 14th and
    // 15th after it, in ticks of 10 ms.
    let fields = stat.rsplit_once(')')?.1.split_whitespace();
    let ticks: Option<f64> = fields.skip(13).take(2).map(|f| f.parse::<f64>().ok()).sum();
    ticks.map(|t| t / 100.0)
}

/// The last `*ERROR` of CalculiX' output with the lines that belong to it.
fn error_message(output: &str) -> Option<String> {
    let start = output.rfind("*ERROR")?;
    let lines = output[start..].lines().take_while(|l| !l.trim().is_empty()).take(4);
    Some(lines.map(str::trim).collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_is_not_there_is_not_found() {
        assert_eq!(Ccx::find(Some(Path::new("/no/such/ccx"))), None);
    }

    #[test]
    fn the_last_error_is_quoted() {
        let output = "a\n *ERROR in one: first\n\n *ERROR in two: second\n        more\n\n end\n";
        assert_eq!(error_message(output).unwrap(), "*ERROR in two: second more");
        assert_eq!(error_message("fine"), None);
    }

    #[test]
    fn a_failing_program_is_reported_with_its_log() {
        let folder = tempfile::tempdir().unwrap();
        // Any program but CalculiX: it does not print the results.
        let shell = Ccx { path: "/bin/false".into() };
        let error = shell.run(folder.path(), "job", "** deck\n").unwrap_err();
        assert!(matches!(error, CcxError::Failed { .. }), "{error}");
        assert!(folder.path().join("job.inp").exists());
    }
}
