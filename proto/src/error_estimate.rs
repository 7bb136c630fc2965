//! How wrong one answer is likely to be: what the section `error_estimate` of an answer holds.
//!
//! Errors are against finite elements on the meshes that the models learnt from. They are relative
//! and have no unit. Of SED it is the relative L2 norm over the map, `|answer - truth| / |truth|`, of
//! force that of its size.
//!
//! | at | member | meaning |
//! |---|---|---|
//! | 0 | `sed.median` | half of such answers err less |
//! | 4 | `sed.p90` | nine of ten such answers err less |
//! | 8 | `force.median` | the same of the force that contact found |
//! | 12 | `force.p90` | likewise |
//!
//! Where nothing is known of an error both of its numbers are infinite: no bound is stated, and a
//! comparison with any limit comes out on the safe side.

/// Bytes of an estimate on the wire: four little-endian f32.
pub const ERROR_ESTIMATE_LEN: usize = 16;

/// What one quantity of an answer errs, relative; see the [module](self).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LikelyError {
    /// Half of such answers err less.
    pub median: f32,
    /// Nine of ten such answers err less.
    pub p90: f32,
}

impl LikelyError {
    /// Nothing is known: infinite.
    pub const UNKNOWN: Self = Self { median: f32::INFINITY, p90: f32::INFINITY };

    /// Whether a bound is stated.
    #[must_use]
    pub fn is_stated(self) -> bool {
        self.p90.is_finite()
    }
}

impl Default for LikelyError {
    fn default() -> Self {
        Self::UNKNOWN
    }
}

/// What an answer errs; see the [module](self).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ErrorEstimate {
    /// Of the map of SED.
    pub sed: LikelyError,
    /// Of the size of the force, where contact found it.
    pub force: LikelyError,
}

impl ErrorEstimate {
    /// The bytes on the wire.
    #[must_use]
    pub fn encode(&self) -> [u8; ERROR_ESTIMATE_LEN] {
        let Self { sed, force } = self;
        let mut bytes = [0; ERROR_ESTIMATE_LEN];
        let members = [sed.median, sed.p90, force.median, force.p90];
        for (room, member) in bytes.chunks_exact_mut(4).zip(members) {
            room.copy_from_slice(&member.to_le_bytes());
        }
        bytes
    }

    /// Reads the first [`ERROR_ESTIMATE_LEN`] bytes; none if there are fewer.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let bytes = bytes.first_chunk::<ERROR_ESTIMATE_LEN>()?;
        let at = |i: usize| {
            f32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
        };
        let of = |i: usize| LikelyError { median: at(i), p90: at(i + 1) };
        Some(Self { sed: of(0), force: of(2) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_lie_where_the_table_says() {
        let sed = LikelyError { median: 0.1, p90: 0.2 };
        let estimate = ErrorEstimate { sed, force: LikelyError::UNKNOWN };
        let bytes = estimate.encode();
        assert_eq!(bytes[4..8], 0.2_f32.to_le_bytes());
        assert_eq!(bytes[8..12], f32::INFINITY.to_le_bytes());
        assert_eq!(ErrorEstimate::decode(&bytes), Some(estimate));
        assert_eq!(ErrorEstimate::decode(&bytes[..15]), None);
        assert!(sed.is_stated() && !estimate.force.is_stated());
        assert!(!ErrorEstimate::default().sed.is_stated());
    }
}
