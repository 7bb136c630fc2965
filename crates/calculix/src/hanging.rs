//! Nodes that follow others, as linear equations.
//!
//! Where large elements border on small ones, two kinds of nodes of the small ones follow the large
//! one's face. The middle of a small edge lies a quarter along a large edge ([`HangingNode`]). And
//! a node in the middle of a face of `Hex27` may be a corner or the middle of an edge of small
//! elements. C3D20 has no such node; its face has the eight functions of the serendipity family,
//! which at the middle are -1/4 at the corners and 1/2 at the middles of the edges. They are
//! closed under halving a face, so with both kinds of equations displacement is continuous.
//!
//! A node that another follows may follow others itself, where edges of three sizes meet;
//! CalculiX gets every equation in free nodes.

use super::{ElementTypes, ExportError, number};
use papilla_fem::element::ElementKind;
use papilla_fem::element::reference::HEX27_LATTICE;
use papilla_fem::mesh::{HangingNode, Mesh};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Nodes that follow others, with the free nodes that they follow and their weights.
pub(super) type Followers = BTreeMap<u32, Vec<(u32, f64)>>;

/// Weight of a face's corner and of the middle of its edge at its middle, by how many of the
/// face's two coordinates are not those of its middle.
const SERENDIPITY: [f64; 3] = [0.0, 0.5, -0.25];
/// Local numbers of the nodes in the middle of faces of `Hex27`.
const FACE_NODES: std::ops::Range<usize> = 20..26;

/// Nodes of `used` that follow others in a deck of `mesh`.
pub(super) fn followers(
    mesh: &Mesh,
    types: ElementTypes,
    used: &[u32],
) -> Result<Followers, ExportError> {
    if mesh.hanging.is_empty() {
        return Ok(Followers::new());
    }
    if let Some(block) = mesh.blocks.iter().find(|b| types.of(b.kind).nodes != 20) {
        return Err(ExportError::Hanging { element: types.of(block.kind).name });
    }
    let mut direct = Followers::new();
    for block in mesh.blocks.iter().filter(|b| b.kind == ElementKind::Hex27) {
        for e in 0..block.len() {
            let nodes = block.element(e);
            for middle in FACE_NODES.filter(|&f| used.binary_search(&nodes[f]).is_ok()) {
                direct.insert(nodes[middle], face_weights(nodes, middle));
            }
        }
    }
    for h in mesh.hanging.iter().filter(|h| used.binary_search(&h.node).is_ok()) {
        direct.insert(h.node, h.masters.into_iter().zip(HangingNode::WEIGHTS).collect());
    }
    let mut resolved = Followers::new();
    for &node in direct.keys() {
        resolve(node, &direct, &mut resolved, &mut Vec::new())?;
    }
    Ok(resolved)
}

/// Serendipity functions of a face of `Hex27` at its middle, which is the local node `middle`.
fn face_weights(nodes: &[u32], middle: usize) -> Vec<(u32, f64)> {
    let normal = HEX27_LATTICE[middle];
    let on_face = |at: &[i8; 3]| (0..3).all(|i| normal[i] == 0 || at[i] == normal[i]);
    let weight = |at: &[i8; 3]| {
        let away = (0..3).filter(|&i| normal[i] == 0 && at[i] != 0).count();
        SERENDIPITY[away]
    };
    let of_face = HEX27_LATTICE[..20].iter().zip(nodes).filter(|(at, _)| on_face(at));
    of_face.map(|(at, &node)| (node, weight(at))).collect()
}

/// Puts what `node` follows in terms of free nodes into `resolved`; `path` are those that follow
/// it.
fn resolve(
    node: u32,
    direct: &Followers,
    resolved: &mut Followers,
    path: &mut Vec<u32>,
) -> Result<(), ExportError> {
    if resolved.contains_key(&node) {
        return Ok(());
    }
    if path.contains(&node) {
        return Err(ExportError::HangingCircle { node: node as usize + 1 });
    }
    path.push(node);
    let mut terms: BTreeMap<u32, f64> = BTreeMap::new();
    for &(master, weight) in &direct[&node] {
        if !direct.contains_key(&master) {
            *terms.entry(master).or_default() += weight;
            continue;
        }
        resolve(master, direct, resolved, path)?;
        for &(free, inner) in &resolved[&master] {
            *terms.entry(free).or_default() += weight * inner;
        }
    }
    path.pop();
    resolved.insert(node, terms.into_iter().filter(|(_, w)| *w != 0.0).collect());
    Ok(())
}

/// Where a node that follows others has to be for a linear field to be one in both elements.
pub(super) fn position_mm(mesh: &Mesh, terms: &[(u32, f64)]) -> [f64; 3] {
    let along = |i: usize| terms.iter().map(|&(n, w)| w * mesh.nodes[n as usize][i]).sum();
    std::array::from_fn(along)
}

/// The equations: one a component, the node that follows first, as CalculiX wants it.
pub(super) fn write_equations(followers: &Followers, out: &mut String) {
    for (node, terms) in followers {
        for component in 1..=3 {
            let _ = write!(out, "*EQUATION\n{}\n", terms.len() + 1);
            let all: Vec<_> = std::iter::once((*node, -1.0))
                .chain(terms.iter().copied())
                .map(|(n, weight)| format!("{},{component},{}", n + 1, number(weight)))
                .collect();
            // Four terms a line.
            for line in all.chunks(4) {
                let _ = writeln!(out, "{}", line.join(","));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Deck, StepControl};
    use papilla_fem::mesh::Block;
    use papilla_fem::mesh::graded_block::graded_block;
    use papilla_fingertip::scene::Scene;
    use papilla_fingertip::simulation::Simulation;
    use papilla_fingertip::tissue::Tissue;

    fn used(mesh: &Mesh) -> Vec<u32> {
        let block = &mesh.blocks[0];
        let mut used: Vec<u32> =
            (0..block.len()).flat_map(|e| block.element(e)[..20].to_vec()).collect();
        used.sort_unstable();
        used.dedup();
        used
    }

    /// A field at the free nodes, anything, and what follows it.
    fn field(mesh: &Mesh, followers: &Followers) -> Vec<f64> {
        let free = |n: usize| (1.7 * n as f64).sin();
        let of = |n: usize| match followers.get(&(n as u32)) {
            Some(terms) => terms.iter().map(|&(m, w)| w * free(m as usize)).sum(),
            None => free(n),
        };
        (0..mesh.nodes.len()).map(of).collect()
    }

    /// Where an element's faces have nodes that follow: those in the middle of a face, and a
    /// quarter along an edge. `None` where nothing does.
    fn places(mesh: &Mesh, followers: &Followers, nodes: &[u32]) -> Vec<(u32, [f64; 3])> {
        let local = |n: u32| nodes[..20].iter().position(|o| *o == n).map(|a| HEX27_LATTICE[a]);
        let middles = FACE_NODES.map(|f| (nodes[f], HEX27_LATTICE[f].map(f64::from)));
        let quarters = mesh.hanging.iter().filter_map(|h| {
            let [near, middle, _] = h.masters.map(local);
            let (near, middle) = (near?, middle?);
            let at = std::array::from_fn(|i| 0.5 * f64::from(near[i] + middle[i]));
            Some((h.node, at))
        });
        middles.chain(quarters).filter(|(n, _)| followers.contains_key(n)).collect()
    }

    /// What follows a face of a large element has what its twenty functions give there.
    fn follows_the_large_element(mesh: &Mesh) {
        let followers = followers(mesh, ElementTypes::default(), &used(mesh)).unwrap();
        let at_node = field(mesh, &followers);
        let block = &mesh.blocks[0];
        let mut checked = std::collections::BTreeSet::new();
        for e in 0..block.len() {
            let nodes = block.element(e);
            for (node, xi) in places(mesh, &followers, nodes) {
                let mut value = [0.0; 27];
                ElementKind::Hex20.shape(xi, &mut value, &mut [[0.0; 3]; 27]);
                let found: f64 = (0..20).map(|a| value[a] * at_node[nodes[a] as usize]).sum();
                let due = at_node[node as usize];
                assert!((found - due).abs() < 1e-12 * due.abs().max(1.0), "{node}: {found} {due}");
                checked.insert(node);
            }
        }
        assert!(!followers.is_empty());
        assert!(followers.keys().all(|n| checked.contains(n)));
    }

    #[test]
    fn nodes_between_sizes_follow_the_large_element() {
        follows_the_large_element(&graded_block());
        let scene: Scene = toml::from_str(
            "[geometry]\nkind = \"fingertip\"\ndensity = \"coarse\"\norder = \"graded\"\n\
             [motion]\ndepth_mm = 0.5\n",
        )
        .unwrap();
        follows_the_large_element(&Simulation::new(&scene).unwrap().body.problem.mesh);
    }

    #[test]
    fn every_equation_is_in_free_nodes_and_keeps_a_linear_field() {
        let mesh = graded_block();
        let followers = followers(&mesh, ElementTypes::default(), &used(&mesh)).unwrap();
        assert!(followers.values().any(|terms| terms.len() > 8), "no chain in the test's mesh");
        for (node, terms) in &followers {
            assert!(terms.iter().all(|(m, _)| !followers.contains_key(m)), "{node}");
            let sum: f64 = terms.iter().map(|(_, w)| w).sum();
            assert!((sum - 1.0).abs() < 1e-14, "{node}: {sum}");
            let (found, at) = (position_mm(&mesh, terms), mesh.nodes[*node as usize]);
            assert!((0..3).all(|i| (found[i] - at[i]).abs() < 1e-12), "{found:?} {at:?}");
        }
    }

    #[test]
    fn what_a_deck_cannot_hold_is_refused() {
        let mut mesh = graded_block();
        let types = ElementTypes::default();
        let node = *followers(&mesh, types, &used(&mesh)).unwrap().keys().next().unwrap();
        let deck = Deck {
            title: "",
            mesh: &mesh,
            materials: &[const { None }; Tissue::ALL.len()],
            fixed: &vec![false; 3 * mesh.nodes.len()],
            prescribed_mm: &[(3 * node as usize + 1, 0.1)],
            press: None,
            types,
            step: StepControl::default(),
        };
        let refused = Err(ExportError::HangingPrescribed { node: node as usize + 1 });
        assert_eq!(deck.to_text(), refused);
        let (kind, region) = (ElementKind::Hex8, mesh.blocks[0].region[..1].to_vec());
        mesh.blocks.push(Block { kind, connectivity: (0..8).collect(), region });
        let refused = Err(ExportError::Hanging { element: "C3D8" });
        assert_eq!(followers(&mesh, types, &used(&mesh)), refused);
    }

    #[test]
    fn what_follows_itself_is_refused() {
        let direct: Followers =
            [(0, vec![(1, 1.0)]), (1, vec![(2, 0.5), (0, 0.5)])].into_iter().collect();
        let refused = resolve(0, &direct, &mut Followers::new(), &mut Vec::new());
        assert_eq!(refused, Err(ExportError::HangingCircle { node: 1 }));
    }

    #[test]
    fn an_equation_has_its_follower_first_and_four_terms_a_line() {
        let followers: Followers =
            [(6, vec![(0, 0.375), (1, 0.75), (2, -0.125), (3, 0.25), (4, -0.25)])].into();
        let mut text = String::new();
        write_equations(&followers, &mut text);
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.len(), 3 * 4);
        assert_eq!(lines[..2], ["*EQUATION", "6"]);
        assert!(lines[2].starts_with("7,1,-1.") && lines[2].split(',').count() == 12);
        assert_eq!(lines[3].split(',').count(), 6);
        assert!(lines[4..6] == ["*EQUATION", "6"] && lines[6].starts_with("7,2,-1."));
    }
}
