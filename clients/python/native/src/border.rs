//! Between Rust and Python: errors as the package's own, panics caught, Ctrl-C heeded.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Mutex, MutexGuard, PoisonError},
};

use papilla_inside::{LoadError, Problem};
use pyo3::{call::PyCallArgs, prelude::*};

/// An exception of `papilla.errors`.
pub(crate) fn error<'py, A>(py: Python<'py>, class: &str, arguments: A) -> PyErr
where
    A: PyCallArgs<'py>,
{
    let made =
        py.import("papilla.errors").and_then(|errors| errors.getattr(class)?.call1(arguments));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// `papilla.Refused`, as a service would say it.
pub(crate) fn refused(py: Python<'_>, problem: &Problem) -> PyErr {
    let Problem { code, message, field } = problem;
    error(py, "Refused", (code.as_str(), message.as_str(), field.as_deref()))
}

/// `papilla.BadModels`.
pub(crate) fn bad_models(py: Python<'_>, problem: &LoadError) -> PyErr {
    error(py, "BadModels", (problem.to_string(),))
}

/// Computes without the interpreter's lock; a panic is `papilla.NativeFault`.
pub(crate) fn compute<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let done = py.detach(|| catch_unwind(AssertUnwindSafe(work)));
    done.map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
        error(py, "NativeFault", (text.unwrap_or("no message").to_owned(),))
    })
}

/// The value of a mutex: what a panic left is given up by whoever caught it.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
