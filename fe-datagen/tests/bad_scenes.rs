//! Bad scenes, given to the real program: one clear error that names file, line,
//! field and cure, exit code 1, and nothing written.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};

const FINGER: &str = "effects = [\"finite_strain\", \"layers\"]

[geometry]
kind = \"fingertip\"
density = \"coarse\"
order = \"linear\"
[motion]
depth_mm = 1.0
";

const BLOCK: &str = "[geometry]
kind = \"block\"
size_mm = [4.0, 4.0]
elements = [4, 4]
layers = [
  { tissue = \"dermis\", thickness_mm = 1.0, elements = 1 },
  { tissue = \"subcutaneous\", thickness_mm = 2.0, elements = 2 },
]

[motion]
depth_mm = 0.5
";

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fe-datagen"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap()
}

/// Runs every command that reads a scene on a bad one.
fn assert_refused(text: &str, line: usize, words: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.toml"), text).unwrap();
    for arguments in [&["solve", "bad.toml", "--out", "out"][..], &["explain", "bad.toml"]] {
        let output = run(folder.path(), arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {error}");
        let at = format!("error: bad.toml:{line}:");
        assert!(error.starts_with(&at), "{error}should start with {at} in\n{text}");
        assert_eq!(error.matches("error: ").count(), 1, "one error: {error}");
        for word in words {
            assert!(error.contains(word), "{error}should say {word}");
        }
        assert!(output.stdout.is_empty());
        let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
        assert_eq!(left.len(), 1, "nothing is written: {left:?}");
    }
}

#[test]
fn an_unknown_effect() {
    let text = FINGER.replace("\"layers\"", "\"sound\"");
    assert_refused(&text, 1, &["effects[1]", "unknown effect 'sound'", "there are: finite_strain"]);
}

#[test]
fn contradictory_effects() {
    let text = FINGER.replace("\"layers\"", "\"plane_strain\"");
    assert_refused(&text, 1, &["'plane_strain'", "solid", "geometry.kind = \"section\""]);
    let text = FINGER.replace("\"finite_strain\", \"layers\"", "\"layers\",\n  \"hyperelastic\"");
    assert_refused(&text, 2, &["'hyperelastic'", "needs 'finite_strain'"]);
    let text = FINGER.replace("\"layers\"", "\"friction\"");
    assert_refused(
        &text,
        1,
        &[
            "effect 'friction': friction.coefficient is 0; leave the effect out or give a coefficient",
        ],
    );
}

#[test]
fn a_negative_thickness() {
    let text = BLOCK.replace("2.0, elements", "-2.0, elements");
    assert_refused(&text, 7, &["geometry.layers[1].thickness_mm = -2", "above 0"]);
    let text = format!("{FINGER}\n[geometry.shape]\ndermis_mm = -1.0\n");
    assert_refused(&text, 11, &["geometry.shape.dermis_mm = -1 mm", "above 0"]);
}

#[test]
fn an_incompressible_tissue() {
    let text =
        format!("{FINGER}\n[materials.dermis]\nyoungs_modulus_mpa = 0.08\npoissons_ratio = 0.5\n");
    assert_refused(&text, 12, &["materials.dermis: Poisson's ratio 0.5", "0.49 to 0.4999"]);
}

#[test]
fn an_indenter_that_starts_inside_the_finger() {
    let text = FINGER.replace(
        "depth_mm = 1.0",
        "path = [\n  { time_s = 0.0, depth_mm = 0.5 },\n  { time_s = 1.0, depth_mm = 1.0 },\n]",
    );
    assert_refused(&text, 9, &["motion.path[0].depth_mm", "inside the finger", "later time_s"]);
}

#[test]
fn an_indenter_that_makes_no_sense_or_goes_by() {
    let with = |table: &str| format!("{FINGER}\n[indenter]\n{table}\n");
    let text = with("shape = \"sphere\"\nradius_mm = -3.0");
    assert_refused(&text, 12, &["indenter.radius_mm = -3.0", "positive"]);
    assert_refused(&with("shape = \"cube\""), 11, &["indenter.shape", "`sphere`"]);
    assert_refused(&with("shape = \"sphere\"\nradius = 3.0"), 12, &["did you mean `radius_mm`"]);
    let text =
        with("shape = \"heightmap\"\nfile = \"none.png\"\nsize_mm = [9.0, 9.0]\nheight_mm = 1.0");
    assert_refused(&text, 12, &["none.png"]);
    let text = with("shape = \"sphere\"\nradius_mm = 2.0")
        .replace("depth_mm = 1.0", "depth_mm = 1.0\noffset_mm = [0.0, 60.0]");
    assert_refused(&text, 9, &["never meets the body", "motion.offset_mm"]);
}

#[test]
fn a_cortex_that_fills_the_bone() {
    let text = format!("{FINGER}\n[geometry.shape]\nbone_cortex_mm = 3.0\n")
        .replace("\"layers\"", "\"elastic_bone\"");
    assert_refused(&text, 11, &["geometry.shape.bone_cortex_mm = 3", "make the cortex thinner"]);
}

#[test]
fn a_finger_too_thin_for_its_bone() {
    let with = |shape: &str| format!("{FINGER}\n[geometry.shape]\n{shape}\n");
    assert_refused(
        &with("width_mm = 12.0"),
        11,
        &["geometry.shape.width_mm = 12", "folds the elements", "at least 1"],
    );
    // One of two is to blame.
    let two = with("epidermis_mm = 0.25\nwidth_mm = 12.0");
    assert_refused(&two, 12, &["geometry.shape.width_mm = 12"]);
}

/// What is not there, or is no file, is said once, with a cure.
#[test]
fn a_file_that_cannot_be_read_is_named_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("folder")).unwrap();
    std::fs::write(folder.path().join("empty.toml"), "").unwrap();
    for (arguments, words) in [
        (&["solve", "none.toml", "--out", "out"][..], &["none.toml", "No such file"][..]),
        (&["explain", "none.toml"], &["none.toml", "No such file"]),
        (&["generate", "none.toml", "--out", "out"], &["none.toml", "No such file"]),
        (&["explain", "folder"], &["folder", "Is a directory"]),
        (&["explain", "empty.toml"], &["empty.toml", "missing field `geometry`"]),
        (&["generate", "empty.toml", "--out", "out"], &["empty.toml", "missing field `name`"]),
        (&["dataset", "verify", "none"], &["none/manifest.json", "No such file", "check the path"]),
        (&["dataset", "stats", "empty.toml"], &["empty.toml/manifest.json", "Not a directory"]),
        (&["contact", "none", "--out", "out"], &["none/manifest.json", "No such file"]),
        (&["solve", "good.toml", "--out", "empty.toml"], &["empty.toml", "a folder is due"]),
        (&["operator", "--out", "empty.toml"], &["empty.toml", "a folder is due"]),
        (&["stability", "--out", "empty.toml"], &["empty.toml", "a folder is due"]),
        (&["solve", "campaign.toml", "--out", "out"], &["campaign.toml", "is a campaign"]),
        (&["generate", "good.toml", "--out", "out"], &["good.toml", "is a scene", "`solve`"]),
    ] {
        std::fs::write(folder.path().join("good.toml"), BLOCK).unwrap();
        std::fs::write(folder.path().join("campaign.toml"), "presses = 4\n").unwrap();
        let output = run(folder.path(), arguments);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {error}");
        for word in words {
            assert_eq!(
                error.matches(word).count(),
                1,
                "{arguments:?}: {error}should say {word} once"
            );
        }
        assert!(!folder.path().join("out").exists(), "{arguments:?} left a folder");
    }
}

#[test]
fn missing_and_absurd_units() {
    let of_motion = |to: &str| FINGER.replace("depth_mm = 1.0", to);
    assert_refused(&of_motion("depth = 1.0"), 8, &["did you mean `depth_mm`"]);
    assert_refused(&of_motion("depth_mm = \"1 mm\""), 8, &["motion.depth_mm", "bare number"]);
    assert_refused(&of_motion("depth_mm = 1000.0"), 8, &["motion.depth_mm", "at most 100 mm"]);
    assert_refused(&of_motion("force_n = 1e6"), 8, &["motion.force_n", "at most 1000 N"]);
    let text =
        format!("{FINGER}\n[materials.dermis]\nyoungs_modulus_mpa = 8e4\npoissons_ratio = 0.48\n");
    assert_refused(&text, 11, &["materials.dermis", "80000 MPa", "was Pa meant?"]);
    let text = format!("{FINGER}\n[geometry.shape]\nepidermis_mm = 200.0\n");
    assert_refused(&text, 11, &["geometry.shape.epidermis_mm = 200 mm", "at most 100"]);
}

#[test]
fn what_is_no_scene() {
    assert_refused(&FINGER.replace("coarse", "huge"), 5, &["geometry.density", "`medium`"]);
    assert_refused(&FINGER.replace("density", "dense"), 5, &["geometry.dense", "`density`"]);
    assert_refused(&FINGER.replace("= 1.0", "= 1.0 mm"), 8, &["expected"]);
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["solve", "none.toml", "--out", "out"]);
    assert_eq!(output.status.code(), Some(1));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.starts_with("error: cannot read none.toml: "), "{error}");
}

#[test]
fn a_mesh_that_is_not_there() {
    let text = "[geometry]\nkind = \"mesh\"\nfile = \"none.msh\"\nfixed = [\"base\"]\n\
                contact = \"skin\"\n[motion]\ndepth_mm = 1.0\n";
    assert_refused(text, 3, &["none.msh"]);
}

#[test]
fn a_good_scene_is_explained_without_being_solved() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("good.toml"), FINGER).unwrap();
    let output = run(folder.path(), &["explain", "good.toml", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let names = |list: &str, key: &str| -> Vec<String> {
        let of = |e: &serde_json::Value| e[key].as_str().unwrap().to_owned();
        said[list].as_array().unwrap().iter().map(of).collect()
    };
    assert_eq!(names("simulated", "effect"), ["finite_strain", "layers"]);
    assert!(names("left_out", "effect").contains(&"friction".into()));
    assert!(said["left_out"].as_array().unwrap().iter().all(|e| e["state"] == 0));
    assert!(said["forecast"]["seconds"]["total"].as_f64().unwrap() > 0.0);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is written");
}

/// The sharp bar would fail, the ball would not: the campaign is explained, and says so.
#[test]
fn a_campaign_says_before_it_is_solved_what_would_fail() {
    let indenter = |name: &str, shape: &str| {
        format!("[[indenters]]\nname = \"{name}\"\nindenter = {{ {shape} }}\n")
    };
    let campaign = |indenters: &[String]| {
        let head = "name = \"two\"\nseed = 1\npresses = 2\ntest_fraction = 0.5\n\
                    density = \"coarse\"\norder = \"graded\"\ndepths_mm = [0.3]\n\
                    effects = [\"finite_strain\", \"layers\"]\n[pose]\npitch_deg = [0.0, 1.0]\n\
                    roll_deg = [0.0, 1.0]\nyaw_deg = [0.0, 0.0]\n";
        format!("{head}{}", indenters.concat())
    };
    let sharp = indenter(
        "sharp",
        "shape = \"cylinder\", radius_mm = 0.005, length_mm = 8.0, end_radius_mm = 0.002",
    );
    let ball = indenter("ball", "shape = \"sphere\", radius_mm = 6.0");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("two.toml");
    std::fs::write(&file, campaign(&[sharp.clone(), ball])).unwrap();
    let output = run(folder.path(), &["explain", "two.toml", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(said["indenters"].as_array().unwrap().len(), 1);
    assert_eq!(
        (&said["refused"][0]["press"], &said["refused"][0]["indenter"]),
        (&0.into(), &"sharp".into())
    );
    assert!(
        said["refused"][0]["reason"].as_str().unwrap().contains("finer than the mesh"),
        "{said}"
    );
    let output = run(folder.path(), &["explain", "two.toml"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("will fail: indentation 0 (sharp)"), "{text}");

    std::fs::write(&file, campaign(&[sharp])).unwrap();
    let output = run(folder.path(), &["explain", "two.toml"]);
    assert!(!output.status.success(), "nothing of it can be solved");
}
