//! A flat plate on the fingertip: balances, and what published fingertips do.

use super::{CaseError, Check, Context};
use papilla_fem::solve::Options;
use papilla_fem::tensor::norm;
use papilla_fingertip::mesh::fingertip::Density;
use papilla_fingertip::scene::Pose;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_fingertip::simulation::record::Checks;

/// Refinement of the path between stored depths: the work integral needs it.
const REFINEMENT: u32 = 2;
/// Depth from which balances are judged, mm: the shallowest a campaign stores.
/// Before it a handful of coarse nodes touch and the work integral is poor.
const DEPTH_MIN_MM: f64 = 0.25;

/// One equilibrium of the flat indentation.
struct Equilibrium {
    depth_mm: f64,
    force_n: f64,
    area_mm2: f64,
    peak_mpa: f64,
    checks: Checks,
}

/// An indentation of the fingertip by a level plate.
pub(super) struct FlatIndentation {
    density: Density,
    equilibria: Vec<Equilibrium>,
}

impl Context {
    fn flat_press(&self) -> Result<&FlatIndentation, CaseError> {
        if let Some(press) = self.flat.get() {
            return Ok(press);
        }
        let press = if self.quick {
            FlatIndentation::solve(Density::Coarse, 0.1, 10)?
        } else {
            FlatIndentation::solve(Density::Medium, 0.2, 10)?
        };
        Ok(self.flat.get_or_init(|| press))
    }
}

impl FlatIndentation {
    /// Presses in steps of `step_mm`.
    fn solve(density: Density, step_mm: f64, steps: u32) -> Result<Self, CaseError> {
        let finger = Body::usual(density)?;
        let mut solver = finger.solver(Options::default())?;
        let depths: Vec<f64> = (1..=steps).map(|i| step_mm * f64::from(i)).collect();
        let skin = &finger.problem.mesh.surfaces["skin"];
        let mut equilibria = Vec::new();
        finger.press(
            &mut solver,
            &Approach::plate(Pose::default()),
            &Drive::Depths(depths),
            REFINEMENT,
            &mut |solver, record, _| {
                let pressure = solver.pressure_mpa(skin);
                let x = solver.deformed();
                let mut area = vec![0.0; x.len()];
                skin.add_nodal_areas(&|n| x[n as usize], &mut area);
                equilibria.push(Equilibrium {
                    depth_mm: record.depth_mm,
                    force_n: norm(record.force_n),
                    area_mm2: area
                        .iter()
                        .zip(&pressure)
                        .filter(|(_, p)| **p > 0.0)
                        .map(|(a, _)| a)
                        .sum(),
                    peak_mpa: pressure.iter().copied().fold(0.0, f64::max),
                    checks: record.checks,
                });
            },
        )?;
        Ok(Self { density, equilibria })
    }

    fn at(&self, depth_mm: f64) -> Result<&Equilibrium, CaseError> {
        let found = self.equilibria.iter().find(|e| (e.depth_mm - depth_mm).abs() < 1e-9);
        found.ok_or_else(|| format!("no equilibrium at {depth_mm} mm").into())
    }
}

pub(super) fn balances(context: &Context) -> Result<Vec<Check>, CaseError> {
    let press = context.flat_press()?;
    let judged = || press.equilibria.iter().filter(|e| e.depth_mm >= DEPTH_MIN_MM);
    let worst = |of: fn(&Checks) -> f64| judged().map(|e| of(&e.checks)).fold(0.0, f64::max);
    let first = judged().next().map_or(0.0, |e| e.depth_mm);
    let deepest = press.equilibria.last().map_or(0.0, |e| e.depth_mm);
    let row = |what: &str, value, tolerance| {
        let density = press.density;
        let quantity = format!("{density:?}, {first:.1} to {deepest:.1} mm: {what}, worst");
        Check::vanishes(quantity, value, tolerance, "equilibrium")
    };
    Ok(vec![
        row("int p n dA against reaction", worst(|c| c.contact_force_vs_pressure_integral), 1e-9),
        row("plate against supports", worst(|c| c.plate_vs_support_reaction), 1e-5),
        row("energy against work", worst(|c| c.energy_vs_work), 0.005),
        row("residual over forces", worst(|c| c.residual_relative), 1e-6),
        row("penetration, mm", worst(|c| c.penetration_mm_max), 1e-4),
    ])
}

pub(super) fn sanity(context: &Context) -> Result<Vec<Check>, CaseError> {
    let press = context.flat_press()?;
    let one = press.at(1.0)?;
    let late: Vec<_> = press.equilibria.iter().filter(|e| e.depth_mm >= DEPTH_MIN_MM).collect();
    let exponent = slope(late.iter().map(|e| (e.force_n.ln(), e.area_mm2.ln())));
    let stiffness: Vec<f64> = press
        .equilibria
        .windows(2)
        .map(|w| (w[1].force_n - w[0].force_n) / (w[1].depth_mm - w[0].depth_mm))
        .collect();
    let least_rise = stiffness.windows(2).map(|w| w[1] / w[0]).fold(f64::INFINITY, f64::min);
    let ratio = one.peak_mpa * one.area_mm2 / one.force_n;
    let bound = "Hertz without bone 0.25 N; bone stiffens it a few times";
    let paraboloid = "inverted paraboloid: 2 (Hertz: 1.5)";
    Ok(vec![
        Check::within("force at 1 mm, N", one.force_n, [0.25, 1.0], bound),
        Check::within(
            "contact area ~ force^n, n",
            exponent,
            [0.0, 2.0 / 3.0],
            "soft pads flatten: below Hertz' 2/3",
        ),
        Check::within(
            "convex force-depth: least ratio of successive stiffnesses",
            least_rise,
            [1.0, 10.0],
            "convex in published presses",
        ),
        Check::within("peak over mean pressure at 1 mm", ratio, [1.5, 2.6], paraboloid),
    ])
}

/// Slope of the least-squares line.
fn slope(points: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
    let n = points.clone().count() as f64;
    let (sx, sy) = points.clone().fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
    let (mx, my) = (sx / n, sy / n);
    let (xy, xx) =
        points.fold((0.0, 0.0), |s, p| (s.0 + (p.0 - mx) * (p.1 - my), s.1 + (p.0 - mx).powi(2)));
    xy / xx
}
