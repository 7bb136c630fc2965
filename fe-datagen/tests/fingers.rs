//! Fingers of one's own, through the real program: written, explained, fitted to a scan, pressed.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use papilla_contact::{Arrays, Header, finger_file_sha256};
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::geometry::fingertip::offset::at_uv;
use papilla_fingertip::scene::Finger;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fe-datagen"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap()
}

/// Runs it and gives back what it said.
fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {error}");
    String::from_utf8(output.stdout).unwrap()
}

fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {error}");
    error
}

/// A scan in OBJ: the default finger, bent, in a frame whose z goes from the hand to the tip.
fn scan(scale: f64) -> String {
    let shape = FingertipShape::default();
    let (rows, columns) = (50_usize, 64_usize);
    let mut text = String::new();
    for n in 0..=rows * columns {
        let (i, j) = if n == 0 { (0, 0) } else { ((n - 1) / columns + 1, (n - 1) % columns) };
        let uv = [j as f64 / columns as f64, 2.0 * i as f64 / rows as f64];
        let [x, y, z] = shape.skin(at_uv(uv));
        let [a, b, c] = [z - 0.002 * x * x, y + 0.003 * x * x, 40.0 - x].map(|v| scale * v);
        text += &format!("v {a} {b} {c}\n");
    }
    let corner = |i: usize, j: usize| if i == 0 { 1 } else { 2 + (i - 1) * columns + j % columns };
    for j in 0..columns {
        text += &format!("f {} {} {}\n", corner(0, 0), corner(1, j), corner(1, j + 1));
        for i in 1..rows {
            let (a, b) = (corner(i, j), corner(i + 1, j));
            let (c, d) = (corner(i + 1, j + 1), corner(i, j + 1));
            text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
    }
    text
}

const SCENE: &str = "[geometry]
kind = \"fingertip\"
density = \"coarse\"
order = \"linear\"
finger = \"mine\"
[motion]
depth_mm = 0.5
";

const SCAN: [&str; 12] = [
    "finger",
    "from-surface",
    "scan.obj",
    "--tip",
    "0,0,40",
    "--axis",
    "0,0,-1",
    "--nail",
    "1,0,0",
    "--unit",
    "mm",
    "--out",
];

#[test]
fn a_new_finger_is_written_once_explained_and_found_by_name() {
    let folder = tempfile::tempdir().unwrap();
    done(folder.path(), &["finger", "new", "--out", "fingers/mine"]);
    let e = refused(folder.path(), &["finger", "new", "--out", "fingers/mine"]);
    assert!(e.contains("is there already"), "{e}");
    let text = done(folder.path(), &["finger", "explain", "fingers/mine", "--json"]);
    let said: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(said["sha256"], Finger::usual().sha256());
    assert_eq!(said["numbers"].as_array().unwrap().len(), 19);
    assert!(said["scaled_jacobian_min"].as_f64().unwrap() > 0.1);
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    done(folder.path(), &["explain", "scene.toml"]);
    let file = folder.path().join("fingers/mine/finger.toml");
    let wide = std::fs::read_to_string(&file).unwrap().replace("width_mm = 17.44", "width_mm = 60");
    std::fs::write(&file, wide).unwrap();
    for command in [&["explain", "scene.toml"][..], &["finger", "explain", "fingers/mine"]] {
        let e = refused(folder.path(), command);
        assert!(e.contains("shape.width_mm = 60.0") && e.contains("7 to 32 mm"), "{e}");
    }
}

/// A contact model of four vertices that was made of a description with this hash.
fn contact_model(finger_file_sha256: &str) -> Vec<u8> {
    let positions_mm = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let normals = [0.0, 0.0, -1.0].repeat(4);
    let triangles = vec![0, 2, 1, 1, 2, 3];
    let arrays = Arrays::half_space(positions_mm, normals, vec![0.25; 4], triangles, 0.2);
    let finger_file_sha256 = finger_file_sha256.to_owned();
    let header = Header {
        vertices: 4,
        triangles: 2,
        share_max: 1.0,
        finger_file_sha256,
        ..Header::current()
    };
    arrays.to_bytes(&header).unwrap()
}

#[test]
fn explain_says_that_a_contact_model_is_of_other_numbers() {
    let folder = tempfile::tempdir().unwrap();
    done(folder.path(), &["finger", "new", "--out", "mine"]);
    let file = folder.path().join("mine/finger.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let contact = folder.path().join("mine/finger.contact");
    let explained = || {
        let said = done(folder.path(), &["finger", "explain", "mine", "--json"]);
        serde_json::from_str::<Value>(&said).unwrap()["contact_is_current"].clone()
    };
    assert_eq!(explained(), Value::Null);
    std::fs::write(&contact, contact_model("")).unwrap();
    assert_eq!(explained(), Value::Null);
    let sha256 = finger_file_sha256(&text, |_| None).unwrap();
    std::fs::write(&contact, contact_model(&sha256)).unwrap();
    assert_eq!(explained(), true);
    std::fs::write(&file, format!("# the same\n{text}")).unwrap();
    assert_eq!(explained(), true);
    std::fs::write(&file, text.replace("width_mm = 17.44", "width_mm = 18")).unwrap();
    assert_eq!(explained(), false);
    let said = done(folder.path(), &["finger", "explain", "mine"]);
    assert!(said.contains("finger.contact is out of date"), "{said}");
}

#[test]
fn an_atlas_is_built_of_the_finger_and_is_the_default_one_for_the_default_finger() {
    let folder = tempfile::tempdir().unwrap();
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models");
    let hash = |path: &Path| -> Value {
        let text = std::fs::read_to_string(path.join("atlas.json")).unwrap();
        serde_json::from_str::<Value>(&text).unwrap()["hash"].clone()
    };
    let build = |name: &str| {
        done(folder.path(), &["finger", "build", name, "--atlas-only"]);
        hash(&folder.path().join(name))
    };
    done(folder.path(), &["finger", "new", "--out", "same"]);
    assert_eq!(build("same"), hash(&models));
    std::fs::create_dir(folder.path().join("wide")).unwrap();
    std::fs::write(folder.path().join("wide/finger.toml"), "[shape]\nwidth_mm = 19.0\n").unwrap();
    assert_ne!(build("wide"), hash(&models));
}

/// Such a finger has no contact on pixels, which the networks for poses learn from: said before hours of
/// presses, not after.
#[test]
fn teaching_poses_to_skin_under_tension_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let mine = folder.path().join("mine");
    std::fs::create_dir(&mine).unwrap();
    let text = "[tissue]\nskin_tension_n_per_mm = 0.01\n";
    std::fs::write(mine.join("finger.toml"), text).unwrap();
    let error = refused(folder.path(), &["finger", "teach", "mine", "--presses", "5"]);
    assert!(error.contains("skin_tension_n_per_mm"), "{error}");
    assert!(error.contains("--without-contact --network small-maps"), "{error}");
    assert!(!mine.join("teach").exists());
}

#[test]
fn a_scan_that_is_refused_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scan.obj"), scan(1e-3)).unwrap();
    let names = || std::fs::read_dir(folder.path()).unwrap().count();
    let e = refused(folder.path(), &[&SCAN[..], &["mine"]].concat());
    assert!(e.contains("looks like metres") && e.contains("--unit m"), "{e}");
    assert_eq!(names(), 1);
    std::fs::write(folder.path().join("scan.obj"), scan(1.0)).unwrap();
    let e = refused(folder.path(), &[&SCAN[..], &["mine", "--length", "60"]].concat());
    assert!(e.contains("scan more of it"), "{e}");
    assert_eq!(names(), 1);
    let e = refused(folder.path(), &[&SCAN[..], &["mine", "--dermis", "thin.csv"]].concat());
    assert!(e.contains("thin.csv is no number of mm, and no file"), "{e}");
    assert_eq!(names(), 1);
    std::fs::create_dir(folder.path().join("mine")).unwrap();
    std::fs::write(folder.path().join("mine/notes.txt"), "keep me").unwrap();
    let e = refused(folder.path(), &[&SCAN[..], &["mine"]].concat());
    assert!(e.contains("is there already"), "{e}");
    assert_eq!(names(), 2);
}

#[test]
fn a_scan_becomes_a_finger_that_is_pressed() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scan.obj"), scan(1.0)).unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    let out = ["fingers/mine", "--who", "a test", "--licence", "none", "--json"];
    let text = done(folder.path(), &[&SCAN[..], &out].concat());
    let fit: Value = serde_json::from_str(&text).unwrap();
    assert!(fit["skin_rms_mm"].as_f64().unwrap() < 0.03, "{fit}");
    assert!(fit["offset_mm_max"].as_f64().unwrap() > 0.05, "the scan is bent: {fit}");
    // With a map of the dermis, from a file.
    let line = format!("0.8{}\n", ", 0.8".repeat(23));
    std::fs::write(folder.path().join("dermis.csv"), line.repeat(17)).unwrap();
    let mapped = ["mapped", "--dermis", "dermis.csv", "--epidermis", "0.3"];
    done(folder.path(), &[&SCAN[..], &mapped].concat());
    let shape = Finger::read(&folder.path().join("mapped")).unwrap().shape;
    assert_eq!((shape.epidermis_mm, shape.dermis_map.is_some()), (0.3, true));
    assert!((shape.dermis_mm - 0.8).abs() < 1e-12, "{}", shape.dermis_mm);
    let mine = folder.path().join("fingers/mine");
    let finger = Finger::read(&mine).unwrap();
    assert_eq!(fit["finger_sha256"], finger.sha256());
    assert_eq!(finger.source.file, "scan.obj");
    let read = |name: &str| std::fs::read(mine.join(name)).unwrap();
    assert!(read("fit.png").starts_with(b"\x89PNG"));
    // The same scan gives the same bytes.
    let again = ["again", "--who", "a test", "--licence", "none"];
    done(folder.path(), &[&SCAN[..], &again].concat());
    for name in ["finger.toml", "skin.json", "fit.json", "fit.png"] {
        let other = std::fs::read(folder.path().join("again").join(name)).unwrap();
        assert_eq!(read(name), other, "{name}");
    }
    done(folder.path(), &["finger", "build", "fingers/mine", "--atlas-only"]);
    // The exit code says whether the state passed its own checks.
    done(folder.path(), &["solve", "scene.toml", "--out", "out"]);
    let text = std::fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&text).unwrap();
    let state = &summary["increments"][0];
    assert!(state["checks"]["energy_vs_work"].as_f64().unwrap().abs() < 0.005, "{state}");
    let force: f64 = state["force_n"][2].as_f64().unwrap().abs();
    assert!((0.05..0.5).contains(&force), "{force}");
    // Maps are on the finger's own atlas; the one of the bundle is of the density of datasets.
    assert!(!read("atlas.json").is_empty());
    let own = ["--density", "coarse", "--finger", "mine", "--out", "coarse"];
    done(folder.path(), &[&["atlas"], &own[..]].concat());
    let text = std::fs::read_to_string(folder.path().join("coarse/atlas.json")).unwrap();
    let atlas: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(summary["atlas_hash"], atlas["hash"]);
}
