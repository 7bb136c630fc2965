//! Contact alone: from poses or gaps to force and pressure.

use std::sync::{Arc, MutexGuard, PoisonError};

use bytes::BytesMut;
use papilla_proto::{
    ErrorCode, ErrorEstimate, HEADER_LEN, Hello, Problem, SampleType, Warning,
    contact::{ContactMethod, MethodError},
    effects::Section,
    flags,
};
use papilla_session_contact::{Finger, Frame, Hand};

use crate::{Bundle, hello};

/// One finger that is touched, and what it remembers: no network, no header, no answer's map of SED.
pub struct Contact {
    bundle: Arc<Bundle>,
    hand: Hand,
    bytes: BytesMut,
}

/// What is not a section of what pushes back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Solved {
    /// Bits of [`papilla_proto::flags`].
    pub flags: u8,
    /// Linearisations that the solve took.
    pub rounds: u32,
}

impl std::fmt::Debug for Contact {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Contact").field("bundle", &self.bundle).finish_non_exhaustive()
    }
}

impl Contact {
    /// Takes all memory that the frames of this hello need, which is of `objects` or `gaps` on one
    /// finger.
    ///
    /// # Errors
    /// A member is unusable or missing; the problem names it.
    pub fn open(bundle: &Arc<Bundle>, hello: &Hello) -> Result<Self, Problem> {
        hello::check_form(hello, &[])?;
        let hand = Hand::of(hello, bundle.skin())?;
        if hand.method().is_none() {
            let message = "pressure that is known needs no contact; 'objects' or 'gaps' is due";
            return Err(Problem::new(ErrorCode::BadContact, message).at("input"));
        }
        if hand.fingers().len() != 1 {
            let message = format!("one finger is due, not {}", hand.fingers().len());
            return Err(Problem::new(ErrorCode::BadContact, message).at("fingers"));
        }
        let mut bytes = BytesMut::new();
        bytes.reserve(hand.sections_len());
        Ok(Self { bundle: Arc::clone(bundle), hand, bytes })
    }

    /// How pressure is found.
    #[must_use]
    pub fn method(&self) -> Option<ContactMethod> {
        self.hand.method()
    }

    /// What that errs against finite elements; none if nobody measured it with this finger.
    #[must_use]
    pub fn expected_error(&self) -> Option<&MethodError> {
        self.bundle.contact_errors.as_ref().zip(self.method()).and_then(|(e, of)| e.of(of))
    }

    /// What of the hello is met, but perhaps not as it was meant.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        self.hand.warnings()
    }

    /// Samples of a frame, all f32.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.hand.form().payload_len_max(1)
    }

    /// The sections of what pushes back, each with its place in [`bytes`](Self::bytes).
    #[must_use]
    pub fn sections(&self) -> Vec<Section> {
        let at = |s: &Section| Section { offset: s.offset - HEADER_LEN as u32, ..*s };
        self.hand.sections().iter().map(at).collect()
    }

    /// Bytes of all sections.
    #[must_use]
    pub fn sections_len(&self) -> usize {
        self.hand.sections_len()
    }

    /// Sections of the last frame.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Solves a frame, which starts from the last one: as many f32 as [`samples`](Self::samples)
    /// says.
    ///
    /// # Errors
    /// Poses or gaps that cannot be; the finger stays as it was.
    pub fn solve(&mut self, payload: &[u8], time_us: u64) -> Result<Solved, Problem> {
        let due = 4 * self.samples();
        if payload.len() != due {
            let message = format!("the frame has {} bytes, {due} are due", payload.len());
            return Err(Problem::new(ErrorCode::WrongLength, message).at("payload"));
        }
        let Self { bundle, hand, bytes } = self;
        bytes.clear();
        let mut finger = only(hand)?;
        let frame = Frame { payload, sample_type: SampleType::F32, scale: 1.0, time_us };
        let taken = finger.take(frame, None)?;
        let is_cut_off = bundle.pixels.are_cut_off_in(&finger);
        finger.write(bytes);
        papilla_render::require_finite(bytes)?;
        state_nothing(&finger, bytes);
        let cut_off = if is_cut_off { flags::CUT_OFF } else { 0 };
        Ok(Solved { flags: taken.flags | cut_off, rounds: taken.iterations.unwrap_or(0) })
    }

    /// In place of [`solve`](Self::solve) where nobody knows where things are.
    ///
    /// # Errors
    /// A fault of this library.
    pub fn lose(&mut self) -> Result<Solved, Problem> {
        let Self { hand, bytes, .. } = self;
        bytes.clear();
        let mut finger = only(hand)?;
        finger.lose();
        finger.write(bytes);
        state_nothing(&finger, bytes);
        Ok(Solved { flags: flags::NOT_TRACKED | flags::NO_CONTACT, rounds: 0 })
    }
}

/// No laws of errors are read with contact alone: where an error is asked for, it is not known.
fn state_nothing(finger: &Finger, bytes: &mut BytesMut) {
    if finger.tells_error() {
        bytes.extend_from_slice(&ErrorEstimate::default().encode());
    }
}

/// The finger, which nobody else has.
fn only(hand: &Hand) -> Result<MutexGuard<'_, Finger>, Problem> {
    let finger = hand.fingers().first();
    let finger =
        finger.ok_or_else(|| Problem::new(ErrorCode::Internal, "a hand without fingers"))?;
    Ok(finger.lock().unwrap_or_else(PoisonError::into_inner))
}
