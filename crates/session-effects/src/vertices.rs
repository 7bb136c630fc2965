//! What a map shows at the vertices of the atlas: some KB in place of 200.

use bytes::BytesMut;
use papilla_codec::{Output, append, scale_of};
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

    /// Appends one sample a vertex; returns their scale, that of the greatest.
    ///
    /// # Errors
    /// Values that are not finite or below zero.
    pub(super) fn write(
        &mut self,
        map: &[f32],
        sample_type: SampleType,
        bytes: &mut BytesMut,
    ) -> Result<f32, SampleError> {
        // Both lengths are those of the atlas.
        let _ = self.sampler.sample(map, &mut self.values);
        let top = self.values.iter().fold(0.0, |top: f32, v| top.max(*v));
        let scale = scale_of(Output::Samples(sample_type), top);
        append(sample_type, &self.values, scale, bytes)?;
        Ok(scale)
    }
}
