//! The form of the frames of a session, and whether a frame has it.

use papilla_proto::{
    ErrorCode, FrameHeader, FrameKind, FrameStatus, Hello, MAP_SIDE_PX, Problem, SampleType,
    Window,
    contact::{Input, ROW, SampleLayout},
};

use super::{announced, unusable};

/// The form of a session's frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameForm {
    pub(crate) input: Input,
    pub(crate) layout: SampleLayout,
    pub(crate) has_force: bool,
    /// Whether three numbers more for each vertex follow those of all vertices.
    pub(crate) has_vectors: bool,
    objects: usize,
    fingers: usize,
    vertices: usize,
}

impl FrameForm {
    pub(crate) fn of(hello: &Hello, objects: usize, fingers: usize, vertices: usize) -> Self {
        let layout = announced::layout(hello);
        let has_force = hello.force_target == Some(true);
        Self {
            input: hello.input.unwrap_or_default(),
            layout,
            has_force,
            has_vectors: hello.velocity == Some(true) || hello.traction == Some(true),
            objects,
            fingers,
            vertices,
        }
    }

    /// Kind of the frames.
    #[must_use]
    pub fn kind(&self) -> FrameKind {
        match self.input {
            Input::Pressure => FrameKind::Pressure,
            Input::Gaps => FrameKind::Gaps,
            Input::Objects => FrameKind::Objects,
        }
    }

    /// Whether frames are pressure: nothing is solved.
    #[must_use]
    pub fn takes_pressure(&self) -> bool {
        self.input == Input::Pressure
    }

    /// Whether the samples are a window of the map that the codec reads.
    #[must_use]
    pub fn is_window(&self) -> bool {
        self.input == Input::Pressure && self.layout == SampleLayout::Map
    }

    /// Width and height that a header has to say; none if any window will do.
    #[must_use]
    pub fn size(&self) -> Option<[usize; 2]> {
        match (self.input, self.layout) {
            (Input::Pressure, SampleLayout::Map) => None,
            (Input::Objects, _) => Some([ROW, self.objects + usize::from(self.has_force)]),
            (_, SampleLayout::Vertices) => {
                Some([if self.has_vectors { 4 * self.vertices } else { self.vertices }, 1])
            }
            (Input::Gaps, SampleLayout::Map) => Some([MAP_SIDE_PX, MAP_SIDE_PX]),
        }
    }

    /// Samples of a net force behind those of gaps.
    fn extra(&self) -> usize {
        if self.has_force && self.input == Input::Gaps { ROW } else { 0 }
    }

    /// Bytes of the payload that goes with a header of this form.
    #[must_use]
    pub fn payload_len(&self, header: &FrameHeader) -> usize {
        if !header.is_tracked() {
            return 0;
        }
        header.payload_len() + self.extra() * header.sample_type.bytes()
    }

    /// Most bytes of a payload of these samples.
    #[must_use]
    pub fn payload_len_max(&self, sample_bytes: usize) -> usize {
        let [width, height] = self.size().unwrap_or([MAP_SIDE_PX, MAP_SIDE_PX]);
        (width * height + self.extra()) * sample_bytes
    }

    /// Checks finger, kind and size of a frame.
    ///
    /// # Errors
    /// The first that does not fit; the problem names the field of the header.
    pub fn check(&self, header: &FrameHeader) -> Result<usize, Problem> {
        let finger = usize::from(header.finger);
        if finger >= self.fingers {
            let message = format!("finger {finger} was not announced; there are {}", self.fingers);
            return Err(unusable("finger", message));
        }
        if !header.is_tracked() {
            // Without samples kind and type mean nothing.
            return if [header.width, header.height] == [0, 0] {
                Ok(finger)
            } else {
                let message = "a frame that is not tracked has no samples: 0 x 0 is due";
                Err(Problem::new(ErrorCode::WrongShape, message).at("width"))
            };
        }
        if header.kind != self.kind() {
            let (found, due) = (header.kind as u8, self.kind() as u8);
            let message = format!("the hello's input is of kind {due}, the frame of kind {found}");
            return Err(Problem::new(ErrorCode::WrongType, message).at("kind"));
        }
        let Window { width, height, .. } = header.window();
        if let Some([columns, rows]) = self.size()
            && [usize::from(width), usize::from(height)] != [columns, rows]
        {
            let message = format!("the frame is {width} x {height}, {columns} x {rows} is due");
            return Err(Problem::new(ErrorCode::WrongShape, message).at("width"));
        }
        Ok(finger)
    }

    /// Checks all of a header that a session with samples of this type takes; gives its finger.
    ///
    /// # Errors
    /// The first that does not fit; the problem names the field of the header.
    pub fn accept(&self, header: &FrameHeader, due: SampleType) -> Result<usize, Problem> {
        let wrong_type =
            |field, message| Err(Problem::new(ErrorCode::WrongType, message).at(field));
        let finger = self.check(header)?;
        if header.status != FrameStatus::Ok {
            return wrong_type("status", "the status of a request is 0".to_owned());
        }
        if header.sample_type != due && header.is_tracked() {
            let message = format!("the hello announced {due:?}, not {:?}", header.sample_type);
            return wrong_type("sample_type", message);
        }
        let window = header.window();
        if self.is_window() && !window.is_inside() {
            let Window { x, y, width, height } = window;
            let message =
                format!("the window of {width} x {height} at column {x}, row {y} leaves the map");
            return Err(Problem::new(ErrorCode::WrongShape, message).at("x"));
        }
        Ok(finger)
    }
}
