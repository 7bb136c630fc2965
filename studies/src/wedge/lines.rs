//! SED along the lines of the section that the paper's figures show.

use super::WedgeError;
use papilla_atlas::PA_PER_MPA;
use papilla_fem::mesh::probe::{Probe, line};
use papilla_fem::solve::Solver;
use papilla_fingertip::geometry::section::SectionShape;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::tissue::Tissue;
use papilla_solid::tensor::Kinematics;

/// Depths of figures 2(b) and 3, mm: the two sides of the dermis and its middle.
pub const DEPTHS_MM: [f64; 3] = [0.2, 0.7, 1.2];
/// Intervals of the depth line in epidermis, dermis and fat.
const INTERVALS: [usize; 3] = [40, 100, 200];
/// Largest change of volume that is believed. The pressure under the tip, some 200 kPa,
/// changes that of a tissue of nu 0.48 by a sixth. An element that the tip has
/// crushed shows more at its rim, where the skin it stood for is folded.
const GROWTH_MAX: f64 = 0.4;
/// How far figures 2(b) and 3 go to the side, mm.
const LATERAL_MM: f64 = 3.0;

/// SED at a point of the depth line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthPoint {
    /// Undeformed depth below the skin, mm.
    pub depth_mm: f64,
    /// Side: an interface has a point of each tissue.
    pub tissue: Tissue,
    /// SED, J/m3 of undeformed volume.
    pub sed_j_per_m3: f64,
}

/// SED against x at one depth.
#[derive(Clone, Debug, PartialEq)]
pub struct LateralLine {
    /// Depth below the skin, along its normal, mm.
    pub depth_mm: f64,
    /// Tissue whose side is shown.
    pub tissue: Tissue,
    /// `(x, SED)`, mm and J/m3; x undeformed, from 0.
    pub points: Vec<[f64; 2]>,
}

/// SED along the lines at one equilibrium.
pub(super) struct Read {
    /// The depth line.
    pub depth_line: Vec<DepthPoint>,
    /// Points of it where an element is not to be believed.
    pub left_out: usize,
    /// Each depth, once for every tissue that meets there.
    pub lateral: Vec<LateralLine>,
}

/// Where the figures' lines are in a mesh.
pub struct Lines {
    depths_mm: Vec<f64>,
    depth: Probe,
    /// `(depth, x of each point, probe)`.
    lateral: Vec<(f64, Vec<f64>, Probe)>,
}

impl Lines {
    /// Finds the lines. Lateral points lie straight below skin nodes, where the
    /// mesh holds the layers' curves exactly.
    pub(super) fn new(shape: &SectionShape, body: &Body) -> Result<Self, WedgeError> {
        let mesh = &body.problem.mesh;
        let skin = shape.skin(0.0)[1];
        let [_, b, c, d] = shape.layers(0.0);
        let mut depths_mm = vec![0.0];
        let mut points = vec![[0.0, skin, 0.0]];
        for (end, intervals) in [b, c, d].into_iter().zip(INTERVALS) {
            let last = points[points.len() - 1];
            points.extend(line(last, [end[0], end[1], 0.0], intervals).into_iter().skip(1));
        }
        depths_mm.extend(points.iter().skip(1).map(|p| p[1] - skin));
        let depth = Probe::new(mesh, &points)?;
        let mut angles: Vec<f64> = mesh.surfaces["skin"]
            .walk()
            .into_iter()
            .map(|n| mesh.nodes[n as usize][0])
            .take_while(|x| *x <= LATERAL_MM)
            .map(|x| shape.pad_angle(x))
            .collect();
        angles.dedup();
        let lateral = DEPTHS_MM
            .iter()
            .map(|&depth| {
                let at = |&a: &f64| shape.below_skin(a, depth);
                let points: Vec<_> = angles.iter().map(at).map(|[x, y]| [x, y, 0.0]).collect();
                let x = points.iter().map(|p| p[0]).collect();
                Ok((depth, x, Probe::new(mesh, &points)?))
            })
            .collect::<Result<Vec<_>, WedgeError>>()?;
        Ok(Self { depths_mm, depth, lateral })
    }

    /// SED along the lines at the solver's equilibrium.
    pub(super) fn read(&self, body: &Body, solver: &Solver<'_>) -> Result<Read, WedgeError> {
        let history = |block, element| solver.history_of(block, element);
        let deformed = body.deformed(solver, &history);
        let (mut depth_line, mut left_out) = (Vec::new(), 0);
        let sed = self.depth.by_region(deformed.mesh, |sample| {
            let h = sample.displacement_gradient(deformed.mesh, deformed.u);
            let growth = Kinematics::new(h).j_minus_1;
            if growth.abs() > GROWTH_MAX { Ok(f64::NAN) } else { sample.sed_mpa(&deformed) }
        });
        for (&depth_mm, sides) in self.depths_mm.iter().zip(sed?) {
            for (region, sed) in sides.into_iter().filter(|(r, _)| *r != Tissue::Bone.region()) {
                if sed.is_nan() {
                    left_out += 1;
                } else {
                    depth_line.push(DepthPoint {
                        depth_mm,
                        tissue: Tissue::of(region),
                        sed_j_per_m3: sed * PA_PER_MPA,
                    });
                }
            }
        }
        let mut lateral = Vec::new();
        for (depth_mm, x, probe) in &self.lateral {
            let sed = probe.sed_mpa(&deformed)?;
            for tissue in Tissue::ALL {
                let points: Vec<_> = x
                    .iter()
                    .zip(&sed)
                    .filter_map(|(&x, sides)| {
                        let side = sides.iter().find(|(r, _)| *r == tissue.region())?;
                        Some([x, side.1 * PA_PER_MPA])
                    })
                    .collect();
                if !points.is_empty() {
                    lateral.push(LateralLine { depth_mm: *depth_mm, tissue, points });
                }
            }
        }
        Ok(Read { depth_line, left_out, lateral })
    }
}
