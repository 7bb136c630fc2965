//! Keeps the buffers of closed sessions for new ones.
//!
//! If they were given back to the allocator, they would lie in the arena of the thread that opened
//! the session. Each arena would then grow to all sessions that its thread ever had at once. Kept
//! here, there are never more buffers than there were sessions at the same time.

use std::{
    mem,
    sync::{Mutex, MutexGuard, PoisonError},
};

use bytes::BytesMut;
use papilla_proto::{HEADER_LEN, MAP_LEN};

use super::{HEADROOM, Recycler};

/// Buffers of one ring of [`Frames`].
const RING: usize = 4;

/// Buffers of the incoming frames of one session. For each finger one is with an inference thread
/// and one waits in the finger's slot. Besides, one is read into, and one was just replaced in a
/// slot.
#[derive(Debug)]
pub(crate) struct Frames {
    rings: Vec<Recycler<RING>>,
}

impl Default for Frames {
    /// Buffers for one finger.
    fn default() -> Self {
        Self { rings: vec![Recycler::default()] }
    }
}

impl Frames {
    /// Has buffers for so many fingers.
    fn resize(&mut self, fingers: usize) {
        let rings = (2 * fingers.max(1) + 2).div_ceil(RING);
        self.rings.resize_with(rings, Recycler::default);
    }

    fn make_room(&mut self, bytes: usize) {
        self.rings.iter_mut().for_each(|ring| ring.make_room(bytes));
    }

    fn has_room(&mut self) -> bool {
        self.rings.iter_mut().any(Recycler::has_room)
    }

    /// Hands out an empty buffer with room for `bytes`. It comes back when it is dropped. Memory is
    /// allocated only if no buffer is both returned and large enough.
    pub(crate) fn lend(&mut self, bytes: usize) -> BytesMut {
        let free = self.rings.iter_mut().position(|ring| ring.turn_to_free(bytes));
        self.rings[free.unwrap_or(0)].lend(bytes)
    }
}

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

    /// Buffers for frames of at most `bytes` for so many fingers.
    pub(crate) fn frames(&self, bytes: usize, fingers: usize) -> Frames {
        let mut frames = self.kept().frames.pop().unwrap_or_default();
        self.enlarge_frames(&mut frames, bytes, fingers);
        frames
    }

    /// Changes a session's buffers to so many fingers.
    pub(crate) fn enlarge_frames(&self, frames: &mut Frames, bytes: usize, fingers: usize) {
        frames.resize(fingers);
        frames.make_room(bytes.max(ROOM));
    }

    /// Buffers for answers of at most `bytes`.
    pub(crate) fn answers(&self, bytes: usize) -> Answers {
        let mut answers = self.kept().answers.pop().unwrap_or_default();
        answers.make_room(bytes.max(ROOM));
        answers
    }

    /// Takes the buffers of a closed session back.
    pub(crate) fn keep_frames(&self, frames: &mut Frames) {
        // Buffers without capacity come from a session that failed before it used them.
        let mut kept = self.kept();
        if frames.has_room() && kept.frames.len() < self.places {
            frames.resize(1);
            kept.frames.push(mem::take(frames));
        }
    }

    /// Takes the buffers of a closed session back.
    pub(crate) fn keep_answers(&self, answers: &mut Answers) {
        let mut kept = self.kept();
        if answers.has_room() && kept.answers.len() < self.places {
            kept.answers.push(mem::take(answers));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    /// Where the buffers of `sessions` lie that are open at the same time.
    fn places(store: &Store, sessions: usize) -> HashSet<usize> {
        let mut open: Vec<_> =
            (0..sessions).map(|_| (store.frames(100, 1), store.answers(300_000))).collect();
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

    /// Each of ten fingers may have a frame with a thread and one that waits.
    #[test]
    fn frames_of_ten_fingers_that_wait_need_no_more_memory() {
        let store = Store::new(1);
        let mut frames = store.frames(100, 10);
        let mut places = HashSet::new();
        for _ in 0..5 {
            let held: Vec<_> = (0..22).map(|_| frames.lend(100)).collect();
            places.extend(held.iter().map(|buffer| buffer.as_ptr() as usize));
        }
        assert!(places.len() <= 24, "{} places for 22 buffers", places.len());
        // A session of one finger gets no more than it needs.
        store.keep_frames(&mut frames);
        let mut frames = store.frames(100, 1);
        let held: HashSet<_> = (0..4).map(|_| frames.lend(100).as_ptr() as usize).collect();
        assert!(held.is_subset(&places));
        assert_eq!(frames.rings.len(), 1);
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
