//! The binary as a process of its own.

use std::{
    fs,
    io::{BufRead, BufReader},
    net::SocketAddr,
    path::Path,
    process::{Child, Command, Stdio},
};

use serde_json::Value;
use tempfile::NamedTempFile;

/// The binary with these arguments.
pub(crate) fn papilla(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_papilla-server"));
    command.args(args);
    command
}

/// The binary as another program starts it, such as `chrt`; by itself if none is named.
pub(crate) fn program_by(starter: &[&str], args: &[&str]) -> Command {
    let Some((first, rest)) = starter.split_first() else { return papilla(args) };
    let mut command = Command::new(first);
    command.args(rest).arg(env!("CARGO_BIN_EXE_papilla-server")).args(args);
    command
}

/// A running binary with one inference thread; dropped, it is killed.
pub(crate) struct Running {
    pub(crate) child: Child,
    pub(crate) address: SocketAddr,
    /// Its start line.
    pub(crate) started: Value,
}

impl Running {
    /// Returns once it listens.
    pub(crate) fn start(models: &Path) -> Self {
        Self::start_with(models, &[])
    }

    /// The same, with more arguments.
    pub(crate) fn start_with(models: &Path, more: &[&str]) -> Self {
        Self::spawn(&[], models, &[&["--log", "error"], more].concat(), Stdio::inherit(), 1)
    }

    fn spawn(
        starter: &[&str],
        models: &Path,
        more: &[&str],
        stderr: Stdio,
        threads: usize,
    ) -> Self {
        let models = models.to_str().unwrap();
        let args = ["--models", models, "--bind", "127.0.0.1:0", "--json"];
        let mut child = program_by(starter, &args)
            .args(["--threads", &threads.to_string()])
            .args(["--calibration-ms", "1"])
            .args(more)
            .stdout(Stdio::piped())
            .stderr(stderr)
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let started: Value = serde_json::from_str(&line).unwrap();
        let port = started["port"].as_u64().unwrap() as u16;
        Self { child, address: SocketAddr::from(([127, 0, 0, 1], port)), started }
    }
}

impl Running {
    /// Sends a signal by its name, as `TERM`.
    pub(crate) fn signal(&self, name: &str) {
        signal(&self.child, name);
    }
}

/// Sends a process a signal by its name, as `TERM`.
pub(crate) fn signal(child: &Child, name: &str) {
    let (signal, pid) = (format!("-{name}"), child.id().to_string());
    assert!(Command::new("kill").args([signal, pid]).status().unwrap().success());
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A running binary whose log is kept.
pub(crate) struct Logged {
    pub(crate) running: Running,
    log: NamedTempFile,
}

impl Logged {
    /// Returns once it listens.
    pub(crate) fn start(models: &Path, more: &[&str]) -> Self {
        Self::start_by(&[], models, more, 1)
    }

    /// The same, started by another program, with so many inference threads.
    pub(crate) fn start_by(starter: &[&str], models: &Path, more: &[&str], threads: usize) -> Self {
        let log = NamedTempFile::new().unwrap();
        let stderr = log.reopen().unwrap().into();
        Self { running: Running::spawn(starter, models, more, stderr, threads), log }
    }

    /// What it has said on stderr so far.
    pub(crate) fn log(&self) -> String {
        fs::read_to_string(self.log.path()).unwrap()
    }
}
