//! Balls around neighbouring vertices. If a ball is far from an object, the distances of its
//! vertices need not be computed.

/// Vertices of a ball at most.
const LEAF: usize = 12;

/// A tree of balls over points.
#[derive(Debug)]
pub(crate) struct Clusters {
    /// Depth first; a leaf has no children.
    balls: Vec<Ball>,
    order: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Ball {
    centre_mm: [f64; 3],
    radius_mm: f64,
    first: u32,
    last: u32,
    /// Balls to step over if this one is far.
    size: u32,
}

impl Clusters {
    pub(crate) fn new(points_mm: &[[f64; 3]]) -> Self {
        let mut built = Self { balls: Vec::new(), order: (0..points_mm.len() as u32).collect() };
        if !points_mm.is_empty() {
            built.split(points_mm, 0, points_mm.len());
        }
        built
    }

    /// The points, neighbours beside each other.
    pub(crate) fn order(&self) -> &[u32] {
        &self.order
    }

    fn split(&mut self, points: &[[f64; 3]], first: usize, last: usize) {
        let own = &mut self.order[first..last];
        let bound = |i: usize, pick: fn(f64, f64) -> f64, from: f64| {
            own.iter().map(|&p| points[p as usize][i]).fold(from, pick)
        };
        let low: [f64; 3] = std::array::from_fn(|i| bound(i, f64::min, f64::INFINITY));
        let high: [f64; 3] = std::array::from_fn(|i| bound(i, f64::max, f64::NEG_INFINITY));
        let centre_mm: [f64; 3] = std::array::from_fn(|i| 0.5 * (low[i] + high[i]));
        let away = |p: &u32| -> f64 {
            (0..3).map(|i| (points[*p as usize][i] - centre_mm[i]).powi(2)).sum::<f64>().sqrt()
        };
        let radius_mm = own.iter().map(away).fold(0.0, f64::max);
        let at = self.balls.len();
        let (a, b) = (first as u32, last as u32);
        self.balls.push(Ball { centre_mm, radius_mm, first: a, last: b, size: 1 });
        if last - first > LEAF {
            let widest =
                |i: &usize, j: &usize| (high[*i] - low[*i]).total_cmp(&(high[*j] - low[*j]));
            let axis = (0..3).max_by(widest).unwrap_or(0);
            let own = &mut self.order[first..last];
            own.sort_by(|p, q| points[*p as usize][axis].total_cmp(&points[*q as usize][axis]));
            let middle = (first + last) / 2;
            self.split(points, first, middle);
            self.split(points, middle, last);
            self.balls[at].size = (self.balls.len() - at) as u32;
        }
    }

    /// Calls `each` with every point that may have less than `margin_mm` of free distance, of
    /// which `clearance_mm` tells a lower bound at any place; returns how often it was asked.
    pub(crate) fn near(
        &self,
        margin_mm: f64,
        clearance_mm: impl Fn([f64; 3]) -> f64,
        mut each: impl FnMut(u32),
    ) -> u32 {
        let (mut at, mut asked) = (0, 0);
        while let Some(ball) = self.balls.get(at) {
            asked += 1;
            if clearance_mm(ball.centre_mm) - ball.radius_mm > margin_mm {
                at += ball.size as usize;
                continue;
            }
            if ball.size == 1 {
                for &point in &self.order[ball.first as usize..ball.last as usize] {
                    each(point);
                }
            }
            at += 1;
        }
        asked
    }

    /// The point with the least free distance, of which `clearance_mm` tells a lower bound at any
    /// place, and how often it was asked; none where all of them are certainly farther than
    /// `margin_mm`.
    pub(crate) fn nearest(
        &self,
        points_mm: &[[f64; 3]],
        margin_mm: f64,
        clearance_mm: impl Fn([f64; 3]) -> f64,
    ) -> (Option<(f64, u32)>, u32) {
        let (mut at, mut asked) = (0, 0);
        let mut best: Option<(f64, u32)> = None;
        while let Some(ball) = self.balls.get(at) {
            asked += 1;
            let least = clearance_mm(ball.centre_mm) - ball.radius_mm;
            if (at == 0 && least > margin_mm) || best.is_some_and(|(free, _)| least >= free) {
                at += ball.size as usize;
                continue;
            }
            if ball.size == 1 {
                for &point in &self.order[ball.first as usize..ball.last as usize] {
                    asked += 1;
                    let free = clearance_mm(points_mm[point as usize]);
                    if best.is_none_or(|(least, _)| free < least) {
                        best = Some((free, point));
                    }
                }
            }
            at += 1;
        }
        (best, asked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_near_point_is_missed_and_air_takes_one_question() {
        let mut random = fastrand::Rng::with_seed(3);
        let points: Vec<[f64; 3]> =
            (0..400).map(|_| std::array::from_fn(|_| 10.0 * random.f64())).collect();
        let clusters = Clusters::new(&points);
        for radius in [0.5, 3.0, 20.0] {
            let centre = [2.0, 5.0, 11.0];
            let away = |p: [f64; 3]| -> f64 {
                (0..3).map(|i| (p[i] - centre[i]).powi(2)).sum::<f64>().sqrt() - radius
            };
            let mut found = Vec::new();
            clusters.near(0.2, away, |p| found.push(p));
            for (i, p) in points.iter().enumerate() {
                assert!(away(*p) > 0.2 || found.contains(&(i as u32)), "{i} at {}", away(*p));
            }
            let least = points.iter().map(|p| away(*p)).fold(f64::INFINITY, f64::min);
            let (nearest, asked) = clusters.nearest(&points, 0.2, away);
            let (free, point) = nearest.expect("it is near");
            assert_eq!((free, away(points[point as usize])), (least, least));
            assert!(asked < 400, "{asked} questions");
        }
        assert_eq!(clusters.near(1.0, |p| 100.0 + p[0], |_| panic!("all is far")), 1);
        assert_eq!(clusters.nearest(&points, 1.0, |p| 100.0 + p[0]), (None, 1));
    }
}
