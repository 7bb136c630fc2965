//! What is done with bytes from outside, and what must hold of it whatever the bytes are.
//!
//! The fuzz targets (`tests/fuzz/run`) and `proto/tests/fuzz.rs` run the same functions.

use std::fmt::Debug;

use papilla_proto::{
    ClientMessage, FrameHeader, HEADER_LEN, MAP_LEN, MapError, PressureRange, SampleType,
    ServerMessage, Summary, Window,
    atlas::{Atlas, AtlasError, Patch, Raster, VertexSampler},
    effects::OutOfRange,
};
use serde::{Serialize, de::DeserializeOwned};

/// A binary frame: what decodes encodes to the bytes that it came from, and its payload is taken
/// or refused, never misread.
pub(crate) fn frame(data: &[u8]) {
    let sequence = FrameHeader::peek_sequence(data);
    let header = match FrameHeader::decode(data) {
        Ok(header) => header,
        Err(error) => {
            assert!(
                error.to_string().len() > 10 && (400..500).contains(&error.code().http_status())
            );
            return;
        }
    };
    assert_eq!(sequence, Some(header.sequence));
    let (head, payload) = data.split_at(HEADER_LEN);
    assert_eq!(&header.encode()[..], head);

    let window = header.window();
    let mut map = vec![f32::NAN; MAP_LEN];
    let decoded = window.decode(header.sample_type, payload, header.scale, &mut map);
    if decoded.is_ok() {
        assert!(window.is_inside() && payload.len() == header.payload_len());
        let beyond = match sequence.unwrap_or_default() {
            0..=9 => OutOfRange::Refuse,
            10..=99 => OutOfRange::Flag,
            _ => OutOfRange::Clamp,
        };
        let range = PressureRange { trained_max_pa: 1e5, beyond };
        check(range, &map);
        // What lies outside of the window is nothing.
        let inside: usize = window.rows().map(|row| row.len()).sum();
        assert_eq!(inside, window.pixel_count());
        assert!(map.iter().filter(|p| p.to_bits() != 0).count() <= inside);
    }
    let _ = Summary::decode(payload);
}

/// A map that passes is finite, not negative and below the limit; one that does not is refused
/// for a sample that is indeed at fault.
fn check(range: PressureRange, map: &[f32]) {
    let headroom = match range.beyond {
        OutOfRange::Refuse => 1.01,
        OutOfRange::Flag => 10.0,
        OutOfRange::Clamp => 1e4,
    };
    let limit_pa = range.trained_max_pa * headroom;
    match range.check(map) {
        Ok(summary) => {
            assert!(map.iter().all(|p| (0.0..=limit_pa).contains(p)));
            assert!(map.iter().all(|p| *p <= summary.peak_pa));
        }
        Err(
            MapError::NotFinite { row, column, value }
            | MapError::Negative { row, column, value }
            | MapError::OutOfRange { row, column, value, .. },
        ) => {
            assert_eq!(map[224 * row + column].to_bits(), value.to_bits());
            assert!(!(0.0..=limit_pa).contains(&value));
        }
        Err(error) => panic!("{error}"),
    }
}

/// The text of a session, either way: what is read can be said again and means the same.
pub(crate) fn session(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    says_the_same::<ClientMessage>(text);
    says_the_same::<ServerMessage>(text);
}

fn says_the_same<M: Serialize + DeserializeOwned + PartialEq + Debug>(text: &str) {
    let Ok(message) = serde_json::from_str::<M>(text) else { return };
    let again = serde_json::to_string(&message).expect("what was read can be written");
    let same = serde_json::from_str::<M>(&again);
    // JSON has no word for infinity, which numbers beyond f32 become; who uses them refuses it.
    if !format!("{message:?}").contains("inf") {
        assert_eq!(same.ok(), Some(message));
    }
}

/// Samples of every type, by any scale and into any window: decoding and encoding again gives
/// the same units.
pub(crate) fn samples(data: &[u8]) {
    let Some((head, payload)) = data.split_first_chunk::<13>() else { return };
    let sample_type = SampleType::ALL[usize::from(head[0] % 4)];
    let scale = f32::from_le_bytes([head[1], head[2], head[3], head[4]]);
    let number = |at: usize| u16::from_le_bytes([head[at], head[at + 1]]);
    let window = Window { x: number(5), y: number(7), width: number(9), height: number(11) };
    let mut map = vec![-1.0; MAP_LEN];
    let _ = window.decode(sample_type, payload, scale, &mut map);
    let _ = window.encode(sample_type, &map, scale, &mut payload.to_vec());

    let whole = payload.len() / sample_type.bytes();
    let payload = &payload[..whole * sample_type.bytes()];
    let mut values = vec![0.0; whole];
    if sample_type.decode(payload, scale, &mut values).is_err() {
        let top = sample_type.unit_max() * scale;
        assert!(sample_type.is_scaled() && !(top.is_finite() && scale > 0.0));
        return;
    }
    assert!(!sample_type.is_scaled() || values.iter().all(|v| v.is_finite() && *v >= 0.0));
    let mut again = vec![0; payload.len()];
    sample_type.encode(&values, scale, &mut again).expect("the scale was good a moment ago");
    // Floats that are no numbers, or half floats that are infinite, need not come back.
    if values.iter().all(|v| v.is_finite()) {
        assert_eq!(again, payload, "{sample_type:?} by {scale}");
    }
}

/// An atlas: what is taken keeps its own rules, and can be drawn and read.
pub(crate) fn atlas(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let atlas = match Atlas::from_json(text) {
        Ok(atlas) => atlas,
        // A changed file has another hash: with that in place, it gets further.
        Err(AtlasError::Hash { expected, found }) if !found.is_empty() => {
            match Atlas::from_json(&text.replace(&found, &expected)) {
                Ok(atlas) => atlas,
                Err(_) => return,
            }
        }
        Err(error) => {
            assert!(error.to_string().len() > 10, "{error}");
            return;
        }
    };
    let again = Atlas::from_json(&atlas.to_json().expect("what was read can be written"));
    assert_eq!(again.expect("what was written can be read").hash(), atlas.hash());
    let values = vec![1.0; atlas.vertex_count()];
    for patch in Patch::ALL {
        let raster = Raster::new(&atlas, patch);
        let mut map = vec![f32::NAN; MAP_LEN];
        raster.rasterise(&values, &mut map).expect("one value a vertex");
        assert!(map.iter().all(|v| (-1e-5..=1.00001).contains(v)));
        let mut back = vec![f32::NAN; atlas.vertex_count()];
        VertexSampler::new(&atlas, &raster).sample(&map, &mut back).expect("one value a vertex");
        assert!(back.iter().all(|v| v.is_finite()));
    }
}
