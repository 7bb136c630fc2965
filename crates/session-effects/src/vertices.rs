//! What a map shows at the vertices of the atlas: some KB in place of 200.

use bytes::BytesMut;
use papilla_codec::append;
use papilla_proto::{SampleError, SampleType, atlas::VertexSampler};

use super::Finger;

/// The vertices and room for their values.
#[derive(Debug)]
pub(super) struct Vertices {
    sampler: VertexSampler,
    values: Vec<f32>,
}

impl Vertices {
    /// Some milliseconds, to be done once a session.
    pub(super) fn new(finger: Finger<'_>) -> Self {
        let sampler = VertexSampler::new(finger.atlas, finger.interface);
        Self { values: vec![0.0; sampler.vertex_count()], sampler }
    }

    pub(super) fn len(&self) -> usize {
        self.values.len()
    }

    /// Appends one sample a vertex; returns their scale.
    ///
    /// # Errors
    /// Values that are not finite or below zero.
    pub(super) fn write(
        &mut self,
        map: &[f32],
        sample_type: SampleType,
        value_max: f32,
        bytes: &mut BytesMut,
    ) -> Result<f32, SampleError> {
        // Both lengths are those of the atlas.
        let _ = self.sampler.sample(map, &mut self.values);
        let scale = if sample_type.is_scaled() {
            self.values.iter().fold(value_max, |top, v| top.max(*v)) / sample_type.unit_max()
        } else {
            1.0
        };
        append(sample_type, &self.values, scale, bytes)?;
        Ok(scale)
    }
}
