//! Processor time, which does not count the work of other programs.

/// Of this thread, s.
pub(crate) fn thread_s() -> f64 {
    papilla_engine::processor_time().as_secs_f64()
}
