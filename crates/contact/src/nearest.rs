//! The nearest object of a vertex, whether a frame describes objects or gaps.

use crate::error::ContactError;

/// The nearest thing.
#[derive(Clone, Copy)]
pub(crate) struct Nearest {
    pub gap_mm: f64,
    pub normal: [f64; 3],
    pub stiffness_mpa_per_mm: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Index of the object; of what is told by gaps 0.
    pub object: u32,
    /// Distances asked beyond one from each object, in those of a sphere.
    pub asked: u32,
}

/// Largest coefficient of friction that is believed; dry skin on glass reaches 3.
pub const FRICTION_MAX: f64 = 10.0;

/// Refuses what is no coefficient of friction.
pub(crate) fn require_friction(member: &'static str, value: f64) -> Result<(), ContactError> {
    let rule = "has to be 0 to 10";
    if (0.0..=FRICTION_MAX).contains(&value) {
        return Ok(());
    }
    Err(ContactError::Value { member, value, rule })
}

/// Refuses a stiffness that is none.
pub(crate) fn require_stiffness(member: &'static str, value: f64) -> Result<(), ContactError> {
    let rule = "has to be positive";
    if value > 0.0 { Ok(()) } else { Err(ContactError::Value { member, value, rule }) }
}
