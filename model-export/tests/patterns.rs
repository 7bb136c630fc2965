//! What the cards note of the maps that models were trained on, and which maps that tells.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

mod bench;

use bench::{Bench, DEPTHS, contact, read_card};
use papilla_engine::card::Index;
use papilla_engine::{MAP_LEN, MAP_SIDE_PX, ladder::Kind};
use papilla_model_export::dataset::Dataset;
use papilla_proto::{InputStatistics, atlas::Patch};
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

#[test]
fn a_card_notes_the_roughest_and_heaviest_map() {
    let bench = Bench::new();
    let evaluate = ["evaluate", "models/tiny.onnx", "data", "--card", "models/tiny.json"];
    let note = ["patterns", "models", "--dataset", "data"];
    bench.done(&evaluate);
    bench.done(&["index", "models", "--default", "tiny"]);
    assert_eq!(read_card(&bench.path("models/tiny.json")).input_statistics_max, None);
    assert!(bench.done(&note).contains("tiny: roughness up to"));
    let noted = read_card(&bench.path("models/tiny.json")).input_statistics_max.unwrap();
    let maps = [0.9, 1.0].into_iter().flat_map(|force| DEPTHS.map(|depth| contact(force * depth)));
    let due = maps.map(|map| InputStatistics::of(&map)).reduce(InputStatistics::max).unwrap();
    assert!((noted.roughness / due.roughness - 1.0).abs() < 1e-4, "{noted:?} {due:?}");
    assert!((noted.load_mpa_px / due.load_mpa_px - 1.0).abs() < 1e-4, "{noted:?} {due:?}");
    // Measured anew on the same data, the model keeps it.
    bench.done(&evaluate);
    assert_eq!(read_card(&bench.path("models/tiny.json")).input_statistics_max, Some(noted));

    // Other data tell nothing of this model.
    let card = fs::read_to_string(bench.path("models/tiny.json")).unwrap();
    let hash = read_card(&bench.path("models/tiny.json")).dataset_sha256;
    fs::write(bench.path("models/tiny.json"), card.replace(&hash, &"0".repeat(64))).unwrap();
    assert!(bench.refused(1, &note).contains("trained on these datasets alone"));
}

/// Maps that no indentation makes, 10 kPa where they are not 0.
fn odd_maps(skin: &[bool]) -> Vec<(String, Vec<f32>)> {
    let drawn = |at: &dyn Fn(usize, usize) -> f32| -> Vec<f32> {
        let pixel =
            |i: usize| if skin[i] { 1e4 * at(i / MAP_SIDE_PX, i % MAP_SIDE_PX) } else { 0.0 };
        (0..MAP_LEN).map(pixel).collect()
    };
    let board = |side_px: usize| {
        drawn(&|y, x| f32::from(u8::from((y / side_px + x / side_px).is_multiple_of(2))))
    };
    let mut maps: Vec<(String, Vec<f32>)> =
        [1, 2, 4, 8, 16, 32].map(|px| (format!("checkerboard of {px} px"), board(px))).into();
    let hash = |y: usize, x: usize| ((y * 7919 + x * 104_729) % 1009) as f32 / 1008.0;
    maps.push(("noise".to_owned(), drawn(&hash)));
    maps.push(("all skin alike".to_owned(), drawn(&|_, _| 1.0)));
    maps
}

#[test]
fn shipped_networks_tell_odd_maps_from_held_out_presses() {
    let dataset = Dataset::open(&root().join("data/heldout-graded")).unwrap();
    let mut indentations = Vec::new();
    for indentation in dataset.every_indentation() {
        let shard = dataset.shard(indentation).unwrap();
        for index in 0..indentation.samples {
            let mut map = vec![0.0; MAP_LEN];
            dataset.draw_pressure(indentation, &shard, index, &mut map).unwrap();
            indentations.push(InputStatistics::of(&map));
        }
    }
    let odd = odd_maps(dataset.maps.raster(Patch::Skin).mask());
    let index = fs::read_to_string(root().join("models/index.json")).unwrap();
    for name in Index::from_json(&index).unwrap().models {
        let card = read_card(&root().join(format!("models/{name}.json")));
        let is_network = Kind::of_network(&card.network).is_network();
        assert_eq!(card.input_statistics_max.is_some(), is_network, "{name}");
        let Some(trained) = card.input_statistics_max else { continue };
        for (what, map) in &odd {
            assert!(InputStatistics::of(map).is_out_of_distribution(trained), "{name}: {what}");
        }
        // Edges and gratings are rougher than all that plates alone have taught.
        if card.datasets().len() > 1 {
            let flagged =
                indentations.iter().filter(|of| of.is_out_of_distribution(trained)).count();
            assert_eq!((flagged, indentations.len()), (0, 48), "{name}");
        }
    }
}
