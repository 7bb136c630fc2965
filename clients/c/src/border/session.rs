//! Functions of a session.

use std::{
    ffi::{CString, c_char},
    mem::MaybeUninit,
};

use papilla_proto::contact::{OBJECTS_MAX, Pose};

use super::{
    handle::{self, Failure, Handle, LastError},
    model::PapillaModel,
    types::{PapillaAnswer, PapillaNetForce, PapillaPose},
};
use crate::{Problem, Session, Status, session::NetForce};

/// A session's handle.
#[derive(Debug, Default)]
pub(crate) struct PapillaSession {
    session: Option<Session>,
    /// How the open session finds pressure; empty if it finds none.
    method: CString,
    /// What its program is to be told; empty if nothing.
    warning: CString,
    error: LastError,
}

impl Handle for PapillaSession {
    fn last_error(&mut self) -> &mut LastError {
        &mut self.error
    }

    fn give_up(&mut self) {
        self.session = None;
    }
}

impl PapillaSession {
    /// Sends a frame and tells what it came to.
    fn send(
        &mut self,
        answer: &mut MaybeUninit<PapillaAnswer>,
        frame: impl FnOnce(&mut Session) -> Result<(), Problem>,
    ) -> Result<(), Failure> {
        let message = "the session is not open: call papilla_session_open first";
        let session = self.session.as_mut();
        let session = session.ok_or_else(|| Failure::new(Status::NotOpen, message))?;
        frame(session)?;
        answer.write(session.answer().into());
        Ok(())
    }
}

/// A handle without a session.
#[unsafe(no_mangle)]
pub(crate) extern "C" fn papilla_session_new() -> *mut PapillaSession {
    handle::new()
}

/// Frees a handle, and what its answers point to.
///
/// # Safety
/// `session` is null or of `papilla_session_new`, and not used again.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_session_free(session: *mut PapillaSession) {
    // SAFETY: as the caller promises.
    unsafe { handle::free(session) }
}

/// What the last failed call with this handle said; empty after one that went well.
///
/// # Safety
/// `session` is null or of `papilla_session_new`.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_session_error(
    session: *const PapillaSession,
) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe { session.as_ref() }.map_or(c"session is null".as_ptr(), |s| s.error.message())
}

/// The member that the last failed call was about, as `objects[0].shape`; empty if none.
///
/// # Safety
/// `session` is null or of `papilla_session_new`.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_session_error_field(
    session: *const PapillaSession,
) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe { session.as_ref() }.map_or(c"".as_ptr(), |session| session.error.field())
}

/// How an open session finds pressure, as `pixels`; empty if it is not open, or is sent pressure.
///
/// # Safety
/// `session` is null or of `papilla_session_new`.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_session_method(
    session: *const PapillaSession,
) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe { session.as_ref() }.map_or(c"".as_ptr(), |session| session.method.as_ptr())
}

/// What an open session cannot do as one might expect, a line each; empty if there is nothing.
///
/// # Safety
/// `session` is null or of `papilla_session_new`.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_session_warning(
    session: *const PapillaSession,
) -> *const c_char {
    // SAFETY: as the caller promises.
    unsafe { session.as_ref() }.map_or(c"".as_ptr(), |session| session.warning.as_ptr())
}

/// Opens a session, or opens it anew; after a failure it is as it was.
///
/// # Safety
/// Handles are null or of this library; `hello` is null or ends with a zero.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_session_open(
    session: *mut PapillaSession,
    model: *const PapillaModel,
    hello: *const c_char,
) -> i32 {
    let work = |handle: &mut PapillaSession| {
        // SAFETY: as the caller promises.
        let (model, hello) = unsafe { (model.as_ref(), handle::due_text("hello", hello)?) };
        let model = model.ok_or_else(|| Failure::new(Status::BadPointer, "model is null"))?;
        let session = Session::open(model.loaded()?, hello)?;
        // Neither holds a zero: they are our own words.
        handle.method = CString::new(session.method()).unwrap_or_default();
        handle.warning = CString::new(session.warnings()).unwrap_or_default();
        handle.session = Some(session);
        Ok(())
    };
    // SAFETY: as the caller promises.
    unsafe { handle::with(session, work) }
}

/// Renders pressure.
///
/// # Safety
/// `session` is null or of this library, `pressure_pa` holds `count` values, `answer` is null or
/// room for one.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_send_map(
    session: *mut PapillaSession,
    finger: u8,
    pressure_pa: *const f32,
    count: usize,
    time_us: u64,
    answer: *mut PapillaAnswer,
) -> i32 {
    let work = |handle: &mut PapillaSession| {
        // SAFETY: as the caller promises.
        let (pressure_pa, answer) = unsafe {
            (handle::list("pressure_pa", pressure_pa, count)?, handle::room("answer", answer)?)
        };
        handle.send(answer, |session| session.send_map(finger, pressure_pa, time_us))
    };
    // SAFETY: as the caller promises.
    unsafe { handle::with(session, work) }
}

/// Tells that nobody knows where things are, or what presses.
///
/// # Safety
/// `session` is null or of this library, `answer` is null or room for one.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_send_not_tracked(
    session: *mut PapillaSession,
    finger: u8,
    time_us: u64,
    answer: *mut PapillaAnswer,
) -> i32 {
    let work = |handle: &mut PapillaSession| {
        // SAFETY: as the caller promises.
        let answer = unsafe { handle::room("answer", answer)? };
        handle.send(answer, |session| session.send_not_tracked(finger, time_us))
    };
    // SAFETY: as the caller promises.
    unsafe { handle::with(session, work) }
}

/// Renders what presses where objects are.
///
/// # Safety
/// `session` is null or of this library, `poses` holds `count` poses, `net` is null or a force,
/// `answer` is null or room for one.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_send_poses(
    session: *mut PapillaSession,
    finger: u8,
    poses: *const PapillaPose,
    count: usize,
    net: *const PapillaNetForce,
    time_us: u64,
    answer: *mut PapillaAnswer,
) -> i32 {
    let work = |handle: &mut PapillaSession| {
        // SAFETY: as the caller promises.
        let (poses, answer, net) = unsafe {
            let poses = handle::list("poses", poses, count)?;
            (poses, handle::room("answer", answer)?, net_force(net)?)
        };
        // More than a hello can announce are refused by their number alone.
        let mut room = [Pose::default(); OBJECTS_MAX + 1];
        let taken = poses.len().min(room.len());
        for (room, pose) in room.iter_mut().zip(poses) {
            *room = pose.into();
        }
        handle.send(answer, |session| session.send_poses(finger, &room[..taken], net, time_us))
    };
    // SAFETY: as the caller promises.
    unsafe { handle::with(session, work) }
}

/// Renders what presses by how deep the skin lies in things.
///
/// # Safety
/// `session` is null or of this library, `depth_mm` holds `count` values, `net` is null or a
/// force, `answer` is null or room for one.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn papilla_send_gaps(
    session: *mut PapillaSession,
    finger: u8,
    depth_mm: *const f32,
    count: usize,
    net: *const PapillaNetForce,
    time_us: u64,
    answer: *mut PapillaAnswer,
) -> i32 {
    let work = |handle: &mut PapillaSession| {
        // SAFETY: as the caller promises.
        let (depth_mm, answer, net) = unsafe {
            let depth_mm = handle::list("depth_mm", depth_mm, count)?;
            (depth_mm, handle::room("answer", answer)?, net_force(net)?)
        };
        handle.send(answer, |session| session.send_gaps(finger, depth_mm, net, time_us))
    };
    // SAFETY: as the caller promises.
    unsafe { handle::with(session, work) }
}

/// The force that is asked for, if one is.
///
/// # Safety
/// `net` is null, or a force lies there.
unsafe fn net_force(net: *const PapillaNetForce) -> Result<Option<NetForce>, Failure> {
    if net.is_null() {
        return Ok(None);
    }
    // SAFETY: as the caller promises.
    let [PapillaNetForce { direction: [x, y, z], force_n }] =
        (unsafe { handle::list("net", net, 1) })?
    else {
        return Ok(None);
    };
    Ok(Some([*x, *y, *z, *force_n]))
}
