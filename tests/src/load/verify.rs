//! What the engine itself answers.

use std::{fs, path::Path};

use papilla_proto::{FrameHeader, MAP_LEN, SampleType};

use super::{LoadError, content::Encoded};

/// Greatest difference of an answer from the engine's own, relative to the greatest value of
/// the map; the error of the sample type comes on top.
pub const TOLERANCE: f64 = 1e-6;

/// The answers due to each map.
#[derive(Debug)]
pub(super) struct Reference {
    sample_type: SampleType,
    answers: Vec<Vec<f32>>,
}

impl Reference {
    /// Runs `tier` from the folder `models` on every map, as the service will decode it.
    pub(super) fn new(models: &Path, tier: &str, encoded: &Encoded) -> Result<Self, LoadError> {
        let path = models.join(format!("{tier}.onnx"));
        let onnx = fs::read(&path).map_err(|source| LoadError::Model { path, source })?;
        let mut session = papilla_engine::load(&onnx, None)?.session()?;
        let mut pressure_pa = vec![0.0; MAP_LEN];
        let mut answers = Vec::with_capacity(encoded.payloads.len());
        for payload in &encoded.payloads {
            encoded.sample_type.decode(payload, encoded.scale, &mut pressure_pa)?;
            let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
            // A map without pressure is answered with zeros, whatever the network says.
            if pressure_pa.iter().any(|&p| p > 0.0) {
                session.infer(&pressure_pa, &mut sed_j_per_m3)?;
            }
            answers.push(sed_j_per_m3);
        }
        Ok(Self { sample_type: encoded.sample_type, answers })
    }

    /// Greatest difference of an answer from the one due to map `index`, beyond what the
    /// sample type costs, relative to the greatest value; none if it cannot be read.
    pub(super) fn difference(
        &self,
        index: usize,
        header: &FrameHeader,
        payload: &[u8],
        scratch: &mut Vec<f32>,
    ) -> Option<f64> {
        scratch.resize(MAP_LEN, 0.0);
        if header.sample_type != self.sample_type {
            return None;
        }
        self.sample_type.decode(payload, header.scale, scratch).ok()?;
        let due = &self.answers[index];
        let most = f64::from(due.iter().copied().fold(f32::MIN_POSITIVE, f32::max));
        let mut worst = 0.0_f64;
        for (found, due) in scratch.iter().zip(due) {
            let beyond = (found - due).abs() - self.sample_type.error_max(*due, header.scale);
            // `max` would drop a NaN.
            if beyond.is_nan() {
                return None;
            }
            worst = worst.max(f64::from(beyond) / most);
        }
        Some(worst)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_relative_to_the_maximum() {
        let mut due = vec![0.0; MAP_LEN];
        due[7] = 200.0;
        let reference = Reference { sample_type: SampleType::F32, answers: vec![due.clone()] };
        let header = FrameHeader::pressure(0, 0, 0, SampleType::F32, 1.0);
        let bytes = |map: &[f32]| map.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>();
        let mut scratch = Vec::new();
        let mut difference =
            |map: &[f32]| reference.difference(0, &header, &bytes(map), &mut scratch);
        assert!(difference(&due).unwrap() < 1e-12);
        let mut off = due.clone();
        off[9] = 2.0;
        assert!((difference(&off).unwrap() - 0.01).abs() < 1e-9);
        off[9] = f32::NAN;
        assert!(difference(&off).is_none());
        assert!(difference(&due[1..]).is_none());
    }
}
