//! Rigid motions that held degrees of freedom leave.
//!
//! They are three translations and three rotations; the held degrees of freedom of a part's
//! nodes, each a linear form of the six, have to leave none of them. What they leave is the
//! null space of the forms' Gram matrix.

use super::middle;
use crate::linear::eigen;
use crate::mesh::Mesh;
use papilla_vector::{cross, norm};
use std::fmt;

/// A rigid motion that nothing holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FreeMode {
    /// Along a unit vector.
    Slide([f64; 3]),
    /// About an axis of this direction through the point, mm.
    Turn([f64; 3], [f64; 3]),
}

/// A motion is held if the forms see this share of it.
const HELD: f64 = 1e-8;

impl fmt::Display for FreeMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slide(d) => write!(f, "moving along {}", direction(*d)),
            Self::Turn(d, [x, y, z]) => {
                let axis = direction(*d);
                write!(f, "turning about {axis} through ({x:.3}, {y:.3}, {z:.3}) mm")
            }
        }
    }
}

/// An axis by its name, another direction by its components.
fn direction(d: [f64; 3]) -> String {
    match d.iter().position(|v| v.abs() > 1.0 - 1e-6) {
        Some(axis) => ["x", "y", "z"][axis].into(),
        None => format!("({:.3}, {:.3}, {:.3})", d[0], d[1], d[2]),
    }
}

/// Motions of a part that its held degrees of freedom leave.
pub(super) fn free_modes(mesh: &Mesh, nodes: &[usize], fixed: &[bool]) -> Vec<FreeMode> {
    let centre = middle(mesh, nodes);
    let arm = |n: usize| -> [f64; 3] { std::array::from_fn(|i| mesh.nodes[n][i] - centre[i]) };
    let size = nodes.iter().map(|&n| papilla_vector::norm(arm(n))).fold(0.0, f64::max);
    let scale = if size > 0.0 { size } else { 1.0 };
    let mut gram = [[0.0; 6]; 6];
    let mut count = 0.0;
    for &n in nodes {
        let r = arm(n).map(|v| v / scale);
        for i in (0..3).filter(|&i| fixed[3 * n + i]) {
            // u = t + w x r.
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let mut form = [0.0; 6];
            (form[i], form[3 + j], form[3 + k]) = (1.0, r[k], -r[j]);
            for a in 0..6 {
                for b in 0..6 {
                    gram[a][b] += form[a] * form[b];
                }
            }
            count += 1.0;
        }
    }
    let (values, vectors) = eigen(gram);
    let free = (0..6).filter(|&a| values[a] <= HELD * f64::max(count, 1.0));
    reduced(free.map(|a| vectors[a]).collect())
        .into_iter()
        .map(|v| mode([v[0], v[1], v[2]], [v[3], v[4], v[5]].map(|w| w / scale), centre))
        .collect()
}

/// The motion of translation `t` and rotation `w` about `centre`.
fn mode(t: [f64; 3], w: [f64; 3], centre: [f64; 3]) -> FreeMode {
    let (slide, turn) = (norm(t), norm(w));
    if turn <= 1e-9 * slide {
        return FreeMode::Slide(t.map(|v| v / slide));
    }
    // The point of the axis next to the centre: w x t / |w|^2.
    let across = cross(w, t);
    let through = std::array::from_fn(|i| centre[i] + across[i] / (turn * turn) + 0.0);
    FreeMode::Turn(w.map(|v| v / turn), through)
}

/// The same space by vectors of which each has an entry that the others lack: single
/// translations and rotations where the space holds them.
fn reduced(mut rows: Vec<[f64; 6]>) -> Vec<[f64; 6]> {
    let mut done = 0;
    // Rotations first, so that what is left over are pure translations.
    for column in [3, 4, 5, 0, 1, 2] {
        let size = |r: &[f64; 6]| r[column].abs();
        let Some(best) =
            (done..rows.len()).max_by(|&a, &b| size(&rows[a]).total_cmp(&size(&rows[b])))
        else {
            break;
        };
        if size(&rows[best]) < 1e-6 {
            continue;
        }
        rows.swap(done, best);
        let pivot = rows[done].map(|v| v / rows[done][column]);
        rows[done] = pivot;
        for (i, row) in rows.iter_mut().enumerate() {
            if i != done {
                let factor = row[column];
                for (v, p) in row.iter_mut().zip(pivot) {
                    *v -= factor * p;
                }
            }
        }
        done += 1;
    }
    let clean = |v: f64| if v.abs() < 1e-9 { 0.0 } else { v };
    rows.into_iter().map(|r| r.map(clean)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::lattice::cube;
    use crate::mesh::supports::hold;

    fn modes(sets: &[(&str, [bool; 3])]) -> Vec<FreeMode> {
        let mesh = cube(ElementKind::Hex8, 2, |[x, y, z]| [x + 5.0, y, z]);
        let nodes: Vec<_> = (0..mesh.nodes.len()).collect();
        free_modes(&mesh, &nodes, &hold(&mesh, sets))
    }

    fn text(sets: &[(&str, [bool; 3])]) -> Vec<String> {
        modes(sets).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn what_is_held_leaves_what_is_free() {
        assert_eq!(modes(&[]).len(), 6);
        assert_eq!(modes(&[("z_min", [true; 3])]), []);
        // Three planes of symmetry hold a corner piece.
        let [x, y, z] = [[true, false, false], [false, true, false], [false, false, true]];
        assert_eq!(modes(&[("x_min", x), ("y_min", y), ("z_min", z)]), []);
        assert_eq!(text(&[("y_min", y), ("z_min", z)]), ["moving along x"]);
        let on_ice = text(&[("z_min", z)]);
        assert_eq!(on_ice.len(), 3, "{on_ice:?}");
        assert!(on_ice.iter().any(|m| m == "moving along x"), "{on_ice:?}");
        assert!(on_ice.iter().any(|m| m.starts_with("turning about z")), "{on_ice:?}");
    }

    #[test]
    fn a_hinge_turns_about_its_edge() {
        let mesh = cube(ElementKind::Hex8, 2, |p| p);
        let nodes: Vec<_> = (0..mesh.nodes.len()).collect();
        let mut fixed = vec![false; 3 * nodes.len()];
        for n in
            nodes.iter().copied().filter(|&n| mesh.nodes[n][0] == 0.0 && mesh.nodes[n][2] == 0.0)
        {
            fixed[3 * n..3 * n + 3].fill(true);
        }
        let [FreeMode::Turn(axis, through)] = free_modes(&mesh, &nodes, &fixed)[..] else {
            panic!("one rotation is free")
        };
        assert!((axis[1].abs() - 1.0).abs() < 1e-9 && axis[0].abs() + axis[2].abs() < 1e-9);
        assert!(through[0].abs() < 1e-9 && through[2].abs() < 1e-9, "{through:?}");
    }
}
