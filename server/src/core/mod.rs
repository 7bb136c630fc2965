//! What renders: the scheduler, the catalogue of models and what is known of their times. It knows
//! no transport.

pub(crate) mod buffers;
pub(crate) mod catalogue;
pub(crate) mod digest;
pub(crate) mod effects;
pub(crate) mod kept;
pub(crate) mod latency;
pub(crate) mod metrics;
pub(crate) mod reload;
pub(crate) mod scheduler;
