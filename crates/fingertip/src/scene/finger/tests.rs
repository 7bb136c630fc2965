use super::*;
use crate::geometry::fingertip::offset::{COLUMNS, ROWS};
use crate::scene::{MaterialSet, Scene};

fn parse(text: &str) -> Result<Finger, FingerError> {
    Finger::parse(Path::new("mine/finger.toml"), text.into())
}

fn assert_refused(text: &str, line: usize, words: &[&str]) {
    let error = parse(text).unwrap_err().to_string();
    for word in words {
        assert!(error.contains(word), "'{error}' should say '{word}'");
    }
    let at = format!("mine/finger.toml:{line}:");
    assert!(error.starts_with(&at), "'{error}' should start with {at}");
}

#[test]
fn an_empty_file_is_the_usual_finger() {
    let finger = parse("").unwrap();
    assert_eq!(finger, Finger::usual());
}

#[test]
fn the_shipped_finger_is_the_usual_one_to_the_bit() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let shipped = Finger::read(&root.join("models")).unwrap();
    assert_eq!(shipped.shape, FingertipShape::default());
    assert_eq!(shipped.tissue, TissueTable::default());
    assert_eq!(shipped.sha256(), Finger::usual().sha256());
}

#[test]
fn what_is_written_is_read_as_the_same() {
    let mut finger = Finger::usual();
    finger.shape.width_mm = 19.123_456_789_012_34;
    finger.shape.bone_tuft_mm = [6.5, 3.25];
    finger.tissue = MaterialSet::People.table();
    finger.tissue.dermis.youngs_modulus_mpa = 0.123;
    finger.tissue.skin_tension_n_per_mm = Some(0.0123);
    finger.source.who = "a \"name\" with\nlines".into();
    let text = finger.to_toml();
    assert!(text.contains("set = \"people\""), "{text}");
    assert_eq!(parse(&text).unwrap(), finger);
    // Of the constants it is said which effects they were fitted with, where the set does not say so.
    let mut fitted = Finger::usual();
    fitted.tissue.needs = MaterialSet::People.table().needs;
    assert!(fitted.to_toml().contains("needs = [\"hyperelastic\"]"));
    assert_eq!(parse(&fitted.to_toml()).unwrap(), fitted);
    assert_ne!(fitted.sha256(), Finger::usual().sha256());
    assert!(!Finger::usual().to_toml().contains("needs"));
    // Every number says its default and its range.
    assert_eq!(text.matches(", default ").count(), FIELDS.len());
}

#[test]
fn tension_of_the_skin_changes_the_hash_where_there_is_some() {
    let with = |tension: &str| {
        parse(&format!("[tissue]\nskin_tension_n_per_mm = {tension}\n")).unwrap().sha256()
    };
    assert_eq!(with("0.0"), Finger::usual().sha256());
    assert_ne!(with("0.01"), Finger::usual().sha256());
    assert_refused(
        "[tissue]\nskin_tension_n_per_mm = -0.1\n",
        2,
        &["tissue.skin_tension_n_per_mm = -0.1"],
    );
}

#[test]
fn every_number_is_a_field_of_the_shape_and_has_a_range_round_its_default() {
    let table = toml::Table::try_from(FingertipShape::default()).unwrap();
    assert_eq!(table.len(), FIELDS.len());
    for field in &FIELDS {
        let value = &table[field.shape];
        let own = value.as_array().map_or(1, Vec::len);
        let values = field.values(&FingertipShape::default());
        assert_eq!(values.len(), own, "{}", field.shape);
        assert_eq!(value.as_float().unwrap_or(values[0]), values[0], "{}", field.shape);
        assert!(values.iter().all(|v| field.range[0] < *v && *v < field.range[1]));
    }
}

#[test]
fn bad_numbers_are_named_with_their_line() {
    assert_refused("[shape]\nwidth_mm = 50.0\n", 2, &["shape.width_mm = 50", "7 to 32 mm"]);
    assert_refused("[shape]\nwidth_mm = 0.017\n", 2, &["was m meant"]);
    assert_refused("[layers]\n\ndermis_mm = nan\n", 3, &["layers.dermis_mm", "0.2 to 3 mm"]);
    assert_refused("[bone]\ntuft_mm = [7.5, 30.0]\n", 2, &["bone.tuft_mm = 30"]);
    assert_refused("[bone]\ntuft_mm = [7.5]\n", 2, &["bone.tuft_mm", "length 1"]);
    assert_refused("[shape]\nbreadth = 1.0\n", 2, &["unknown field `breadth`"]);
    assert_refused("[bones]\n", 1, &["unknown field `bones`"]);
    assert_refused(
        "[tissue.dermis]\nyoungs_modulus_mpa = 80.0\npoissons_ratio = 0.4\n",
        2,
        &["tissue.dermis", "80"],
    );
    let long = "[shape]\nlength_mm = 12.0\ncap_length_mm = 13.0\n";
    assert_refused(long, 3, &["cap_length_mm must be below length_mm"]);
}

#[test]
fn a_bone_outside_of_the_skin_is_named_with_its_place() {
    let e = parse("[bone]\nbase_mm = [19.0, 6.5]\n").unwrap_err().to_string();
    assert!(e.contains("mine/finger.toml: the bone is only") && e.contains("y = "), "{e}");
}

#[test]
fn layers_thicker_than_the_pulp_are_named_with_their_place() {
    let e = "[layers]\nepidermis_mm = 1.5\ndermis_mm = 3.0\n[bone]\noffset_mm = 0.5\n";
    assert_refused(e, 3, &["4.50 mm thick", "above the bone at x = 11.25", "they may take"]);
}

/// A file with a map of the dermis.
fn mapped(mm: impl Fn(usize, usize) -> f64) -> String {
    let row = |i| (0..COLUMNS).map(|j| mm(i, j)).collect::<Vec<f64>>();
    let rows: String = (0..ROWS).map(|i| format!("  {:?},\n", row(i))).collect();
    format!("[layers]\ndermis_mm = [\n{rows}]\n")
}

#[test]
fn a_layer_may_be_a_map() {
    let finger = parse(&mapped(|i, j| 0.9 + 0.01 * i as f64 + 0.001 * j as f64)).unwrap();
    assert_eq!(parse(&finger.to_toml()).unwrap(), finger);
    assert_ne!(finger.sha256(), Finger::usual().sha256());
    // In the middle of the pad: row 8, column 0, smoothed with its neighbours round the finger.
    assert!((finger.shape.dermis_mm - 0.984).abs() < 2e-3, "{}", finger.shape.dermis_mm);
    let other = parse(&mapped(|i, j| 0.9 + 0.01 * i as f64 + 0.002 * j as f64)).unwrap();
    assert_ne!(finger.sha256(), other.sha256());
    let thick = mapped(|i, j| if (i, j) == (8, 5) { 3.5 } else { 1.0 });
    assert_refused(&thick, 2, &["layers.dermis_mm[8][5] = 3.5", "0.2 to 3 mm"]);
    assert_refused("[layers]\ndermis_mm = [[1.0]]\n", 2, &["layers.dermis_mm", "17 rows", "has 1"]);
    assert_refused("[layers]\ndermis_mm = \"thin\"\n", 2, &["layers.dermis_mm", "or a map"]);
    assert_refused(&mapped(|_, _| 2.9), 2, &["3.10 mm thick", "they may take"]);
}

#[test]
fn a_skin_is_read_from_beside_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(FINGER_FILE);
    std::fs::write(&path, "[shape]\nskin = \"skin.json\"\n").unwrap();
    let e = Finger::read(folder.path()).unwrap_err().to_string();
    assert!(e.contains("cannot read") && e.contains("skin.json"), "{e}");
    let skin = SkinOffset { format: 1, offset_mm: vec![vec![0.25; COLUMNS]; ROWS] };
    let write = |text: &str| std::fs::write(folder.path().join(SKIN_FILE), text).unwrap();
    write(&serde_json::to_string(&skin).unwrap());
    let finger = Finger::read(folder.path()).unwrap();
    assert_eq!(finger.shape.offset.as_deref(), Some(&skin));
    assert_ne!(finger.sha256(), Finger::usual().sha256());
    // A constant offset is a finger that much thicker.
    let pad = crate::geometry::fingertip::SurfaceParameter::Body([0.0, -1.0], 0.0);
    let p = finger.shape.skin(pad);
    assert!((p[2] + 6.53 + 0.25).abs() < 1e-9, "{p:?}");
    write("{\"format\": 1, \"offset_mm\": [[0.0]]}");
    let e = Finger::read(folder.path()).unwrap_err().to_string();
    assert!(e.contains("finger.toml:2:") && e.contains("17 lists of 24"), "{e}");
}

#[test]
fn a_scene_takes_a_finger_by_path_or_name() {
    let folder = tempfile::tempdir().unwrap();
    let mine = folder.path().join("fingers/mine");
    std::fs::create_dir_all(&mine).unwrap();
    let text = "[shape]\nwidth_mm = 19.0\n[tissue]\nset = \"people\"\n";
    std::fs::write(mine.join(FINGER_FILE), text).unwrap();
    let scene = |geometry: &str, more: &str| {
        let text = format!(
            "[geometry]\nkind = \"fingertip\"\n{geometry}\n[motion]\ndepth_mm = 1.0\n{more}"
        );
        Scene::parse(&folder.path().join("scene.toml"), text)
    };
    for name in ["mine", "fingers/mine", "fingers/mine/finger.toml"] {
        let found = scene(&format!("finger = \"{name}\""), "").unwrap();
        let crate::scene::Geometry::Fingertip { shape, .. } = &found.geometry else { panic!() };
        assert_eq!(shape.width_mm, 19.0);
        assert_eq!(found.materials, MaterialSet::People.table());
    }
    let own = scene("finger = \"mine\"", "[materials]\nset = \"papers\"\n").unwrap();
    assert_eq!(own.materials, TissueTable::default());
    let e = scene("finger = \"yours\"", "").unwrap_err().to_string();
    assert!(e.contains("scene.toml:3:") && e.contains("there is no finger 'yours'"), "{e}");
    assert!(e.contains("fingers/yours/finger.toml") && e.contains("finger new"), "{e}");
    let e = scene("finger = \"mine\"\nshape = { width_mm = 18.0 }", "").unwrap_err().to_string();
    assert!(e.contains("geometry.shape") && e.contains("one of the two"), "{e}");
    std::fs::write(mine.join(FINGER_FILE), "[shape]\nwidth_mm = 190.0\n").unwrap();
    let e = scene("finger = \"mine\"", "").unwrap_err().to_string();
    assert!(e.contains("finger.toml:2:") && e.contains("7 to 32 mm"), "{e}");
}
