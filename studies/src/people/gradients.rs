//! How the epidermis is deformed around the first touch of an indenter.

use crate::people::PeopleError;
use crate::people::receptors::{Felt, population_mm};
use papilla_fem::mesh::probe::Probe;
use papilla_fem::mesh::sample::Sample;
use papilla_fem::solve::Solver;
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::simulation::body::Body;

/// What is stored of a place: the displacement gradient, row by row, and the gap of the skin above.
pub(crate) const STORED: usize = 10;
/// How far below the skin its gap is read, mm: a point on the skin itself may lie beside the mesh.
const BELOW_SKIN_MM: f64 = 0.01;

/// The gap of skin that no indenter is near, mm: a number, so that it can be stored.
const FAR_MM: f64 = 1e3;

/// Places in the middle of the epidermis around the first touch.
pub(crate) struct Gradients<'a> {
    body: &'a Body,
    middle: Probe,
    skin: Probe,
}

impl<'a> Gradients<'a> {
    pub(crate) fn new(
        press: &str,
        finger: &FingertipShape,
        body: &'a Body,
        first: [f64; 3],
    ) -> Result<Self, PeopleError> {
        let below = |depth_mm: f64| {
            let point = |[along, across]: [f64; 2]| -> [f64; 3] {
                let p = [first[0] + along, first[1] + across, first[2]];
                let skin = finger.on_skin(p);
                let normal = finger.skin_normal(skin);
                std::array::from_fn(|i| skin[i] - depth_mm * normal[i])
            };
            let points: Vec<[f64; 3]> = population_mm().into_iter().map(point).collect();
            Probe::new(&body.problem.mesh, &points)
                .map_err(|e| PeopleError::Receptor { press: press.into(), why: e.to_string() })
        };
        let (middle, skin) = (below(0.5 * finger.epidermis_mm)?, below(BELOW_SKIN_MM)?);
        Ok(Self { body, middle, skin })
    }

    /// `[0][one of STORED][place]`.
    pub(crate) fn read(&self, solver: &Solver<'_>) -> Felt {
        let (mesh, u) = (&self.body.problem.mesh, solver.displacement_mm());
        let x = solver.deformed();
        let gap_mm = |s: &Sample| {
            let at = s.interpolate(mesh, &x);
            solver.distance(at).map_or(FAR_MM, |d| d.gap_mm) - BELOW_SKIN_MM
        };
        let places = self.middle.samples().iter().zip(self.skin.samples());
        let mut stored = vec![Vec::new(); STORED];
        for (middle, skin) in places {
            let gradient = middle[0].displacement_gradient(mesh, u);
            for (list, value) in stored.iter_mut().zip(gradient.as_flattened()) {
                list.push(*value);
            }
            stored[STORED - 1].push(gap_mm(&skin[0]));
        }
        vec![stored]
    }
}
