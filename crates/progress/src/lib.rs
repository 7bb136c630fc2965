//! How far long work is: a bar on a terminal, elsewhere a line every few seconds.
//!
//! ```
//! use papilla_progress::Progress;
//!
//! let progress = Progress::new("samples", 3, 0, false);
//! for sample in ["a", "b", "c"] {
//!     progress.set_message(sample);
//!     progress.inc();
//! }
//! ```

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write as _;
use std::io::{IsTerminal as _, Write as _};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often a line is written where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// The progress of some work, on standard error until it is dropped.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    lines: Option<Lines>,
}

impl Progress {
    /// Of `total` parts of which `reused` were done by an earlier run; `quiet` shows nothing.
    pub fn new(what: &str, total: usize, reused: usize, quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let shown = terminal && !quiet;
        let target =
            if shown { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(total as u64), target);
        // indicatif's own rate looks back some 15 s, less than one part may take.
        let left = move |state: &ProgressState, out: &mut dyn std::fmt::Write| {
            let (done, all) = (state.pos(), state.len().unwrap_or(0));
            let _ = write!(out, "{}", left(state.elapsed(), done, all, reused as u64));
        };
        let template =
            "{bar:32} {pos}/{len} {prefix}  {elapsed_precise} passed  {left} left  {msg}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.with_key("left", left));
        }
        bar.set_prefix(what.to_owned());
        bar.set_position(reused as u64);
        bar.enable_steady_tick(Duration::from_secs(1));
        let lines = (!terminal && !quiet).then(|| Lines::start(bar.clone(), reused as u64));
        Self { bar, lines }
    }

    /// One more part is done.
    pub fn inc(&self) {
        self.bar.inc(1);
    }

    /// So many parts are done.
    pub fn set_position(&self, done: usize) {
        self.bar.set_position(done as u64);
    }

    /// There are so many parts.
    pub fn set_length(&self, total: usize) {
        self.bar.set_length(total as u64);
    }

    /// What is being done now.
    pub fn set_message(&self, state: impl Into<String>) {
        self.bar.set_message(state.into());
    }

    /// Prints to standard output or error without a bar in the way.
    pub fn suspend(&self, print: impl FnOnce()) {
        self.bar.suspend(print);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        self.lines.take();
    }
}

/// A thread that writes lines until it is dropped.
#[derive(Debug)]
struct Lines {
    ended: Arc<(Mutex<bool>, Condvar)>,
    writer: Option<JoinHandle<()>>,
}

impl Lines {
    fn start(bar: ProgressBar, reused: u64) -> Self {
        let ended = Arc::new((Mutex::new(false), Condvar::new()));
        let until = Arc::clone(&ended);
        let began = Instant::now();
        let write = move || {
            let (ended, changed) = &*until;
            let mut ended = ended.lock().unwrap_or_else(|p| p.into_inner());
            while !*ended {
                let wait = changed.wait_timeout(ended, LINE_EVERY);
                let (guard, waited) = wait.unwrap_or_else(|p| p.into_inner());
                ended = guard;
                if waited.timed_out() && !*ended {
                    let (what, state) = (bar.prefix(), bar.message());
                    let all = bar.length().unwrap_or(0);
                    let line = line(&what, &state, began.elapsed(), bar.position(), all, reused);
                    // A reader that is gone is no reason to stop.
                    let _ = writeln!(std::io::stderr(), "{line}");
                }
            }
        };
        // Without the thread the work goes on, untold.
        Self { ended, writer: std::thread::Builder::new().spawn(write).ok() }
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        *self.ended.0.lock().unwrap_or_else(|p| p.into_inner()) = true;
        self.ended.1.notify_all();
        self.writer.take().map(JoinHandle::join);
    }
}

/// What a line says: what, share, state, time passed and left.
fn line(what: &str, state: &str, passed: Duration, done: u64, all: u64, reused: u64) -> String {
    let share = if all == 0 { 0.0 } else { 100.0 * done as f64 / all as f64 };
    let mut out = format!("{what}: {done} of {all} ({share:.0} %)");
    if !state.is_empty() {
        let _ = write!(out, ", {state}");
    }
    let left = left(passed, done, all, reused);
    let _ = write!(out, ", {} passed, {left} left", clock(passed));
    out
}

/// Time left, if the parts to come take as long as those that this run has done.
fn left(passed: Duration, done: u64, all: u64, reused: u64) -> String {
    match done.saturating_sub(reused) {
        0 => "?".into(),
        own => clock(passed.mul_f64(all.saturating_sub(done) as f64 / own as f64)),
    }
}

/// A duration as h:mm:ss.
pub fn clock(duration: Duration) -> String {
    let s = duration.as_secs();
    format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_state_share_and_time_left() {
        let seconds = Duration::from_secs;
        assert_eq!(
            line("states", "coarse", seconds(60), 5, 20, 2),
            "states: 5 of 20 (25 %), coarse, 0:01:00 passed, 0:05:00 left"
        );
        assert_eq!(
            line("states", "", seconds(3661), 2, 20, 2),
            "states: 2 of 20 (10 %), 1:01:01 passed, ? left"
        );
        assert_eq!(line("", "", seconds(0), 0, 0, 0), ": 0 of 0 (0 %), 0:00:00 passed, ? left");
    }
}
