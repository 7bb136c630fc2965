//! The progress bar: presses done, rate, time left.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::time::Duration;

/// A bar for `total` presses of which `reused` were done by an earlier run.
/// Hidden when `visible` is false or standard error is no terminal.
pub(crate) fn bar(total: usize, reused: usize, visible: bool) -> ProgressBar {
    let target = if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(total as u64), target);
    // indicatif's own rate looks back some 15 s, less than one indentation takes.
    let solved = move |state: &ProgressState| state.pos().saturating_sub(reused as u64);
    let rate = move |state: &ProgressState, out: &mut dyn Write| {
        let minutes = state.elapsed().as_secs_f64() / 60.0;
        let per_minute = solved(state) as f64 / minutes.max(1e-9);
        let _ = if solved(state) == 0 { write!(out, "-") } else { write!(out, "{per_minute:.2}") };
    };
    let left = move |state: &ProgressState, out: &mut dyn Write| {
        let remaining = state.len().unwrap_or(0).saturating_sub(state.pos());
        let text = match solved(state) {
            0 => "?".to_string(),
            done => clock(state.elapsed().mul_f64(remaining as f64 / done as f64)),
        };
        let _ = write!(out, "{text}");
    };
    let template =
        "{bar:32} {pos}/{len} presses  {rate}/min  {elapsed_precise} passed  {left} left  {msg}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("rate", rate).with_key("left", left));
    }
    bar.set_position(reused as u64);
    bar.enable_steady_tick(Duration::from_secs(1));
    bar
}

/// A duration as h:mm:ss.
pub(super) fn clock(duration: Duration) -> String {
    let s = duration.as_secs();
    format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}
