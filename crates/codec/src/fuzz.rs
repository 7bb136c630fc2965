//! What is done with maps from outside, and what must hold whatever the bytes are.
//!
//! Here for the fuzz targets in `crates/codec/fuzz` (`tests/fuzz/run`) and the test below alone: no
//! other build has this module.

use bytes::BytesMut;
use papilla_proto::{MAP_LEN, SampleType};

#[path = "../../../tests/fuzz/refusal.rs"]
mod refusal;

use refusal::is_typed;

use crate::{Input, Map, Output, Quantity, decode, encode};

/// Full white of the images, Pa.
const WHITE_PA: f32 = 30_000.0;

/// A body decodes into a whole map that encodes and decodes to itself within `error` of each
/// sample, or it is refused.
fn body(input: Input, form: Output, data: &[u8], error: impl Fn(f32) -> f32) {
    let mut map = vec![f32::NAN; MAP_LEN];
    if let Err(problem) = decode(input, data, &mut map) {
        assert!(is_typed(&problem), "{problem}");
        return;
    }
    if !map.iter().all(|v| v.is_finite() && *v >= 0.0) {
        // The check that comes next in the service refuses it.
        return;
    }
    let mut bytes = BytesMut::new();
    let values = &map[..];
    let of = Map { quantity: Quantity::Pressure, values, source: "fuzz" };
    let scale = encode(form, of, &mut bytes).expect("a good map can be encoded");
    let again_as = match input {
        Input::Png { .. } => Input::Png { pressure_max_pa: scale },
        other => other,
    };
    let mut again = vec![f32::NAN; MAP_LEN];
    decode(again_as, &bytes, &mut again).expect("what was written can be read");
    for (found, due) in again.iter().zip(&map) {
        assert!((found - due).abs() <= error(*due), "{due} became {found}");
    }
}

/// A PNG.
pub fn png(data: &[u8]) {
    let step = SampleType::U16;
    body(Input::Png { pressure_max_pa: WHITE_PA }, Output::Png, data, |v| {
        step.error_max(v, WHITE_PA / step.unit_max())
    });
}

/// A numpy array; once as it is, once with zeros behind it up to a whole map of f4, so that short
/// inputs get as far as the samples.
pub fn npy(data: &[u8]) {
    body(Input::Npy, Output::Npy, data, |_| 0.0);
    if let Some(end) = data.iter().position(|byte| *byte == b'\n') {
        body(Input::Npy, Output::Npy, &extended(data, end + 1), |_| 0.0);
    }
}

/// `data` with its part from `start` brought to the length of a map of f4.
fn extended(data: &[u8], start: usize) -> Vec<u8> {
    let mut data = data.to_vec();
    data.resize(start + 4 * MAP_LEN, 0);
    data
}

/// A map in JSON.
pub fn json(data: &[u8]) {
    body(Input::Json, Output::Json, data, |_| 0.0);
}

#[cfg(test)]
#[path = "../../../tests/fuzz/replay.rs"]
mod replay;

#[cfg(test)]
mod tests {
    use super::replay::replay;

    const CORPUS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus");

    #[test]
    fn images() {
        replay(CORPUS, "png", super::png);
    }

    #[test]
    fn arrays() {
        replay(CORPUS, "npy", super::npy);
    }

    #[test]
    fn maps_in_json() {
        replay(CORPUS, "json", super::json);
    }
}
