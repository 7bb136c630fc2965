//! Answer buffers that go out to the socket and come back without an allocation.

mod store;

use bytes::BytesMut;

pub(crate) use self::store::{Frames, Store};

/// Free bytes at the start of a session's answer, into which its transport writes the header of the
/// WebSocket frame. A multiple of 16, so that the sections behind it are aligned.
pub(crate) const HEADROOM: usize = 16;

/// A ring of `N` reusable buffers. Answers need three: one is being written to the socket, one
/// waits behind it, and the next is filled.
///
/// A buffer is handed out by splitting it off. Its memory can be claimed again once the receiver
/// has dropped what it got.
#[derive(Debug)]
pub(crate) struct Recycler<const N: usize = 3> {
    buffers: [BytesMut; N],
    next: usize,
}

impl<const N: usize> Default for Recycler<N> {
    fn default() -> Self {
        Self { buffers: std::array::from_fn(|_| BytesMut::new()), next: 0 }
    }
}

impl<const N: usize> Recycler<N> {
    /// Gives every buffer that nobody holds room for `bytes`, so that later claims of at most that
    /// size do not allocate.
    pub(crate) fn make_room(&mut self, bytes: usize) {
        for buffer in &mut self.buffers {
            if !buffer.try_reclaim(bytes) {
                *buffer = BytesMut::with_capacity(bytes);
                // The first split allocates the reference count; this does it now.
                drop(buffer.split());
            }
        }
    }

    /// Whether a buffer that nobody holds has any capacity.
    pub(crate) fn has_room(&mut self) -> bool {
        self.buffers.iter_mut().any(|buffer| buffer.try_reclaim(1))
    }

    /// Turns to a buffer that nobody holds and that has room for `bytes`, if there is one.
    fn turn_to_free(&mut self, bytes: usize) -> bool {
        let free = (0..N)
            .map(|turn| (self.next + turn) % N)
            .find(|&index| self.buffers[index].try_reclaim(bytes));
        self.next = free.unwrap_or(self.next);
        free.is_some()
    }

    /// An empty buffer with room for `bytes`. It allocates only if no buffer is both returned and
    /// large enough.
    pub(crate) fn claim(&mut self, bytes: usize) -> &mut BytesMut {
        self.turn_to_free(bytes);
        let index = self.next;
        self.next = (self.next + 1) % N;
        let buffer = &mut self.buffers[index];
        buffer.clear();
        buffer.reserve(bytes);
        buffer
    }

    /// [`claim`](Self::claim)s a buffer and hands it out. It returns to the ring when it is
    /// dropped.
    pub(crate) fn lend(&mut self, bytes: usize) -> BytesMut {
        self.claim(bytes).split_off(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(recycler: &mut Recycler) -> bytes::Bytes {
        let buffer = recycler.claim(1000);
        buffer.resize(1000, 7);
        buffer.split().freeze()
    }

    #[test]
    fn memory_comes_back_once_the_answer_is_sent() {
        let mut recycler = Recycler::<3>::default();
        let mut places = std::collections::HashSet::new();
        for _ in 0..20 {
            places.insert(answer(&mut recycler).as_ptr());
        }
        assert!(places.len() <= 3, "{} places for 20 answers sent in turn", places.len());
    }

    #[test]
    fn one_answer_on_its_way_out_costs_no_allocation() {
        let mut recycler = Recycler::<3>::default();
        let mut places = std::collections::HashSet::new();
        let mut sending = answer(&mut recycler);
        for _ in 0..20 {
            let next = answer(&mut recycler);
            places.insert(next.as_ptr());
            assert_ne!(next.as_ptr(), sending.as_ptr());
            sending = next;
        }
        assert!(places.len() <= 3, "{} places", places.len());
    }

    #[test]
    fn room_made_beforehand_is_what_is_claimed() {
        let mut recycler = Recycler::<3>::default();
        assert!(!recycler.has_room());
        recycler.make_room(1000);
        assert!(recycler.has_room());
        let places = recycler.buffers.each_ref().map(|buffer| buffer.as_ptr());
        let held: Vec<_> = (0..3)
            .map(|_| {
                let buffer = recycler.claim(1000);
                buffer.resize(1000, 7);
                buffer.split().freeze()
            })
            .collect();
        assert!(held.iter().all(|answer| places.contains(&answer.as_ptr())));
    }

    #[test]
    fn answers_that_are_held_stay_as_they_are() {
        let mut recycler = Recycler::<3>::default();
        let held: Vec<_> = (0..5).map(|_| answer(&mut recycler)).collect();
        assert!(held.iter().all(|a| a.len() == 1000 && a.iter().all(|&b| b == 7)));
    }
}
