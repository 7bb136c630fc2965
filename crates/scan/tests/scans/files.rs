//! Every kind of file holds the same surface.

use crate::surfaces::skin;
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_scan::{Surface, Unit, read};
use std::path::Path;

fn small() -> Surface {
    let mut surface = skin(&FingertipShape::default(), [8, 10]);
    // As the files hold it.
    surface.vertices_mm.iter_mut().for_each(|p| *p = p.map(|v| f64::from(v as f32)));
    surface
}

fn obj(s: &Surface) -> String {
    let corners = s.vertices_mm.iter().map(|p| format!("v {} {} {}\n", p[0], p[1], p[2]));
    let faces = s.triangles.iter().map(|t| {
        let [a, b, c] = t.map(|c| c + 1);
        format!("f {a} {b} {c}\n")
    });
    corners.chain(faces).collect()
}

fn ply(s: &Surface) -> String {
    let head = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        s.vertices_mm.len(),
        s.triangles.len()
    );
    let corners = s.vertices_mm.iter().map(|p| format!("{} {} {}\n", p[0], p[1], p[2]));
    let faces = s.triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n"));
    std::iter::once(head).chain(corners).chain(faces).collect()
}

fn stl(s: &Surface) -> String {
    let mut text = String::from("solid finger\n");
    for t in &s.triangles {
        text += "facet normal 0 0 1\nouter loop\n";
        for p in t.map(|c| s.vertices_mm[c as usize]) {
            text += &format!("vertex {} {} {}\n", p[0], p[1], p[2]);
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid finger\n"
}

/// In metres, moved back by a node.
fn glb(s: &Surface) -> Vec<u8> {
    let mut binary: Vec<u8> = Vec::new();
    for p in &s.vertices_mm {
        let [x, y, z] = *p;
        for v in [x - 1.0, y, z] {
            binary.extend(((1e-3 * v) as f32).to_le_bytes());
        }
    }
    let corners = binary.len();
    binary.extend(s.triangles.iter().flatten().flat_map(|c| c.to_le_bytes()));
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
        "nodes":[{{"translation":[0.001,0,0],"children":[1]}},{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3"}},
        {{"bufferView":1,"componentType":5125,"count":{},"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{corners}}},{{"buffer":0,"byteOffset":{corners},"byteLength":{}}}],
        "buffers":[{{"byteLength":{}}}]}}"#,
        s.vertices_mm.len(),
        3 * s.triangles.len(),
        binary.len() - corners,
        binary.len()
    );
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + json.len() + 8 + binary.len();
    let mut out = Vec::new();
    for word in [0x4654_6C67, 2, total as u32, json.len() as u32, 0x4E4F_534A] {
        out.extend(u32::to_le_bytes(word));
    }
    out.extend(json);
    for word in [binary.len() as u32, 0x004E_4942] {
        out.extend(u32::to_le_bytes(word));
    }
    out.extend(binary);
    out
}

/// Corners of triangles in their order, whatever their numbers.
fn soup(s: &Surface) -> Vec<[f64; 3]> {
    s.triangles.iter().flatten().map(|&c| s.vertices_mm[c as usize]).collect()
}

fn assert_same(found: &Surface, due: &Surface, kind: &str) {
    let (found, due) = (soup(found), soup(due));
    assert_eq!(found.len(), due.len(), "{kind}");
    for (p, q) in found.iter().zip(&due) {
        assert!((0..3).all(|i| (p[i] - q[i]).abs() < 1e-5), "{kind}: {p:?} {q:?}");
    }
}

fn read_as(name: &str, bytes: &[u8], unit: Unit) -> Result<Surface, papilla_scan::ScanError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    read::surface(&path, unit)
}

#[test]
fn every_kind_of_file_holds_the_same_surface() {
    let due = small();
    for (name, bytes, unit) in [
        ("a.stl", stl(&due).into_bytes(), Unit::Millimetre),
        ("a.OBJ", obj(&due).into_bytes(), Unit::Millimetre),
        ("a.ply", ply(&due).into_bytes(), Unit::Millimetre),
        ("a.glb", glb(&due), Unit::Metre),
    ] {
        assert_same(&read_as(name, &bytes, unit).unwrap_or_else(|e| panic!("{e}")), &due, name);
    }
}

#[test]
fn another_unit_is_named() {
    let metres =
        |text: &str, unit| read_as("a.obj", text.as_bytes(), unit).unwrap_err().to_string();
    let scaled = |by: f64| {
        let mut s = small();
        s.vertices_mm.iter_mut().for_each(|p| *p = p.map(|v| by * v));
        obj(&s)
    };
    let e = metres(&scaled(1e-3), Unit::Millimetre);
    assert!(e.contains("looks like metres") && e.contains("--unit m"), "{e}");
    let e = metres(&scaled(0.1), Unit::Millimetre);
    assert!(e.contains("centimetres or inches") && e.contains("--unit cm"), "{e}");
    let e = metres(&scaled(1.0), Unit::Metre);
    assert!(e.contains("looks like millimetres") && e.contains("--unit mm"), "{e}");
    let e = metres(&scaled(1e9), Unit::Millimetre);
    assert!(e.contains("in any unit"), "{e}");
}

#[test]
fn what_is_no_surface_is_refused() {
    let refused =
        |name: &str, bytes: &[u8]| read_as(name, bytes, Unit::Millimetre).unwrap_err().to_string();
    let e = refused("a.txt", b"");
    assert!(e.contains(".stl, .obj, .ply or .glb"), "{e}");
    for name in ["a.stl", "a.ply", "a.glb"] {
        let e = refused(name, b"nonsense");
        assert!(e.contains(name), "{e}");
    }
    assert!(refused("a.obj", b"v 0 0 0\nv 10 0 0\nv 0 20 0\n").contains("no triangles"));
    let e = refused("a.ply", ply(&small()).replace("3 0 2 1", "3 0 2 9999").as_bytes());
    assert!(e.contains("names a corner that is not there"), "{e}");
    // A GLB that is cut off anywhere is refused, or is still whole.
    let whole = glb(&small());
    for length in (0..whole.len()).step_by(97) {
        drop(read_as("a.glb", &whole[..length], Unit::Metre));
    }
    let missing = read::surface(Path::new("/nowhere/a.stl"), Unit::Millimetre).unwrap_err();
    assert!(missing.to_string().contains("cannot read"), "{missing}");
}
