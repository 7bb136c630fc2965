//! Where the skin is strained while a plate that rubs moves along the finger.
//!
//! As the preprint does with cameras, strain is that of the skin's surface from the state in which the
//! plate presses to the one to which it has moved. Its energy is that of a uniform, incompressible
//! membrane: whatever its modulus, it has no part in a share.

use crate::people::PeopleError;
use crate::people::press::{Cells, Press, Subject};
use crate::people::solution::{Reads, until};
use papilla_fem::mesh::probe::{Probe, ProbeError};
use papilla_fem::mesh::sample::Sample;
use papilla_fem::solve::{Options, Solver};
use papilla_fingertip::scene::{EffectName, Friction, PathPoint, Scene};
use papilla_fingertip::simulation::Simulation;
use papilla_fingertip::simulation::body::SimulationError;
use papilla_fingertip::simulation::drive::Visit;
use papilla_processor::thread_s;
use papilla_solid::tensor::Kinematics;
use papilla_validation::stored;
use papilla_vector::norm;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Skin nearer to the plate than this touches, mm.
const TOUCH_MM: f64 = 0.001;
/// Stored states of each of both ways.
const STATES: usize = 5;
/// Time of each way, s; the tissues do not relax here.
const TIME_S: f64 = 1.0;

/// What a press with a rubbing plate leaves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Tangential {
    /// What it was solved from.
    fingerprint: String,
    /// Share of the energy outside of contact, at the end.
    pub share_outside: f64,
    /// Force along the plate over that into the finger, at the end.
    pub along_over_normal: f64,
    /// Processor time, s.
    pub solve_s: f64,
}

impl Tangential {
    /// From `folder`, or solved and written there, on the even coarse mesh.
    pub(crate) fn found_or_solved(
        subject: &Subject,
        (force_n, shift_mm, friction): (f64, f64, f64),
        folder: &Path,
    ) -> Result<Self, PeopleError> {
        let press = Press::plate(0.0, subject.clone());
        let way = until(&press, force_n, Cells::COARSE, Reads::Contact, folder)?;
        let (reached_n, depth_mm) = way.path.deepest();
        let name = || "plate that moves along the finger".to_owned();
        let wanted = PeopleError::Force {
            press: name(),
            wanted_n: force_n,
            reached_n,
            depth_mm,
            why: way.ended.clone(),
        };
        let depth_mm = way.path.depth_at(force_n).ok_or(wanted)?;
        let scene = scene(&press, depth_mm, shift_mm, friction);
        let fingerprint = stored::fingerprint(&(&scene, env!("CARGO_PKG_VERSION")))?;
        let path = folder.join(format!("tangential-{}.json", &fingerprint[..8]));
        let found: Option<Self> = stored::read_json(&path)?;
        if let Some(found) = found.filter(|f| f.fingerprint == fingerprint) {
            return Ok(found);
        }
        let found = Self { fingerprint, ..solved(&scene, &name())? };
        papilla_output::atomic::write_json(&path, &found)?;
        Ok(found)
    }
}

fn scene(press: &Press, depth_mm: f64, shift_mm: f64, friction: f64) -> Scene {
    let mut scene = press.scene(Cells::COARSE, depth_mm);
    let point = |time_s, shift| PathPoint { time_s, depth_mm, shift_mm: [shift, 0.0] };
    scene.motion.depth_mm = None;
    scene.motion.path = Some(vec![point(TIME_S, 0.0), point(2.0 * TIME_S, shift_mm)]);
    scene.motion.increments = STATES;
    scene.effects.extend(EffectName::named("friction"));
    scene.friction = Friction { coefficient: friction };
    scene
}

fn solved(scene: &Scene, press: &str) -> Result<Tangential, PeopleError> {
    let failed = |e: SimulationError| PeopleError::Press { press: press.into(), source: e.into() };
    let begun_s = thread_s();
    let setup = Simulation::new(scene).map_err(failed)?;
    let skin = Skin::new(&setup)
        .map_err(|e| PeopleError::Receptor { press: press.into(), why: e.to_string() })?;
    let mut solver = setup.body.solver(Options::default()).map_err(failed)?;
    let (mut count, mut pressed) = (0, Vec::new());
    let mut found = Tangential::default();
    let visit: Visit<'_> = &mut |solver, record, _| {
        count += 1;
        if count == STATES {
            pressed = skin.edges(solver);
        }
        if count == 2 * STATES {
            found.share_outside = skin.share_outside(solver, &pressed);
            let [x, y, z] = record.force_n;
            found.along_over_normal = x.hypot(y) / z.abs();
        }
    };
    let pressed_so = setup.body.press(&mut solver, &setup.approach, &setup.drive, 1, visit);
    pressed_so.map_err(failed)?;
    Ok(Tangential { solve_s: thread_s() - begun_s, ..found })
}

/// Two edges of the skin at a place, deformed from two unit vectors across each other.
type Edges = [[f64; 3]; 2];

/// The palmar skin: the middle of each of its faces.
struct Skin<'a> {
    setup: &'a Simulation,
    places: Vec<Place>,
}

struct Place {
    sample: Sample,
    tangents: Edges,
    area_mm2: f64,
}

impl<'a> Skin<'a> {
    fn new(setup: &'a Simulation) -> Result<Self, ProbeError> {
        let mesh = &setup.body.problem.mesh;
        let surface = &mesh.surfaces[&setup.body.contact];
        let nodes = &mesh.nodes;
        let mut middles: Vec<([f64; 3], [f64; 3])> = Vec::new();
        surface.integrate(&[([0.0; 2], 4.0)], &|n| nodes[n as usize], &mut |face, value, area| {
            let at: [f64; 3] = std::array::from_fn(|i| {
                face.iter().zip(value).map(|(&n, v)| v * nodes[n as usize][i]).sum()
            });
            if at[2] < 0.0 {
                middles.push((at, area));
            }
        });
        let points: Vec<[f64; 3]> = middles.iter().map(|m| m.0).collect();
        let probe = Probe::new(mesh, &points)?;
        let places = probe.samples().iter().zip(&middles);
        let place = |(samples, (_, area)): (&Vec<Sample>, &([f64; 3], [f64; 3]))| {
            let area_mm2 = norm(*area);
            let tangents = tangents(area.map(|a| a / area_mm2));
            Place { sample: samples[0].clone(), tangents, area_mm2 }
        };
        Ok(Self { setup, places: places.map(place).collect() })
    }

    /// The deformed edges of every place.
    fn edges(&self, solver: &Solver<'_>) -> Vec<Edges> {
        let (mesh, u) = (&self.setup.body.problem.mesh, solver.displacement_mm());
        let of = |place: &Place| {
            let f = Kinematics::new(place.sample.displacement_gradient(mesh, u)).f;
            place.tangents.map(|t| f.map(|row| (0..3).map(|i| row[i] * t[i]).sum()))
        };
        self.places.iter().map(of).collect()
    }

    /// Share of the energy from `pressed` to the solver's state where the skin does not touch.
    fn share_outside(&self, solver: &Solver<'_>, pressed: &[Edges]) -> f64 {
        let (mesh, x) = (&self.setup.body.problem.mesh, solver.deformed());
        let (mut outside, mut all) = (0.0, 0.0);
        let moved = self.edges(solver);
        for ((place, from), to) in self.places.iter().zip(pressed).zip(&moved) {
            let energy = place.area_mm2 * membrane_energy(from, to);
            let gap = solver.distance(place.sample.interpolate(mesh, &x));
            all += energy;
            if gap.is_none_or(|d| d.gap_mm > TOUCH_MM) {
                outside += energy;
            }
        }
        outside / all
    }
}

/// Two unit vectors across the unit vector `n` and across each other.
fn tangents(n: [f64; 3]) -> Edges {
    let least = (0..3).min_by(|&a, &b| n[a].abs().total_cmp(&n[b].abs())).unwrap_or(0);
    let u: [f64; 3] = std::array::from_fn(|i| f64::from(u8::from(i == least)) - n[least] * n[i]);
    let size = norm(u);
    let u = u.map(|v| v / size);
    [u, std::array::from_fn(|i| n[(i + 1) % 3] * u[(i + 2) % 3] - n[(i + 2) % 3] * u[(i + 1) % 3])]
}

/// Energy of a stretched membrane whose edges `from` become `to`, for each mm2 between the unit edges
/// and over `E / (2 (1 - nu^2))` with nu = 1/2: `tr(e)^2 - det(e)`, `e` Green's strain.
fn membrane_energy(from: &Edges, to: &Edges) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| a[i] * b[i]).sum::<f64>();
    let metric = |e: &Edges| [dot(e[0], e[0]), dot(e[0], e[1]), dot(e[1], e[1])];
    let ([a, b, c], [p, q, r]) = (metric(from), metric(to));
    let size = a * c - b * b;
    // (A^-1 B - 1) / 2.
    let e = [
        [0.5 * ((c * p - b * q) / size - 1.0), 0.5 * (c * q - b * r) / size],
        [0.5 * (a * q - b * p) / size, 0.5 * ((a * r - b * q) / size - 1.0)],
    ];
    let (trace, det) = (e[0][0] + e[1][1], e[0][0] * e[1][1] - e[0][1] * e[1][0]);
    size.sqrt() * (trace * trace - det)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::people::press::Materials;

    #[test]
    fn a_turned_membrane_has_no_energy_and_a_stretched_one_its_own() {
        let from: Edges = [[1.1, 0.2, 0.0], [0.1, 0.9, 0.3]];
        let turned: Edges = from.map(|[x, y, z]| [-y, x, z]);
        assert!(membrane_energy(&from, &turned).abs() < 1e-15);
        let unit: Edges = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let pulled: Edges = [[1.1, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let strain = 0.5 * (1.1 * 1.1 - 1.0);
        assert!((membrane_energy(&unit, &pulled) - strain * strain).abs() < 1e-15);
        // Simple shear by g: e = [[0, g/2], [g/2, g^2/2]].
        let sheared: Edges = [[1.0, 0.0, 0.0], [0.2, 1.0, 0.0]];
        let exact = 0.02_f64.powi(2) + 0.01;
        assert!((membrane_energy(&unit, &sheared) - exact).abs() < 1e-15);
        // Twice the area, twice the energy.
        let twice = |e: Edges| [e[0].map(|v| 2.0 * v), e[1]];
        let (small, large) =
            (membrane_energy(&unit, &pulled), membrane_energy(&twice(unit), &twice(pulled)));
        assert!((large / small - 2.0).abs() < 1e-12);
    }

    /// A plate that slips drags the skin less far than one that sticks, and either leaves a part of
    /// the energy on both sides of the edge of contact.
    #[test]
    #[ignore = "long"]
    fn a_plate_that_moves_strains_skin_inside_and_outside() {
        let folder = tempfile::tempdir().unwrap();
        let subject = Materials::NeoHookean.subject();
        let found = |friction| {
            Tangential::found_or_solved(&subject, (0.2, 0.4, friction), folder.path()).unwrap()
        };
        let [slips, sticks] = [0.1, 2.0].map(found);
        for f in [&slips, &sticks] {
            assert!((0.05..0.999).contains(&f.share_outside), "{f:?}");
        }
        assert!(slips.along_over_normal <= 0.101 && sticks.along_over_normal > 0.101);
    }
}
