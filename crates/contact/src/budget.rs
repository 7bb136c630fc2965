//! What a frame may take: counted and not timed, so that the same frame gets the same bits.
//!
//! A unit is one multiply-add over an entry of a matrix. What has used its budget ends with what it
//! has, after the linearisation or the round that it is in, and is not settled.

/// Units of a frame, and of all frames that are tried for a net force: more than any takes that
/// settles among some thousand random poses, which `docs/concepts/contact.md` tells of.
pub(crate) const UNITS_MAX: u64 = 1_400_000_000;
