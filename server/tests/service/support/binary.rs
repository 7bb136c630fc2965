//! The binary as a process of its own.

use std::{
    io::{BufRead, BufReader},
    net::SocketAddr,
    path::Path,
    process::{Child, Command, Stdio},
};

use serde_json::Value;

/// The binary with these arguments.
pub(crate) fn papilla(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_papilla-server"));
    command.args(args);
    command
}

/// A running binary with one inference thread; dropped, it is killed.
pub(crate) struct Running {
    pub(crate) child: Child,
    pub(crate) address: SocketAddr,
}

impl Running {
    /// Returns once it listens.
    pub(crate) fn start(models: &Path) -> Self {
        Self::start_with(models, &[])
    }

    /// The same, with more arguments.
    pub(crate) fn start_with(models: &Path, more: &[&str]) -> Self {
        let models = models.to_str().unwrap();
        let args = ["--models", models, "--bind", "127.0.0.1:0", "--json", "--threads", "1"];
        let mut child = papilla(&args)
            .args(["--calibration-ms", "1", "--log", "error"])
            .args(more)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let started: Value = serde_json::from_str(&line).unwrap();
        let port = started["port"].as_u64().unwrap() as u16;
        Self { child, address: SocketAddr::from(([127, 0, 0, 1], port)) }
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
