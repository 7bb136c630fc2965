//! Keeps the buffers of closed sessions for new ones.
//!
//! If they were given back to the allocator, they would lie in the arena of the thread that opened
//! the session. Each arena would then grow to all sessions that its thread ever had at once. Kept
//! here, there are never more buffers than there were sessions at the same time.

use std::{
    mem,
    sync::{Mutex, MutexGuard, PoisonError},
};

use papilla_proto::{HEADER_LEN, MAP_LEN};

use super::{HEADROOM, Recycler};

/// Buffers of incoming frames. Four: one is read into, one is with an inference thread, one waits
/// in the slot, and one was just replaced there.
pub(crate) type Frames = Recycler<4>;

/// Buffers of answers.
pub(crate) type Answers = Recycler;

/// Capacity of every buffer, bytes: a whole float32 map with its headers, so that any session can
/// use any buffer. Pages that a session never touches take no physical memory.
const ROOM: usize = 2 * HEADROOM + HEADER_LEN + 4 * MAP_LEN;

/// The buffers that nobody uses.
#[derive(Debug)]
pub(crate) struct Store {
    kept: Mutex<Kept>,
    /// The most of each kind that are kept: one for each session that may be open.
    places: usize,
}

#[derive(Debug, Default)]
struct Kept {
    frames: Vec<Frames>,
    answers: Vec<Answers>,
}

impl Store {
    /// An empty store for the buffers of at most `places` sessions.
    pub(crate) fn new(places: usize) -> Self {
        Self { kept: Mutex::default(), places }
    }

    fn kept(&self) -> MutexGuard<'_, Kept> {
        // Every change below leaves the lists whole, so a poisoned lock is usable.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Buffers for frames of at most `bytes`.
    pub(crate) fn frames(&self, bytes: usize) -> Frames {
        let mut frames = self.kept().frames.pop().unwrap_or_default();
        frames.make_room(bytes.max(ROOM));
        frames
    }

    /// Buffers for answers of at most `bytes`.
    pub(crate) fn answers(&self, bytes: usize) -> Answers {
        let mut answers = self.kept().answers.pop().unwrap_or_default();
        answers.make_room(bytes.max(ROOM));
        answers
    }

    /// Takes the buffers of a closed session back.
    pub(crate) fn keep_frames(&self, frames: &mut Frames) {
        keep(&mut self.kept().frames, frames, self.places);
    }

    /// Takes the buffers of a closed session back.
    pub(crate) fn keep_answers(&self, answers: &mut Answers) {
        keep(&mut self.kept().answers, answers, self.places);
    }
}

fn keep<const N: usize>(kept: &mut Vec<Recycler<N>>, back: &mut Recycler<N>, places: usize) {
    // Buffers without capacity come from a session that failed before it used them.
    if back.has_room() && kept.len() < places {
        kept.push(mem::take(back));
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    /// Where the buffers of `sessions` lie that are open at the same time.
    fn places(store: &Store, sessions: usize) -> HashSet<usize> {
        let mut open: Vec<_> =
            (0..sessions).map(|_| (store.frames(100), store.answers(300_000))).collect();
        let mut places = HashSet::new();
        for (frames, answers) in &mut open {
            places.extend((0..4).map(|_| frames.lend(100).as_ptr() as usize));
            places.extend((0..3).map(|_| answers.claim(300_000).as_ptr() as usize));
        }
        for (mut frames, mut answers) in open {
            store.keep_frames(&mut frames);
            store.keep_answers(&mut answers);
        }
        places
    }

    #[test]
    fn sessions_to_come_use_the_memory_of_those_that_are_over() {
        let store = Store::new(5);
        let first = places(&store, 5);
        assert_eq!(first.len(), 35);
        for sessions in [1, 5, 3, 5] {
            assert!(places(&store, sessions).is_subset(&first), "{sessions} sessions");
        }
    }

    #[test]
    fn no_more_is_kept_than_there_may_be_sessions() {
        let store = Store::new(2);
        places(&store, 6);
        store.keep_frames(&mut Frames::default());
        let kept = store.kept();
        assert_eq!((kept.frames.len(), kept.answers.len()), (2, 2));
    }
}
