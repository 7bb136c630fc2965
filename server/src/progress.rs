//! How far the start is. `/readyz` tells it until the start is over.

use std::sync::{Mutex, MutexGuard, PoisonError};

use papilla_proto::{ErrorCode, Problem};
use serde::Serialize;

/// What the start is at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Stage {
    /// The default tier's model is read and checked; requests wait.
    Loading,
    /// Threads get their sessions; requests wait.
    Warming,
    /// The contact model and the other tiers' models are read and checked; requests of the default
    /// tier are served.
    Completing,
    /// Tiers are measured; requests are served.
    Calibrating,
    /// Over.
    Ready,
}

/// What the start is at, and with which tiers it is done.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct State {
    stage: Stage,
    tiers_done: Vec<String>,
    tiers_left: Vec<String>,
}

/// The start, as those who ask see it.
#[derive(Debug)]
pub(crate) struct Progress(Mutex<State>);

impl Default for Progress {
    fn default() -> Self {
        let (tiers_done, tiers_left) = (Vec::new(), Vec::new());
        Self(Mutex::new(State { stage: Stage::Loading, tiers_done, tiers_left }))
    }
}

impl Progress {
    fn state(&self) -> MutexGuard<'_, State> {
        // Every change below leaves the state whole, so a poisoned lock is usable.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A stage begins, with all these tiers left.
    pub(crate) fn enter(&self, stage: Stage, tiers_left: Vec<String>) {
        *self.state() = State { stage, tiers_done: Vec::new(), tiers_left };
    }

    /// The stage is done with a tier.
    pub(crate) fn done(&self, tier: &str) {
        let mut state = self.state();
        state.tiers_left.retain(|left| left != tier);
        state.tiers_done.push(tier.to_owned());
    }

    /// What is still going on; none once the start is over.
    pub(crate) fn left(&self) -> Option<State> {
        let state = self.state();
        (state.stage != Stage::Ready).then(|| state.clone())
    }
}

impl State {
    /// The refusal of whoever needs the start to be over.
    pub(crate) fn problem(&self) -> Problem {
        let stage = match self.stage {
            Stage::Loading => "models are being loaded",
            Stage::Warming => "threads are being warmed",
            Stage::Completing => "the other tiers are being loaded",
            Stage::Calibrating => "tiers are being measured",
            Stage::Ready => "it is ready",
        };
        let done = self.tiers_done.len();
        let all = done + self.tiers_left.len();
        let count = if all > 0 { format!(", {done} of {all} done") } else { String::new() };
        let message = format!("the service is starting: {stage}{count}; try again in a moment");
        Problem::new(ErrorCode::Overloaded, message)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_stage_is_told_with_its_tiers_until_the_start_is_over() {
        let progress = Progress::default();
        let told = |progress: &Progress| json!(progress.left().unwrap());
        assert_eq!(
            told(&progress),
            json!({"stage": "loading", "tiers_done": [], "tiers_left": []})
        );
        progress.enter(Stage::Calibrating, vec!["a".to_owned(), "b".to_owned()]);
        progress.done("b");
        let due = json!({"stage": "calibrating", "tiers_done": ["b"], "tiers_left": ["a"]});
        assert_eq!(told(&progress), due);
        assert!(progress.left().unwrap().problem().message.contains("measured, 1 of 2 done"));
        progress.enter(Stage::Ready, Vec::new());
        assert!(progress.left().is_none());
    }
}
