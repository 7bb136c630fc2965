//! Calls tract: its errors and panics become errors of this crate, and its panics are not written
//! to the log.

use crate::{Backend, EngineError};
use std::any::Any;
use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe, catch_unwind};
use std::sync::Once;
use tract_onnx::prelude::TractResult;

thread_local! {
    /// Whether this thread is inside [`guarded`], whose caller gets a panic as an error.
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Runs tract's code, and turns its errors and panics into errors of this crate.
///
/// tract reports most bad models as errors, but asserts here and there (shape arithmetic,
/// indexing), and a model file must not end a service. Such a panic is not printed either: the
/// first call installs a panic hook that is silent for threads inside this function and calls the
/// earlier hook for all others.
pub(crate) fn guarded<T>(
    action: &'static str,
    work: impl FnOnce() -> TractResult<T>,
) -> Result<T, EngineError> {
    static HOOK: Once = Once::new();
    HOOK.call_once(silence_guarded_panics);
    let backend = Backend::Tract;
    let outer = IS_GUARDED.replace(true);
    // On failure the callers drop or rebuild whatever `work` was changing.
    let result = catch_unwind(AssertUnwindSafe(work));
    IS_GUARDED.set(outer);
    match result {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => {
            let reason = in_one_line(&format!("{error:#}"));
            Err(EngineError::Backend { backend, action, reason })
        }
        Err(panic) => {
            let reason = in_one_line(panic_text(panic.as_ref()));
            Err(EngineError::Panicked { backend, action, reason })
        }
    }
}

fn silence_guarded_panics() {
    // A thread that is unwinding may not change the hook.
    if std::thread::panicking() {
        return;
    }
    let loud = panic::take_hook();
    panic::set_hook(Box::new(move |panic| {
        // Fails if the thread is ending, and then it is not inside `guarded`.
        if !IS_GUARDED.try_with(Cell::get).unwrap_or(false) {
            loud(panic);
        }
    }));
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}

/// Joins the lines of a message, since a log has one line for each event.
fn in_one_line(text: &str) -> String {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn a_guarded_panic_is_told_to_the_caller_alone() {
        static PRINTED: AtomicUsize = AtomicUsize::new(0);
        // Of this thread alone: other tests may panic meanwhile.
        let this = std::thread::current().id();
        panic::set_hook(Box::new(move |_| {
            if std::thread::current().id() == this {
                PRINTED.fetch_add(1, Ordering::Relaxed);
            }
        }));
        silence_guarded_panics();
        let error = guarded("read the model", || -> TractResult<()> {
            assert_eq!(1, 2);
            Ok(())
        });
        let Err(EngineError::Panicked { action: "read the model", reason, .. }) = error else {
            panic!("{error:?}")
        };
        assert!(reason.contains("left: 1; right: 2"), "{reason}");
        assert_eq!(PRINTED.load(Ordering::Relaxed), 0, "the panic was printed");
        let outside = catch_unwind(|| panic!("of our own"));
        assert!(outside.is_err());
        assert_eq!(PRINTED.load(Ordering::Relaxed), 1, "a panic of our own was not printed");
        // One within another leaves the outer guarded.
        let nested = guarded("read the model", || -> TractResult<()> {
            let _ = guarded("decode the model", || -> TractResult<()> { panic!("inner") });
            panic!("outer")
        });
        assert!(matches!(nested, Err(EngineError::Panicked { reason, .. }) if reason == "outer"));
        assert_eq!(PRINTED.load(Ordering::Relaxed), 1);
    }
}
