//! The outer surface of bodies that touch or overlap, as it is seen from inside.
//!
//! Outside, the distance of the nearest body is that of all. Inside it is so only where its foot
//! on that body's surface is free: bodies side by side cover each other's walls. The nearest free
//! point of all surfaces lies on a face of one body, in a concave edge between the faces of two,
//! or in a corner of three. So each body tells its faces ([`SignedDistance::exits`]), a point on
//! a face counts if no body [covers](SEAM_MM) it, and a covered one is moved on by the planes of
//! the body that covers it. Of plane faces the result is exact; curved ones are approached by
//! their tangent planes.

use super::{Distance, Placed, Placement, SignedDistance};
use papilla_vector::{along, cross, dot, minus, norm};

/// Bodies closer than this are one: there is no way in between, mm.
pub(crate) const SEAM_MM: f64 = 1e-3;
/// Depth from which a place is inside and not upon a surface, mm: rounding.
const INSIDE_MM: f64 = 1e-9;
/// Four directions across, in line with none that bodies are likely to have.
const ASIDE: [[f64; 2]; 4] = [[0.924, 0.383], [-0.383, 0.924], [-0.924, -0.383], [0.383, -0.924]];
/// Bodies whose free distance is remembered, so that far ones are not asked again.
const REMEMBERED: usize = 64;
/// Most distances that are asked for one point, in those of a sphere's: what is known by then counts.
const QUESTIONS_MAX: u32 = 4096;
/// Most planes that a point is moved by.
const PLANES_MAX: usize = 4;
/// Most faces that are looked at of a body that covers a point.
const FACES_MAX: usize = 12;
/// Most faces that are seen of it to find these.
const FACES_SEEN_MAX: u32 = 512;
/// Most steps from a point in the air to the surface.
const PULLS_MAX: u32 = 48;

/// Planes that touch a round surface of radius `radius_mm` about an axis or a point from outside,
/// across the axes that are `across`: what is round has no faces that could be told one by one.
pub(super) fn tangents(
    p: [f64; 3],
    radius_mm: f64,
    across: &[usize],
    each: &mut dyn FnMut(Distance) -> f64,
) {
    for &i in across {
        for sign in [-1.0, 1.0] {
            let mut normal = [0.0; 3];
            normal[i] = sign;
            each(Distance { gap_mm: sign * p[i] - radius_mm, normal, hessian: [[0.0; 3]; 3] });
        }
    }
}

/// Something that is placed.
pub trait Body {
    /// What it is.
    fn shape(&self) -> &dyn SignedDistance;
    /// Where.
    fn placement(&self) -> &Placement;
}

impl Body for Placed {
    fn shape(&self) -> &dyn SignedDistance {
        self.part.as_ref()
    }

    fn placement(&self) -> &Placement {
        &self.placement
    }
}

/// Whether a body with the second least gap can cover the foot of the nearest one.
#[must_use]
pub fn may_be_covered(gap_mm: f64, second_mm: f64) -> bool {
    gap_mm < 0.5 * SEAM_MM && second_mm < 2.0 * (gap_mm.abs() + SEAM_MM)
}

/// Distance from the outer surface of all `bodies` and the body that it belongs to, if the foot of
/// `p` on the nearest body, whose index and distance are given, is covered by others. None if it
/// is free, so that the nearest body's distance is right already.
///
/// Takes no memory. At most some thousand distances are asked for: `asked` grows by how many, in those
/// of a sphere.
#[must_use]
pub fn beneath<B: Body>(
    bodies: &[B],
    p: [f64; 3],
    nearest: usize,
    distance: &Distance,
    asked: &mut u32,
) -> Option<(usize, Distance)> {
    let size = norm(distance.normal);
    if !(size > 1e-6 && distance.gap_mm < 0.5 * SEAM_MM) {
        return None;
    }
    let out = distance.normal.map(|v| v / size);
    let mut search = Search {
        bodies,
        p,
        free_mm: [f64::NEG_INFINITY; REMEMBERED],
        best_mm: f64::INFINITY,
        found: None,
        questions: 0,
    };
    let covers = search.cover(along(p, -distance.gap_mm, out), out, Some(nearest));
    if covers.is_some() {
        search.run(nearest);
    }
    *asked += search.questions;
    search.found
}

/// A half-space to which a point has to go, `n . (y - p) >= depth_mm`.
#[derive(Clone, Copy)]
struct Plane {
    normal: [f64; 3],
    depth_mm: f64,
    bend: [[f64; 3]; 3],
    body: usize,
}

const NO_PLANE: Plane = Plane { normal: [0.0; 3], depth_mm: 0.0, bend: [[0.0; 3]; 3], body: 0 };

/// The shortest way into some half-spaces.
#[derive(Clone, Copy)]
struct Way {
    to: [f64; 3],
    length_mm: f64,
    hessian: [[f64; 3]; 3],
    /// Of the planes that it ends at, the one that turns it most first.
    bodies: [usize; 3],
    /// Between the normals of these planes: in a corner the way itself may run along one of them.
    between: [f64; 3],
}

struct Search<'a, B> {
    bodies: &'a [B],
    p: [f64; 3],
    /// Distance from `p` that is certainly free of each body; negative inside it.
    free_mm: [f64; REMEMBERED],
    best_mm: f64,
    found: Option<(usize, Distance)>,
    questions: u32,
}

impl<B: Body> Search<'_, B> {
    fn run(&mut self, nearest: usize) {
        for (free, body) in self.free_mm.iter_mut().zip(self.bodies) {
            *free = body.placement().clearance_mm(body.shape(), self.p);
        }
        let order = || {
            let others = (0..self.bodies.len()).filter(move |i| *i != nearest);
            std::iter::once(nearest).chain(others)
        };
        // Free faces first: they bound what has to be looked at between covered ones.
        let order: [_; 2] = [order(), order()];
        for (pass, order) in order.into_iter().enumerate() {
            for body in order {
                if self.free(body) < self.best_mm {
                    self.faces_of(body, pass == 1);
                }
            }
        }
    }

    fn free(&self, body: usize) -> f64 {
        self.free_mm.get(body).copied().unwrap_or(f64::NEG_INFINITY)
    }

    /// Looks at the faces of a body: at those that are free, or `between` those that are not.
    fn faces_of(&mut self, body: usize, between: bool) {
        let (p, bodies) = (self.p, self.bodies);
        let of = &bodies[body];
        of.placement().exits(of.shape(), p, &mut |face| {
            let depth_mm = -face.gap_mm;
            if depth_mm > -SEAM_MM && depth_mm < self.best_mm {
                let depth_mm = depth_mm.max(0.0);
                let plane = Plane { normal: face.normal, depth_mm, bend: face.hessian, body };
                let mut planes = [NO_PLANE; PLANES_MAX];
                planes[0] = plane;
                self.look(planes, 1, between);
            }
            if self.questions < QUESTIONS_MAX { self.best_mm } else { 0.0 }
        });
    }

    /// Takes the nearest point of the half-spaces if it is free, or else moves on by the planes of
    /// what covers it.
    fn look(&mut self, planes: [Plane; PLANES_MAX], count: usize, between: bool) {
        // What is as near adds nothing but rounding.
        let most_mm = self.best_mm - INSIDE_MM;
        let Some(way) = way(&planes[..count]).filter(|way| way.length_mm < most_mm) else {
            return;
        };
        if self.questions >= QUESTIONS_MAX {
            return;
        }
        let there = along(self.p, 1.0, way.to);
        let out = if way.length_mm > INSIDE_MM {
            way.to.map(|v| v / way.length_mm)
        } else {
            // Where planes meet at `p` itself, between their normals.
            let sum = std::array::from_fn(|i| planes[..count].iter().map(|p| p.normal[i]).sum());
            let size = norm(sum);
            if !(size > 1e-3) {
                return;
            }
            sum.map(|v| v / size)
        };
        let size = norm(way.between);
        let beyond = if size > 0.1 { way.between.map(|v| v / size) } else { out };
        let Some(cover) = self.cover(there, beyond, None) else {
            self.take(way, out, there);
            return;
        };
        if !between || count == PLANES_MAX || self.questions >= QUESTIONS_MAX {
            return;
        }
        let (faces, found) = self.planes_of(cover, there);
        for face in &faces[..found] {
            let mut planes = planes;
            planes[count] = *face;
            self.look(planes, count + 1, true);
        }
    }

    /// The body that covers a place of the surface whose outside is said to be in the direction
    /// `out`; another one than `own`.
    fn cover(&mut self, there: [f64; 3], out: [f64; 3], own: Option<usize>) -> Option<usize> {
        let beyond = along(there, SEAM_MM, out);
        let (gap_mm, body) = self.deepest(beyond, own);
        if gap_mm < -INSIDE_MM {
            return Some(body);
        }
        if gap_mm > 0.5 * SEAM_MM + INSIDE_MM {
            return None;
        }
        // On the surface of another one, or in a seam between others: a seam has no free side.
        let aside = cross(out, if out[0].abs() < 0.7 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] });
        let size = norm(aside);
        let aside = aside.map(|v| v / size);
        let across = cross(out, aside);
        let mut body = body;
        for [a, b] in ASIDE {
            let way: [f64; 3] = std::array::from_fn(|i| a * aside[i] + b * across[i]);
            let (gap_mm, inside) = self.deepest(along(beyond, 2.0 * SEAM_MM, way), own);
            if gap_mm > -INSIDE_MM {
                return None;
            }
            body = inside;
        }
        Some(body)
    }

    /// The least gap of a place from the bodies that may be near, but for `own`, and of which.
    fn deepest(&mut self, at: [f64; 3], own: Option<usize>) -> (f64, usize) {
        let far = norm(minus(at, self.p));
        let mut deepest = (f64::INFINITY, 0);
        for (i, body) in self.bodies.iter().enumerate() {
            if self.free(i) > far + SEAM_MM || own == Some(i) {
                continue;
            }
            self.questions += body.shape().cost() as u32;
            let gap_mm = side(body, at);
            if gap_mm < deepest.0 {
                deepest = (gap_mm, i);
            }
        }
        deepest
    }

    /// Planes that lead out of a body from a place inside it, the nearest ones.
    fn planes_of(&self, body: usize, at: [f64; 3]) -> ([Plane; FACES_MAX], usize) {
        let mut planes = [NO_PLANE; FACES_MAX];
        let (mut count, mut seen) = (0, 0);
        let of = &self.bodies[body];
        let behind = minus(at, self.p);
        of.placement().exits(of.shape(), at, &mut |face| {
            let depth_mm = dot(face.normal, behind) - face.gap_mm;
            if face.gap_mm < 0.0 && depth_mm > 0.0 {
                let new = Plane { normal: face.normal, depth_mm, bend: face.hessian, body };
                let place = planes[..count].partition_point(|plane| plane.depth_mm <= depth_mm);
                if place < FACES_MAX {
                    count = (count + 1).min(FACES_MAX);
                    planes[place..count].rotate_right(1);
                    planes[place] = new;
                }
            }
            seen += 1;
            if seen < FACES_SEEN_MAX { 2.0 * self.best_mm } else { 0.0 }
        });
        (planes, count)
    }

    /// Takes a free point; one in the air is drawn to the surface first.
    fn take(&mut self, way: Way, out: [f64; 3], there: [f64; 3]) {
        // Tangent planes of what is round meet beside its surface.
        let on_all = way.bodies.iter().all(|i| side(&self.bodies[*i], there) < 2.0 * SEAM_MM);
        let (way, out) = if on_all { (way, out) } else { self.pulled(way, out, there) };
        if way.length_mm < self.best_mm {
            self.best_mm = way.length_mm;
            let distance = Distance { gap_mm: -way.length_mm, normal: out, hessian: way.hessian };
            self.found = Some((way.bodies[0], distance));
        }
    }

    /// Gap of the nearest body.
    fn surface_gap(&mut self, at: [f64; 3]) -> f64 {
        self.questions += self.bodies.iter().map(|body| body.shape().cost() as u32).sum::<u32>();
        self.bodies.iter().map(|body| side(body, at)).fold(f64::INFINITY, f64::min)
    }

    /// Goes from a place in the air towards `p` for as long as it stays in the air: each step is the
    /// shortest way into the half-spaces beyond the tangent planes of what is near.
    fn pulled(&mut self, way: Way, out: [f64; 3], mut at: [f64; 3]) -> (Way, [f64; 3]) {
        let (mut best, mut last) = (way, way);
        for _ in 0..PULLS_MAX {
            if self.questions > QUESTIONS_MAX {
                break;
            }
            let mut planes = [NO_PLANE; PLANES_MAX];
            let mut gaps = [f64::INFINITY; PLANES_MAX];
            let behind = minus(at, self.p);
            for (i, body) in self.bodies.iter().enumerate() {
                self.questions += body.shape().cost() as u32;
                let found = body.placement().distance(body.shape(), at);
                let size = norm(found.normal);
                if !(size > 1e-6) {
                    continue;
                }
                let normal = found.normal.map(|v| v / size);
                let depth_mm = dot(normal, behind) - found.gap_mm;
                let place = gaps.partition_point(|gap| *gap <= found.gap_mm);
                if place < PLANES_MAX {
                    let plane = Plane { normal, depth_mm, bend: found.hessian, body: i };
                    gaps[place..].rotate_right(1);
                    planes[place..].rotate_right(1);
                    (gaps[place], planes[place]) = (found.gap_mm, plane);
                }
            }
            let count = gaps.partition_point(|gap| gap.is_finite());
            if is_seam(&planes[..count], &gaps) {
                best = last;
                break;
            }
            last = best;
            let Some(next) = shortest(&planes[..count]) else { break };
            let step = minus(next.to, behind);
            let share = [1.0, 0.5, 0.25, 0.125, 0.0625]
                .into_iter()
                .find(|share| self.surface_gap(along(at, *share, step)) > -0.1 * SEAM_MM);
            let Some(share) = share else { break };
            at = along(at, share, step);
            let to = minus(at, self.p);
            let length_mm = norm(to);
            // At `p` itself it is between bodies that touch, not in the air: a foot of `p` is covered.
            if !(length_mm < best.length_mm) || length_mm <= INSIDE_MM {
                break;
            }
            let gained = best.length_mm - length_mm;
            best = Way { to, length_mm, ..next };
            if gained < 1e-3 * INSIDE_MM {
                break;
            }
        }
        let out =
            if best.length_mm > INSIDE_MM { best.to.map(|v| v / best.length_mm) } else { out };
        (best, out)
    }
}

/// Whether two of these planes face each other without room in between.
fn is_seam(planes: &[Plane], gaps: &[f64; PLANES_MAX]) -> bool {
    let near = gaps.partition_point(|gap| *gap < 0.5 * SEAM_MM).min(planes.len());
    let near = &planes[..near];
    near.iter().enumerate().any(|(i, a)| near[..i].iter().any(|b| dot(a.normal, b.normal) < -0.99))
}

/// The shortest way into all of these half-spaces that lies on the last one: on its plane, in a
/// line with one more, or in a corner of three.
fn way(planes: &[Plane]) -> Option<Way> {
    let (last, others) = planes.split_last()?;
    let mut best: Option<Way> = None;
    let mut offer = |active: [&Plane; 3], count: usize| {
        if let Some(way) = meeting(active, count, planes)
            && best.as_ref().is_none_or(|b| way.length_mm < b.length_mm)
        {
            best = Some(way);
        }
    };
    offer([last; 3], 1);
    for (i, one) in others.iter().enumerate() {
        offer([last, one, one], 2);
        for two in &others[..i] {
            offer([last, one, two], 3);
        }
    }
    best
}

/// The shortest way into all of these half-spaces, whichever they are.
fn shortest(planes: &[Plane]) -> Option<Way> {
    let ways = (0..planes.len()).filter_map(|last| {
        let mut turned = [NO_PLANE; PLANES_MAX];
        turned[..planes.len()].copy_from_slice(planes);
        turned.swap(last, planes.len() - 1);
        way(&turned[..planes.len()])
    });
    ways.min_by(|a, b| a.length_mm.total_cmp(&b.length_mm))
}

/// The way to where some planes meet, if it is the shortest one into `all` half-spaces.
fn meeting(active: [&Plane; 3], count: usize, all: &[Plane]) -> Option<Way> {
    let factors = multipliers(active, count)?;
    if factors.iter().any(|f| *f < 0.0) {
        return None;
    }
    let to: [f64; 3] = std::array::from_fn(|i| {
        active.iter().zip(factors).map(|(plane, f)| f * plane.normal[i]).sum()
    });
    let length_mm = norm(to);
    let slack = 1e-9 * (1.0 + length_mm);
    if all.iter().any(|plane| dot(plane.normal, to) < plane.depth_mm - slack) {
        return None;
    }
    let out = to.map(|v| v / length_mm.max(f64::MIN_POSITIVE));
    let along_edge = if count == 2 {
        let t = cross(active[0].normal, active[1].normal);
        t.map(|v| v / norm(t))
    } else {
        [0.0; 3]
    };
    let hessian = match count {
        1 => active[0].bend,
        _ if length_mm < SEAM_MM => [[0.0; 3]; 3],
        _ => std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let unit = f64::from(u8::from(i == j));
                -(unit - out[i] * out[j] - along_edge[i] * along_edge[j]) / length_mm
            })
        }),
    };
    let most = (0..count).max_by(|a, b| factors[*a].total_cmp(&factors[*b])).unwrap_or(0);
    let mut bodies = active.map(|plane| plane.body);
    bodies.swap(0, most);
    let between =
        std::array::from_fn(|i| active[..count].iter().map(|plane| plane.normal[i]).sum());
    Some(Way { to, length_mm, hessian, bodies, between })
}

/// Factors of the normals whose sum reaches all `count` planes at once.
fn multipliers(active: [&Plane; 3], count: usize) -> Option<[f64; 3]> {
    let [a, b, c] = active;
    let (ab, ac, bc) = (dot(a.normal, b.normal), dot(a.normal, c.normal), dot(b.normal, c.normal));
    let [p, q, r] = active.map(|plane| plane.depth_mm);
    match count {
        1 => Some([p, 0.0, 0.0]),
        2 => {
            let det = 1.0 - ab * ab;
            (det > 1e-9).then(|| [(p - ab * q) / det, (q - ab * p) / det, 0.0])
        }
        _ => {
            let det = 1.0 + 2.0 * ab * ac * bc - ab * ab - ac * ac - bc * bc;
            (det > 1e-9).then(|| {
                let of = |x: f64, y: f64, z: f64| x / det + y / det + z / det;
                [
                    of(p * (1.0 - bc * bc), q * (ac * bc - ab), r * (ab * bc - ac)),
                    of(p * (ac * bc - ab), q * (1.0 - ac * ac), r * (ab * ac - bc)),
                    of(p * (ab * bc - ac), q * (ab * ac - bc), r * (1.0 - ab * ab)),
                ]
            })
        }
    }
}

/// Signed distance of a body's nearest surface, covered or not.
fn side<B: Body>(body: &B, at: [f64; 3]) -> f64 {
    body.placement().side_mm(body.shape(), at)
}

#[cfg(test)]
mod tests;
