//! Between Rust and Python: errors as the package's own, panics caught, Ctrl-C heeded.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Mutex, MutexGuard, PoisonError},
};

use papilla_inside::{LoadError, Problem};
use pyo3::{call::PyCallArgs, prelude::*, types::PyBytes};

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
    done.map_err(|panic| error(py, "NativeFault", (panic_text(panic.as_ref()),)))
}

/// What a panic says.
pub(crate) fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message").to_owned()
}

/// The value of a mutex: what a panic left is given up by whoever caught it.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A report as JSON.
pub(crate) fn to_json(py: Python<'_>, value: &impl serde::Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(|e| error(py, "NativeFault", (e.to_string(),)))
}

/// Numbers as bytes, little-endian.
pub(crate) fn bytes_of<'py, T: Copy, const N: usize>(
    py: Python<'py>,
    values: &[T],
    bytes: impl Fn(T) -> [u8; N],
) -> PyResult<Bound<'py, PyBytes>> {
    PyBytes::new_with(py, N * values.len(), |room| {
        for (to, value) in room.chunks_exact_mut(N).zip(values) {
            to.copy_from_slice(&bytes(*value));
        }
        Ok(())
    })
}

/// The same of doubles.
pub(crate) fn doubles<'py>(py: Python<'py>, values: &[f64]) -> PyResult<Bound<'py, PyBytes>> {
    bytes_of(py, values, f64::to_le_bytes)
}
