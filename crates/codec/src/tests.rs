//! Every form of a map: what is written is read back, and no bytes make a panic.

use papilla_proto::SampleType;
use proptest::prelude::*;

use super::*;

/// Maps of all magnitudes that a pressure may have, zero, denormals and the greatest among them.
fn any_map() -> impl Strategy<Value = Vec<f32>> {
    let value = prop_oneof![
        Just(0.0_f32),
        Just(1e-40_f32),
        Just(f32::MIN_POSITIVE),
        1e-30_f32..1.0,
        1.0_f32..1e5,
        Just(f32::MAX),
    ];
    (prop::collection::vec(value, 1..40), any::<u64>()).prop_map(|(values, seed)| {
        let mut random = fastrand::Rng::with_seed(seed);
        (0..MAP_LEN).map(|_| values[random.usize(..values.len())]).collect()
    })
}

fn written(output: Output, values: &[f32]) -> (BytesMut, f32) {
    let mut bytes = BytesMut::new();
    let map = Map { quantity: Quantity::Pressure, values, source: "test" };
    let scale = encode(output, map, &mut bytes).unwrap();
    (bytes, scale)
}

#[test]
fn a_map_that_holds_no_number_is_not_written() {
    for bad in [f32::NAN, f32::INFINITY] {
        let mut values = vec![1.0; MAP_LEN];
        values[777] = bad;
        let samples = SampleType::ALL.map(Output::Samples);
        for output in samples.into_iter().chain([Output::Npy, Output::Png, Output::Json]) {
            let map = Map { quantity: Quantity::Sed, values: &values, source: "test" };
            let mut bytes = BytesMut::new();
            let error = encode(output, map, &mut bytes).unwrap_err();
            assert!(error.to_string().contains("place 777"), "{output:?}: {error}");
            assert!(bytes.is_empty(), "{output:?}");
        }
    }
}

fn read(input: Input, bytes: &[u8]) -> Result<Vec<f32>, Problem> {
    let mut map = vec![f32::NAN; MAP_LEN];
    decode(input, bytes, &mut map).map(|()| map)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn exact_forms_come_back_bit_for_bit(map in any_map()) {
        let raw = Input::Samples { sample_type: SampleType::F32, scale: 1.0 };
        for (output, input) in [
            (Output::Samples(SampleType::F32), raw),
            (Output::Npy, Input::Npy),
            (Output::Json, Input::Json),
        ] {
            let (bytes, _) = written(output, &map);
            let back = read(input, &bytes).unwrap();
            let same = back.iter().zip(&map).all(|(a, b)| a.to_bits() == b.to_bits());
            prop_assert!(same, "{output:?}");
        }
    }

    #[test]
    fn coarse_forms_come_back_within_half_a_unit(map in any_map(), share in -40_f32..0.0) {
        // Maps of any magnitude, down to where a map is nothing.
        let share = share.exp2();
        let map: Vec<f32> = map.iter().map(|v| share * v.min(1e6)).collect();
        let top = map.iter().copied().fold(0.0, f32::max);
        for sample_type in [SampleType::U16, SampleType::U8] {
            let (bytes, scale) = written(Output::Samples(sample_type), &map);
            let back = read(Input::Samples { sample_type, scale }, &bytes).unwrap();
            prop_assert!(top < 1e-25 || (scale * sample_type.unit_max() / top - 1.0).abs() < 1e-6);
            for (a, b) in map.iter().zip(&back) {
                prop_assert!((a - b).abs() <= sample_type.error_max(*a, scale), "{a} became {b}");
            }
        }
        let (bytes, white) = written(Output::Png, &map);
        let back = read(Input::Png { pressure_max_pa: white }, &bytes).unwrap();
        let unit = white / 65_535.0;
        for (a, b) in map.iter().zip(&back) {
            prop_assert!((a - b).abs() <= SampleType::U16.error_max(*a, unit), "{a} became {b}");
        }
    }

    #[test]
    fn files_that_are_cut_or_changed_are_read_or_refused(
        map in any_map(), cut in 0.0_f64..1.0, flips in prop::collection::vec(any::<u64>(), 0..4),
    ) {
        for (output, input) in [
            (Output::Npy, Input::Npy),
            (Output::Json, Input::Json),
            (Output::Png, Input::Png { pressure_max_pa: 1e4 }),
        ] {
            let (mut bytes, _) = written(output, &map);
            for flip in &flips {
                let at = (*flip / 8 % bytes.len() as u64) as usize;
                bytes[at] ^= 1 << (flip % 8);
            }
            if let Err(problem) = read(input, &bytes) {
                prop_assert!((400..500).contains(&problem.code.http_status()), "{problem}");
            }
            let short = (cut * (bytes.len() - 1) as f64) as usize;
            // A PNG without its end is whole once all of its rows are there.
            prop_assert!(read(input, &bytes[..short]).is_err() || output == Output::Png);
        }
    }
}
