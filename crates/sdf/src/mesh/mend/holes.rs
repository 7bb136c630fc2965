//! Holes: their rims, and what closes them.

use super::super::winding::Winding;
use papilla_vector::{along, cross, minus, norm};
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;

/// A rim round less than this share of the square of its length is a crack.
const CRACK: f64 = 1e-4;
/// Places on either side of a hole at which the winding number is looked at.
const STEPS: i32 = 8;
/// Halvings that find where it is one half.
const HALVINGS: u32 = 24;
/// Winding numbers that a hole asks for at most.
pub(super) const LOOKS: u64 = 4 * STEPS as u64 + 2 * HALVINGS as u64;
/// The middle of a hole is left in its plane if it is no farther off, in radii of the hole: the
/// winding number is not more exact.
const PLANE: f64 = 0.03;
/// Across a surface the winding number jumps by one, in a hole it changes by less than this within a
/// thousandth of its radius.
const JUMP: f64 = 0.25;

/// The rims of the holes, each in the order in which a triangle that closes it runs along it. More
/// triangles at one edge are a rim only as far as they do not cancel.
pub(super) fn rims(triangles: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut net: HashMap<[u32; 2], i32> = HashMap::with_capacity(2 * triangles.len());
    for t in triangles {
        for [a, b] in [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]] {
            *net.entry([a.min(b), a.max(b)]).or_insert(0) += if a < b { 1 } else { -1 };
        }
    }
    // Against the way of the triangles that are there; ordered, so that it is the same each time.
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut open: Vec<_> = net.into_iter().filter(|(_, count)| *count != 0).collect();
    open.sort_unstable();
    for ([low, high], count) in open {
        let [from, to] = if count > 0 { [high, low] } else { [low, high] };
        for _ in 0..count.unsigned_abs() {
            next.entry(from).or_default().push(to);
        }
    }
    let mut rims = Vec::new();
    while let Some(start) = next.iter().find(|(_, to)| !to.is_empty()).map(|(from, _)| *from) {
        walk(start, &mut next, &mut rims);
        next.retain(|_, to| !to.is_empty());
    }
    rims
}

/// Goes on from a corner until there is no way; each time that it comes back to a corner of its way,
/// that is a rim.
fn walk(start: u32, next: &mut BTreeMap<u32, Vec<u32>>, rims: &mut Vec<Vec<u32>>) {
    let mut way = vec![start];
    let mut place = HashMap::from([(start, 0)]);
    while let Some(to) = way.last().and_then(|at| next.get_mut(at)?.pop()) {
        if let Some(&from) = place.get(&to) {
            rims.push(way[from..].to_vec());
            for gone in way.drain(from + 1..) {
                place.remove(&gone);
            }
        } else {
            place.insert(to, way.len());
            way.push(to);
        }
    }
}

/// Triangles from a rim to where the `open` surface has the winding number one half; none where it
/// has that nowhere near, as in a crack between surfaces that go round the body together.
pub(super) fn fan(rim: &[[f64; 3]], open: &Winding) -> Option<Vec<[[f64; 3]; 3]>> {
    let edges = || (0..rim.len()).map(|k| [rim[k], rim[(k + 1) % rim.len()]]);
    let (mut length, mut moment) = (0.0, [0.0; 3]);
    for [a, b] in edges() {
        let of = norm(minus(b, a));
        length += of;
        moment = along(along(moment, 0.5 * of, a), 0.5 * of, b);
    }
    if !(length > 0.0) {
        return None;
    }
    let middle = moment.map(|m| m / length);
    let area = edges()
        .fold([0.0; 3], |sum, [a, b]| along(sum, 0.5, cross(minus(a, middle), minus(b, middle))));
    let size = norm(area);
    if !(size > CRACK * length * length) {
        return None;
    }
    let n = area.map(|v| v / size);
    let radius = (size / PI).sqrt();
    let off = half(radius, &|off| open.at(along(middle, off, n)))?;
    let tip = along(middle, if off.abs() < PLANE * radius { 0.0 } else { off }, n);
    Some(edges().map(|[a, b]| [a, b, tip]).collect())
}

/// Where a number that falls outward is one half without a jump, within `radius` of 0 and as near to
/// it as can be.
fn half(radius: f64, number: &dyn Fn(f64) -> f64) -> Option<f64> {
    let at = |step: i32| radius * f64::from(step) / f64::from(STEPS);
    let near = (0..STEPS).flat_map(|k| [k, -1 - k]);
    for step in near {
        let [mut low, mut high] = [at(step), at(step + 1)];
        // The number is known to some hundredth.
        if !(number(low) >= 0.49 && number(high) <= 0.51) {
            continue;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if number(middle) > 0.5 { low = middle } else { high = middle }
        }
        let found = 0.5 * (low + high);
        let beside = 1e-3 * radius;
        if (number(found - beside) - number(found + beside)).abs() < JUMP {
            return Some(found);
        }
    }
    None
}
