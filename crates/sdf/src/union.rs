//! Indenter `union`: several parts that move as one body, and their signed distance.

use super::beneath::{beneath, may_be_covered};
use super::{Distance, Placed, SignedDistance};
use papilla_vector::norm;

/// The union of parts: outside, its gap is that of the nearest one; inside, that of the outer
/// surface of all, see [`beneath`]. Faces that other parts cover do not count.
///
/// At a seam, where two parts are as near, the gap is continuous and its gradient jumps to
/// the other part's. On the surface that is a concave corner, which skin rarely fills: a
/// node there is pushed by one part, or by the other after it has slid across; Newton's
/// line search accepts the kink because the contact potential is continuous. In the air
/// it is of no matter.
pub struct AnyOf {
    parts: Vec<Placed>,
    /// A ball round each part, so that far parts are not asked.
    balls: Vec<Ball>,
    cost: f64,
}

/// A ball that holds a body.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    centre_mm: [f64; 3],
    radius_mm: f64,
}

impl Ball {
    /// Round the box of what a body reaches; without end if it has none.
    #[must_use]
    pub fn round(body: &dyn SignedDistance) -> Self {
        let reach = |i: usize, sign: f64| {
            body.reach_mm(std::array::from_fn(|k| if k == i { sign } else { 0.0 }))
        };
        let ends: [[f64; 2]; 3] = std::array::from_fn(|i| [-reach(i, -1.0), reach(i, 1.0)]);
        if ends.as_flattened().iter().any(|end| !end.is_finite()) {
            return Self { centre_mm: [0.0; 3], radius_mm: f64::INFINITY };
        }
        let half = ends.map(|[low, high]| 0.5 * (high - low));
        let radius_mm = norm(half);
        Self { centre_mm: ends.map(|[low, high]| 0.5 * (low + high)), radius_mm }
    }

    /// A distance below which the body cannot be, mm; rounding is left out of it.
    #[must_use]
    pub fn free_mm(&self, p: [f64; 3]) -> f64 {
        let square: f64 = (0..3).map(|i| (p[i] - self.centre_mm[i]).powi(2)).sum();
        let far = square.sqrt();
        far - self.radius_mm - 1e-9 * (far + self.radius_mm)
    }
}

/// The distance that is less; the first one where they tie.
pub(super) fn nearer(a: Distance, b: Distance) -> Distance {
    if b.gap_mm < a.gap_mm { b } else { a }
}

/// Time of a distance where most parts lie over each other, in those of a sphere's: of the parts
/// whose balls hold the middle of one, and of the faces that these may cover of each other. A ball
/// takes a tenth of a sphere.
fn cost(parts: &[Placed], balls: &[Ball]) -> f64 {
    let at = |middle: &Ball| {
        let there = parts.iter().zip(balls);
        let there = there.filter(|(_, ball)| !(ball.free_mm(middle.centre_mm) > 0.0));
        let (count, sum) =
            there.fold((0.0, 0.0), |(n, sum), (part, _)| (n + 1.0, sum + part.cost()));
        sum * (1.0 + 0.5 * (count - 1.0f64).max(0.0))
    };
    0.1 * parts.len() as f64 + balls.iter().map(at).fold(0.0, f64::max)
}

impl AnyOf {
    /// Of these parts.
    #[must_use]
    pub fn new(parts: Vec<Placed>) -> Self {
        let balls: Vec<Ball> = parts.iter().map(|part| Ball::round(part)).collect();
        let cost = cost(&parts, &balls);
        Self { parts, balls, cost }
    }

    /// The least of a distance of the parts, which no ball undercuts.
    fn least(&self, p: [f64; 3], of: impl Fn(&Placed) -> f64) -> f64 {
        let mut least = f64::INFINITY;
        for (part, ball) in self.parts.iter().zip(&self.balls) {
            if !(ball.free_mm(p) > least) {
                least = least.min(of(part));
            }
        }
        least
    }
}

impl SignedDistance for AnyOf {
    /// Infinitely far from nothing.
    fn distance(&self, p: [f64; 3]) -> Distance {
        let mut found =
            Distance { gap_mm: f64::INFINITY, normal: [0.0, 0.0, 1.0], hessian: [[0.0; 3]; 3] };
        let (mut nearest, mut second_mm) = (0, f64::INFINITY);
        for (i, (part, ball)) in self.parts.iter().zip(&self.balls).enumerate() {
            let free_mm = ball.free_mm(p);
            if free_mm > found.gap_mm {
                second_mm = second_mm.min(free_mm);
                continue;
            }
            let new = part.distance(p);
            if new.gap_mm < found.gap_mm {
                second_mm = second_mm.min(found.gap_mm);
                (nearest, found) = (i, new);
            } else {
                second_mm = second_mm.min(new.gap_mm);
            }
        }
        if !may_be_covered(found.gap_mm, second_mm) {
            return found;
        }
        beneath(&self.parts, p, nearest, &found, &mut 0).map_or(found, |(_, outer)| outer)
    }

    fn reach_mm(&self, direction: [f64; 3]) -> f64 {
        self.parts.iter().map(|part| part.reach_mm(direction)).fold(f64::NEG_INFINITY, f64::max)
    }

    fn clearance_mm(&self, p: [f64; 3]) -> f64 {
        self.least(p, |part| part.clearance_mm(p))
    }

    fn side_mm(&self, p: [f64; 3]) -> f64 {
        self.least(p, |part| part.side_mm(p))
    }

    fn exits(&self, p: [f64; 3], each: &mut dyn FnMut(Distance) -> f64) {
        for part in &self.parts {
            part.exits(p, each);
        }
    }

    fn cost(&self) -> f64 {
        self.cost
    }

    fn mended(&self) -> Vec<String> {
        let each = self.parts.iter().enumerate();
        each.flat_map(|(i, part)| part.mended().into_iter().map(move |m| format!("part {i}: {m}")))
            .collect()
    }

    fn narrowest_mm(&self) -> f64 {
        self.parts.iter().map(Placed::narrowest_mm).fold(f64::INFINITY, f64::min)
    }
}
