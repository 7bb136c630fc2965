//! The evaluation by rows compared with tract's evaluation of the same graph.

use super::trial::{DIFFERENCE_MAX, difference};
use super::*;
use crate::tract_backend::TractModel;
use crate::{MAP_LEN, MAP_SIDE_PX, checked};
use proptest::prelude::*;
use std::cell::RefCell;

mod naive;

/// What is added where answers are compared: pressures of less than 1e-9 Pa count for nothing.
const NOTHING: f32 = 1e-20;
const MAP_NETS: [&str; 4] = ["nano", "small", "large", "large-maps"];

fn read(name: &str) -> Vec<u8> {
    let path = format!("{}/../../models/{name}.onnx", env!("CARGO_MANIFEST_DIR"));
    std::fs::read(path).unwrap()
}

/// A shipped model, run by its graph as it stands and by rows.
struct Pair {
    plain: Box<dyn Session>,
    by_rows: Box<dyn Session>,
    max_pa: f32,
}

impl Pair {
    fn new(name: &str) -> Self {
        let (proto, info) = checked(&read(name), None).unwrap();
        let max_pa = info.pressure_max_pa;
        let by_rows =
            MapModel::new(info.clone(), find(&proto).unwrap().runner()).session().unwrap();
        let plain = TractModel::load(&proto, info).unwrap().session().unwrap();
        Self { plain, by_rows, max_pa }
    }

    fn apart(&mut self, pressure_pa: &[f32]) -> f32 {
        let [mut due, mut found] = [vec![f32::NAN; MAP_LEN], vec![f32::NAN; MAP_LEN]];
        self.plain.infer(pressure_pa, &mut due).unwrap();
        self.by_rows.infer(pressure_pa, &mut found).unwrap();
        let some: Vec<f32> = due.iter().map(|due| due + NOTHING).collect();
        found.iter_mut().for_each(|found| *found += NOTHING);
        difference(&found, &some)
    }
}

#[test]
fn map_networks_are_found_and_others_are_not() {
    for name in MAP_NETS {
        let model = crate::load(&read(name), None).unwrap();
        assert!(model.info().backend.ends_with(" by rows"), "{name}");
        let (proto, _) = checked(&read(name), None).unwrap();
        let count = if name == "large-maps" { 3 } else { 1 };
        assert_eq!(find(&proto).map(|found| found.0.len()), Some(count), "{name}");
    }
    for name in ["half-space", "s1-base16"] {
        let (proto, _) = checked(&read(name), None).unwrap();
        assert!(find(&proto).is_none(), "{name}");
    }
}

#[test]
fn trials_differ_by_rounding_alone() {
    for name in MAP_NETS {
        let mut pair = Pair::new(name);
        for (trial, map) in super::trial::trials(pair.max_pa).iter().enumerate() {
            let apart = pair.apart(map);
            // Far enough from the bar that no other processor's rounding passes it.
            assert!(apart <= 0.4 * DIFFERENCE_MAX, "{name} {trial}: {apart:.2e}");
        }
    }
}

/// A patch of pressure: an ellipse or a box, smooth or rough, anywhere.
#[derive(Clone, Debug)]
struct Patch {
    middle: [f32; 2],
    radii: [f32; 2],
    is_box: bool,
    is_rough: bool,
    /// As a share of the greatest pressure of the training.
    peak: f32,
}

impl Patch {
    fn any() -> impl Strategy<Value = Self> {
        let radius = prop_oneof![0.4_f32..3.0, 3.0_f32..40.0, 40.0_f32..250.0];
        let peak = prop_oneof![Just(1e-9_f32), 1e-4_f32..0.05, 0.05_f32..1.5];
        let place = -20.0_f32..244.0;
        ([place.clone(), place], [radius.clone(), radius], any::<bool>(), any::<bool>(), peak)
            .prop_map(|(middle, radii, is_box, is_rough, peak)| Self {
                middle,
                radii,
                is_box,
                is_rough,
                peak,
            })
    }

    fn add(&self, max_pa: f32, map: &mut [f32]) {
        for (place, value) in map.iter_mut().enumerate() {
            let at = [(place / MAP_SIDE_PX) as f32, (place % MAP_SIDE_PX) as f32];
            let [y, x] = [0, 1].map(|axis| (at[axis] - self.middle[axis]) / self.radii[axis]);
            let inside = if self.is_box { 1.0 - y.abs().max(x.abs()) } else { 1.0 - y * y - x * x };
            if inside > 0.0 {
                let rough = if self.is_rough { ((place * 7919) % 101) as f32 / 101.0 } else { 1.0 };
                *value += self.peak * max_pa * rough * inside.sqrt();
            }
        }
    }
}

thread_local! {
    static PAIRS: RefCell<Vec<Pair>> =
        RefCell::new(["nano", "small"].into_iter().map(Pair::new).collect());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    /// One session takes maps one after another, so that what a map leaves behind is noticed too.
    #[test]
    fn any_contact_is_answered_as_by_the_graph(
        patches in prop::collection::vec(Patch::any(), 0..5),
        empty in 0_usize..8,
    ) {
        PAIRS.with_borrow_mut(|pairs| {
            for (tier, pair) in pairs.iter_mut().enumerate() {
                let mut map = vec![0.0; MAP_LEN];
                patches.iter().for_each(|patch| patch.add(pair.max_pa, &mut map));
                let apart = pair.apart(&map);
                prop_assert!(apart <= DIFFERENCE_MAX, "tier {}: {:.2e}", tier, apart);
                if empty == tier {
                    prop_assert!(pair.apart(&vec![0.0; MAP_LEN]) <= 0.0);
                }
            }
            Ok(())
        })?;
    }
}

#[test]
fn wide_networks_and_means_are_answered_as_by_the_graph() {
    for name in ["large", "large-maps"] {
        let mut pair = Pair::new(name);
        let patch = |middle, radius, is_rough, peak| Patch {
            middle,
            radii: [radius; 2],
            is_box: is_rough,
            is_rough,
            peak,
        };
        for patches in [
            vec![patch([100.0, 112.0], 18.0, false, 0.4)],
            vec![patch([20.0, 30.0], 9.0, true, 0.9), patch([190.0, 200.0], 3.0, false, 0.2)],
            vec![],
            vec![patch([112.0, 112.0], 300.0, true, 1.0)],
            vec![patch([50.0, 217.0], 0.6, false, 1.2)],
        ] {
            let mut map = vec![0.0; MAP_LEN];
            patches.iter().for_each(|patch| patch.add(pair.max_pa, &mut map));
            let apart = pair.apart(&map);
            assert!(apart <= DIFFERENCE_MAX, "{name}: {apart:.2e}");
        }
    }
}

#[test]
fn single_pixels_and_the_whole_map_are_answered_as_by_the_graph() {
    for name in ["nano", "small"] {
        let mut pair = Pair::new(name);
        let max_pa = pair.max_pa;
        let last = MAP_SIDE_PX - 1;
        for (row, column) in
            [(0, 0), (0, last), (last, 0), (last, last), (1, 8), (100, 15), (101, 16), (7, 120)]
        {
            let mut map = vec![0.0; MAP_LEN];
            map[row * MAP_SIDE_PX + column] = max_pa;
            let apart = pair.apart(&map);
            assert!(apart <= DIFFERENCE_MAX, "{name} {row} {column}: {apart:.2e}");
        }
        for pressure_pa in [1e-40, -0.0, 1.0, max_pa] {
            let apart = pair.apart(&vec![pressure_pa; MAP_LEN]);
            assert!(apart <= DIFFERENCE_MAX, "{name} {pressure_pa}: {apart:.2e}");
        }
    }
}

/// What changes a single weight or setting of `nano`, in the file.
fn altered(change: impl FnOnce(&mut tract_onnx::pb::GraphProto)) -> ModelProto {
    let (mut proto, _) = checked(&read("nano"), None).unwrap();
    change(proto.graph.as_mut().unwrap());
    proto
}

fn weights<'a>(graph: &'a mut tract_onnx::pb::GraphProto, name: &str) -> &'a mut Vec<u8> {
    &mut graph.initializer.iter_mut().find(|tensor| tensor.name == name).unwrap().raw_data
}

#[test]
fn a_graph_that_differs_is_not_taken_for_one() {
    let node = |graph: &mut tract_onnx::pb::GraphProto, operator: &str| {
        graph.node.iter().position(|node| node.op_type == operator).unwrap()
    };
    assert!(find(&altered(|_| {})).is_some());
    // No product of a mix and the interpolation.
    assert!(
        find(&altered(|graph| {
            let raw = weights(graph, "network.levels.0.above");
            let at = 4 * (9 * 21 + 4);
            let weight = f32::from_le_bytes(raw[at..at + 4].try_into().unwrap());
            raw[at..at + 4].copy_from_slice(&(1.001 * weight + 1e-6).to_le_bytes());
        }))
        .is_none()
    );
    assert!(
        find(&altered(|graph| {
            let at = node(graph, "Clip");
            graph.node[at].input.swap(1, 2);
        }))
        .is_none()
    );
    assert!(
        find(&altered(|graph| {
            let at = node(graph, "DepthToSpace");
            graph.node[at].attribute.iter_mut().for_each(|attribute| {
                if attribute.name == "mode" {
                    attribute.s = b"DCR".to_vec();
                }
            });
        }))
        .is_none()
    );
    assert!(
        find(&altered(|graph| {
            let at = node(graph, "Conv");
            graph.node[at].input.push("mask".into());
        }))
        .is_none()
    );
}

#[test]
fn what_is_answered_otherwise_is_left_to_tract() {
    let (proto, info) = checked(&read("nano"), None).unwrap();
    let other = find(&altered(|graph| {
        let raw = weights(graph, "network.levels.0.near");
        raw[..4].copy_from_slice(&0.5_f32.to_le_bytes());
    }));
    let plain: Arc<dyn Model> = Arc::new(TractModel::load(&proto, info).unwrap());
    let kept = prefer(Arc::clone(&plain), other).unwrap().into_model();
    assert!(Arc::ptr_eq(&kept, &plain));
}

#[test]
fn weights_that_are_denormal_numbers_are_none() {
    let tiny = |graph: &mut tract_onnx::pb::GraphProto| {
        for name in ["network.levels.0.near", "network.reach_out", "network.levels.1.over_finger"] {
            for bytes in weights(graph, name).as_chunks_mut::<4>().0 {
                *bytes = 1e-39_f32.to_le_bytes();
            }
        }
    };
    let (_, info) = checked(&read("nano"), None).unwrap();
    let proto = altered(tiny);
    let by_rows = MapModel::new(info.clone(), find(&proto).unwrap().runner()).session().unwrap();
    let max_pa = info.pressure_max_pa;
    let plain = TractModel::load(&proto, info).unwrap().session().unwrap();
    let apart = Pair { plain, by_rows, max_pa }.apart(&crate::trial_map(max_pa));
    assert!(apart <= DIFFERENCE_MAX, "{apart:.2e}");
}
