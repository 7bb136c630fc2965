//! What every call has in common: a handle, its last error, and a way out of panics.

use std::{
    ffi::{CStr, CString, c_char},
    mem::MaybeUninit,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

use papilla_proto::Problem;

use crate::{LoadError, Status};

/// Why a call failed.
#[derive(Debug)]
pub(super) struct Failure {
    status: Status,
    message: String,
    field: String,
}

impl Failure {
    pub(super) fn new(status: Status, message: impl Into<String>) -> Self {
        Self { status, message: message.into(), field: String::new() }
    }
}

impl From<Problem> for Failure {
    fn from(problem: Problem) -> Self {
        let Problem { code, message, field } = problem;
        Self { status: code.into(), message, field: field.unwrap_or_default() }
    }
}

impl From<LoadError> for Failure {
    fn from(error: LoadError) -> Self {
        Self::new(Status::from(&error), error.to_string())
    }
}

/// The last error of a handle.
#[derive(Debug, Default)]
pub(super) struct LastError {
    message: CString,
    field: CString,
}

/// A handle: a value behind a pointer, with its last error.
pub(super) trait Handle {
    fn last_error(&mut self) -> &mut LastError;
    /// Gives up what a panic may have left half done.
    fn give_up(&mut self);
}

fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

impl LastError {
    fn set(&mut self, failure: Failure) -> i32 {
        let Failure { status, message, field } = failure;
        *self = Self { message: c_string(&message), field: c_string(&field) };
        status as i32
    }

    pub(super) fn message(&self) -> *const c_char {
        self.message.as_ptr()
    }

    pub(super) fn field(&self) -> *const c_char {
        self.field.as_ptr()
    }

    fn clear(&mut self) {
        // Allocates nothing, and nothing at all happens where there is no error.
        if !self.message.is_empty() {
            *self = Self::default();
        }
    }
}

/// Does `work` with a handle; what goes wrong is kept in it, a panic as well.
///
/// # Safety
/// `handle` is null, or of this library, not freed, and in nobody else's hands for the call.
pub(super) unsafe fn with<H: Handle>(
    handle: *mut H,
    work: impl FnOnce(&mut H) -> Result<(), Failure>,
) -> i32 {
    // SAFETY: as the caller promises.
    let Some(handle) = (unsafe { handle.as_mut() }) else { return Status::BadPointer as i32 };
    // Whatever `work` was changing is given up if it panics.
    let failure = match catch_unwind(AssertUnwindSafe(|| work(handle))) {
        Ok(Ok(())) => {
            handle.last_error().clear();
            return Status::Ok as i32;
        }
        Ok(Err(failure)) => failure,
        Err(panic) => {
            handle.give_up();
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
            let message = format!("a fault of the library: {}", text.unwrap_or("no message"));
            Failure::new(Status::Internal, message)
        }
    };
    handle.last_error().set(failure)
}

/// A new handle; null if there is no memory for it.
pub(super) fn new<H: Default>() -> *mut H {
    catch_unwind(|| Box::into_raw(Box::<H>::default())).unwrap_or(std::ptr::null_mut())
}

/// Frees a handle.
///
/// # Safety
/// As for [`with`]; the handle is not used again.
pub(super) unsafe fn free<H>(handle: *mut H) {
    if handle.is_null() {
        return;
    }
    // SAFETY: `new` made it with a box, and nobody has it but the caller.
    let handle = unsafe { Box::from_raw(handle) };
    // What a destructor panics about can be told to nobody.
    let _ = catch_unwind(AssertUnwindSafe(|| drop(handle)));
}

/// A text of C, if there is one.
///
/// # Safety
/// `text` is null or ends with a zero, and lives as long as the call.
pub(super) unsafe fn text<'a>(name: &str, text: *const c_char) -> Result<Option<&'a str>, Failure> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: as the caller promises.
    let text = unsafe { CStr::from_ptr(text) };
    match text.to_str() {
        Ok(text) => Ok(Some(text)),
        Err(error) => {
            Err(Failure::new(Status::BadPointer, format!("{name} is not UTF-8: {error}")))
        }
    }
}

/// A text that is due.
///
/// # Safety
/// As for [`text`].
pub(super) unsafe fn due_text<'a>(name: &str, given: *const c_char) -> Result<&'a str, Failure> {
    // SAFETY: as the caller promises.
    unsafe { text(name, given) }?.ok_or_else(|| null(name))
}

/// A path that may be null.
///
/// # Safety
/// As for [`text`].
pub(super) unsafe fn path<'a>(
    name: &str,
    given: *const c_char,
) -> Result<Option<&'a Path>, Failure> {
    // SAFETY: as the caller promises.
    Ok(unsafe { text(name, given) }?.map(Path::new))
}

/// `count` values of C; a null pointer is none.
///
/// # Safety
/// `values` is null, or `count` values lie there that nobody writes during the call.
pub(super) unsafe fn list<'a, T>(
    name: &str,
    values: *const T,
    count: usize,
) -> Result<&'a [T], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    check(name, values)?;
    if count > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(Failure::new(Status::WrongLength, format!("{count} values in {name}")));
    }
    // SAFETY: neither null nor out of line; the rest as the caller promises.
    Ok(unsafe { std::slice::from_raw_parts(values, count) })
}

/// Where an answer goes; C may not have written there yet.
///
/// # Safety
/// `out` is null, or there is room for a value that nobody else uses during the call.
pub(super) unsafe fn room<'a, T>(
    name: &str,
    out: *mut T,
) -> Result<&'a mut MaybeUninit<T>, Failure> {
    check(name, out)?;
    // SAFETY: neither null nor out of line; the rest as the caller promises.
    Ok(unsafe { &mut *out.cast() })
}

fn check<T>(name: &str, pointer: *const T) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(null(name));
    }
    if !pointer.is_aligned() {
        let due = align_of::<T>();
        let message = format!("{name} is not at a multiple of {due} bytes");
        return Err(Failure::new(Status::BadPointer, message));
    }
    Ok(())
}

fn null(name: &str) -> Failure {
    Failure::new(Status::BadPointer, format!("{name} is null"))
}
