//! Decks for CalculiX from scenes.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn export(scene: &Path, folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fe-datagen"))
        .args(["export", "--format", "inp", "--out"])
        .args([folder, scene])
        .output()
        .unwrap()
}

fn shipped(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name)
}

/// Lines between a keyword line that starts with `keyword` and the next one.
fn data<'a>(deck: &'a str, keyword: &str) -> Vec<&'a str> {
    let lines = deck.lines().skip_while(|l| !l.starts_with(keyword)).skip(1);
    lines.take_while(|l| !l.starts_with('*')).collect()
}

#[test]
fn a_scene_becomes_a_whole_deck() {
    let folder = tempfile::tempdir().unwrap();
    // What follows a full stop belongs to the scene's name.
    let scene = folder.path().join("block-0.3.toml");
    std::fs::copy(shipped("layered-block.toml"), &scene).unwrap();
    let out = folder.path().join("deck/block-0.3.inp");
    let done = export(&scene, &folder.path().join("deck"));
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let deck = std::fs::read_to_string(&out).unwrap();
    assert_eq!(data(&deck, "*NODE, NSET=NBODY").len(), 25 * 25 * 10);
    let elements: usize = ["EEPIDERMIS", "EDERMIS", "ESUBCUTANEOUS"]
        .iter()
        .map(|set| data(&deck, &format!("*ELEMENT, TYPE=C3D8, ELSET={set}")).len())
        .sum();
    assert_eq!(elements, 24 * 24 * 9);
    assert_eq!(data(&deck, "*SURFACE, NAME=TOUCHED").len(), 24 * 24);
    assert!(data(&deck, "*SURFACE, NAME=TOUCHED")[0].ends_with(",S1"), "bricks' lower faces");
    // mu/2 and 2/K of the epidermis.
    let constants: Vec<f64> =
        data(&deck, "*HYPERELASTIC")[0].split(',').map(|v| v.parse().unwrap()).collect();
    assert!((constants[0] - 0.136 / 2.96 / 2.0).abs() < 1e-12);
    assert!((constants[1] - 2.0 * 0.12 / 0.136).abs() < 1e-11);
    // Five stored depths; the plate goes up by the last.
    assert_eq!(data(&deck, "*TIME POINTS").len(), 5);
    let travel = deck.lines().find(|l| l.starts_with("NINDENTER,3,3,")).unwrap();
    assert_eq!(travel.rsplit(',').next().unwrap().parse(), Ok(0.5));
}

const BLOCK: &str = "[geometry]
kind = \"block\"
size_mm = [4.0, 4.0]
elements = [4, 4]
layers = [{ tissue = \"dermis\", thickness_mm = 2.0, elements = 2 }]
";

/// What CalculiX cannot express is named, with the cure, and nothing is written.
#[test]
fn what_calculix_cannot_express_is_refused() {
    let four = "[materials.dermis]\nyoungs_modulus_mpa = 0.08\npoissons_ratio = 0.48\n[materials.dermis.ogden]\nmu_mpa = [0.01, 0.01, 0.01, 0.01]\nalpha = [2.0, 3.0, 4.0, 5.0]";
    let path = "path = [{ time_s = 1.0, depth_mm = 0.2 }]";
    let cases = [
        ("[\"finite_strain\", \"viscoelastic\"]", path, "", "reads *VISCOELASTIC and ignores it"),
        (
            "[\"finite_strain\", \"friction\"]",
            "depth_mm = 0.2",
            "[friction]\ncoefficient = 0.5",
            "friction",
        ),
        ("[\"finite_strain\"]", "force_n = 0.2", "", "motion.force_n"),
        ("[\"finite_strain\"]", "depth_mm = 0.2", "[indenter]\nshape = \"ring\"", "'ring'"),
        (
            "[\"finite_strain\", \"layers\", \"hyperelastic\"]",
            "depth_mm = 0.2",
            four,
            "CalculiX takes one to three",
        ),
    ];
    let folder = tempfile::tempdir().unwrap();
    let (scene, out) = (folder.path().join("bad.toml"), folder.path().join("bad.inp"));
    for (effects, motion, rest, word) in cases {
        let text = format!("effects = {effects}\n{BLOCK}[motion]\n{motion}\n{rest}\n");
        std::fs::write(&scene, text).unwrap();
        let done = export(&scene, folder.path());
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(1), "{message}");
        assert!(message.contains(word), "{message} should name {word}");
        assert!(!out.exists());
    }
}

/// A path has its corners in the deck, and tissues without an Ogden law stay neo-Hookean.
#[test]
fn paths_and_ogden_laws_are_expressed() {
    let folder = tempfile::tempdir().unwrap();
    let (scene, out) = (folder.path().join("path.toml"), folder.path().join("path.inp"));
    let path = "[{ time_s = 1.0, depth_mm = 0.2 }, { time_s = 4.0, depth_mm = 0.2, shift_mm = [1.0, 0.0] }]";
    let text = format!(
        "effects = [\"finite_strain\", \"layers\", \"hyperelastic\"]\n{BLOCK}[motion]\npath = {path}\n"
    );
    std::fs::write(&scene, text).unwrap();
    let done = export(&scene, folder.path());
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let deck = std::fs::read_to_string(&out).unwrap();
    let points = |name: &str| -> Vec<(f64, f64)> {
        let rows = data(&deck, &format!("*AMPLITUDE, NAME={name}"));
        let pair =
            |l: &&str| l.split_once(',').map(|(t, v)| (t.parse().unwrap(), v.parse().unwrap()));
        rows.iter().filter_map(pair).collect()
    };
    assert_eq!(points("ALONG1"), [(0.0, 0.0), (0.25, 0.0), (1.0, 1.0)]);
    assert_eq!(points("ALONG3"), [(0.0, 0.0), (0.25, 0.2), (1.0, 0.2)]);
    assert!(deck.contains("*HYPERELASTIC, OGDEN, N=3"));
    assert_eq!(data(&deck, "*TIME POINTS").len(), 2);
}
