//! One press: from a scene to stored equilibria.

pub mod record;

pub mod body;
pub mod fields;
