//! What is done with files from outside, and what must hold of it whatever is in them.
//!
//! The fuzz targets (`tests/fuzz/run`) and `tests/tests/fuzz.rs` run the same functions.

use std::path::Path;

use papilla_fem::element::BlockGeometry;
use papilla_fem::mesh::complete::for_contact;
use papilla_fem::mesh::gmsh;
use papilla_fingertip::scene::Scene;
use papilla_fingertip::tissue::Tissue;

/// A scene file: refused with words, or it can be written again and is the same scene.
pub(crate) fn scene(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let path = Path::new("fuzz.toml");
    let scene = match Scene::parse(path, text.to_owned()) {
        Ok(scene) => scene,
        Err(error) => {
            assert!(error.to_string().len() > 10, "{error}");
            return;
        }
    };
    let again = toml::to_string(&scene).expect("what was read can be written");
    let same = Scene::parse(path, again).expect("what was written can be read");
    assert_eq!(Scene { origin: scene.origin.clone(), ..same }, scene);
}

/// A mesh file: refused with words, or a mesh whose every index is inside and whose elements are
/// measured or refused.
pub(crate) fn msh(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let mesh = match gmsh::read(&text, &Tissue::ALL.map(Tissue::name)) {
        Ok(mesh) => mesh,
        Err(error) => {
            assert!(error.to_string().len() > 10, "{error}");
            return;
        }
    };
    let mesh = for_contact(mesh, "contact");
    let nodes = mesh.nodes.len();
    assert!(mesh.nodes.iter().flatten().all(|x| x.is_finite()), "a node is nowhere");
    for block in &mesh.blocks {
        assert!(block.connectivity.iter().all(|&n| (n as usize) < nodes));
        if let Ok(geometry) = BlockGeometry::new(block.kind, &mesh.nodes, &block.connectivity) {
            for e in 0..block.len() {
                assert!(geometry.element(e).weights.iter().all(|w| *w > 0.0), "element {e}");
            }
        }
    }
    for surface in mesh.surfaces.values() {
        assert!(surface.connectivity.iter().all(|&n| (n as usize) < nodes));
    }
}
