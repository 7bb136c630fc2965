//! Answer buffers that go out to the socket and come back without an allocation.

use bytes::BytesMut;

/// Two buffers in turn: one may still be on its way out while the next is filled.
///
/// A buffer is handed out by splitting it off; when whoever sent it lets go,
/// the memory can be claimed again.
#[derive(Debug, Default)]
pub(crate) struct Recycler {
    buffers: [BytesMut; 2],
    next: usize,
}

impl Recycler {
    /// An empty buffer with room for `bytes`; memory is taken from the system only if
    /// neither buffer of an earlier answer is back and large enough.
    pub(crate) fn claim(&mut self, bytes: usize) -> &mut BytesMut {
        for turn in 0..2 {
            let index = (self.next + turn) % 2;
            if self.buffers[index].try_reclaim(bytes) {
                self.next = index;
                break;
            }
        }
        let index = self.next;
        self.next = (self.next + 1) % 2;
        let buffer = &mut self.buffers[index];
        buffer.clear();
        buffer.reserve(bytes);
        buffer
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
        let mut recycler = Recycler::default();
        let mut places = std::collections::HashSet::new();
        for _ in 0..20 {
            places.insert(answer(&mut recycler).as_ptr());
        }
        assert!(places.len() <= 2, "{} places for 20 answers sent in turn", places.len());
    }

    #[test]
    fn one_answer_on_its_way_out_costs_no_allocation() {
        let mut recycler = Recycler::default();
        let mut places = std::collections::HashSet::new();
        let mut sending = answer(&mut recycler);
        for _ in 0..20 {
            let next = answer(&mut recycler);
            places.insert(next.as_ptr());
            assert_ne!(next.as_ptr(), sending.as_ptr());
            sending = next;
        }
        assert!(places.len() <= 2, "{} places", places.len());
    }

    #[test]
    fn answers_that_are_held_stay_as_they_are() {
        let mut recycler = Recycler::default();
        let held: Vec<_> = (0..5).map(|_| answer(&mut recycler)).collect();
        assert!(held.iter().all(|a| a.len() == 1000 && a.iter().all(|&b| b == 7)));
    }
}
