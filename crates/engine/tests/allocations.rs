//! A warm frame of a network on maps takes no memory.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

#[path = "common/counting.rs"]
mod counting;

use counting::ALLOCATIONS;
use papilla_engine::{MAP_LEN, MAP_SIDE_PX, load};

/// A square of pressure of this many pixels, Pa.
fn square(middle: usize, side: usize) -> Vec<f32> {
    let near = |at: usize| at.abs_diff(middle) <= side / 2;
    (0..MAP_LEN)
        .map(|i| if near(i / MAP_SIDE_PX) && near(i % MAP_SIDE_PX) { 8e3 } else { 0.0 })
        .collect()
}

#[test]
fn a_warm_frame_takes_no_memory() {
    for name in ["nano", "small", "large-maps"] {
        let path = format!("{}/../../models/{name}.onnx", env!("CARGO_MANIFEST_DIR"));
        let mut session = load(&std::fs::read(path).unwrap(), None).unwrap().session().unwrap();
        let maps = [square(112, 30), square(70, 1), square(112, 224), square(0, 0)];
        let mut sed_j_per_m3 = vec![0.0; MAP_LEN];
        session.infer(&maps[0], &mut sed_j_per_m3).unwrap();
        let before = ALLOCATIONS.get();
        for map in maps.iter().chain(&maps) {
            session.infer(map, &mut sed_j_per_m3).unwrap();
        }
        assert_eq!(ALLOCATIONS.get() - before, 0, "{name}");
    }
}
