//! What a frame came to.

use papilla_proto::{
    FrameKind, HEADER_LEN_V2, Window,
    effects::{Section, SectionName},
};

/// What a frame came to; lists are empty where the hello did not ask for them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer<'a> {
    /// Bits of [`papilla_proto::flags`].
    pub flags: u8,
    /// What map, vertices and points show; none if the network was not asked for.
    pub kind: Option<FrameKind>,
    /// The pixels of `map`.
    pub window: Window,
    /// J/m3 or Hz, row-major.
    pub map: &'a [f32],
    /// The same at the vertices.
    pub vertices: &'a [f32],
    /// Pressure that was found, Pa: a map or vertices.
    pub pressure_pa: &'a [f32],
    /// Values at the points.
    pub points: &'a [f32],
    /// Intensities of the actuators.
    pub actuators: &'a [f32],
    /// Sixteen numbers: [`papilla_proto::Summary`].
    pub summary: &'a [f32],
    /// Sixteen numbers: [`papilla_proto::contact::Touch`].
    pub touch: &'a [f32],
}

impl Answer<'_> {
    /// Nothing was asked for yet.
    pub(crate) const EMPTY: Self = Self {
        flags: 0,
        kind: None,
        window: Window::EMPTY,
        map: &[],
        vertices: &[],
        pressure_pa: &[],
        points: &[],
        actuators: &[],
        summary: &[],
        touch: &[],
    };
}

/// Where the sections of an answer lie among its numbers.
#[derive(Debug, Clone)]
pub(crate) struct Layout(Vec<Section>);

impl Layout {
    /// Those of a finger, and behind their `behind` bytes those of effects.
    pub(crate) fn of(finger: &[Section], behind: usize, effects: &[Section]) -> Self {
        let moved = effects.iter().map(|s| Section { offset: s.offset + behind as u32, ..*s });
        Self(finger.iter().copied().chain(moved).collect())
    }

    /// Most numbers of an answer.
    pub(crate) fn len(&self) -> usize {
        let end = |s: &Section| (s.offset + s.bytes) as usize - HEADER_LEN_V2;
        self.0.iter().map(end).max().unwrap_or(0).next_multiple_of(16) / 4
    }

    /// Hands each section out of `values` to `answer`. The last one may be shorter: a map that is
    /// cut to a window.
    pub(crate) fn give<'a>(&self, values: &'a [f32], answer: &mut Answer<'a>) {
        for section in &self.0 {
            let begin = (section.offset as usize - HEADER_LEN_V2) / 4;
            let end = (begin + section.bytes as usize / 4).min(values.len());
            let part = values.get(begin..end).unwrap_or_default();
            let list = match section.name {
                SectionName::Summary => &mut answer.summary,
                SectionName::Points => &mut answer.points,
                SectionName::Actuators => &mut answer.actuators,
                SectionName::Map => &mut answer.map,
                SectionName::Vertices => &mut answer.vertices,
                SectionName::Touch => &mut answer.touch,
                SectionName::Pressure => &mut answer.pressure_pa,
                // No hello gets this far with them.
                SectionName::Spikes | SectionName::Shear => continue,
            };
            *list = part;
        }
    }
}
