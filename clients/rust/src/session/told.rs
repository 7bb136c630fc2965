//! What people are told, each thing once.

use std::collections::HashSet;

use papilla_proto::{Ready, Warning};

/// Things that are told, at most.
const MOST: usize = 100;

#[derive(Debug, Default)]
pub(super) struct Told {
    codes: HashSet<String>,
    pub(super) words: Vec<String>,
}

impl Told {
    /// Says it on standard error, unless something of that code was said.
    pub(super) fn once(&mut self, code: &str, words: impl FnOnce() -> String) {
        if self.codes.contains(code) || self.codes.len() >= MOST {
            return;
        }
        self.codes.insert(code.to_owned());
        let words = words();
        eprintln!("papilla: {words}");
        self.words.push(words);
    }

    /// What the service asks, and a budget that it cannot meet.
    pub(super) fn question(&mut self, ready: &Ready) {
        for Warning { member, question, .. } in &ready.warnings {
            let words = format!("{member}: {question}");
            self.once(&words, || words.clone());
        }
        let (Some(false), Some(budget_us)) = (ready.meets_budget, ready.budget_us) else { return };
        let Ready { tier, predicted_latency_us, .. } = ready;
        let meant = if budget_us < 100 {
            format!("; it counts microseconds: were {budget_us} ms meant?")
        } else {
            String::new()
        };
        let words = format!(
            "a frame of tier {tier} takes some {predicted_latency_us} us, and budget_us is \
             {budget_us}, so that frames may be late{meant}"
        );
        self.once(&words, || words.clone());
    }
}
