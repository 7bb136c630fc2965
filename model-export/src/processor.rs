//! Processor time: what else the machine does does not count.

/// Of this thread, s.
pub(crate) fn thread_s() -> f64 {
    papilla_engine::processor_time().as_secs_f64()
}
