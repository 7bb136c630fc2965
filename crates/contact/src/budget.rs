//! The budget of work of a frame. Work is counted and not timed, so that the same frame always
//! gives the same bits.
//!
//! A unit is one multiplication and addition for an entry of a matrix. A solve that has used its
//! budget finishes the linearisation or the round that it is in, ends with what it has, and is not
//! settled.

/// Units of a frame, and of all frames that are tried for a net force: more than any takes that
/// settles among some thousand random poses, which `docs/concepts/contact.md` tells of.
pub const WORK_MAX: u64 = 1_400_000_000;
