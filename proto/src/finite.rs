//! Whether numbers are finite: the last look at an answer before it is sent.

/// Bits of the magnitude of an f32, and those of infinity: what is not finite has no smaller ones.
const MAGNITUDE: u32 = 0x7fff_ffff;
const INFINITE: u32 = 0x7f80_0000;

/// Samples looked at together.
const LANES: usize = 16;

/// The place of the first value that is NaN or infinite; some microseconds for a map.
///
/// ```
/// use papilla_proto::finite::first_not_finite;
/// assert_eq!(first_not_finite(&[0.0, f32::MAX, -1.0]), None);
/// assert_eq!(first_not_finite(&[0.0, f32::NAN]), Some(1));
/// ```
#[must_use]
pub fn first_not_finite(values: &[f32]) -> Option<usize> {
    // Without a branch, so that the compiler makes vectors of it.
    let mut greatest = [0; LANES];
    let (chunks, rest) = values.as_chunks::<LANES>();
    for chunk in chunks {
        for (greatest, value) in greatest.iter_mut().zip(chunk) {
            *greatest = (*greatest).max(value.to_bits() & MAGNITUDE);
        }
    }
    let is_good =
        greatest.iter().all(|bits| *bits < INFINITE) && rest.iter().all(|v| v.is_finite());
    if is_good { None } else { values.iter().position(|value| !value.is_finite()) }
}

/// The same of little-endian f32 as they stand in an answer. Bytes behind the last whole one are
/// passed over.
#[must_use]
pub fn first_not_finite_in(bytes: &[u8]) -> Option<usize> {
    let mut values = bytes.as_chunks::<4>().0.iter();
    values.position(|bytes| u32::from_le_bytes(*bytes) & MAGNITUDE >= INFINITE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_place_is_looked_at_and_the_first_is_named() {
        for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for len in [1, 15, 16, 17, 33] {
                for at in 0..len {
                    let mut values = vec![-f32::MAX; len];
                    values[at] = bad;
                    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
                    assert_eq!(first_not_finite(&values), Some(at), "{bad} at {at} of {len}");
                    assert_eq!(first_not_finite_in(&bytes), Some(at), "{bad} at {at} of {len}");
                    values[at..].fill(bad);
                    assert_eq!(first_not_finite(&values), Some(at), "{bad} from {at} of {len}");
                }
                assert_eq!(first_not_finite(&vec![f32::MIN_POSITIVE; len]), None);
            }
        }
        assert_eq!((first_not_finite(&[]), first_not_finite_in(&[0xff; 3])), (None, None));
    }
}
