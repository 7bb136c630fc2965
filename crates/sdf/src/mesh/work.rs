//! How much the check of a mesh looks at.

use super::MeshError;

/// Boxes and triangles that are looked at for each triangle of a mesh. A well-made mesh takes some
/// 100; more than this is one whose triangles reach across each other.
const PER_TRIANGLE: u64 = 600;
/// What is looked at anyway: below some 300 triangles even all pairs are not more.
const ANYWAY: u64 = 300_000;
/// Between two questions whether to go on: some .1 ms.
const QUESTION: u64 = 8192;

/// Boxes and triangles that may still be looked at.
pub(super) struct Work<'a> {
    most: u64,
    left: u64,
    to_question: u64,
    go_on: &'a dyn Fn() -> bool,
}

impl<'a> Work<'a> {
    pub(super) fn new(triangles: usize, go_on: &'a dyn Fn() -> bool) -> Self {
        let most = ANYWAY.max(PER_TRIANGLE * triangles as u64);
        Self { most, left: most, to_question: 0, go_on }
    }

    /// Looks at so many.
    ///
    /// # Errors
    /// It is too much, or nobody waits any more.
    pub(super) fn spend(&mut self, count: u64) -> Result<(), MeshError> {
        let too_many = MeshError::TooTangled { most: self.most };
        self.left = self.left.checked_sub(count).ok_or(too_many)?;
        self.to_question = self.to_question.saturating_sub(count);
        if self.to_question == 0 {
            self.to_question = QUESTION;
            if !(self.go_on)() {
                return Err(MeshError::Stopped);
            }
        }
        Ok(())
    }
}
