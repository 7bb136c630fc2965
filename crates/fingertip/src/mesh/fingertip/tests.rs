use super::*;
use crate::mesh::quality;
use papilla_atlas::flatten::build_atlas;
use papilla_fem::element::BlockGeometry;
use papilla_fem::mesh::recovery::SedRecovery;
use sha2::{Digest, Sha256};
use std::collections::{BTreeSet, HashMap, HashSet};

const RIGID: Parts = Parts { bone: false, nail: false };
const SOLID: Parts = Parts { bone: true, nail: true };
const PARTS: [Parts; 4] =
    [RIGID, Parts { bone: true, nail: false }, Parts { bone: false, nail: true }, SOLID];
const DENSITIES: [Density; 3] = [Density::Coarse, Density::Medium, Density::Fine];
const ORDERS: [Order; 2] = [Order::Linear, Order::Quadratic];

fn finger(density: Density, order: Order, parts: Parts) -> FingertipMesh {
    build(&FingertipShape::default(), density, order, parts, None).unwrap()
}

/// Unknowns when what is rigid is held, as the sets' documentation says.
fn unknowns(mesh: &Mesh, parts: Parts) -> usize {
    let mut fixed = BTreeSet::new();
    let mut hold = |set: &str, components: u32| {
        for n in &mesh.node_sets[set] {
            fixed.extend((0..components).map(|c| 3 * n + c));
        }
    };
    hold("base", 1);
    hold(if parts.bone { "bone_base" } else { "bone" }, 3);
    if !parts.nail {
        hold("nail", 3);
    }
    3 * mesh.nodes.len() - fixed.len()
}

/// Prints the table of sizes and shapes; `--nocapture` shows it.
#[test]
fn every_mesh_is_well_shaped() {
    println!("elements' worst scaled Jacobian and aspect by tissue");
    for (density, order) in DENSITIES.into_iter().flat_map(|d| ORDERS.map(|o| (d, o))) {
        for parts in PARTS {
            let mesh = finger(density, order, parts).mesh;
            for block in &mesh.blocks {
                let geometry = BlockGeometry::new(block.kind, &mesh.nodes, &block.connectivity);
                assert!(geometry.is_ok(), "{density:?} {order:?} {parts:?}: {:?}", geometry.err());
            }
            print!("{density:?} {order:?} bone {} nail {}: ", parts.bone, parts.nail);
            println!("{} nodes, {} unknowns", mesh.nodes.len(), unknowns(&mesh, parts));
            for tissue in Tissue::ALL {
                let q = quality::of(&mesh, tissue);
                let meshed = match tissue {
                    Tissue::Bone => parts.bone,
                    Tissue::Nail => parts.nail,
                    _ => true,
                };
                assert_eq!(q.elements > 0, meshed, "{tissue:?} in {parts:?}");
                if meshed {
                    let (least, most) = (q.scaled_jacobian_min, q.aspect_max);
                    println!("  {tissue:?}: {} elements, {least:.3}, {most:.1}", q.elements);
                    let solid = matches!(tissue, Tissue::Bone | Tissue::Nail);
                    assert!(least > if solid { 0.45 } else { 0.05 }, "{tissue:?} {least}");
                    assert!(most < if solid { 20.0 } else { 50.0 }, "{tissue:?} {most}");
                }
            }
        }
    }
}

/// Hash of coordinates (rounded to `f32`, as datasets store values, so that it
/// does not hang on the last bit of a platform's `tan`), connectivity, sets,
/// surfaces and patch.
fn hash(finger: &FingertipMesh) -> String {
    let FingertipMesh { mesh, patch, .. } = finger;
    let mut bytes = Vec::new();
    for x in mesh.nodes.as_flattened() {
        bytes.extend((*x as f32).to_bits().to_le_bytes());
    }
    let list = |v: &[u32]| v.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<_>>();
    for block in &mesh.blocks {
        bytes.extend(list(&block.connectivity));
        bytes.extend(block.region.iter().map(|t| t.index() as u8));
    }
    for (name, set) in &mesh.node_sets {
        bytes.extend(name.bytes());
        bytes.extend(list(set));
    }
    for (name, surface) in &mesh.surfaces {
        bytes.extend(name.bytes());
        bytes.extend(list(&surface.connectivity));
    }
    for part in [&patch.skin, &patch.interface, &patch.triangles.concat()] {
        bytes.extend(list(part));
    }
    Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect()
}

#[test]
fn the_rigid_mesh_is_the_one_that_datasets_were_made_on() {
    // Computed before bone and nail could be solid. A change here orphans every dataset.
    let known = [
        (
            Density::Coarse,
            Order::Linear,
            "fd9eb3cfc3ca2a94ea2f6f3e683a308cfc497c02f24288ae45734403b6788567",
        ),
        (
            Density::Coarse,
            Order::Quadratic,
            "15cad6802c422c58227fce2f495c4b4a6ceea0eb2edc22853b482034848e3d7e",
        ),
        (
            Density::Medium,
            Order::Linear,
            "6fca914ed4ec919491b33c38350219e7d3245822e126ceb71df57227d671a979",
        ),
        (
            Density::Medium,
            Order::Quadratic,
            "a14a3aede2549f90a9c7cb5435a7eb17259fed38cd58b36b21d331d994294bf9",
        ),
        (
            Density::Fine,
            Order::Linear,
            "1227071539e245d520371d4a25240730c1080b69f1843bd76015a851ab39eea5",
        ),
        (
            Density::Fine,
            Order::Quadratic,
            "650522359e56d9db02ed3c1175c7b2669488663918563c32e6bdc2bb92933ffd",
        ),
    ];
    for (density, order, due) in known {
        assert_eq!(hash(&finger(density, order, RIGID)), due, "{density:?} {order:?}");
    }
}

#[test]
fn solid_parts_leave_the_soft_tissue_as_it_is() {
    let bits = |nodes: &[[f64; 3]]| nodes.iter().map(|p| p.map(f64::to_bits)).collect::<Vec<_>>();
    for order in ORDERS {
        let rigid = finger(Density::Coarse, order, RIGID);
        for parts in PARTS {
            let solid = finger(Density::Coarse, order, parts);
            let (a, b) = (&rigid.mesh, &solid.mesh);
            assert_eq!(bits(&a.nodes), bits(&b.nodes[..a.nodes.len()]));
            let (old, new) = (&a.blocks[0], &b.blocks[0]);
            assert_eq!(old.connectivity, new.connectivity[..old.connectivity.len()]);
            assert_eq!(old.region, new.region[..old.len()]);
            assert!(a.node_sets.iter().all(|(name, set)| *set == b.node_sets[name]));
            let interface = |m: &Mesh| m.surfaces["interface"].connectivity.clone();
            assert_eq!(interface(a), interface(b));
            assert_eq!(rigid.patch.skin, solid.patch.skin);
            assert_eq!(rigid.patch.triangles, solid.patch.triangles);
            // No part of the patch is covered, or the indenter would never meet it.
            let skin: HashSet<_> = b.surfaces["skin"].nodes().into_iter().collect();
            assert!(solid.patch.skin.iter().all(|s| skin.contains(s)));
        }
    }
}

/// Outward faces of the whole solid: those of one element alone, corners
/// counter-clockwise from outside, turned to start at the least.
fn boundary(mesh: &Mesh) -> HashSet<[u32; 4]> {
    const OUTWARD: [[usize; 4]; 6] =
        [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]];
    let mut faces: HashMap<[u32; 4], Vec<[u32; 4]>> = HashMap::new();
    for block in &mesh.blocks {
        for e in 0..block.len() {
            for corners in OUTWARD {
                let face = corners.map(|c| block.element(e)[c]);
                let mut key = face;
                key.sort_unstable();
                faces.entry(key).or_default().push(turned(&face));
            }
        }
    }
    assert!(faces.values().all(|f| f.len() <= 2), "a face has two sides");
    faces.into_values().filter(|f| f.len() == 1).map(|f| f[0]).collect()
}

fn turned(face: &[u32]) -> [u32; 4] {
    let start = (0..4).min_by_key(|&i| face[i]).unwrap();
    std::array::from_fn(|i| face[(start + i) % 4])
}

#[test]
fn the_skin_is_all_of_the_outside_but_the_base_and_the_bone() {
    for order in ORDERS {
        for parts in PARTS {
            let mesh = finger(Density::Coarse, order, parts).mesh;
            let mut base: HashSet<u32> = mesh.node_sets["base"].iter().copied().collect();
            base.extend(mesh.node_sets.get("bone_base").into_iter().flatten());
            // What is hollow inside: all that a rigid bone fills, or the marrow cavity.
            let surface: HashSet<u32> = mesh.node_sets["bone"].iter().copied().collect();
            let wall = if parts.bone { &bone_nodes(&mesh) - &surface } else { surface };
            let mut outside = boundary(&mesh);
            outside.retain(|f| [&base, &wall].iter().all(|set| !f.iter().all(|n| set.contains(n))));
            let skin: HashSet<_> = mesh.surfaces["skin"].faces().map(turned).collect();
            assert_eq!(skin.len(), mesh.surfaces["skin"].faces().count());
            assert_eq!(skin, outside, "{order:?} {parts:?}");
        }
    }
}

/// Nodes of the bone's elements.
fn bone_nodes(mesh: &Mesh) -> HashSet<u32> {
    let block = &mesh.blocks[0];
    let bone = (0..block.len()).filter(|&e| block.region[e] == Tissue::Bone.region());
    bone.flat_map(|e| block.element(e).to_vec()).collect()
}

#[test]
fn a_solid_bone_meets_the_base_in_a_ring() {
    for order in ORDERS {
        let mesh = finger(Density::Coarse, order, SOLID).mesh;
        let (bone, base) = (&mesh.node_sets["bone"], &mesh.node_sets["base"]);
        let ring = &mesh.node_sets["bone_base"];
        let length_mm = FingertipShape::default().length_mm;
        let at_base = |n: &&u32| mesh.nodes[**n as usize][0] >= length_mm;
        assert!(ring.iter().all(|n| at_base(&n)));
        let expected: BTreeSet<_> = bone_nodes(&mesh).into_iter().collect();
        assert!(ring.iter().eq(expected.iter().filter(at_base)));
        let shared: Vec<_> = base.iter().filter(|n| ring.binary_search(n).is_ok()).collect();
        assert!(shared.into_iter().eq(bone.iter().filter(at_base)));
    }
}

#[test]
fn the_nail_is_a_plate_of_its_thickness_in_one_piece() {
    let shape = FingertipShape::default();
    for (density, order) in DENSITIES.into_iter().flat_map(|d| ORDERS.map(|o| (d, o))) {
        let mesh = finger(density, order, SOLID).mesh;
        let plate = &mesh.blocks[1];
        let geometry = BlockGeometry::new(plate.kind, &mesh.nodes, &plate.connectivity).unwrap();
        let volume: f64 = (0..plate.len()).flat_map(|e| geometry.element(e).weights).sum();
        let on_skin: HashSet<_> = mesh.node_sets["nail"].iter().collect();
        let mut directed = HashSet::new();
        let mut corners = HashSet::<u32>::new();
        let mut under = 0;
        for e in 0..plate.len() {
            let foot = &plate.element(e)[..4];
            if foot.iter().all(|n| on_skin.contains(n)) {
                under += 1;
                corners.extend(foot);
                directed.extend((0..4).map(|i| (foot[i], foot[(i + 1) % 4])));
            }
        }
        let rim = directed.iter().filter(|&&(a, b)| !directed.contains(&(b, a))).count();
        let edges = (directed.len() + rim) / 2;
        assert_eq!(corners.len() + under, edges + 1, "V - E + F of a disc: {density:?} {order:?}");
        let area = volume / shape.nail_thickness_mm;
        println!("{density:?} {order:?}: {under} cells, {area:.1} mm2, rim of {rim} sides");
        // The plate ends on whole cells: 11 x 12 mm, less where cells are 3 mm wide.
        assert!(area > 60.0 && area < 160.0, "{area} mm2");
    }
}

#[test]
fn a_nail_that_covers_nothing_is_refused() {
    let shape = FingertipShape { nail_mm: [0.1, 0.1], ..FingertipShape::default() };
    assert!(build(&shape, Density::Coarse, Order::Linear, RIGID, None).is_ok());
    let refused = build(&shape, Density::Coarse, Order::Linear, SOLID, None).unwrap_err();
    assert_eq!(refused, FingertipShapeError::NailTooSmall);
}

#[test]
fn the_mesh_mirrors_left_to_right_exactly() {
    // The bit patterns of a node, its mirror image, an element as a set of nodes.
    let key = |p: [f64; 3], sign: f64| [p[0], sign * p[1] + 0.0, p[2]].map(f64::to_bits);
    for order in ORDERS {
        let mesh = finger(Density::Coarse, order, SOLID).mesh;
        let at: HashMap<_, _> = (0..).zip(&mesh.nodes).map(|(n, &p)| (key(p, 1.0), n)).collect();
        assert_eq!(at.len(), mesh.nodes.len(), "no two nodes in one place");
        let twin: Vec<u32> = mesh.nodes.iter().map(|&p| at[&key(p, -1.0)]).collect();
        for block in &mesh.blocks {
            let sorted = |nodes: &mut dyn Iterator<Item = u32>| {
                let mut nodes: Vec<_> = nodes.collect();
                nodes.sort_unstable();
                nodes
            };
            let elements: HashMap<_, _> = (0..block.len())
                .map(|e| (sorted(&mut block.element(e).iter().copied()), block.region[e]))
                .collect();
            for e in 0..block.len() {
                let mirrored = sorted(&mut block.element(e).iter().map(|&n| twin[n as usize]));
                assert_eq!(elements.get(&mirrored), Some(&block.region[e]));
            }
        }
    }
}

#[test]
fn skin_faces_look_outward() {
    let finger = finger(Density::Coarse, Order::Linear, RIGID);
    let skin = &finger.mesh.surfaces["skin"];
    let centre = [15.0, 0.0, 0.0];
    let position = |n: u32| finger.mesh.nodes[n as usize];
    skin.integrate(&skin.kind.quadrature(), &position, &mut |face, value, normal| {
        let x: [f64; 3] =
            std::array::from_fn(|i| face.iter().zip(value).map(|(&n, v)| v * position(n)[i]).sum());
        let outward: f64 = (0..3).map(|i| normal[i] * (x[i] - centre[i])).sum();
        assert!(outward > 0.0, "{x:?} {normal:?}");
    });
}

#[test]
fn the_patch_is_a_disc() {
    let finger = finger(Density::Coarse, Order::Linear, RIGID);
    let p = &finger.patch;
    let mut edges = std::collections::HashSet::new();
    for t in &p.triangles {
        for e in 0..3 {
            assert!(edges.insert((t[e], t[(e + 1) % 3])), "edge twice in one direction");
        }
    }
    let boundary = edges.iter().filter(|(a, b)| !edges.contains(&(*b, *a))).count();
    let undirected = (edges.len() + boundary) / 2;
    let euler = p.skin.len() as i64 - undirected as i64 + p.triangles.len() as i64;
    assert_eq!(euler, 1, "V - E + F of a disc");
}

#[test]
fn the_fingertip_flattens_at_every_density() {
    for density in [Density::Coarse, Density::Medium, Density::Fine] {
        let finger =
            build(&FingertipShape::default(), density, Order::Linear, Parts::default(), None)
                .unwrap();
        let at = |nodes: &[u32]| nodes.iter().map(|&n| finger.mesh.nodes[n as usize]).collect();
        let (skin, interface): (Vec<_>, Vec<_>) =
            (at(&finger.patch.skin), at(&finger.patch.interface));
        let (atlas, report) = build_atlas(&skin, &interface, &finger.patch.triangles).unwrap();
        assert_eq!(atlas.triangles(), finger.patch.triangles, "already wound outward");
        for patch in [&report.skin, &report.interface] {
            let [abf, lscm, spectral] = [0, 1, 2].map(|i| &patch.methods[i]);
            assert!(abf.convergence.is_some_and(|c| c.iterations <= 8), "{abf:?}");
            for method in [abf, lscm, spectral] {
                assert_eq!(method.distortion.flipped, 0, "{density:?}");
            }
            let [abf, lscm] = [abf, lscm].map(|m| m.distortion.angle_error_rad);
            assert!(abf.rms < lscm.rms && abf.mean < 0.03, "{density:?}: {abf:?} {lscm:?}");
        }
    }
}

/// On the same lattice of nodes quadratic elements are read by the stencil of linear ones.
#[test]
fn a_vertex_takes_the_quarters_round_it() {
    let of = |order| {
        let shape = Default::default();
        let finger = build(&shape, Density::Coarse, order, Parts::default(), None).unwrap();
        let nodes = &finger.patch.interface;
        let mesh = &finger.mesh;
        SedRecovery::by_quarters(mesh, "interface", Tissue::Dermis.region(), nodes).unwrap()
    };
    let [linear, quadratic] = [Order::Linear, Order::Quadratic].map(of);
    assert_eq!(linear.terms().len(), quadratic.terms().len());
    let sizes = |r: &SedRecovery| {
        let mut sizes: Vec<_> = r.terms().iter().map(Vec::len).collect();
        sizes.sort_unstable();
        sizes
    };
    assert_eq!(sizes(&linear), sizes(&quadratic));
    for terms in quadratic.terms() {
        assert!((terms.iter().map(|t| t.1).sum::<f64>() - 1.0).abs() < 1e-12);
    }
    for sample in quadratic.samples() {
        let off = sample.xi.iter().filter(|x| (x.abs() - 0.5).abs() < 1e-12).count();
        assert_eq!(off, 2, "{:?}", sample.xi);
    }
}
