//! A session in process: frames of the protocol in, answers of the protocol out.

use std::{sync::Mutex, time::Instant};

use papilla_inside::{Frame, Made, Session as Inside};
use papilla_proto::{ErrorCode, FrameHeader, FrameStatus, Problem, ServerMessage};
use pyo3::{buffer::PyBuffer, prelude::*, pybacked::PyBackedBytes, types::PyByteArray};

use crate::border::{compute, error, lock, refused};

/// A hand and what it remembers. Frames of several threads are rendered one after the other.
#[pyclass(frozen, module = "papilla._native")]
pub(crate) struct Session {
    /// None once a panic has left it half done, or it was closed.
    state: Mutex<Option<State>>,
}

struct State {
    inside: Inside,
    /// Samples of the frame at hand.
    payload: Vec<u8>,
    /// A frame is being rendered, or a panic ended it.
    is_half_done: bool,
}

impl Session {
    pub(crate) fn new(inside: Inside) -> Self {
        let state = State { inside, payload: Vec::new(), is_half_done: false };
        Self { state: Mutex::new(Some(state)) }
    }

    /// Lends what the session remembers, so that neither the interpreter's lock nor the session's is
    /// held for the other's.
    fn with<T>(&self, py: Python<'_>, work: impl FnOnce(&mut State) -> PyResult<T>) -> PyResult<T> {
        let mut state = compute(py, || lock(&self.state).take())?.ok_or_else(|| closed(py))?;
        let done = work(&mut state);
        if !state.is_half_done {
            *lock(&self.state) = Some(state);
        }
        done
    }
}

/// Places in an answer, and where what begins there goes.
type Rooms = Vec<(usize, PyBuffer<u8>)>;

/// Number of a frame that was refused; code, message and field of the problem.
type RefusedFrame = (usize, String, String, Option<String>);

fn closed(py: Python<'_>) -> PyErr {
    error(py, "Closed", ("the session is closed",))
}

fn header_of(py: Python<'_>, head: &[u8]) -> PyResult<FrameHeader> {
    FrameHeader::decode(head).map_err(|problem| {
        let told = Problem::new(problem.code(), problem.to_string());
        let told = match problem.field() {
            Some(field) => told.at(field),
            None => told,
        };
        refused(py, &told)
    })
}

#[pymethods]
impl Session {
    /// What the session agreed to, as JSON.
    fn ready(&self, py: Python<'_>) -> PyResult<String> {
        let ready = compute(py, || lock(&self.state).as_ref().map(|state| state.inside.ready()))?;
        let ready = ready.ok_or_else(|| closed(py))?;
        serde_json::to_string(&ServerMessage::Ready(Box::new(ready)))
            .map_err(|problem| error(py, "NativeFault", (problem.to_string(),)))
    }

    /// Renders a frame, its header and its samples, and gives the answer, header and sections.
    ///
    /// Raises Refused, and the session goes on.
    fn frame<'py>(
        &self,
        py: Python<'py>,
        head: &[u8],
        samples: PyBuffer<u8>,
    ) -> PyResult<Bound<'py, PyByteArray>> {
        let start = Instant::now();
        let header = header_of(py, head)?;
        self.with(py, |state| match state.answer(py, &header, samples, start)? {
            Ok(message) => Ok(PyByteArray::new(py, message)),
            Err(problem) => Err(refused(py, &problem)),
        })
    }

    /// Renders frames, each of a header and samples, one after the other. The bytes of an answer from an
    /// offset on go into a room of that many bytes.
    ///
    /// Ends at the first frame that is refused, and gives it; the session goes on.
    fn frames(
        &self,
        py: Python<'_>,
        frames: Vec<(PyBackedBytes, PyBuffer<u8>, Rooms)>,
    ) -> PyResult<Option<RefusedFrame>> {
        self.with(py, |state| {
            for (number, (head, samples, rooms)) in frames.into_iter().enumerate() {
                // Ctrl-C.
                py.check_signals()?;
                let start = Instant::now();
                let header = header_of(py, &head)?;
                match state.answer(py, &header, samples, start)? {
                    Ok(message) => fill(py, message, &rooms)?,
                    Err(Problem { code, message, field }) => {
                        return Ok(Some((number, code.as_str().to_owned(), message, field)));
                    }
                }
            }
            Ok(None)
        })
    }

    /// Renders a frame again and again, and gives how long each time took here, ns. What a frame takes
    /// in Python beyond that is the price of Python.
    ///
    /// Raises Refused, and the session goes on.
    fn timed(
        &self,
        py: Python<'_>,
        head: &[u8],
        samples: &[u8],
        times: usize,
    ) -> PyResult<Vec<u64>> {
        let header = header_of(py, head)?;
        self.with(py, |state| {
            state.payload = samples.to_vec();
            let frame = |state: &mut State| -> Result<u64, Problem> {
                let start = Instant::now();
                state.render(&header)?;
                Ok(u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX))
            };
            let found =
                compute(py, || (0..times).map(|_| frame(state)).collect::<Result<Vec<_>, _>>())?;
            found.map_err(|problem| refused(py, &problem))
        })
    }

    /// Ends the session.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        compute(py, || drop(lock(&self.state).take()))
    }
}

/// Writes parts of an answer into their rooms.
fn fill(py: Python<'_>, message: &[u8], rooms: &[(usize, PyBuffer<u8>)]) -> PyResult<()> {
    for (offset, room) in rooms {
        let part = message.get(*offset..).and_then(|rest| rest.get(..room.item_count()));
        let Some(part) = part else {
            let (bytes, of) = (room.item_count(), message.len());
            let words = format!("a room for {bytes} bytes at {offset} of an answer of {of}");
            return Err(error(py, "NativeFault", (words,)));
        };
        room.copy_from_slice(py, part)?;
    }
    Ok(())
}

impl State {
    /// Renders a frame; what comes of it is the whole message.
    fn answer(
        &mut self,
        py: Python<'_>,
        header: &FrameHeader,
        samples: PyBuffer<u8>,
        start: Instant,
    ) -> PyResult<Result<&[u8], Problem>> {
        // A copy, since other threads of Python may change them.
        self.payload.resize(samples.item_count(), 0);
        samples.copy_to_slice(py, &mut self.payload)?;
        drop(samples);
        let made = match compute(py, || self.render(header))? {
            Ok(made) => made,
            Err(problem) => return Ok(Err(problem)),
        };
        let total_us = u32::try_from(start.elapsed().as_micros()).unwrap_or(u32::MAX);
        let mut head = header.answer(FrameStatus::Ok, total_us, made.scale).windowed(made.window);
        head.sample_type = self.inside.answer_sample_type();
        head.infer_us = u32::try_from(made.infer.as_micros()).unwrap_or(u32::MAX);
        (head.queue_us, head.tier, head.flags) = (0, made.tier, made.flags);
        Ok(Ok(self.inside.message(&head)))
    }

    fn render(&mut self, header: &FrameHeader) -> Result<Made, Problem> {
        self.is_half_done = true;
        let made = self.render_payload(header);
        self.is_half_done = false;
        made
    }

    fn render_payload(&mut self, header: &FrameHeader) -> Result<Made, Problem> {
        let Self { inside, payload, .. } = self;
        let finger = inside.check(header)?;
        let due = inside.form().payload_len(header);
        if payload.len() != due {
            let message = format!("the payload has {} bytes, {due} are due", payload.len());
            return Err(Problem::new(ErrorCode::WrongLength, message).at("payload"));
        }
        let (sample_type, scale) = (header.sample_type, header.scale);
        let frame = if !header.is_tracked() {
            Frame::NotTracked
        } else if inside.form().is_window() {
            Frame::Window { window: header.window(), sample_type, scale, payload }
        } else {
            Frame::Rows { sample_type, scale, payload }
        };
        let mut made = inside.render(finger, frame, header.client_time_us)?;
        if !inside.has_effects() {
            inside.append_map(&mut made)?;
        }
        Ok(made)
    }
}
