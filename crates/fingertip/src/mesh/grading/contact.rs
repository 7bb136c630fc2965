//! Where an indenter first touches the undeformed finger, whatever its mesh.

use crate::geometry::fingertip::{FingertipShape, SurfaceParameter, tangents};
use papilla_sdf::{Placement, SignedDistance};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// What cells are split for.
#[derive(Clone)]
pub struct Contact {
    /// The indenter's shape.
    pub shape: Arc<dyn SignedDistance>,
    /// Where it is at first touch.
    pub start: Placement,
    /// The point of the skin that it touches first, mm.
    pub first: [f64; 3],
    /// Unit vector along which it presses.
    pub direction: [f64; 3],
    /// How deep it presses in the states that are stored, mm, rising.
    pub depths_mm: Vec<f64>,
    /// Where it has slid to in states at the deepest of them, mm.
    pub slides_mm: Vec<[f64; 3]>,
}

/// How an indenter comes to the finger.
pub struct Coming<'a> {
    /// Its shape.
    pub shape: &'a Arc<dyn SignedDistance>,
    /// Its axes in the world, as columns; it presses along the third.
    pub rotation: [[f64; 3]; 3],
    /// Its highest point along its own z, mm.
    pub top_mm: f64,
    /// Where its axis meets the skin, mm along its own x and y from the point that a flat plate
    /// would touch first.
    pub offset_mm: [f64; 2],
    /// How deep it presses in the states that are stored, mm, rising.
    pub depths_mm: Vec<f64>,
    /// Where it has slid to in states at the deepest of them, mm along its own x and y.
    pub slides_mm: Vec<[f64; 2]>,
}

/// Step of the search for the first touch at its start and its end, mm.
const SEARCH_MM: (f64, f64) = (0.1, 1e-6);

impl Contact {
    /// The first touch of an indenter that comes straight; `None` if it passes the finger.
    #[must_use]
    pub fn new(finger: &FingertipShape, coming: &Coming<'_>) -> Option<Self> {
        let axis = |k: usize| [0, 1, 2].map(|i| coming.rotation[i][k]);
        let (x, y, direction) = (axis(0), axis(1), axis(2));
        let along = |p: [f64; 3]| -> f64 { (0..3).map(|i| p[i] * direction[i]).sum() };
        let plate = least(finger, direction, along)?;
        let [a, b] = coming.offset_mm;
        let start = Placement {
            rotation: coming.rotation,
            origin_mm: std::array::from_fn(|i| {
                plate[i] - coming.top_mm * direction[i] + a * x[i] + b * y[i]
            }),
        };
        let far = Self {
            shape: coming.shape.clone(),
            start,
            first: plate,
            direction,
            depths_mm: coming.depths_mm.clone(),
            slides_mm: (coming.slides_mm.iter())
                .map(|[a, b]| std::array::from_fn(|i| a * x[i] + b * y[i]))
                .collect(),
        };
        let limit = 2.0 * finger.length_mm;
        let first = least(finger, direction, |p| far.travel_mm(p, limit))?;
        let travel = far.travel_mm(first, limit);
        let origin_mm = std::array::from_fn(|i| start.origin_mm[i] + travel * direction[i]);
        travel.is_finite().then(|| Self { start: Placement { origin_mm, ..start }, first, ..far })
    }

    /// It slid aside, pressing straight there, to the deepest state alone.
    fn aside(&self, by_mm: [f64; 3]) -> Self {
        let origin_mm = std::array::from_fn(|i| self.start.origin_mm[i] + by_mm[i]);
        Self {
            start: Placement { origin_mm, ..self.start },
            depths_mm: vec![self.deepest_mm()],
            slides_mm: Vec::new(),
            ..self.clone()
        }
    }

    /// All of it as straight presses: on its way in, and one for each place that it slides to.
    pub(super) fn straight(&self) -> impl Iterator<Item = Self> + '_ {
        let straight = Self { slides_mm: Vec::new(), ..self.clone() };
        std::iter::once(straight).chain(self.slides_mm.iter().map(|by| self.aside(*by)))
    }

    /// How deep it presses in the end, mm.
    #[must_use]
    pub fn deepest_mm(&self) -> f64 {
        self.depths_mm.last().copied().unwrap_or(0.0)
    }

    /// Travel until the indenter reaches the undeformed point `p`, mm; infinite if it does not
    /// within `limit_mm`. Steps are as long as the clearance (sphere tracing).
    pub(super) fn travel_mm(&self, p: [f64; 3], limit_mm: f64) -> f64 {
        const STEPS_MAX: usize = 400;
        const TOUCH_MM: f64 = 1e-9;
        let mut travel = 0.0;
        for _ in 0..STEPS_MAX {
            let back = std::array::from_fn(|i| p[i] - travel * self.direction[i]);
            let free = self.start.clearance_mm(self.shape.as_ref(), back);
            if free < TOUCH_MM {
                return travel;
            }
            travel += free.max(TOUCH_MM);
            if travel >= limit_mm {
                return f64::INFINITY;
            }
        }
        f64::INFINITY
    }
}

/// The point of the skin with the least `value`: the best of samples, then a compass search
/// along the skin.
fn least(
    finger: &FingertipShape,
    direction: [f64; 3],
    value: impl Fn([f64; 3]) -> f64,
) -> Option<[f64; 3]> {
    let (mut best, mut at) = facing(finger, direction)
        .map(|p| (value(p), p))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|(v, _)| v.is_finite())?;
    let mut step = SEARCH_MM.0;
    while step > SEARCH_MM.1 {
        let n = finger.skin_normal(at);
        let [u, v] = tangents(n);
        let mut moved = false;
        for (c, s) in [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)] {
            let p = finger.on_skin(std::array::from_fn(|i| at[i] + step * (c * u[i] + s * v[i])));
            let found = value(p);
            if found < best {
                (best, at, moved) = (found, p, true);
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    Some(at)
}

/// Points of the skin, some .1 mm apart under the pad, whose outward normal is against
/// `direction`.
pub(super) fn facing(
    finger: &FingertipShape,
    direction: [f64; 3],
) -> impl Iterator<Item = [f64; 3]> + '_ {
    const ROUND: u32 = 400;
    const ALONG: u32 = 240;
    (0..=ALONG).flat_map(move |i| {
        // From the tip's pole over the equator to the base plane.
        let s = 2.0 * f64::from(i) / f64::from(ALONG);
        (0..ROUND).filter_map(move |j| {
            let (y, z) = (TAU * f64::from(j) / f64::from(ROUND)).sin_cos();
            let parameter = if s <= 1.0 {
                let (across, x) = (FRAC_PI_2 * s).sin_cos();
                SurfaceParameter::Cap([-x, across * y, -across * z])
            } else {
                SurfaceParameter::Body([y, -z], s - 1.0)
            };
            let n = finger.skin_normal_at(parameter);
            let along: f64 = (0..3).map(|i| n[i] * direction[i]).sum();
            (along < -0.05).then(|| finger.skin(parameter))
        })
    })
}
