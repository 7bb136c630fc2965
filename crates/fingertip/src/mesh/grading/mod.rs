//! Lattice lines drawn together under an indenter.
//!
//! Nodes of the skin slide along it towards where the indenter is going to touch, and most
//! towards where it is curved: the lattice keeps its connectivity, and spacing follows contact. A chart of the
//! skin around the first touch has the indenter's own axes: `X` and `Y` are the place along them,
//! scaled to the straight distance from the first touch. Lines are drawn together along `X` and
//! `Y` apart, or along the distance from the indenter's axis where that needs fewer of them.

mod contact;
mod line;
mod spacing;

pub use contact::{Coming, Contact};

use super::half_cube::Grid;
use crate::geometry::fingertip::{FingertipShape, SurfaceParameter, smoothstep};
use line::LineMap;
use papilla_fem::tensor::norm;

/// Farthest from the first touch that nodes slide, mm along a straight line.
const REACH_MM: f64 = 10.0;
/// Part of the reach within which they slide all their way.
const WHOLE: f64 = 0.6;
/// Distance from what is held over which nodes come to a rest, mm.
const HELD_FADE_MM: f64 = 4.0;

/// How nodes of the skin slide.
#[derive(Clone, Debug)]
pub struct Grading {
    chart: Chart,
    lines: Lines,
    /// Part of their way that nodes go.
    strength: f64,
}

/// The skin around the first touch, in the plane.
#[derive(Clone, Debug)]
struct Chart {
    /// First touch, mm.
    centre: [f64; 3],
    /// The indenter's x and y axes.
    axes: [[f64; 3]; 2],
}

impl Chart {
    /// Place of a point of the skin, mm.
    fn place(&self, p: [f64; 3]) -> [f64; 2] {
        let r: [f64; 3] = std::array::from_fn(|i| p[i] - self.centre[i]);
        let c = self.axes.map(|a| (0..3).map(|i| a[i] * r[i]).sum::<f64>());
        let size = c[0].hypot(c[1]);
        if size > 0.0 { c.map(|v| v * norm(r) / size) } else { [0.0; 2] }
    }
}

#[derive(Clone, Debug)]
enum Lines {
    /// Along the indenter's x and y.
    Across(Box<[LineMap; 2]>),
    /// Along the distance from a centre of the chart, mm.
    Around(LineMap),
}

impl Grading {
    /// The sliding that suits a contact.
    #[must_use]
    pub fn new(shape: &FingertipShape, contact: &Contact) -> Self {
        let r = contact.start.rotation;
        let axes = [0, 1].map(|k| [r[0][k], r[1][k], r[2][k]]);
        let chart = Chart { centre: contact.first, axes };
        let touched = spacing::touched(shape, contact, axes);
        let places: Vec<_> = touched.iter().map(|t| (chart.place(t.at), t)).collect();
        let across = [0, 1].map(|k| {
            let points = places.iter().map(|(c, t)| (c[k], t.spacing_mm[k]));
            LineMap::new(REACH_MM, &spacing::along(points))
        });
        let around = places.iter().flat_map(|(c, t)| {
            let h = t.spacing_mm[0].min(t.spacing_mm[1]);
            let r = c[0].hypot(c[1]);
            [(r, h), (-r, h)]
        });
        let around = LineMap::new(REACH_MM, &spacing::along(around));
        let lines = if around.intervals.powi(2) < across[0].intervals * across[1].intervals {
            Lines::Around(around)
        } else {
            Lines::Across(Box::new(across))
        };
        Self { chart, lines, strength: 1.0 }
    }

    /// The same with nodes that go `factor` of their way.
    #[must_use]
    pub fn weaker(&self, factor: f64) -> Self {
        Self { strength: factor * self.strength, ..self.clone() }
    }

    /// Slides the nodes of a grid of cells of `step` intervals; those under the nail plate stay.
    /// Nodes between the corners of a cell come to lie in their middle.
    pub(super) fn slide(&self, shape: &FingertipShape, grid: &mut Grid, step: usize) {
        let n = step;
        let corners = [0, n, n * (n + 1) + n, n * (n + 1)];
        let mut at: Vec<_> = grid.parameters.iter().map(|&s| shape.skin(s)).collect();
        // What is held under the nail and what lies in the base plane stay to the last bit.
        let in_base = |s: &SurfaceParameter| matches!(s, SurfaceParameter::Body(_, t) if *t >= 1.0);
        let stays: Vec<bool> = at
            .iter()
            .zip(&grid.parameters)
            .map(|(&p, s)| shape.under_nail(p) || in_base(s))
            .collect();
        let mut slid = vec![false; at.len()];
        for cell in &grid.cells {
            for c in corners {
                let s = cell[c] as usize;
                if !slid[s] && !stays[s] {
                    at[s] = self.moved(shape, at[s]);
                }
                slid[s] = true;
            }
        }
        if step == 2 {
            for cell in &grid.cells {
                let [a, b, c, d] = corners.map(|k| cell[k] as usize);
                let between: [(usize, &[usize]); 5] =
                    [(1, &[a, b]), (3, &[a, d]), (4, &[a, b, c, d]), (5, &[b, c]), (7, &[c, d])];
                for (k, of) in between {
                    let s = cell[k] as usize;
                    if !slid[s] && !stays[s] {
                        let mean = |i: usize| of.iter().map(|&v| at[v][i]).sum::<f64>();
                        let p = std::array::from_fn(|i| mean(i) / of.len() as f64);
                        at[s] = shape.on_skin(p);
                        slid[s] = true;
                    }
                }
            }
        }
        for (s, p) in at.into_iter().enumerate() {
            if !stays[s] {
                grid.parameters[s] = shape.parameter_of(p);
            }
        }
    }

    /// Where a point of the skin slides to, mm; it is projected back onto the skin.
    #[must_use]
    pub fn moved(&self, shape: &FingertipShape, p: [f64; 3]) -> [f64; 3] {
        let from = self.chart.place(p);
        let r: [f64; 3] = std::array::from_fn(|i| p[i] - self.chart.centre[i]);
        let fade = self.strength * fade(norm(r) / REACH_MM) * free(shape, p);
        if fade <= 0.0 {
            return p;
        }
        let wanted = match &self.lines {
            Lines::Across(maps) => std::array::from_fn(|k| maps[k].moved_mm(from[k])),
            Lines::Around(map) => {
                let size = from[0].hypot(from[1]);
                let scale = if size > 0.0 { map.moved_mm(size) / size } else { 1.0 };
                from.map(|v| v * scale)
            }
        };
        let target: [f64; 2] = std::array::from_fn(|k| from[k] + fade * (wanted[k] - from[k]));
        self.at(shape, p, target)
    }

    /// The point of the skin at a place of the chart, from one nearby: the chart's own axes as
    /// the Jacobian, since the skin is smooth.
    fn at(&self, shape: &FingertipShape, near: [f64; 3], target: [f64; 2]) -> [f64; 3] {
        const ITERATIONS: usize = 30;
        let mut p = near;
        for _ in 0..ITERATIONS {
            let here = self.chart.place(p);
            let miss: [f64; 2] = std::array::from_fn(|k| target[k] - here[k]);
            if miss[0].hypot(miss[1]) < 1e-9 {
                break;
            }
            let [x, y] = self.chart.axes;
            let step: [f64; 3] = std::array::from_fn(|i| miss[0] * x[i] + miss[1] * y[i]);
            // Along the skin, not off it.
            let n = shape.skin_normal(p);
            let off: f64 = (0..3).map(|i| step[i] * n[i]).sum();
            p = shape.on_skin(std::array::from_fn(|i| p[i] + 0.8 * (step[i] - off * n[i])));
        }
        p
    }
}

/// 1 where nodes may slide all their way, 0 at the height of the nail plate and at the base plane,
/// where they are held.
fn free(shape: &FingertipShape, p: [f64; 3]) -> f64 {
    let below_nail = (0.25 * shape.height_mm - p[2]) / HELD_FADE_MM;
    let before_base = (shape.length_mm - p[0]) / HELD_FADE_MM;
    smoothstep(below_nail) * smoothstep(before_base)
}

/// 1 near the first touch, 0 at the reach, smooth between.
fn fade(part: f64) -> f64 {
    smoothstep((1.0 - part) / (1.0 - WHOLE))
}

#[cfg(test)]
mod tests;
