//! Contact area, and how pressure is spread over it.

use papilla_fem::solve::Solver;
use papilla_fingertip::simulation::body::Body;
use papilla_vector::norm;
use serde::{Deserialize, Serialize};

/// What is read of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ContactRead {
    /// Area of the deformed skin that touches, mm2.
    pub area_mm2: f64,
    /// Peak over mean of the pressure; see [`peak_over_mean`].
    pub peak_over_mean: f64,
}

/// Skin nearer to the indenter than this touches, mm. Contact leaves less; beside it the skin bends
/// away as distance^1.5, so that a thousandth of a mm adds 2 to 3 % to an area of 30 mm2.
const TOUCH_MM: f64 = 0.001;
/// Parts of a face's side in which the skin is looked at.
const PARTS: usize = 8;

/// The contact of a plate that presses along `direction`; `None` where nothing touches.
pub(crate) fn read(
    body: &Body,
    solver: &Solver<'_>,
    rotation: [[f64; 3]; 3],
) -> Option<ContactRead> {
    let mesh = &body.problem.mesh;
    let surface = &mesh.surfaces[&body.contact];
    let x = solver.deformed();
    let in_plane = |p: [f64; 3]| [0, 1].map(|k| (0..3).map(|i| rotation[i][k] * p[i]).sum::<f64>());
    let mut touched = Moments::default();
    surface.integrate(&middles(), &|n| x[n as usize], &mut |face, value, area| {
        let at: [f64; 3] = std::array::from_fn(|i| {
            face.iter().zip(value).map(|(&n, v)| v * x[n as usize][i]).sum()
        });
        if solver.distance(at).is_some_and(|d| d.gap_mm <= TOUCH_MM) {
            touched.add(norm(area), in_plane(at));
        }
    });
    let mut areas = vec![0.0; x.len()];
    surface.add_nodal_areas(&|n| x[n as usize], &mut areas);
    let mut pressed = Moments::default();
    for ((p, area), at) in solver.pressure_mpa(surface).iter().zip(&areas).zip(&x) {
        if *p > 0.0 {
            pressed.add(p * area, in_plane(*at));
        }
    }
    (touched.sum > 0.0 && pressed.sum > 0.0).then(|| ContactRead {
        area_mm2: touched.sum,
        peak_over_mean: peak_over_mean(touched.covariance(), pressed.covariance()),
    })
}

/// Whether skin is pressed that lies, in the undeformed finger, further from the tip than `from_mm`.
pub(crate) fn reaches(body: &Body, solver: &Solver<'_>, from_mm: f64) -> bool {
    let mesh = &body.problem.mesh;
    let pressure = solver.pressure_mpa(&mesh.surfaces[&body.contact]);
    mesh.nodes.iter().zip(&pressure).any(|(at, p)| at[0] > from_mm && *p > 0.0)
}

/// Midpoints of the squares of a face, with their weights.
fn middles() -> Vec<([f64; 2], f64)> {
    let width = 2.0 / PARTS as f64;
    let at = |k: usize| -1.0 + width * (k as f64 + 0.5);
    let square = |k: usize| ([at(k % PARTS), at(k / PARTS)], width * width);
    (0..PARTS * PARTS).map(square).collect()
}

/// Peak over mean of a pressure `p0 (1 - rho^2)^m` over an ellipse, `rho` 1 on its edge: `m + 1`,
/// from the second moments of the ellipse (1/4 along each half axis) and of the pressure
/// (`1 / (2 m + 4)`): moments ask for no single value, which a mesh blurs. Hertz has 3/2, an
/// inverted paraboloid 2.
fn peak_over_mean(ellipse: [f64; 3], pressure: [f64; 3]) -> f64 {
    let [a, b, c] = ellipse;
    let [p, q, r] = pressure;
    // tr(ellipse^-1 pressure) / 2 = 2 / (m + 2).
    let share = 0.5 * (c * p - 2.0 * b * q + a * r) / (a * c - b * b);
    2.0 / share - 1.0
}

/// Sums of a weight, its first and its second moments in a plane.
#[derive(Default)]
struct Moments {
    sum: f64,
    first: [f64; 2],
    second: [f64; 3],
}

impl Moments {
    fn add(&mut self, weight: f64, [x, y]: [f64; 2]) {
        self.sum += weight;
        self.first[0] += weight * x;
        self.first[1] += weight * y;
        for (s, v) in self.second.iter_mut().zip([x * x, x * y, y * y]) {
            *s += weight * v;
        }
    }

    /// xx, xy and yy about the middle.
    fn covariance(&self) -> [f64; 3] {
        let [x, y] = self.first.map(|v| v / self.sum);
        let [xx, xy, yy] = self.second.map(|v| v / self.sum);
        [xx - x * x, xy - x * y, yy - y * y]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use papilla_fem::solve::Options;
    use papilla_fingertip::scene::Scene;
    use papilla_fingertip::simulation::Simulation;
    use papilla_solid::tensor::UNIT;

    /// A block that a larger plate squeezes touches it with its whole face, which has grown as its
    /// volume stayed.
    #[test]
    fn the_face_of_a_squeezed_block_touches() {
        let text = "
            [geometry]
            kind = \"block\"
            size_mm = [6.0, 4.0]
            elements = [6, 4]
            order = \"quadratic\"
            layers = [{ tissue = \"dermis\", thickness_mm = 5.0, elements = 3 }]
            [motion]
            depth_mm = 0.5
            increments = 2";
        let scene = Scene::parse("scene.toml".as_ref(), text.into()).unwrap();
        let Simulation { body, approach, drive, .. } = Simulation::new(&scene).unwrap();
        let mut solver = body.solver(Options::default()).unwrap();
        body.press(&mut solver, &approach, &drive, 1, &mut |_, _, _| ()).unwrap();
        let found = read(&body, &solver, UNIT).unwrap();
        // A tenth shorter is a tenth wider in area; the far end, which is held, takes some of it.
        assert!(found.area_mm2 > 24.0 * 1.05 && found.area_mm2 < 24.0 * 1.15, "{found:?}");
        // Nearly even, but for the edges, where a block without shear on its face has no peak.
        assert!((found.peak_over_mean - 1.0).abs() < 0.15, "{found:?}");
    }

    /// Pressures of known shape over an ellipse that lies askew.
    #[test]
    fn the_peak_of_a_known_pressure_is_found() {
        for power in [0.0, 0.5, 1.0, 2.0] {
            let (mut ellipse, mut pressure) = (Moments::default(), Moments::default());
            let count = 400;
            for i in -count..=count {
                for j in -count..=count {
                    let (u, v) = (f64::from(i) / 400.0, f64::from(j) / 400.0);
                    let inside = 1.0 - u * u - v * v;
                    if inside > 0.0 {
                        let at = [3.0 * u - v + 7.0, u + 2.0 * v];
                        ellipse.add(1.0, at);
                        pressure.add(inside.powf(power), at);
                    }
                }
            }
            let found = peak_over_mean(ellipse.covariance(), pressure.covariance());
            assert!((found - power - 1.0).abs() < 5e-3, "{power}: {found}");
        }
    }
}
