//! Prescribed degrees of freedom, `3 node + component`.

use super::Mesh;

/// Prescribed degrees of freedom: components of the nodes of sets.
pub fn hold(mesh: &Mesh, sets: &[(&str, [bool; 3])]) -> Vec<bool> {
    let mut fixed = vec![false; 3 * mesh.nodes.len()];
    for (name, components) in sets {
        for &n in mesh.node_sets.get(*name).into_iter().flatten() {
            for i in 0..3 {
                fixed[3 * n as usize + i] |= components[i];
            }
        }
    }
    fixed
}

/// What either of two lists prescribes.
#[must_use]
pub fn merge(mut a: Vec<bool>, b: &[bool]) -> Vec<bool> {
    for (x, y) in a.iter_mut().zip(b) {
        *x |= y;
    }
    a
}

/// All degrees of freedom of the sides of a lattice.
pub fn hold_boundary(mesh: &Mesh) -> Vec<bool> {
    let all = [true; 3];
    hold(
        mesh,
        &[
            ("x_min", all),
            ("x_max", all),
            ("y_min", all),
            ("y_max", all),
            ("z_min", all),
            ("z_max", all),
        ],
    )
}

/// Prescribed values of the held degrees of freedom from a displacement field.
pub fn prescribe(
    mesh: &Mesh,
    fixed: &[bool],
    u: impl Fn([f64; 3]) -> [f64; 3],
) -> Vec<(usize, f64)> {
    let held = (0..fixed.len()).filter(|&dof| fixed[dof]);
    held.map(|dof| (dof, u(mesh.nodes[dof / 3])[dof % 3])).collect()
}
