//! What is done with requests from outside, and what must hold whatever the bytes are.
//!
//! Here for the fuzz target in `crates/oip/fuzz` (`tests/fuzz/run`) and the test below alone: no
//! other build has this module.

use bytes::Bytes;
use papilla_proto::MAP_LEN;

#[path = "../../../tests/fuzz/refusal.rs"]
mod refusal;

use refusal::is_typed;

use crate::{Request, head_len};

/// A request. The first two bytes, little-endian, say how long the JSON before the bytes of the
/// tensor is; 65535: there are none, and no header says so. Bytes are taken as they are, and brought
/// to the length of a whole map.
pub fn request(data: &[u8]) {
    let Some((length, data)) = data.split_first_chunk::<2>() else { return };
    let length = u16::from_le_bytes(*length);
    let header = (length < u16::MAX).then(|| length.to_string());
    let mut whole = data.to_vec();
    whole.resize(usize::from(length) + 4 * MAP_LEN, 0);
    let bodies = if header.is_some() { vec![data, &whole] } else { vec![data] };
    for body in bodies {
        let header = header.as_deref().map(str::as_bytes);
        let read = head_len(header, body.len())
            .and_then(|length| Request::read(&Bytes::copy_from_slice(body), length));
        match read {
            // Either all of the map or bytes whose number the request gave itself.
            Ok(read) => assert!(read.pressure_pa.len() <= body.len().max(4 * MAP_LEN)),
            Err(problem) => assert!(is_typed(&problem), "{problem}"),
        }
    }
}

#[cfg(test)]
#[path = "../../../tests/fuzz/replay.rs"]
mod replay;

#[cfg(test)]
mod tests {
    use super::replay::replay;

    const CORPUS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus");

    #[test]
    fn requests() {
        replay(CORPUS, "oip", super::request);
    }
}
