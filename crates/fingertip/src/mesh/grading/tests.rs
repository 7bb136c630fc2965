use super::*;
use crate::geometry::fingertip::FingertipShape;
use crate::mesh::fingertip::{Density, FingertipMesh, Order, Parts, build, build_guide};
use papilla_fem::element::BlockGeometry;
use papilla_fem::mesh::{HangingNode, Mesh};
use papilla_sdf::{IndenterSpec, Placement};
use papilla_vector::norm;
use std::collections::BTreeSet;
use std::path::Path;

/// An indenter that comes to the default finger in a pose.
fn contact(indenter: &str, angles_deg: [f64; 3], offset_mm: [f64; 2], depth_mm: f64) -> Contact {
    sliding(indenter, angles_deg, offset_mm, depth_mm, Vec::new())
}

/// One that also slides to these places.
fn sliding(
    indenter: &str,
    angles_deg: [f64; 3],
    offset_mm: [f64; 2],
    depth_mm: f64,
    slides_mm: Vec<[f64; 2]>,
) -> Contact {
    let spec: IndenterSpec = toml::from_str(indenter).unwrap();
    let shape = spec.build(Path::new("")).unwrap();
    let [pitch, roll, yaw] = angles_deg;
    let rotation = Placement::turned(pitch, roll, yaw, [0.0; 3]).rotation;
    let top_mm = spec.top_mm();
    let depths_mm = vec![depth_mm];
    let coming = Coming { shape: &shape, rotation, top_mm, offset_mm, depths_mm, slides_mm };
    Contact::new(&FingertipShape::default(), &coming).unwrap()
}

fn mesh(density: Density, contact: &Contact) -> FingertipMesh {
    let shape = FingertipShape::default();
    build(&shape, density, Order::Graded, Parts::default(), Some(contact)).unwrap()
}

/// Distances of skin nodes to their nearest neighbour within `within_mm` of the first touch.
fn spacing_near(mesh: &FingertipMesh, contact: &Contact, within_mm: f64) -> Vec<f64> {
    let at: Vec<[f64; 3]> = mesh.patch.skin.iter().map(|&n| mesh.mesh.nodes[n as usize]).collect();
    let away = |p: &[f64; 3], q: &[f64; 3]| norm(std::array::from_fn(|i| p[i] - q[i]));
    at.iter()
        .filter(|p| away(p, &contact.first) < within_mm)
        .map(|p| at.iter().map(|q| away(p, q)).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min))
        .collect()
}

const PLATE: &str = "shape = 'plate'\nsize_mm = [20.0, 20.0]\nedge_radius_mm = 1.0";
const BALL: &str = "shape = 'sphere'\nradius_mm = 6.0";
const BAR: &str = "shape = 'cylinder'\nradius_mm = 1.0\nlength_mm = 30.0\nend_radius_mm = 0.5";
const PUNCH: &str = "shape = 'punch'\nradius_mm = 2.0\nrim_radius_mm = 0.5\nheight_mm = 8.0";
const DOT: &str = "shape = 'dots'\ncount = [1, 1]\npitch_mm = 5.0\nbase_mm = 1.6\nheight_mm = 0.5\n\
                   plate_mm = [20.0, 20.0]";
const GRATING: &str = "shape = 'grating'\nridges = 6\nridge_mm = 2.0\ngroove_mm = 2.0\n\
                       height_mm = 1.5\nedge_radius_mm = 0.7\nlength_mm = 24.0";

#[test]
fn skin_is_as_close_where_an_indenter_slides_to() {
    let by_mm = 3.0;
    let straight = contact(BALL, [0.0; 3], [0.0; 2], 0.6);
    let slid = sliding(BALL, [0.0; 3], [0.0; 2], 0.6, vec![[by_mm, 0.0]]);
    let there = {
        let mut first = straight.first;
        first[0] += by_mm;
        Contact { first: FingertipShape::default().on_skin(first), ..straight.clone() }
    };
    let farthest = |at: &Contact, of: &Contact| {
        spacing_near(&mesh(Density::Coarse, of), at, 1.0).into_iter().fold(0.0, f64::max)
    };
    let [first, after, without] =
        [(&straight, &slid), (&there, &slid), (&there, &straight)].map(|(at, of)| farthest(at, of));
    assert!(after < 1.5 * first && without > 1.2 * after, "{first} {after} {without}");
}

/// Of every indenter, in poses at the limits of the campaigns, no element folds.
#[test]
fn no_element_folds() {
    let poses = [
        ([0.0, 0.0, 0.0], [0.0, 0.0]),
        ([45.0, 30.0, 0.0], [0.0, 0.0]),
        ([40.0, -25.0, 70.0], [2.0, -2.0]),
        ([10.0, 25.0, -45.0], [-2.0, 2.0]),
    ];
    for indenter in [PLATE, BALL, BAR, PUNCH, DOT, GRATING] {
        for (angles, offset) in poses {
            let contact = contact(indenter, angles, offset, 1.5);
            let mesh = mesh(Density::Coarse, &contact).mesh;
            for block in &mesh.blocks {
                let found = BlockGeometry::new(block.kind, &mesh.nodes, &block.connectivity);
                assert!(found.is_ok(), "{indenter} {angles:?}: {:?}", found.err());
            }
        }
    }
}

/// Nodes are as close under an indenter as it wants them: the narrower, the closer.
#[test]
fn nodes_are_close_where_the_indenter_is_narrow() {
    let largest = |indenter, within_mm| {
        let contact = contact(indenter, [10.0, 5.0, 0.0], [0.0; 2], 1.0);
        let mesh = mesh(Density::Medium, &contact);
        spacing_near(&mesh, &contact, within_mm).into_iter().fold(0.0, f64::max)
    };
    // Spacing of .14 sqrt(R) and .6 mm; distances to the nearest are at most that.
    assert!(largest(BAR, 0.6) <= 0.14 + 1e-9);
    assert!(largest(PLATE, 1.0) <= 0.6 + 1e-9);
    assert!(largest(PLATE, 1.0) > 0.2, "a plate does not pay for what it does not need");
}

/// Across the edge of a plate's contact nodes are a fifth of a millimetre apart; in its middle and
/// beyond they are not.
#[test]
fn nodes_are_close_where_an_edge_passes() {
    let contact = contact(PLATE, [10.0, 5.0, 0.0], [0.0; 2], 1.0);
    let mesh = mesh(Density::Medium, &contact);
    let at: Vec<[f64; 3]> = mesh.patch.skin.iter().map(|&n| mesh.mesh.nodes[n as usize]).collect();
    let spacing = |p: &[f64; 3]| {
        let away = |q: &[f64; 3]| norm(std::array::from_fn(|i| p[i] - q[i]));
        at.iter().map(away).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min)
    };
    let within = |from: f64, to: f64| -> Vec<f64> {
        let travels = |p: &&[f64; 3]| (from..to).contains(&contact.travel_mm(**p, 2.0));
        at.iter().filter(travels).map(spacing).collect()
    };
    let largest = |all: Vec<f64>| all.into_iter().fold(0.0, f64::max);
    let (edge, middle) = (within(0.5, 0.6), within(0.0, 0.15));
    assert!(edge.len() > 100 && middle.len() > 10, "{} {}", edge.len(), middle.len());
    assert!(largest(edge) < 0.2 * 2.0_f64.sqrt());
    assert!(largest(middle) > 0.25);
}

/// Nodes of a guide, read at the nodes of the mesh that it guides, are those nodes to the order of
/// the cells; what is linear on the lattice stays what it is in each cell.
#[test]
fn a_guide_is_read_where_it_is() {
    let contact = contact(BALL, [10.0, 5.0, 0.0], [0.0; 2], 1.0);
    let shape = FingertipShape::default();
    let (density, parts) = (Density::Medium, Parts::default());
    let fine = mesh(density, &contact);
    let (guide, transfer) = build_guide(&shape, density, parts, &fine).unwrap().unwrap();
    assert!(guide.mesh.nodes.len() < fine.mesh.nodes.len() / 2);
    let found = transfer.nodal(&guide.mesh.nodes);
    assert_eq!(found.len(), fine.mesh.nodes.len());
    for (p, q) in found.iter().zip(&fine.mesh.nodes) {
        let miss = norm(std::array::from_fn(|i| p[i] - q[i]));
        assert!(miss < 0.1, "{p:?} {q:?}");
    }
    let rows = |mesh: &FingertipMesh| -> Vec<[f64; 4]> {
        let cells = &mesh.refined.as_ref().unwrap().leaves().to_vec();
        let layers = mesh.mesh.blocks[0].len() / cells.len();
        let of = |layer: usize| {
            cells.iter().map(move |l| {
                let (first, half) = (f64::from(l.first[0]), 0.5 * f64::from(l.size[0]));
                [first + half, half, 0.0, layer as f64]
            })
        };
        (0..layers).flat_map(of).collect()
    };
    assert_eq!(transfer.linear(&rows(&guide)), rows(&fine));
    assert!(build_guide(&shape, Density::Coarse, parts, &fine).unwrap().is_none());
}

/// Nodes of the even lattice that are held under the nail are held on any mesh, and all others
/// that are lie under it too.
#[test]
fn the_nail_is_held_whatever_the_contact() {
    let shape = FingertipShape::default();
    let places = |m: &Mesh| -> BTreeSet<[u64; 3]> {
        m.node_sets["nail"].iter().map(|&n| m.nodes[n as usize].map(f64::to_bits)).collect()
    };
    let even = build(&shape, Density::Coarse, Order::Graded, Parts::default(), None).unwrap().mesh;
    let due = places(&even);
    assert!(due.len() > 20);
    for indenter in [BALL, BAR] {
        let contact = contact(indenter, [30.0, 10.0, 20.0], [1.0, 0.0], 1.5);
        let found = mesh(Density::Coarse, &contact).mesh;
        assert!(places(&found).is_superset(&due));
        let held = found.node_sets["nail"].iter().map(|&n| found.nodes[n as usize]);
        assert!(held.into_iter().all(|p| shape.under_nail(p)));
    }
}

/// Every face of an element is a face of one other, of two half its size, or half of a larger
/// one whose nodes those of the small one follow, or it is outside.
#[test]
fn elements_meet_along_whole_faces_or_hang() {
    let contact = contact(PUNCH, [10.0, 5.0, 30.0], [0.0; 2], 1.0);
    let mesh = mesh(Density::Medium, &contact).mesh;
    assert!(!mesh.hanging.is_empty());
    assert!(mesh.hanging.windows(2).all(|w| w[0].node < w[1].node));
    let hangs = |n: u32| mesh.hanging_node(n).is_some();
    for h in &mesh.hanging {
        assert!(h.masters.iter().all(|&m| !hangs(m)), "no node follows one that follows others");
        let HangingNode { node, .. } = *h;
        let miss = h.of(|m| mesh.nodes[m as usize]);
        assert_eq!(miss, mesh.nodes[node as usize], "it lies on the edge of its neighbour");
    }
    // Volume: with gaps or overlaps between cells it would not be that of the even lattice.
    let volume = |m: &Mesh| -> f64 {
        let b = &m.blocks[0];
        let g = BlockGeometry::new(b.kind, &m.nodes, &b.connectivity).unwrap();
        (0..b.len()).flat_map(|e| g.element(e).weights.to_vec()).sum()
    };
    let shape = FingertipShape::default();
    let even = build(&shape, Density::Fine, Order::Linear, Parts::default(), None).unwrap().mesh;
    let (found, due) = (volume(&mesh), volume(&even));
    assert!((found / due - 1.0).abs() < 5e-3, "{found} against {due} mm3");
}

/// Places of the skin read at the atlas' vertices are those vertices, to the order of the cells.
#[test]
fn vertices_are_read_where_they_are() {
    let contact = contact(BALL, [10.0, 5.0, 0.0], [0.0; 2], 1.0);
    let FingertipMesh { mesh, patch, .. } = mesh(Density::Coarse, &contact);
    let vertices = patch.vertices.as_ref().unwrap();
    for (nodes, due) in
        [(&patch.skin, &vertices.skin_mm), (&patch.interface, &vertices.interface_mm)]
    {
        let at: Vec<[f64; 3]> = nodes.iter().map(|&n| mesh.nodes[n as usize]).collect();
        let found = vertices.vector(&at);
        assert_eq!(found.len(), due.len());
        for (p, q) in found.iter().zip(due) {
            let miss = norm(std::array::from_fn(|i| p[i] - q[i]));
            assert!(miss < 0.08, "{p:?} {q:?}");
        }
    }
}

/// A ball that comes straight along the normal of a body of revolution touches where the
/// smooth skin says, to the tolerance of the search.
#[test]
fn first_touch_is_that_of_the_smooth_skin() {
    // The equator's section is an ellipse; with no crease the skin beyond it is a cylinder.
    let finger = FingertipShape { crease_depth_mm: 0.0, ..FingertipShape::default() };
    let spec: IndenterSpec = toml::from_str(BALL).unwrap();
    let shape = spec.build(Path::new("")).unwrap();
    let rotation = Placement::turned(0.0, 0.0, 0.0, [0.0; 3]).rotation;
    let top_mm = spec.top_mm();
    // Along the cylinder's lowest line every point ties: the touch is at z = -h/2 and y = 0.
    let depths_mm = vec![1.0];
    let coming = Coming {
        shape: &shape,
        rotation,
        top_mm,
        offset_mm: [0.0; 2],
        depths_mm,
        slides_mm: Vec::new(),
    };
    let found = Contact::new(&finger, &coming).unwrap();
    assert!(found.first[1].abs() < 1e-4, "{:?}", found.first);
    assert!((found.first[2] + 0.5 * finger.height_mm).abs() < 1e-9, "{:?}", found.first);
    // The ball's centre is a radius below.
    let centre = found.start.origin_mm[2];
    assert!((centre + 0.5 * finger.height_mm + 6.0).abs() < 1e-6, "{centre}");
    // Beside the axis by 1 mm: the centre's height over the ellipse, by Newton's method in the plane.
    let beside = Contact::new(&finger, &Coming { offset_mm: [0.0, 1.0], ..coming }).unwrap();
    let (a, b) = (0.5 * finger.width_mm, 0.5 * finger.height_mm);
    // On the parallel curve at distance 6: x = a sin t + 6 n_x = 1.
    let place = |t: f64| {
        let (s, c) = t.sin_cos();
        let n = [s / a, c / b];
        let size = n[0].hypot(n[1]);
        [a * s + 6.0 * n[0] / size, b * c + 6.0 * n[1] / size]
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if place(middle)[0] < 1.0 { low = middle } else { high = middle }
    }
    let due = -place(low)[1];
    assert!((beside.start.origin_mm[2] - due).abs() < 1e-5, "{:?} {due}", beside.start.origin_mm);
}
