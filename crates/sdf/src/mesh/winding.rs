//! How often a surface goes round a place: 1 inside of a closed one, 0 outside, something in between
//! beside a hole (Jacobson, Kavan & Sorkine-Hornung, *Robust inside-outside segmentation using
//! generalized winding numbers*, 2013). Triangles that are far together count as one dipole
//! (Barill, Dickson, Schmidt, Levin & Jacobson, *Fast winding numbers for soups and clouds*, 2018).

use super::tree::Tree;
use super::{normal, square};
use papilla_vector::{along, cross, dot, minus, norm};
use std::f64::consts::PI;

/// A box counts as far from so many of its radii on: the number is then some 1 % off.
const FAR: f64 = 2.5;
/// Winding number from which a place is inside.
const INSIDE: f64 = 0.5;

/// The generalised winding number of some triangles.
pub(super) struct Winding {
    places: Vec<[[f64; 3]; 3]>,
    tree: Tree,
    dipoles: Vec<Dipole>,
}

/// All triangles of a box as one.
#[derive(Clone, Copy)]
struct Dipole {
    /// Sum of the areas, and their middle times this sum.
    area: f64,
    moment: [f64; 3],
    /// Sum of the areas along their outward normals.
    vector: [f64; 3],
    centre: [f64; 3],
    /// From the centre to the farthest corner of the box.
    radius: f64,
}

impl Dipole {
    fn of(parts: impl Iterator<Item = (f64, [f64; 3], [f64; 3])>, ends: [[f64; 3]; 2]) -> Self {
        let (mut area, mut moment, mut vector) = (0.0, [0.0; 3], [0.0; 3]);
        for (of, at, along_normal) in parts {
            area += of;
            moment = along(moment, 1.0, at);
            vector = along(vector, 1.0, along_normal);
        }
        let middle = std::array::from_fn(|i| 0.5 * (ends[0][i] + ends[1][i]));
        let centre = if area > 0.0 { moment.map(|m| m / area) } else { middle };
        let far = |i: usize| (centre[i] - ends[0][i]).max(ends[1][i] - centre[i]);
        let radius = norm(std::array::from_fn(far));
        Self { area, moment, vector, centre, radius }
    }

    fn both(a: Self, b: Self, ends: [[f64; 3]; 2]) -> Self {
        Self::of([a, b].into_iter().map(|d| (d.area, d.moment, d.vector)), ends)
    }
}

impl Winding {
    pub(super) fn new(places: Vec<[[f64; 3]; 3]>) -> Self {
        let tree = Tree::new(&places);
        let leaf = |own: &[u32], ends: [[f64; 3]; 2]| {
            let parts = own.iter().map(|t| {
                let place = places[*t as usize];
                let vector = normal(place).map(|v| 0.5 * v);
                let area = norm(vector);
                let third = |i: usize| area * (place[0][i] + place[1][i] + place[2][i]) / 3.0;
                (area, std::array::from_fn(third), vector)
            });
            Dipole::of(parts, ends)
        };
        let dipoles = tree.sums(leaf, Dipole::both);
        Self { places, tree, dipoles }
    }

    /// The winding number at a place.
    pub(super) fn at(&self, p: [f64; 3]) -> f64 {
        self.sum(p).0
    }

    /// Whether the surface goes round a place.
    pub(super) fn is_inside(&self, p: [f64; 3]) -> bool {
        self.at(p) > INSIDE
    }

    /// How many boxes and triangles are looked at for it.
    pub(super) fn looked_at(&self, p: [f64; 3]) -> u32 {
        self.sum(p).1
    }

    fn sum(&self, p: [f64; 3]) -> (f64, u32) {
        let looked = std::cell::Cell::new(0);
        let (mut far, mut near) = (0.0, 0.0);
        let into = |at: usize| {
            let dipole = &self.dipoles[at];
            looked.set(looked.get() + 1);
            let away = minus(dipole.centre, p);
            let square = square(away);
            let is_near = square <= (FAR * dipole.radius).powi(2);
            if !is_near {
                far += dot(dipole.vector, away) / (square * square.sqrt());
            }
            is_near
        };
        self.tree.descend(into, |triangle| {
            looked.set(looked.get() + 1);
            near += solid_angle(self.places[triangle].map(|corner| minus(corner, p)));
        });
        ((far + near) / (4.0 * PI), looked.get())
    }
}

/// Solid angle of a triangle seen from the origin, positive from behind (van Oosterom & Strackee, *The
/// solid angle of a plane triangle*, 1983).
fn solid_angle([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let [x, y, z] = [norm(a), norm(b), norm(c)];
    let volume = dot(a, cross(b, c));
    let below = x * y * z + dot(a, b) * z + dot(b, c) * x + dot(c, a) * y;
    2.0 * volume.atan2(below)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;
    use crate::mesh::tests::ball;
    use proptest::prelude::*;

    fn places(mesh: &Mesh) -> Vec<[[f64; 3]; 3]> {
        mesh.triangles.iter().map(|t| t.map(|c| mesh.vertices_mm[c as usize])).collect()
    }

    #[test]
    fn an_octant_is_an_eighth_of_what_is_seen() {
        let axes = [[2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 0.5]];
        assert!((solid_angle(axes) - 0.5 * PI).abs() < 1e-14);
        let [a, b, c] = axes;
        assert!((solid_angle([b, a, c]) + 0.5 * PI).abs() < 1e-14);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// 1 inside, 0 outside, and as much as all triangles one by one.
        #[test]
        fn a_closed_ball_goes_round_its_inside_once(p in prop::array::uniform3(-12.0..12.0f64)) {
            static BALL: std::sync::OnceLock<Winding> = std::sync::OnceLock::new();
            let winding = BALL.get_or_init(|| Winding::new(places(&ball(5.0, 4))));
            let far = norm(p);
            prop_assume!(!(4.95..=5.0).contains(&far));
            let due = if far < 5.0 { 1.0 } else { 0.0 };
            prop_assert!((winding.at(p) - due).abs() < 0.02, "{} at {p:?}", winding.at(p));
            let all: f64 = winding.places.iter().map(|t| solid_angle(t.map(|c| minus(c, p)))).sum();
            prop_assert!((all / (4.0 * PI) - due).abs() < 1e-9);
        }
    }

    #[test]
    fn few_triangles_are_looked_at() {
        let winding = Winding::new(places(&ball(5.0, 5)));
        let looked = winding.looked_at([0.0, 0.0, 5.5]);
        assert!(looked < 600, "{looked} of 8192");
    }
}
