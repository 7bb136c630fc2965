//! `solve` shows a state as datasets hold it.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use ndarray::{Ix1, Ix3};
use papilla_atlas::MAP_LEN;
use papilla_dataset::{Dataset, Field, Maps};
use papilla_fingertip::campaign::{CampaignSpec, indentations};
use papilla_output::npz::NpzArrays;
use std::path::Path;
use std::process::Command;

/// A bar thinner than the atlas' vertices lie apart, on a mesh that is split under it.
const CAMPAIGN: &str = r#"
name = "one road"
seed = 5
presses = 1
depths_mm = [0.3]
test_fraction = 0.0
density = "coarse"
order = "graded"
effects = ["finite_strain", "layers"]
indenter = { shape = "cylinder", radius_mm = 1.0, length_mm = 10.0, end_radius_mm = 0.5 }
[pose]
pitch_deg = [0.0, 20.0]
roll_deg = [-10.0, 10.0]
yaw_deg = [-90.0, 90.0]
"#;

fn run(words: &[&dyn AsRef<std::ffi::OsStr>]) {
    let words = words.iter().map(|w| w.as_ref());
    let found = Command::new(env!("CARGO_BIN_EXE_fe-datagen")).args(words).output().unwrap();
    assert!(found.status.success(), "{}", String::from_utf8_lossy(&found.stderr));
}

fn scene_of(campaign: &Path) -> String {
    let spec = CampaignSpec::read(campaign).unwrap();
    let press = indentations(&spec).remove(0);
    let mut scene = spec.scene(&spec.candidates()[press.candidate]);
    scene.motion = press.motion();
    toml::to_string(&scene).unwrap()
}

/// The state of a campaign's press, solved as a scene: the same maps, to the bit.
#[test]
fn a_scene_and_a_dataset_show_a_state_alike() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("campaign.toml"), CAMPAIGN).unwrap();
    std::fs::write(at("scene.toml"), scene_of(&at("campaign.toml"))).unwrap();
    run(&[&"generate", &at("campaign.toml"), &"--out", &at("data")]);
    run(&[&"solve", &at("scene.toml"), &"--out", &at("out")]);

    let dataset = Dataset::open(&at("data")).unwrap();
    let shard = dataset.shard(&dataset.manifest().presses[0]).unwrap();
    let maps = Maps::read(&at("data"), dataset.atlas()).unwrap();
    let bytes = std::fs::read(at("out/maps.npz")).unwrap();
    let mut npz = NpzArrays::new("maps.npz".as_ref(), &bytes).unwrap();
    for (name, field) in [
        ("pressure_pa", Field::Pressure),
        ("sed_dermis_j_per_m3", Field::SedDermis),
        ("sed_epidermis_j_per_m3", Field::SedEpidermis),
    ] {
        let mut due = vec![0.0; MAP_LEN];
        maps.of(&shard).draw(field, 0, &mut due).unwrap();
        let found = npz.get::<f32, Ix3>(name).unwrap();
        assert_eq!(found.dim(), (1, 224, 224));
        let peak = due.iter().copied().fold(0.0, f32::max);
        assert!(peak > 1.0, "{name}: {peak}");
        let differ = found.iter().zip(&due).filter(|(a, b)| a.to_bits() != b.to_bits()).count();
        assert_eq!(differ, 0, "{name}: pixels that differ");
    }
    assert_eq!(npz.get::<f32, Ix1>("depth_mm").unwrap(), shard.depth_mm);
    let atlas = std::fs::read_to_string(at("out/atlas.json")).unwrap();
    assert!(atlas.contains(dataset.atlas().hash()));
}
