//! Triangles that are there twice, or are not turned as their neighbours are.

use super::super::normal;
use papilla_vector::{cross, dot, minus, norm};
use std::collections::{HashMap, HashSet};

/// A volume below this share of what the surface could hold says nothing.
const FLAT: f64 = 1e-6;

/// Leaves out triangles that are there twice; such as lie back to back only where most do, as of
/// surfaces that are told from both sides: else bodies touch there. Says how many.
pub(super) fn without_doubles(triangles: &mut Vec<[u32; 3]>) -> usize {
    let before = triangles.len();
    let sorted = |mut t: [u32; 3]| {
        t.sort_unstable();
        t
    };
    let distinct: HashSet<_> = triangles.iter().copied().map(sorted).collect();
    let two_sided = 2 * distinct.len() <= before + before / 8;
    // The corner of least number first: the same turn has the same order.
    let turned = |t: [u32; 3]| {
        let least = (0..3).min_by_key(|k| t[*k]).unwrap_or(0);
        [0, 1, 2].map(|k| t[(least + k) % 3])
    };
    let mut seen = HashSet::new();
    triangles.retain(|t| seen.insert(if two_sided { sorted(*t) } else { turned(*t) }));
    before - triangles.len()
}

/// Turns triangles as their neighbours are, and each connected surface outward. Says how many.
pub(super) fn outward(corners_mm: &[[f64; 3]], triangles: &mut [[u32; 3]]) -> usize {
    let edges = edges(triangles);
    let surfaces = surfaces(triangles, &edges);
    let boxes: Vec<_> = surfaces.iter().map(|s| s.ends(corners_mm, triangles)).collect();
    let mut count = 0;
    for (at, surface) in surfaces.iter().enumerate() {
        let mut flips = surface.flips();
        let holds = |a: &[[f64; 3]; 2], b: &[[f64; 3]; 2]| {
            (0..3).all(|i| a[0][i] < b[0][i] && b[1][i] < a[1][i])
        };
        let cavity = surface.is_closed
            && boxes.iter().enumerate().any(|(i, other)| i != at && holds(other, &boxes[at]));
        if !cavity && surface.is_inside_out(corners_mm, triangles, flips) {
            flips = !flips;
        }
        for &(triangle, flip) in &surface.members {
            if flip != flips {
                triangles[triangle].swap(1, 2);
                count += 1;
            }
        }
    }
    count
}

/// The triangles at each edge: the first two, and how many.
type Edges = HashMap<[u32; 2], ([usize; 2], u32)>;

fn edges(triangles: &[[u32; 3]]) -> Edges {
    let mut edges = Edges::with_capacity(2 * triangles.len());
    for (triangle, corners) in triangles.iter().enumerate() {
        for k in 0..3 {
            let [a, b] = [corners[k], corners[(k + 1) % 3]];
            let (of, count) = edges.entry([a.min(b), a.max(b)]).or_insert(([triangle; 2], 0));
            of[usize::from(*count > 0)] = triangle;
            *count += 1;
        }
    }
    edges
}

/// Triangles that are connected over edges of two, each with whether it is turned otherwise than the
/// first one.
struct Surface {
    members: Vec<(usize, bool)>,
    is_closed: bool,
}

fn surfaces(triangles: &[[u32; 3]], edges: &Edges) -> Vec<Surface> {
    let runs_along = |triangle: usize, [a, b]: [u32; 2]| {
        let t = triangles[triangle];
        (0..3).any(|k| t[k] == a && t[(k + 1) % 3] == b)
    };
    let mut seen = vec![false; triangles.len()];
    let mut surfaces = Vec::new();
    for first in 0..triangles.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let mut surface = Surface { members: vec![(first, false)], is_closed: true };
        let mut next = 0;
        while let Some(&(triangle, flip)) = surface.members.get(next) {
            next += 1;
            for k in 0..3 {
                let edge = [triangles[triangle][k], triangles[triangle][(k + 1) % 3]];
                let key = [edge[0].min(edge[1]), edge[0].max(edge[1])];
                let Some(&(of, 2)) = edges.get(&key) else {
                    surface.is_closed = false;
                    continue;
                };
                let other = if of[0] == triangle { of[1] } else { of[0] };
                if !std::mem::replace(&mut seen[other], true) {
                    surface.members.push((other, flip != runs_along(other, edge)));
                }
            }
        }
        surfaces.push(surface);
    }
    surfaces
}

impl Surface {
    /// How most of it is turned: what has this flag stays as it is.
    fn flips(&self) -> bool {
        2 * self.members.iter().filter(|(_, flip)| *flip).count() > self.members.len()
    }

    fn ends(&self, corners_mm: &[[f64; 3]], triangles: &[[u32; 3]]) -> [[f64; 3]; 2] {
        let places = || self.members.iter().flat_map(|(t, _)| triangles[*t]);
        let fold = |pick: fn(f64, f64) -> f64, from: f64| {
            std::array::from_fn(|i| places().map(|c| corners_mm[c as usize][i]).fold(from, pick))
        };
        [fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY)]
    }

    /// Whether it holds a negative volume if what has the flag `stays` stays as it is. Of an open one
    /// it is that of the cones from the middle of its rims.
    fn is_inside_out(&self, corners_mm: &[[f64; 3]], triangles: &[[u32; 3]], stays: bool) -> bool {
        let middle = self.middle_of_rims(corners_mm, triangles);
        let (mut volume, mut area) = (0.0, 0.0);
        for &(triangle, flip) in &self.members {
            let place = triangles[triangle].map(|c| minus(corners_mm[c as usize], middle));
            let sign = if flip == stays { 1.0 } else { -1.0 };
            volume += sign * dot(place[0], cross(place[1], place[2])) / 6.0;
            area += 0.5 * norm(normal(place));
        }
        volume < -FLAT * area * area.sqrt()
    }

    /// The middle of the edges of a single triangle; of all corners if there are none.
    fn middle_of_rims(&self, corners_mm: &[[f64; 3]], triangles: &[[u32; 3]]) -> [f64; 3] {
        let mut count: HashMap<[u32; 2], u32> = HashMap::new();
        for (triangle, _) in &self.members {
            let t = triangles[*triangle];
            for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
                *count.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
            }
        }
        let mut rim: Vec<u32> =
            count.iter().filter(|(_, n)| **n == 1).flat_map(|(edge, _)| *edge).collect();
        if rim.is_empty() {
            rim = self.members.iter().flat_map(|(t, _)| triangles[*t]).collect();
        }
        // In one order, so that the sum is the same each time.
        rim.sort_unstable();
        let n = rim.len().max(1) as f64;
        std::array::from_fn(|i| rim.iter().map(|c| corners_mm[*c as usize][i]).sum::<f64>() / n)
    }
}
