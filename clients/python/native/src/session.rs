//! A session in process: frames of the protocol in, answers of the protocol out.

use std::{sync::Mutex, time::Instant};

use papilla_inside::{Frame, Made, Session as Inside};
use papilla_proto::{ErrorCode, FrameHeader, FrameStatus, HEADER_LEN, Problem, ServerMessage};
use pyo3::{buffer::PyBuffer, prelude::*, types::PyByteArray};

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
}

impl Session {
    pub(crate) fn new(inside: Inside) -> Self {
        Self { state: Mutex::new(Some(State { inside, payload: Vec::new() })) }
    }
}

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
        // Lent, so that neither the interpreter's lock nor the session's is held for the other's.
        let mut state = compute(py, || lock(&self.state).take())?.ok_or_else(|| closed(py))?;
        state.payload.resize(samples.item_count(), 0);
        let read = samples.copy_to_slice(py, &mut state.payload);
        drop(samples);
        if let Err(problem) = read {
            *lock(&self.state) = Some(state);
            return Err(problem);
        }
        let (state, made) = compute(py, move || {
            let made = state.render(&header);
            (state, made)
        })?;
        let answer = made.map(|made| {
            let total_us = u32::try_from(start.elapsed().as_micros()).unwrap_or(u32::MAX);
            let mut head = header.answer(FrameStatus::Ok, total_us, made.scale);
            head = head.windowed(made.window);
            head.sample_type = state.inside.answer_sample_type();
            head.infer_us = u32::try_from(made.infer.as_micros()).unwrap_or(u32::MAX);
            (head.queue_us, head.tier, head.flags) = (0, 0, made.flags);
            let sections = state.inside.bytes();
            PyByteArray::new_with(py, HEADER_LEN + sections.len(), |room| {
                room[..HEADER_LEN].copy_from_slice(&head.encode());
                room[HEADER_LEN..].copy_from_slice(sections);
                Ok(())
            })
        });
        *lock(&self.state) = Some(state);
        answer.map_err(|problem| refused(py, &problem))?
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
        let mut state = compute(py, || lock(&self.state).take())?.ok_or_else(|| closed(py))?;
        state.payload = samples.to_vec();
        let (state, found) = compute(py, move || {
            let frame = |_| {
                let start = Instant::now();
                state.render(&header)?;
                Ok(u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX))
            };
            let found = (0..times).map(frame).collect::<Result<Vec<_>, Problem>>();
            (state, found)
        })?;
        *lock(&self.state) = Some(state);
        found.map_err(|problem| refused(py, &problem))
    }

    /// Ends the session.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        compute(py, || drop(lock(&self.state).take()))
    }
}

impl State {
    fn render(&mut self, header: &FrameHeader) -> Result<Made, Problem> {
        let Self { inside, payload } = self;
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
