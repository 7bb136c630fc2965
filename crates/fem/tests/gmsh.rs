//! Meshes written by Gmsh 4.15, read back, and what is wrong with bad ones.

// clippy.toml allows it in tests; helpers outside of test functions are tests too.
#![allow(clippy::float_cmp, clippy::unwrap_used)]

use papilla_fem::element::{BlockGeometry, ElementKind};
use papilla_fem::mesh::complete::for_contact;
use papilla_fem::mesh::gmsh::{self, GmshError};
use papilla_fem::mesh::{FaceKind, Mesh, Region};
use std::path::{Path, PathBuf};

/// Regions of the files.
const NAMES: [&str; 5] = ["epidermis", "dermis", "subcutaneous", "nail", "bone"];
const EPIDERMIS: Region = Region(0);
const DERMIS: Region = Region(1);

fn read(text: &str) -> Result<Mesh, GmshError> {
    gmsh::read(text, &NAMES)
}

fn read_file(path: &Path) -> Result<Mesh, GmshError> {
    gmsh::read_file(path, &NAMES)
}

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn mesh(name: &str) -> Mesh {
    read_file(&path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn text(name: &str) -> String {
    std::fs::read_to_string(path(name)).unwrap()
}

/// As editors on Windows write it.
#[test]
fn a_byte_order_mark_is_passed_over_and_utf_16_is_named() {
    let plain = text("ball_tet4.msh");
    let file = std::env::temp_dir().join(format!("papilla-{}.msh", std::process::id()));
    std::fs::write(&file, format!("\u{feff}{plain}")).unwrap();
    assert_eq!(read_file(&file).unwrap().nodes.len(), mesh("ball_tet4.msh").nodes.len());
    let wide: Vec<u8> = plain.encode_utf16().flat_map(u16::to_le_bytes).collect();
    std::fs::write(&file, wide).unwrap();
    let error = read_file(&file).unwrap_err().to_string();
    std::fs::remove_file(&file).unwrap();
    assert!(error.contains("UTF-16"), "{error}");
}

fn volume(mesh: &Mesh) -> f64 {
    let mut total = 0.0;
    for b in &mesh.blocks {
        let g = BlockGeometry::new(b.kind, &mesh.nodes, &b.connectivity).unwrap();
        total += (0..b.len()).map(|e| g.element(e).weights.iter().sum::<f64>()).sum::<f64>();
    }
    total
}

/// Area vector and enclosed volume (divergence theorem) of a surface.
fn area_vector(mesh: &Mesh, name: &str) -> ([f64; 3], f64) {
    let surface = &mesh.surfaces[name];
    let (mut total, mut flux) = ([0.0; 3], 0.0);
    let at = |n: u32| mesh.nodes[n as usize];
    surface.integrate(&surface.kind.quadrature(), &at, &mut |face, value, area| {
        for i in 0..3 {
            total[i] += area[i];
            let x: f64 = face.iter().zip(value).map(|(&n, v)| v * at(n)[i]).sum();
            flux += x * area[i] / 3.0;
        }
    });
    (total, flux)
}

#[test]
fn a_layered_block_has_its_tissues_and_outward_surfaces() {
    for (name, kind, face) in [
        ("block_hex8.msh", ElementKind::Hex8, FaceKind::Quad4),
        ("block_hex27.msh", ElementKind::Hex27, FaceKind::Quad9),
    ] {
        let m = mesh(name);
        assert_eq!(m.blocks.len(), 1, "{name}");
        let b = &m.blocks[0];
        assert_eq!((b.kind, b.len()), (kind, 4), "{name}");
        let dermis = b.region.iter().filter(|t| **t == DERMIS).count();
        let epidermis = b.region.iter().filter(|t| **t == EPIDERMIS).count();
        assert_eq!((dermis, epidermis), (2, 2), "{name}");
        assert!((volume(&m) - 2.0).abs() < 1e-12, "{name}");
        // The interface looks away from the deeper tissue, the dermis.
        for (surface, z) in [("fixed", -2.0), ("contact", 2.0), ("interface", 2.0)] {
            assert_eq!(m.surfaces[surface].kind, face, "{name}");
            let (a, _) = area_vector(&m, surface);
            assert!(a[0].abs() + a[1].abs() < 1e-12 && (a[2] - z).abs() < 1e-12, "{name} {a:?}");
            assert_eq!(m.node_sets[surface], m.surfaces[surface].nodes(), "{name}");
        }
    }
}

/// Every node of a straight-sided element lies where its place in our node
/// order says.
#[test]
fn nodes_of_a_straight_hex27_are_in_our_order() {
    let m = mesh("block_hex27.msh");
    let b = &m.blocks[0];
    for e in 0..b.len() {
        let nodes = b.element(e);
        let (mut value, mut gradient) = (vec![0.0; 8], vec![[0.0; 3]; 8]);
        for (a, &n) in nodes.iter().enumerate() {
            ElementKind::Hex8.shape(b.kind.node_xi(a), &mut value, &mut gradient);
            for i in 0..3 {
                let x: f64 =
                    nodes.iter().zip(&value).map(|(&c, v)| v * m.nodes[c as usize][i]).sum();
                assert!((x - m.nodes[n as usize][i]).abs() < 1e-12, "element {e} node {a}");
            }
        }
    }
}

#[test]
fn a_curved_sector_keeps_its_volume_and_area() {
    // Four quadratic elements over 90 degrees between radii 1 and 2, 0.5 high.
    let pi = std::f64::consts::PI;
    for (name, kind, face) in [
        ("sector_hex27.msh", ElementKind::Hex27, FaceKind::Quad9),
        ("sector_hex20.msh", ElementKind::Hex20, FaceKind::Quad8),
    ] {
        let m = mesh(name);
        assert_eq!((m.blocks[0].kind, m.surfaces["contact"].kind), (kind, face), "{name}");
        let exact = 0.25 * pi * (4.0 - 1.0) * 0.5;
        assert!((volume(&m) / exact - 1.0).abs() < 1e-3, "{name}: {} {exact}", volume(&m));
        let (a, _) = area_vector(&m, "contact");
        // The quarter cylinder of radius 2 projects to 2 x 0.5 along x and y.
        assert!((a[0] - 1.0).abs() < 1e-9 && (a[1] - 1.0).abs() < 1e-9, "{name}: {a:?}");
        let (a, _) = area_vector(&m, "fixed");
        assert!(a[2] < -2.3, "{name}: {a:?}");
    }
}

/// 20-node hexahedra completed for contact are those that Gmsh writes with 27.
#[test]
fn completed_hexahedra_have_the_nodes_of_whole_ones() {
    let m = for_contact(mesh("sector_hex20.msh"), "contact");
    let twin = mesh("sector_hex27.msh");
    assert_eq!(m.blocks[0].kind, ElementKind::Hex27);
    assert_eq!(m.surfaces["contact"].kind, FaceKind::Quad9);
    assert_eq!(m.nodes.len(), twin.nodes.len());
    assert!((volume(&m) / volume(&twin) - 1.0).abs() < 1e-3);
    for (name, set) in &twin.node_sets {
        assert_eq!(m.node_sets[name].len(), set.len(), "{name}");
    }
}

/// A quarter ring of two tissues without volumes is plane strain; its outer half
/// is numbered clockwise in the file.
#[test]
fn a_planar_ring_has_its_tissues_and_edges_that_look_outward() {
    let pi = std::f64::consts::PI;
    for (name, kind, face) in [
        ("ring_quad4.msh", ElementKind::Quad4, FaceKind::Line2),
        ("ring_quad8.msh", ElementKind::Quad8, FaceKind::Line3),
        ("ring_quad9.msh", ElementKind::Quad9, FaceKind::Line3),
    ] {
        let m = mesh(name);
        assert!(m.is_planar());
        let b = &m.blocks[0];
        assert_eq!((b.kind, b.len()), (kind, 6), "{name}");
        let dermis = b.region.iter().filter(|t| **t == DERMIS).count();
        assert_eq!(dermis, 3, "{name}");
        // Three straight chords a quarter circle, or three parabolas.
        let sector: f64 = 0.5 * (pi / 6.0).sin();
        let exact = if kind == ElementKind::Quad4 { 9.0 * sector } else { 0.25 * pi * 3.0 };
        assert!((volume(&m) / exact - 1.0).abs() < 1e-3, "{name}: {}", volume(&m));
        for (surface, radius) in [("fixed", -1.0), ("contact", 2.0), ("interface", 1.5)] {
            assert_eq!(m.surfaces[surface].kind, face, "{name}");
            let (a, _) = area_vector(&m, surface);
            // A chord of the whole arc, turned: outward from the ring, on the
            // interface away from the dermis.
            let good = (a[0] - radius).abs() + (a[1] - radius).abs() < 1e-9 && a[2] == 0.0;
            assert!(good, "{name} {surface} {a:?}");
            assert_eq!(m.node_sets[surface], m.surfaces[surface].nodes(), "{name}");
        }
        let [corner] = m.node_sets["corner"][..] else { panic!("{name}: one corner") };
        assert_eq!(m.nodes[corner as usize], [2.0, 0.0, 0.0]);
    }
}

#[test]
fn what_is_not_plane_strain_is_refused() {
    use GmshError as E;
    let good = text("ring_quad4.msh");
    let bent = good.replacen("\n2 0 0\n", "\n2 0 0.01\n", 1);
    assert_ne!(bent, good);
    assert!(matches!(read(&bent), Err(E::NotFlat { z_mm, .. }) if z_mm == 0.01));
    let rounded = good.replacen("\n2 0 0\n", "\n2 0 1e-17\n", 1);
    assert!(read(&rounded).unwrap().nodes.iter().all(|x| x[2] == 0.0));
    // The surface elements of a body whose volumes were not meshed.
    let ball = text("ball_tet4.msh").replace("3 1 \"subcutaneous\"", "2 1 \"dermis\"");
    let start = ball.find("$Elements").unwrap();
    let triangle =
        format!("{}$Elements\n1 1 1 1\n2 1 2 1\n1 1 2 3\n$EndElements\n", &ball[..start]);
    assert!(matches!(read(&triangle), Err(E::UnsupportedPlanarElement { element_type: 2, .. })));
}

#[test]
fn the_surface_of_a_ball_encloses_its_elements() {
    for (name, kind) in
        [("ball_tet4.msh", ElementKind::Tet4), ("ball_tet10.msh", ElementKind::Tet10)]
    {
        let m = mesh(name);
        assert_eq!(m.blocks[0].kind, kind);
        let (total, enclosed) = area_vector(&m, "contact");
        assert!(total.iter().all(|v| v.abs() < 1e-6), "{name}: closed surface {total:?}");
        // Four-point quadrature of a curved tetrahedron's volume is not exact.
        assert!((volume(&m) / enclosed - 1.0).abs() < 5e-3, "{name}: {} {enclosed}", volume(&m));
    }
    let exact = 4.0 / 3.0 * std::f64::consts::PI;
    let (_, curved) = area_vector(&mesh("ball_tet10.msh"), "contact");
    assert!((curved / exact - 1.0).abs() < 0.02, "{curved} {exact}");
}

/// One hexahedron with its physical volume and top, to be spoilt.
const CUBE: &str = "$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
2 2 \"contact\"
3 1 \"dermis\"
$EndPhysicalNames
$Entities
0 0 1 1
1 0 0 1 1 1 1 1 2 0
1 0 0 0 1 1 1 1 1 0
$EndEntities
$Nodes
1 8 1 8
3 1 0 8
1
2
3
4
5
6
7
8
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
$EndNodes
$Elements
2 2 1 2
2 1 3 1
2 5 8 7 6
3 1 5 1
1 1 2 3 4 5 6 7 8
$EndElements
";

fn spoilt(from: &str, to: &str) -> GmshError {
    let bad = CUBE.replacen(from, to, 1);
    assert_ne!(bad, CUBE, "nothing replaced");
    read(&bad).expect_err("a spoilt mesh was read")
}

#[test]
fn a_face_that_looks_inward_is_turned() {
    let m = read(CUBE).unwrap();
    let (a, _) = area_vector(&m, "contact");
    assert!((a[2] - 1.0).abs() < 1e-15, "{a:?}");
}

#[test]
fn errors_name_the_line_and_the_culprit() {
    use GmshError as E;
    assert!(matches!(spoilt("4.1 0", "2.2 0"), E::Version { line: 2, .. }));
    assert!(matches!(spoilt("4.1 0", "4.1 1"), E::Binary { line: 2 }));
    assert!(
        matches!(spoilt("\"dermis\"", "\"fat\""), E::UnknownRegion { line: 7, name, .. } if name == "fat")
    );
    assert!(matches!(
        spoilt("1 1 2 3 4 5 6 7 8", "1 2 1 4 3 6 5 8 7"),
        E::InvertedElement { line: 39, element: 1, .. }
    ));
    assert!(matches!(
        spoilt("6 7 8\n$EndEl", "6 7 9\n$EndEl"),
        E::MissingNode { line: 39, element: 1, tag: 9 }
    ));
    assert!(matches!(spoilt("7\n8\n0", "7\n7\n0"), E::DuplicateNode { line: 24, tag: 7 }));
    assert!(matches!(
        spoilt("1 1 1 1 1 0\n$EndE", "1 1 1 0 0\n$EndE"),
        E::NoPhysicalGroup { line: 38, entity: 1, .. }
    ));
    assert!(matches!(
        spoilt("3 1 \"dermis\"", "3 4 \"dermis\""),
        E::UnnamedGroup { line: 38, dimension: 3, tag: 1 }
    ));
    assert!(matches!(
        spoilt("3 1 5 1\n", "3 1 6 1\n"),
        E::UnsupportedElement { line: 38, element_type: 6 }
    ));
    assert!(matches!(spoilt("2 5 8 7 6", "2 5 8 7 1"), E::LooseFace { line: 37, element: 2, .. }));
    assert!(matches!(spoilt("1 1 0\n0 1 0", "1 1 nan\n0 1 0"), E::Syntax { line: 27, .. }));
    assert!(
        matches!(spoilt("$EndElements\n", ""), E::Truncated { section } if section == "Elements")
    );
    assert!(matches!(
        spoilt("3 1 5 1\n1 1 2 3 4 5 6 7 8", "3 1 5 1\n1 1 2 3 4 5 6 7"),
        E::Syntax { line: 39, .. }
    ));
    assert!(matches!(read(""), Err(E::MissingSection { section: "MeshFormat", .. })));
    assert!(matches!(read_file(&path("block_binary.msh")), Err(E::Binary { line: 2 })));
    assert!(matches!(read_file(&path("none.msh")), Err(E::Io { .. })));
}

/// A file cut anywhere is refused, not half read.
#[test]
fn a_file_cut_short_is_an_error() {
    let whole = text("block_hex8.msh");
    let lines: Vec<_> = whole.lines().collect();
    for n in 0..lines.len() - 1 {
        assert!(read(&lines[..n].join("\n")).is_err(), "cut after line {n}");
    }
}
