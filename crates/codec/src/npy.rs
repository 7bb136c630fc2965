//! Maps as `.npy` files, what `numpy.save` writes: versions 1 to 3, f4 and f8.
//!
//! Format: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>

use bytes::{BufMut, BytesMut};
use papilla_proto::{ErrorCode, MAP_SIDE_PX, Problem, error::shortened};

use super::wrong_shape;

const MAGIC: &[u8] = b"\x93NUMPY";

/// Length of the header that [`encode`] writes, magic included: a multiple of 64.
pub(super) const HEADER_LEN: usize = 128;

/// Most axes of an array, as of numpy itself.
const AXES_MAX: usize = 64;

/// What the header says.
#[derive(Debug, PartialEq)]
struct Header<'a> {
    descr: &'a str,
    fortran_order: bool,
    shape: Vec<usize>,
}

fn bad(message: impl Into<String>) -> Problem {
    Problem::new(ErrorCode::BadNpy, message)
}

/// Whether `bytes` start like a `.npy` file.
pub fn is_npy(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Splits the file into its header and its data.
fn split(bytes: &[u8]) -> Result<(Header<'_>, &[u8]), Problem> {
    let rest =
        bytes.strip_prefix(MAGIC).ok_or_else(|| bad("no .npy file: the magic is missing"))?;
    let (len, rest) = match rest {
        [1, _, a, b, rest @ ..] => (usize::from(u16::from_le_bytes([*a, *b])), rest),
        [2 | 3, _, a, b, c, d, rest @ ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, rest),
        _ => return Err(bad("the .npy version is not 1, 2 or 3, or the file is cut short")),
    };
    let (header, data) = rest
        .split_at_checked(len)
        .ok_or_else(|| bad("the .npy file is cut short in its header"))?;
    let header = std::str::from_utf8(header).map_err(|_| bad("the .npy header is not text"))?;
    let header = parse(header)
        .ok_or_else(|| bad(format!("unreadable .npy header: {}", shortened(header))))?;
    Ok((header, data))
}

/// The value after `'key':` in a Python dictionary of plain values.
fn member<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let at = header.find(&format!("'{key}'"))? + key.len() + 2;
    header[at..].trim_start().strip_prefix(':').map(str::trim_start)
}

fn parse(header: &str) -> Option<Header<'_>> {
    let descr = member(header, "descr")?.strip_prefix('\'')?.split('\'').next()?;
    let order = member(header, "fortran_order")?;
    let fortran_order = order.starts_with("True");
    if !fortran_order && !order.starts_with("False") {
        return None;
    }
    let (shape, _) = member(header, "shape")?.strip_prefix('(')?.split_once(')')?;
    let shape = shape
        .split(',')
        .map(str::trim)
        .filter(|size| !size.is_empty())
        .take(AXES_MAX + 1)
        .map(|size| size.parse().ok())
        .collect::<Option<Vec<_>>>()
        .filter(|shape| shape.len() <= AXES_MAX)?;
    Some(Header { descr, fortran_order, shape })
}

/// Decodes an array of 224 x 224 (axes of length 1 before it are ignored), C or Fortran order.
pub(super) fn decode(bytes: &[u8], pressure_pa: &mut [f32]) -> Result<(), Problem> {
    let (header, data) = split(bytes)?;
    let ones = header.shape.iter().take_while(|&&size| size == 1).count();
    match header.shape[ones..] {
        [MAP_SIDE_PX, MAP_SIDE_PX] => {}
        [rows, columns] => return Err(wrong_shape(rows, columns)),
        _ => {
            let message = format!("the array has the shape {:?}; (224, 224) is due", header.shape);
            return Err(Problem::new(ErrorCode::WrongShape, message));
        }
    }
    match header.descr {
        "<f4" => fill(pressure_pa, data, |b: [u8; 4]| f32::from_le_bytes(b)),
        ">f4" => fill(pressure_pa, data, |b: [u8; 4]| f32::from_be_bytes(b)),
        "<f8" => fill(pressure_pa, data, |b: [u8; 8]| f64::from_le_bytes(b) as f32),
        ">f8" => fill(pressure_pa, data, |b: [u8; 8]| f64::from_be_bytes(b) as f32),
        other => {
            let message =
                format!("the array's type is '{}'; '<f4' or '<f8' is due", shortened(other));
            return Err(Problem::new(ErrorCode::WrongType, message).at("descr"));
        }
    }?;
    if header.fortran_order {
        transpose(pressure_pa);
    }
    Ok(())
}

fn fill<const N: usize>(
    out: &mut [f32],
    data: &[u8],
    read: impl Fn([u8; N]) -> f32,
) -> Result<(), Problem> {
    let (chunks, rest) = data.as_chunks::<N>();
    if chunks.len() != out.len() || !rest.is_empty() {
        let message =
            format!("the array's data has {} bytes, {} are due", data.len(), N * out.len());
        return Err(Problem::new(ErrorCode::WrongLength, message));
    }
    for (value, chunk) in out.iter_mut().zip(chunks) {
        *value = read(*chunk);
    }
    Ok(())
}

fn transpose(map: &mut [f32]) {
    for row in 0..MAP_SIDE_PX {
        for column in 0..row {
            map.swap(row * MAP_SIDE_PX + column, column * MAP_SIDE_PX + row);
        }
    }
}

/// Appends the map as a version 1 `.npy` file of shape (224, 224), `<f4`.
pub(super) fn encode(sed_j_per_m3: &[f32], out: &mut BytesMut) {
    let header = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({MAP_SIDE_PX}, {MAP_SIDE_PX}), }}"
    );
    // Magic, version and length take 10 bytes; spaces and a newline fill up to the data.
    let width = HEADER_LEN - 10 - 1;
    out.put_slice(MAGIC);
    out.put_slice(&[1, 0]);
    out.put_u16_le((width + 1) as u16);
    out.put_slice(format!("{header:<width$}\n").as_bytes());
    for value in sed_j_per_m3 {
        out.put_f32_le(*value);
    }
}

#[cfg(test)]
mod tests {
    use papilla_proto::MAP_LEN;
    use proptest::prelude::*;

    use super::*;

    fn file(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        out.extend([version, 0]);
        if version == 1 {
            out.extend((header.len() as u16).to_le_bytes());
        } else {
            out.extend((header.len() as u32).to_le_bytes());
        }
        out.extend(header.as_bytes());
        out.extend(data);
        out
    }

    fn header(descr: &str, fortran: &str, shape: &str) -> String {
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}\n")
    }

    fn decoded(bytes: &[u8]) -> Result<Vec<f32>, ErrorCode> {
        let mut out = vec![f32::NAN; MAP_LEN];
        decode(bytes, &mut out).map(|()| out).map_err(|problem| problem.code)
    }

    #[test]
    fn what_is_written_reads_back() {
        let map: Vec<f32> = (0..MAP_LEN).map(|i| i as f32).collect();
        let mut bytes = BytesMut::new();
        encode(&map, &mut bytes);
        assert_eq!(bytes.len(), HEADER_LEN + 4 * MAP_LEN);
        assert_eq!(bytes[HEADER_LEN - 1], b'\n');
        assert_eq!(decoded(&bytes), Ok(map));
    }

    #[test]
    fn types_orders_versions_and_leading_ones() {
        let data: Vec<u8> =
            (0..MAP_LEN).flat_map(|i| ((i % MAP_SIDE_PX) as f64).to_be_bytes()).collect();
        for version in 1..=3 {
            let c = decoded(&file(version, &header(">f8", "False", "(224, 224)"), &data)).unwrap();
            assert_eq!((c[1].to_bits(), c[224].to_bits()), (1f32.to_bits(), 0));
            let f = decoded(&file(version, &header(">f8", "True", "(1, 1, 224, 224)"), &data));
            let f = f.unwrap();
            assert_eq!((f[1].to_bits(), f[224].to_bits()), (0, 1f32.to_bits()));
        }
    }

    #[test]
    fn other_arrays_are_refused_for_what_they_are() {
        let zeros = vec![0; 4 * MAP_LEN];
        let code = |descr, fortran, shape, data: &[u8]| {
            decoded(&file(1, &header(descr, fortran, shape), data)).unwrap_err()
        };
        assert_eq!(code("<i4", "False", "(224, 224)", &zeros), ErrorCode::WrongType);
        assert_eq!(code("<f4", "False", "(224, 225)", &zeros), ErrorCode::WrongShape);
        assert_eq!(code("<f4", "False", "(50176,)", &zeros), ErrorCode::WrongShape);
        assert_eq!(code("<f4", "False", "()", &zeros), ErrorCode::WrongShape);
        assert_eq!(code("<f4", "False", "(224, 224)", &zeros[1..]), ErrorCode::WrongLength);
        assert_eq!(code("<f8", "False", "(224, 224)", &zeros), ErrorCode::WrongLength);
        assert_eq!(code("<f4", "Maybe", "(224, 224)", &zeros), ErrorCode::BadNpy);
        assert_eq!(code("<f4", "False", "(224, x)", &zeros), ErrorCode::BadNpy);
        assert_eq!(decoded(&file(4, "", &zeros)), Err(ErrorCode::BadNpy));
        assert_eq!(decoded(b"\x93NUMPY\x01\x00\xff\xff"), Err(ErrorCode::BadNpy));
    }

    proptest! {
        #[test]
        fn bytes_of_any_kind_do_not_panic(
            version in 0u8..5,
            header in "[{}':, ()a-z0-9<>\\n]{0,80}",
            tail in prop::collection::vec(any::<u8>(), 0..40),
        ) {
            let mut bytes = file(version, &header, &tail);
            let _ = decoded(&bytes);
            bytes.truncate(tail.len());
            let _ = decoded(&bytes);
        }
    }
}
