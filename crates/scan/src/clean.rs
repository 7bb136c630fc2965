//! One skin of a scan: doubles joined, small pieces dropped, triangles turned the same way round,
//! small holes closed. Each is said.

use crate::{ScanError, Surface};
use papilla_vector::{cross, dot, minus, norm};
use std::collections::{BTreeMap, VecDeque};

/// Pieces of less than this share of the largest are dropped.
const PIECE_SHARE: f64 = 0.05;
/// Longest way round a hole that is closed, mm: a tenth of the way round a finger.
pub const HOLE_MAX_MM: f64 = 8.0;
/// Shortest way round a finger's cut end, mm.
const CUT_MIN_MM: f64 = 15.0;
/// Corners closer than this part of the surface's size are one.
const JOINED: f64 = 1e-6;

/// A surface with one piece, its triangles counter-clockwise seen from outside.
#[derive(Clone, Debug)]
pub struct Cleaned {
    /// The surface; holes are closed but the finger's cut end.
    pub surface: Surface,
    /// Corners along the cut end, in order; none if the surface is closed there.
    pub cut: Vec<u32>,
    /// What was done.
    pub done: Vec<String>,
}

/// Makes one skin of a scan. `axis` points from the tip towards the hand: the opening that lies
/// farthest along it is the cut end.
///
/// # Errors
/// [`ScanError::Flat`], [`ScanError::Pieces`], [`ScanError::Hole`].
pub fn clean(scan: &Surface, axis: [f64; 3]) -> Result<Cleaned, ScanError> {
    let mut done = Vec::new();
    let mut surface = joined(scan, &mut done);
    if surface.triangles.is_empty() {
        return Err(ScanError::Flat { count: scan.triangles.len() });
    }
    largest_piece(&mut surface, &mut done)?;
    turned(&mut surface, &mut done);
    let cut = close_holes(&mut surface, axis, &mut done)?;
    Ok(Cleaned { surface, cut, done })
}

/// Corners at the same place become one; triangles without area go.
fn joined(scan: &Surface, done: &mut Vec<String>) -> Surface {
    let step = JOINED * scan.diagonal_mm();
    let mut first = BTreeMap::new();
    let mut out = Surface::default();
    let new: Vec<u32> = scan
        .vertices_mm
        .iter()
        .map(|p| {
            *first.entry(p.map(|v| (v / step).round() as i64)).or_insert_with(|| {
                out.vertices_mm.push(*p);
                out.vertices_mm.len() as u32 - 1
            })
        })
        .collect();
    let mut seen = std::collections::BTreeSet::new();
    for t in &scan.triangles {
        let t = t.map(|c| new[c as usize]);
        let [a, b, c] = t.map(|c| out.vertices_mm[c as usize]);
        let area = norm(cross(minus(b, a), minus(c, a)));
        let mut key = t;
        key.sort_unstable();
        if area > step * step && seen.insert(key) {
            out.triangles.push(t);
        }
    }
    let gone = scan.triangles.len() - out.triangles.len();
    if gone > 0 {
        done.push(format!("dropped {gone} triangles without area or given twice"));
    }
    out
}

/// The triangles on each side of each edge, ends in rising order.
fn edges(surface: &Surface) -> BTreeMap<[u32; 2], Vec<usize>> {
    let mut edges: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (n, t) in surface.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_default().push(n);
        }
    }
    edges
}

fn corners(surface: &Surface, triangle: usize) -> [[f64; 3]; 3] {
    surface.triangles[triangle].map(|c| surface.vertices_mm[c as usize])
}

/// Twice a triangle's area along its normal.
fn normal(surface: &Surface, triangle: usize) -> [f64; 3] {
    let [a, b, c] = corners(surface, triangle);
    cross(minus(b, a), minus(c, a))
}

/// Keeps the largest piece, if all others are small.
fn largest_piece(surface: &mut Surface, done: &mut Vec<String>) -> Result<(), ScanError> {
    let edges = edges(surface);
    let mut piece = vec![usize::MAX; surface.triangles.len()];
    let mut areas: Vec<(f64, usize, [f64; 3])> = Vec::new();
    for first in 0..piece.len() {
        if piece[first] != usize::MAX {
            continue;
        }
        let (own, mut area, mut middle) = (areas.len(), 0.0, [0.0; 3]);
        let mut open = VecDeque::from([first]);
        piece[first] = own;
        while let Some(at) = open.pop_front() {
            let size = norm(normal(surface, at));
            area += 0.5 * size;
            for p in corners(surface, at) {
                for i in 0..3 {
                    middle[i] += size * p[i] / 6.0;
                }
            }
            let t = surface.triangles[at];
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                for &other in &edges[&[a.min(b), a.max(b)]] {
                    if piece[other] == usize::MAX {
                        piece[other] = own;
                        open.push_back(other);
                    }
                }
            }
        }
        areas.push((area, own, middle.map(|v| v / area)));
    }
    areas.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (largest, own, first_mm) = areas[0];
    let large = areas.iter().filter(|(area, ..)| *area > PIECE_SHARE * largest).count();
    if large > 1 {
        return Err(ScanError::Pieces { count: large, first_mm, second_mm: areas[1].2 });
    }
    if areas.len() > 1 {
        let rest: f64 = areas[1..].iter().map(|a| a.0).sum();
        done.push(format!("dropped {} small pieces, {rest:.1} mm2 in all", areas.len() - 1));
        let kept = |(n, t): (usize, &[u32; 3])| (piece[n] == own).then_some(*t);
        surface.triangles = surface.triangles.iter().enumerate().filter_map(kept).collect();
    }
    Ok(())
}

/// Turns triangles the same way round, then all of them outward.
fn turned(surface: &mut Surface, done: &mut Vec<String>) {
    let edges = edges(surface);
    let mut is_turned: Vec<Option<bool>> = vec![None; surface.triangles.len()];
    is_turned[0] = Some(false);
    let mut open = VecDeque::from([0]);
    // Whether a triangle walks an edge from its lower end, before any turn.
    let walks = |t: &[u32; 3], edge: [u32; 2]| (0..3).any(|k| [t[k], t[(k + 1) % 3]] == edge);
    while let Some(at) = open.pop_front() {
        let t = surface.triangles[at];
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let edge = [a.min(b), a.max(b)];
            // More than two triangles at an edge say nothing of each other.
            let [one, two] = edges[&edge][..] else { continue };
            let other = if one == at { two } else { one };
            if is_turned[other].is_none() {
                let same = walks(&t, edge) == walks(&surface.triangles[other], edge);
                is_turned[other] = Some(same != is_turned[at].unwrap_or(false));
                open.push_back(other);
            }
        }
    }
    let flip = |t: &mut [u32; 3]| t.swap(1, 2);
    let wrong = is_turned.iter().filter(|t| **t == Some(true)).count();
    for (t, _) in surface.triangles.iter_mut().zip(&is_turned).filter(|(_, w)| **w == Some(true)) {
        flip(t);
    }
    let [low, high] = surface.bounds_mm();
    let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * (low[i] + high[i]));
    let volume: f64 = (0..surface.triangles.len())
        .map(|n| dot(minus(corners(surface, n)[0], middle), normal(surface, n)))
        .sum();
    if volume < 0.0 {
        surface.triangles.iter_mut().for_each(flip);
    }
    let count = surface.triangles.len();
    let turned = if volume < 0.0 { count - wrong } else { wrong };
    if turned > 0 {
        done.push(format!("turned {turned} of {count} triangles outward"));
    }
}

/// Closes holes but the cut end, whose corners are returned.
fn close_holes(
    surface: &mut Surface,
    axis: [f64; 3],
    done: &mut Vec<String>,
) -> Result<Vec<u32>, ScanError> {
    let mut holes = Vec::new();
    for rim in rims(surface) {
        let at = |k: usize| surface.vertices_mm[rim[k % rim.len()] as usize];
        let around: f64 = (0..rim.len()).map(|k| norm(minus(at(k + 1), at(k)))).sum();
        let middle: [f64; 3] = std::array::from_fn(|i| {
            (0..rim.len()).map(|k| at(k)[i]).sum::<f64>() / rim.len() as f64
        });
        holes.push((rim, around, middle));
    }
    let cut = (0..holes.len())
        .filter(|&n| holes[n].1 > CUT_MIN_MM)
        .max_by(|&a, &b| dot(holes[a].2, axis).total_cmp(&dot(holes[b].2, axis)));
    let cut = cut.map_or_else(Vec::new, |n| holes.remove(n).0);
    for (rim, around, middle) in holes {
        if around > HOLE_MAX_MM {
            let (around_mm, at_mm, most_mm) = (around, middle, HOLE_MAX_MM);
            return Err(ScanError::Hole { around_mm, at_mm, most_mm });
        }
        let [x, y, z] = middle;
        done.push(format!("closed a hole of {around:.1} mm round ({x:.1}, {y:.1}, {z:.1}) mm"));
        let top = surface.vertices_mm.len() as u32;
        surface.vertices_mm.push(middle);
        for k in 0..rim.len() {
            surface.triangles.push([rim[k], rim[(k + 1) % rim.len()], top]);
        }
    }
    Ok(cut)
}

/// Rims of the surface, each walked with the hole to its left seen from outside, so that a triangle
/// over an edge of it has the edge in that order.
fn rims(surface: &Surface) -> Vec<Vec<u32>> {
    let walked: std::collections::BTreeSet<[u32; 2]> =
        surface.triangles.iter().flat_map(|t| (0..3).map(|k| [t[k], t[(k + 1) % 3]])).collect();
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for [a, b] in walked.iter().filter(|[a, b]| !walked.contains(&[*b, *a])) {
        next.entry(*b).or_default().push(*a);
    }
    let mut rims = Vec::new();
    while let Some((&first, _)) = next.iter().next() {
        let (mut rim, mut at) = (Vec::new(), first);
        while let Some(ends) = next.get_mut(&at) {
            rim.push(at);
            let to = ends.pop();
            if ends.is_empty() {
                next.remove(&at);
            }
            match to {
                Some(to) if to != first => at = to,
                _ => break,
            }
        }
        if rim.len() > 2 {
            rims.push(rim);
        }
    }
    rims
}
