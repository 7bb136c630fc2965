//! How far each mesh is from the fine one: the discretisation error of a press.

use super::{CaseError, Check, Context};
use crate::mesh::fingertip::Density;
use crate::press::body::Body;
use crate::press::drive::{Approach, Drive};
use crate::press::record::{IncrementRecord, Pose, relative_l2};
use crate::solve::Options;

const SOURCE: &str = "the same press on the next finer mesh";
const DEPTH_MM: f64 = 1.0;

/// Largest differences accepted: force, pressure, SED of both sides.
type Accepted = [f64; 4];

pub(super) fn run(context: &Context) -> Result<Vec<Check>, CaseError> {
    let pairs: &[(Density, Density, Accepted)] = if context.quick {
        &[(Density::Coarse, Density::Medium, [0.03, 0.25, 0.25, 0.35])]
    } else {
        &[
            (Density::Coarse, Density::Medium, [0.03, 0.25, 0.25, 0.35]),
            (Density::Medium, Density::Fine, [0.02, 0.12, 0.12, 0.15]),
        ]
    };
    let mut rows = Vec::new();
    for &(coarse, fine, accepted) in pairs {
        rows.extend(compare(coarse, fine, accepted)?);
    }
    Ok(rows)
}

fn compare(coarse: Density, fine: Density, accepted: Accepted) -> Result<Vec<Check>, CaseError> {
    let (a, b) = (press(coarse)?, press(fine)?);
    let relative = |get: fn(&Pressed) -> &[f64], points: fn(&Pressed) -> &[[f64; 3]]| {
        relative_l2(get(&a), &a.read(&b, get(&b), points))
    };
    let name = |what: &str| {
        format!("{coarse:?} against {fine:?}, flat press to 1 mm: {what}").to_lowercase()
    };
    let [force, pressure, dermis, epidermis] = accepted;
    let row = |what: &str, value, tolerance| {
        Check::vanishes(name(&format!("{what}, relative L2")), value, tolerance, SOURCE)
    };
    Ok(vec![
        Check::relative(name("force, N"), a.force_n(), b.force_n(), force, SOURCE),
        row("pressure", relative(|p| &p.record.pressure_mpa, |p| &p.skin), pressure),
        row("sed, dermis side", relative(|p| &p.record.sed_dermis_mpa, |p| &p.interface), dermis),
        row(
            "sed, epidermis side",
            relative(|p| &p.record.sed_epidermis_mpa, |p| &p.interface),
            epidermis,
        ),
    ])
}

/// A press and where its values are.
struct Pressed {
    record: IncrementRecord,
    skin: Vec<[f64; 3]>,
    interface: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Pressed {
    fn force_n(&self) -> f64 {
        self.record.force_n[2].abs()
    }

    /// Values of another mesh at this one's points: linear in the triangle whose
    /// plane point is nearest, seen along the finger's own height.
    fn read(&self, other: &Self, values: &[f64], points: fn(&Self) -> &[[f64; 3]]) -> Vec<f64> {
        let nodes = points(other);
        points(self).iter().map(|p| interpolate(nodes, &other.triangles, values, *p)).collect()
    }
}

/// Value at the point of the triangulated surface that is nearest to `p`.
fn interpolate(nodes: &[[f64; 3]], triangles: &[[u32; 3]], values: &[f64], p: [f64; 3]) -> f64 {
    let mut best = (f64::INFINITY, 0.0);
    for t in triangles {
        let [a, b, c] = t.map(|n| nodes[n as usize]);
        let w = nearest(a, b, c, p);
        let at = |i: usize| w[0] * a[i] + w[1] * b[i] + w[2] * c[i];
        let distance: f64 = (0..3).map(|i| (at(i) - p[i]).powi(2)).sum();
        if distance < best.0 {
            best = (distance, (0..3).map(|k| w[k] * values[t[k] as usize]).sum());
        }
    }
    best.1
}

/// Barycentric coordinates of the point of a triangle nearest to `p` (Ericson
/// 2005, sec. 5.1.5).
fn nearest(a: [f64; 3], b: [f64; 3], c: [f64; 3], p: [f64; 3]) -> [f64; 3] {
    let sub = |x: [f64; 3], y: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| x[i] - y[i]) };
    let dot = |x: [f64; 3], y: [f64; 3]| (0..3).map(|i| x[i] * y[i]).sum::<f64>();
    let (ab, ac) = (sub(b, a), sub(c, a));
    let (d1, d2) = (dot(ab, sub(p, a)), dot(ac, sub(p, a)));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let (d3, d4) = (dot(ab, sub(p, b)), dot(ac, sub(p, b)));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let (d5, d6) = (dot(ab, sub(p, c)), dot(ac, sub(p, c)));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    [va / sum, vb / sum, vc / sum]
}

fn press(density: Density) -> Result<Pressed, CaseError> {
    let finger = Body::usual(density)?;
    let mut solver = finger.solver(Options::default())?;
    let (approach, drive) = (Approach::plate(Pose::default()), Drive::Depths(vec![DEPTH_MM]));
    let mut last = None;
    finger.press(&mut solver, &approach, &drive, 1, &mut |_, record, _| {
        last = Some(record.clone());
    })?;
    let patch = &finger.patch.as_ref().ok_or("the fingertip has no patch")?.patch;
    let at = |nodes: &[u32]| nodes.iter().map(|&n| finger.problem.mesh.nodes[n as usize]).collect();
    Ok(Pressed {
        record: last.ok_or("the press gave no record")?,
        skin: at(&patch.skin),
        interface: at(&patch.interface),
        triangles: patch.triangles.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_point_of_a_triangle_is_found_in_every_region() {
        let (a, b, c) = ([0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        let close = |p: [f64; 3], w: [f64; 3]| {
            let found = nearest(a, b, c, p);
            assert!((0..3).all(|i| (found[i] - w[i]).abs() < 1e-15), "{p:?}: {found:?}");
        };
        close([-1.0, -1.0, 5.0], [1.0, 0.0, 0.0]);
        close([4.0, -1.0, 0.0], [0.0, 1.0, 0.0]);
        close([-1.0, 5.0, 1.0], [0.0, 0.0, 1.0]);
        close([1.0, -3.0, 0.0], [0.5, 0.5, 0.0]);
        close([-2.0, 1.0, 0.0], [0.5, 0.0, 0.5]);
        close([3.0, 3.0, 1.0], [0.0, 0.5, 0.5]);
        close([0.5, 0.5, -7.0], [0.5, 0.25, 0.25]);
    }
}
