//! Maps as JSON: the easiest to write, the slowest to read.

use std::{
    fmt,
    io::{self, Write},
};

use papilla_proto::{ErrorCode, MAP_LEN, MAP_SIDE_PX, Problem, json};
use serde::{
    Deserialize, Deserializer, Serialize,
    de::{SeqAccess, Visitor},
};

use super::{Map, Quantity};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PressureMap {
    pressure_pa: Samples,
}

/// Numbers of a list; no more are kept than a map has.
#[derive(Default)]
struct Samples {
    kept: Vec<f32>,
    count: usize,
}

impl<'de> Deserialize<'de> for Samples {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(Self::default())
    }
}

impl<'de> Visitor<'de> for Samples {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut list: A) -> Result<Self, A::Error> {
        self.kept.reserve_exact(MAP_LEN);
        while let Some(value) = list.next_element::<f64>()? {
            self.count += 1;
            if self.count <= MAP_LEN {
                // What overflows becomes infinite, and is refused with its place.
                self.kept.push(value as f32);
            }
        }
        Ok(self)
    }
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
    let map: PressureMap = json::read_bounded(bytes).map_err(|error| {
        let mut problem = Problem::from(error);
        problem.message.push_str("; {\"pressure_pa\": [50176 numbers]} is due");
        problem
    })?;
    let Samples { kept, count } = map.pressure_pa;
    if count != pressure_pa.len() {
        let message = format!("the map has {count} samples, 224 x 224 = {MAP_LEN} are needed");
        return Err(Problem::new(ErrorCode::WrongLength, message).at("pressure_pa"));
    }
    pressure_pa.copy_from_slice(&kept);
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
