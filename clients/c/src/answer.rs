//! What a frame came to.

use papilla_proto::{
    HEADER_LEN, Window,
    effects::{RATES_HEAD_LEN, Section, SectionName},
};

/// What a frame came to; lists are empty where the hello did not ask for them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer<'a> {
    /// Bits of [`papilla_proto::flags`].
    pub flags: u8,
    /// Whether the network was asked, or would have been with a contact: `map` and `points` are SED.
    pub has_sed: bool,
    /// The pixels of `map`.
    pub window: Window,
    /// SED, J/m3, row-major.
    pub map: &'a [f32],
    /// The same at the vertices.
    pub vertices: &'a [f32],
    /// Pressure that was found, Pa: a map or vertices.
    pub pressure_pa: &'a [f32],
    /// Firing rates, Hz: a whole map, or at the vertices.
    pub rates_hz: &'a [f32],
    /// SED at the points, J/m3.
    pub points: &'a [f32],
    /// Firing rates at the points, Hz.
    pub point_rates_hz: &'a [f32],
    /// Intensities of the actuators.
    pub actuators: &'a [f32],
    /// Sixteen numbers: [`papilla_proto::Summary`].
    pub summary: &'a [f32],
    /// Sixteen numbers: [`papilla_proto::contact::Touch`].
    pub touch: &'a [f32],
    /// Four numbers: [`papilla_proto::ErrorEstimate`].
    pub error_estimate: &'a [f32],
}

impl Answer<'_> {
    /// Nothing was asked for yet.
    pub(crate) const EMPTY: Self = Self {
        flags: 0,
        has_sed: false,
        window: Window::EMPTY,
        map: &[],
        vertices: &[],
        pressure_pa: &[],
        rates_hz: &[],
        points: &[],
        point_rates_hz: &[],
        actuators: &[],
        summary: &[],
        touch: &[],
        error_estimate: &[],
    };
}

/// Where the sections of an answer lie among its numbers.
#[derive(Debug, Clone)]
pub(crate) struct Layout(pub(crate) Vec<Section>);

impl Layout {
    /// Most numbers of an answer.
    pub(crate) fn len(&self) -> usize {
        let end = |s: &Section| (s.offset + s.bytes) as usize - HEADER_LEN;
        self.0.iter().map(end).max().unwrap_or(0).next_multiple_of(16) / 4
    }

    /// Hands each section out of `values` to `answer`. The last one may be shorter: a map that is
    /// cut to a window.
    pub(crate) fn give<'a>(&self, values: &'a [f32], answer: &mut Answer<'a>) {
        for section in &self.0 {
            let begin = (section.offset as usize - HEADER_LEN) / 4;
            let end = (begin + section.bytes as usize / 4).min(values.len());
            let part = values.get(begin..end).unwrap_or_default();
            let list = match section.name {
                SectionName::Summary => &mut answer.summary,
                SectionName::Rates => {
                    // f32 need no scale.
                    answer.rates_hz = part.get(RATES_HEAD_LEN / 4..).unwrap_or_default();
                    continue;
                }
                SectionName::Points => &mut answer.points,
                SectionName::PointRates => &mut answer.point_rates_hz,
                SectionName::Actuators => &mut answer.actuators,
                SectionName::Map => &mut answer.map,
                SectionName::Vertices => &mut answer.vertices,
                SectionName::Touch => &mut answer.touch,
                SectionName::ErrorEstimate => &mut answer.error_estimate,
                SectionName::Pressure => &mut answer.pressure_pa,
                // No hello gets this far with them.
                SectionName::Spikes | SectionName::Shear | SectionName::Displacement => continue,
            };
            *list = part;
        }
    }
}
