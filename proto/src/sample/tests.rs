use proptest::prelude::*;

use super::*;

fn any_type() -> impl Strategy<Value = SampleType> {
    prop::sample::select(SampleType::ALL.to_vec())
}

fn round_trip(t: SampleType, values: &[f32], scale: f32) -> Vec<f32> {
    let mut payload = vec![0; values.len() * t.bytes()];
    t.encode(values, scale, &mut payload).unwrap();
    let mut back = vec![f32::NAN; values.len()];
    t.decode(&payload, scale, &mut back).unwrap();
    back
}

#[test]
fn wire_numbers_read_back_and_names_are_lowercase() {
    for t in SampleType::ALL {
        assert_eq!(SampleType::from_wire(t.to_wire()), Some(t));
        let name = serde_json::to_string(&t).unwrap();
        assert_eq!(name, format!("\"{t:?}\"").to_lowercase());
    }
    assert!((4..=255).all(|n| SampleType::from_wire(n).is_none()));
}

#[test]
fn bad_scales_are_refused_by_integers_and_ignored_by_floats() {
    for scale in [0.0, -1.0, f32::NAN, f32::INFINITY, f32::MAX] {
        for t in SampleType::ALL {
            let mut out = [0.0; 3];
            let result = t.decode(&vec![0; 3 * t.bytes()], scale, &mut out);
            assert_eq!(result.is_err(), t.is_scaled(), "{t:?} {scale}");
            let result = t.encode(&[0.0; 3], scale, &mut vec![0; 3 * t.bytes()]);
            assert_eq!(result.is_err(), t.is_scaled(), "{t:?} {scale}");
        }
    }
}

#[test]
fn values_beyond_the_range_are_clamped() {
    for t in [SampleType::F16, SampleType::U16, SampleType::U8] {
        let back = round_trip(t, &[1e30], 0.5);
        assert!((back[0] - t.value_max(0.5)).abs() <= f32::EPSILON * back[0], "{t:?}");
    }
    assert_eq!(round_trip(SampleType::U8, &[-3.0, f32::NAN], 0.5), [0.0, 0.0]);
}

proptest! {
    #[test]
    fn floats_32_come_back_bit_for_bit(bits in prop::collection::vec(any::<u32>(), 0..64)) {
        let values: Vec<f32> = bits.iter().map(|&b| f32::from_bits(b)).collect();
        let back = round_trip(SampleType::F32, &values, 1.0);
        let back: Vec<u32> = back.iter().map(|v| v.to_bits()).collect();
        prop_assert_eq!(back, bits);
    }

    #[test]
    fn the_error_stays_within_its_bound(
        t in any_type(),
        fractions in prop::collection::vec(0.0f32..=1.0, 1..64),
        scale in 1e-6f32..1e4,
    ) {
        let top = if t == SampleType::F32 { 1e6 } else { t.value_max(scale) };
        let values: Vec<f32> = fractions.iter().map(|f| f * top).collect();
        for (value, back) in values.iter().zip(round_trip(t, &values, scale)) {
            let error = (value - back).abs();
            prop_assert!(error <= t.error_max(*value, scale), "{t:?} {value} -> {back}");
        }
    }

    #[test]
    fn encoded_units_come_back_bit_for_bit(
        t in any_type(),
        units in prop::collection::vec(any::<u8>(), 0..64),
        scale in 1e-6f32..1e4,
    ) {
        // Any whole number of samples; f16 and f32 NaNs keep no payload bits to speak of.
        let payload = &units[..units.len() / t.bytes() * t.bytes()];
        let mut values = vec![0.0; payload.len() / t.bytes()];
        t.decode(payload, scale, &mut values).unwrap();
        prop_assume!(values.iter().all(|v| v.is_finite()));
        let mut again = vec![0; payload.len()];
        t.encode(&values, scale, &mut again).unwrap();
        prop_assert_eq!(&again[..], payload);
    }

    #[test]
    fn no_length_panics(t in any_type(), bytes in 0usize..40, samples in 0usize..12) {
        let fits = bytes == samples * t.bytes();
        prop_assert_eq!(t.decode(&vec![7; bytes], 1.0, &mut vec![0.0; samples]).is_ok(), fits);
        prop_assert_eq!(t.encode(&vec![7.0; samples], 1.0, &mut vec![0; bytes]).is_ok(), fits);
    }
}
