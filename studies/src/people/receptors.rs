//! What a receptor feels: strain, stress and strain energy at a depth below the skin.

use crate::people::PeopleError;
use papilla_atlas::PA_PER_MPA;
use papilla_fem::element::{HistoryVariables, Inverted};
use papilla_fem::mesh::probe::Probe;
use papilla_fem::mesh::reader::SurfaceReader;
use papilla_fem::mesh::sample::{Deformed, Sample};
use papilla_fem::solve::Solver;
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::simulation::body::Body;
use papilla_fingertip::simulation::record::IncrementRecord;
use papilla_solid::tensor::{Kinematics, Mat3, eigen, trace};
use serde::{Deserialize, Serialize};

/// Distances from the middle of the indenter at which receptors are read, mm.
pub const SPACING_MM: f64 = 0.2;
/// Their number.
pub const PLACES: usize = 21;
/// Depths below the skin, mm; the first is the dermis-epidermis interface, from the dermis.
pub const DEPTHS_MM: [f64; 4] = [0.2, 0.5, 0.75, 1.0];
/// Where strain and stress of the interface's dermis side are read, mm: a quarter of the first
/// element in.
const BELOW_INTERFACE_MM: f64 = 0.02;

/// What a receptor may answer to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stimulus {
    /// Strain energy density, J/m3.
    Sed,
    /// Its square root, which goes as strain does.
    RootSed,
    /// Largest principal stretch less 1.
    TensileStrain,
    /// 1 less the least principal stretch.
    CompressiveStrain,
    /// Von Mises' stress, Pa.
    VonMises,
    /// Largest compressive principal stress, Pa.
    CompressiveStress,
    /// Mean of the compressive principal stresses, Pa.
    Pressure,
}

impl Stimulus {
    /// Every one.
    pub const ALL: [Self; 7] = [
        Self::Sed,
        Self::RootSed,
        Self::TensileStrain,
        Self::CompressiveStrain,
        Self::VonMises,
        Self::CompressiveStress,
        Self::Pressure,
    ];

    /// What it is called in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sed => "SED",
            Self::RootSed => "root of SED",
            Self::TensileStrain => "largest tensile strain",
            Self::CompressiveStrain => "largest compressive strain",
            Self::VonMises => "von Mises stress",
            Self::CompressiveStress => "largest compressive stress",
            Self::Pressure => "mean pressure",
        }
    }

    /// Its unit.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Sed => "J/m3",
            Self::RootSed => "(J/m3)^1/2",
            Self::TensileStrain | Self::CompressiveStrain => "1",
            Self::VonMises | Self::CompressiveStress | Self::Pressure => "Pa",
        }
    }
}

/// Radius of the disc that a population fills, mm: an afferent farther from the middle is silent in the
/// measured profiles.
const POPULATION_MM: f64 = 4.0;
/// Distance of a population's receptors, mm.
const POPULATION_SPACING_MM: f64 = 0.5;

/// Values of every stimulus at each place: `[depth][stimulus][place]`.
pub type Felt = Vec<Vec<Vec<f64>>>;

/// Receptors of a finger around the first touch of an indenter.
pub(crate) struct Receptors<'a> {
    body: &'a Body,
    interface: SurfaceReader,
    /// Points in the order depth, place, direction.
    probe: Probe,
    /// Points whose mean is felt at a place.
    directions: usize,
}

/// Along the finger and across it, both ways.
const DIRECTIONS: [[f64; 2]; 4] = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];

/// Places of a population, mm along the finger and across it from the middle.
pub(crate) fn population_mm() -> Vec<[f64; 2]> {
    let half = (POPULATION_MM / POPULATION_SPACING_MM).round() as i32;
    let at = |i: i32| POPULATION_SPACING_MM * f64::from(i);
    let square = (-half..=half).flat_map(|i| (-half..=half).map(move |j| [at(i), at(j)]));
    square.filter(|[x, y]| x.hypot(*y) <= POPULATION_MM).collect()
}

impl<'a> Receptors<'a> {
    /// Receptors at [`PLACES`] distances from `first` (mm), on the skin under an indenter that comes
    /// along +z; what is felt at one is the mean of [`DIRECTIONS`].
    pub(crate) fn lines(
        press: &str,
        finger: &FingertipShape,
        body: &'a Body,
        first: [f64; 3],
    ) -> Result<Self, PeopleError> {
        let place = |k: usize| DIRECTIONS.map(|d| d.map(|v| v * SPACING_MM * k as f64));
        let offsets: Vec<[f64; 2]> = (0..PLACES).flat_map(place).collect();
        Self::new(press, finger, body, first, (&offsets, DIRECTIONS.len()))
    }

    /// Receptors at [`population_mm`] around `first`.
    pub(crate) fn grid(
        press: &str,
        finger: &FingertipShape,
        body: &'a Body,
        first: [f64; 3],
    ) -> Result<Self, PeopleError> {
        Self::new(press, finger, body, first, (&population_mm(), 1))
    }

    fn new(
        press: &str,
        finger: &FingertipShape,
        body: &'a Body,
        first: [f64; 3],
        (offsets, directions): (&[[f64; 2]], usize),
    ) -> Result<Self, PeopleError> {
        let bad = |why: String| PeopleError::Receptor { press: press.into(), why };
        let (mut interface, mut points) = (Vec::new(), Vec::new());
        for depth_mm in DEPTHS_MM {
            for [along, across] in offsets {
                let p = [first[0] + along, first[1] + across, first[2]];
                let parameter = finger.parameter_of(p);
                let skin = finger.skin(parameter);
                let normal = finger.skin_normal(skin);
                let below = |d: f64| std::array::from_fn(|i| skin[i] - d * normal[i]);
                if depth_mm > finger.epidermis_mm {
                    points.push(below(depth_mm));
                } else {
                    let layers = finger.layers(parameter).map_err(|e| bad(e.to_string()))?;
                    interface.push(layers[1]);
                    points.push(below(depth_mm + BELOW_INTERFACE_MM));
                }
            }
        }
        let mesh = &body.problem.mesh;
        Ok(Self {
            body,
            interface: SurfaceReader::new(mesh, &mesh.surfaces["interface"], &interface),
            probe: Probe::new(mesh, &points).map_err(|e| bad(e.to_string()))?,
            directions,
        })
    }

    /// What they feel at an equilibrium.
    pub(crate) fn felt(
        &self,
        solver: &Solver<'_>,
        record: &IncrementRecord,
    ) -> Result<Felt, Inverted> {
        let history = |block, element| solver.history_of(block, element);
        let deformed = self.body.deformed(solver, &history);
        let mut values = Vec::with_capacity(self.probe.samples().len());
        for samples in self.probe.samples() {
            // A point on a face has an element on either side.
            let mut mean = [0.0; Stimulus::ALL.len()];
            for sample in samples {
                for (m, v) in mean.iter_mut().zip(felt_at(sample, &deformed)?) {
                    *m += v / samples.len() as f64;
                }
            }
            values.push(mean);
        }
        for (value, sed) in values.iter_mut().zip(self.interface_sed(record)) {
            value[0] = sed;
            value[1] = sed.max(0.0).sqrt();
        }
        let count = values.len() / (DEPTHS_MM.len() * self.directions);
        let mean = |depth: usize, stimulus: usize, place: usize| {
            let from = self.directions * (depth * count + place);
            let around = &values[from..from + self.directions];
            around.iter().map(|v| v[stimulus]).sum::<f64>() / self.directions as f64
        };
        let line = |d, s| (0..count).map(|p| mean(d, s, p)).collect();
        let depth = |d| (0..Stimulus::ALL.len()).map(|s| line(d, s)).collect();
        Ok((0..DEPTHS_MM.len()).map(depth).collect())
    }

    /// SED of the interface's dermis side, J/m3, as maps have it.
    fn interface_sed(&self, record: &IncrementRecord) -> Vec<f64> {
        let nodes = self.body.patch.as_ref().map_or(&[][..], |p| &p.patch.interface);
        let nodal = self.body.at_nodes(nodes, &record.sed_dermis_mpa);
        self.interface.read(|n| PA_PER_MPA * nodal[n as usize])
    }
}

/// Every stimulus at a point, in the order of [`Stimulus::ALL`].
fn felt_at(sample: &Sample, body: &Deformed<'_>) -> Result<[f64; Stimulus::ALL.len()], Inverted> {
    let sed = PA_PER_MPA * sample.sed_mpa(body)?;
    let k = Kinematics::new(sample.displacement_gradient(body.mesh, body.u));
    // C = I + 2 E; the roots of its eigenvalues are the principal stretches.
    let (green, _) = eigen::symmetric(&k.green_strain());
    let stretch = |e: f64| (1.0 + 2.0 * e).sqrt();
    let most = green.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = green.iter().copied().fold(f64::INFINITY, f64::min);
    let [von_mises, compressive, pressure] = stresses_pa(&cauchy_mpa(sample, body, &k)?);
    let (tensile_strain, compressive_strain) = (stretch(most) - 1.0, 1.0 - stretch(least));
    let root = sed.max(0.0).sqrt();
    Ok([sed, root, tensile_strain, compressive_strain, von_mises, compressive, pressure])
}

/// Cauchy stress `P F^T / J`, MPa, of tissues without memory; its pressure is that of the element's
/// dilatation.
fn cauchy_mpa(sample: &Sample, body: &Deformed<'_>, k: &Kinematics) -> Result<Mat3, Inverted> {
    let nodes = body.mesh.blocks[sample.block].element(sample.element);
    let local: Vec<_> = nodes.iter().map(|&n| body.u[n as usize]).collect();
    let material = &body.materials[sample.region(body.mesh)];
    let shape = body.geometry[sample.block].element(sample.element);
    let mut force = vec![[0.0; 3]; local.len()];
    let memory = HistoryVariables::default();
    let theta = material.evaluate(shape, &local, memory, &mut force, None)?.theta_minus_1;
    let theta_minus_1: f64 = sample.basis.iter().zip(theta).map(|(b, t)| b * t).sum();
    let p = material.first_piola_mpa(k, theta_minus_1, memory);
    let j = k.j();
    Ok(std::array::from_fn(|a| {
        std::array::from_fn(|b| (0..3).map(|i| p[a][i] * k.f[b][i]).sum::<f64>() / j)
    }))
}

/// Von Mises' stress, the largest compressive principal stress and the pressure, Pa, of a Cauchy
/// stress in MPa.
fn stresses_pa(cauchy_mpa: &Mat3) -> [f64; 3] {
    let (principal, _) = eigen::symmetric(cauchy_mpa);
    let [a, b, c] = principal;
    let von_mises = (0.5 * ((a - b).powi(2) + (b - c).powi(2) + (c - a).powi(2))).sqrt();
    let compressive = -principal.iter().copied().fold(f64::INFINITY, f64::min);
    [von_mises, compressive, -trace(cauchy_mpa) / 3.0].map(|v| PA_PER_MPA * v)
}

/// Name of a depth in tables.
#[must_use]
pub fn depth_name(depth: usize) -> String {
    let mm = DEPTHS_MM[depth];
    if depth == 0 { format!("{mm} mm (interface)") } else { format!("{mm} mm") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stresses_of_plain_states() {
        let pull = stresses_pa(&[[0.0; 3], [0.0, 2e-3, 0.0], [0.0; 3]]);
        assert!((pull[0] - 2e3).abs() < 1e-9 && pull[1].abs() < 1e-9);
        assert!((pull[2] + 2e3 / 3.0).abs() < 1e-9);
        // Pure shear: von Mises is root 3 of it, and there is no pressure.
        let shear = stresses_pa(&[[0.0, 1e-3, 0.0], [1e-3, 0.0, 0.0], [0.0; 3]]);
        assert!((shear[0] - 1e3 * 3f64.sqrt()).abs() < 1e-9 && (shear[1] - 1e3).abs() < 1e-9);
        let water = stresses_pa(&[[-1e-3, 0.0, 0.0], [0.0, -1e-3, 0.0], [0.0, 0.0, -1e-3]]);
        assert!(water[0].abs() < 1e-9 && (water[2] - 1e3).abs() < 1e-9);
    }
}
