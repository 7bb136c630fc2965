//! The scenes in `scenes/`, the examples in docs/reference/scenes.md and the JSON schema are
//! those that this program reads.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::unwrap_used)]

use ndarray::Array2;
use ndarray_npy::NpzWriter;
use papilla_fingertip::scene::{Scene, schema};
use std::fs::File;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn every_scene_is_read() {
    let files = std::fs::read_dir(root().join("scenes")).unwrap();
    let scenes =
        files.map(|f| f.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "toml"));
    let mut read = 0;
    for path in scenes {
        Scene::read(&path).unwrap_or_else(|e| panic!("{e}"));
        read += 1;
    }
    assert!(read >= 3);
}

/// What an example that shows only some tables leaves out.
const REST: &str =
    "[geometry]\nkind = \"fingertip\"\ndensity = \"coarse\"\n[motion]\ndepth_mm = 1.0\n";

/// A tetrahedron as an STL file, with edges of 10 and 14 mm if its unit is the metre.
const TETRAHEDRON: &str = "solid part
facet normal 0 0 -1
outer loop
vertex 0 0 0
vertex 0 0.01 0
vertex 0.01 0 0
endloop
endfacet
facet normal 0 -1 0
outer loop
vertex 0 0 0
vertex 0.01 0 0
vertex 0 0 0.01
endloop
endfacet
facet normal -1 0 0
outer loop
vertex 0 0 0
vertex 0 0 0.01
vertex 0 0.01 0
endloop
endfacet
facet normal 1 1 1
outer loop
vertex 0.01 0 0
vertex 0 0.01 0
vertex 0 0 0.01
endloop
endfacet
endsolid part
";

/// Puts what `whole` has and the example lacks into the example, table by table.
fn complete(example: &mut Table, whole: &Table) {
    let presses = example.contains_key("pressure");
    for (key, value) in whole.iter().filter(|(key, _)| !(presses && *key == "motion")) {
        match (example.get_mut(key), value) {
            (None, _) => drop(example.insert(key.clone(), value.clone())),
            (Some(Value::Table(own)), Value::Table(other))
                if key == "geometry" && !own.contains_key("kind") =>
            {
                complete(own, other);
            }
            (Some(Value::Table(own)), Value::Table(_)) => {
                let says = ["depth_mm", "force_n", "path"].iter().any(|k| own.contains_key(*k));
                if !says && key == "motion" {
                    own.insert("depth_mm".into(), Value::Float(1.0));
                }
            }
            _ => {}
        }
    }
}

#[test]
fn every_example_in_the_documentation_is_a_scene() {
    let read =
        |name: &str| std::fs::read_to_string(root().join("docs/reference").join(name)).unwrap();
    let text = read("scenes.md") + &read("indenters.md");
    let rest: Table = toml::from_str(REST).unwrap();
    // The examples name files, relative to the scene: those of `scenes`, a body and a pressure of their own.
    let folder = tempfile::tempdir().unwrap();
    let mesh = "two-layer.msh";
    std::fs::copy(root().join("scenes").join(mesh), folder.path().join(mesh)).unwrap();
    std::fs::write(folder.path().join("part.stl"), TETRAHEDRON).unwrap();
    let mut measured = NpzWriter::new(File::create(folder.path().join("measured.npz")).unwrap());
    measured.add_array("pressure_pa", &Array2::from_elem([224, 224], 5e3f32)).unwrap();
    measured.finish().unwrap();
    let path = folder.path().join("example.toml");
    let mut seen = 0;
    for block in text.split("```toml\n").skip(1) {
        let example = block.split("```").next().unwrap();
        let mut table: Table = toml::from_str(example).unwrap_or_else(|e| panic!("{e}\n{example}"));
        complete(&mut table, &rest);
        let whole = toml::to_string(&table).unwrap();
        Scene::parse(&path, whole).unwrap_or_else(|e| panic!("{e}\nin the example\n{example}"));
        seen += 1;
    }
    assert!(seen >= 12, "{seen} examples");
}

#[test]
fn the_committed_schema_is_up_to_date() {
    let path = root().join("docs/reference/scene.schema.json");
    let committed = std::fs::read_to_string(&path).unwrap();
    let now = serde_json::to_string_pretty(&schema()).unwrap() + "\n";
    let cure = "fe-datagen schema scene > docs/reference/scene.schema.json";
    assert!(committed == now, "{} is out of date: {cure}", path.display());
}
