//! Maps as JSON: the easiest to write, the slowest to read.

use std::io::{self, Write};

use papilla_proto::{ErrorCode, MAP_LEN, MAP_SIDE_PX, Problem};
use serde::{Deserialize, Serialize};

use super::{Map, Quantity};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PressureMap {
    /// In 64 bits: what overflows 32 is then infinite, and refused with its place.
    pressure_pa: Vec<f64>,
}

/// Only what a reader needs: a pressure map reads back as it is.
#[derive(Serialize)]
#[serde(untagged)]
enum AnyMap<'a> {
    Pressure { pressure_pa: &'a [f32] },
    Sed { width: usize, height: usize, source: &'a str, sed_j_per_m3: &'a [f32] },
}

/// Decodes `{"pressure_pa": [50176 numbers]}`, row-major, Pa.
pub(super) fn decode(bytes: &[u8], pressure_pa: &mut [f32]) -> Result<(), Problem> {
    let map: PressureMap = serde_json::from_slice(bytes).map_err(|error| {
        let message = format!("{error}; {{\"pressure_pa\": [50176 numbers]}} is due");
        Problem::new(ErrorCode::BadJson, message)
    })?;
    let samples = map.pressure_pa.len();
    if samples != pressure_pa.len() {
        let message = format!("the map has {samples} samples, 224 x 224 = {MAP_LEN} are needed");
        return Err(Problem::new(ErrorCode::WrongLength, message).at("pressure_pa"));
    }
    for (sample, value) in pressure_pa.iter_mut().zip(map.pressure_pa) {
        *sample = value as f32;
    }
    Ok(())
}

/// Writes the map: `{"pressure_pa": [...]}`, which can be posted, or `{"sed_j_per_m3":
/// [...], "width": 224, "height": 224, "source": "..."}`.
pub(super) fn encode(map: Map<'_>, out: impl Write) -> io::Result<()> {
    let (width, height) = (MAP_SIDE_PX, MAP_SIDE_PX);
    let map = match map.quantity {
        Quantity::Pressure => AnyMap::Pressure { pressure_pa: map.values },
        Quantity::Sed => {
            AnyMap::Sed { width, height, source: map.source, sed_j_per_m3: map.values }
        }
    };
    serde_json::to_writer(out, &map).map_err(io::Error::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_documented_object_is_taken() {
        let mut out = [0.0; 2];
        decode(br#"{"pressure_pa": [1, 2.5]}"#, &mut out).unwrap();
        assert_eq!(out.map(f32::to_bits), [1.0_f32, 2.5].map(f32::to_bits));
        for (bad, code) in [
            (&br#"{"pressure_pa": [1]}"#[..], ErrorCode::WrongLength),
            (br#"{"pressure_pa": [1, 2, 3]}"#, ErrorCode::WrongLength),
            (br#"{"pressure_pa": [1, null]}"#, ErrorCode::BadJson),
            (br#"{"pressure_pa": [1, NaN]}"#, ErrorCode::BadJson),
            (br#"{"pressure_pa": [1, "2"]}"#, ErrorCode::BadJson),
            (br#"{"pressure_pa": [1, 2], "x": 1}"#, ErrorCode::BadJson),
            (b"[1, 2]", ErrorCode::BadJson),
            (b"\xff", ErrorCode::BadJson),
            (b"", ErrorCode::BadJson),
        ] {
            assert_eq!(decode(bad, &mut out).unwrap_err().code, code);
        }
    }
}
