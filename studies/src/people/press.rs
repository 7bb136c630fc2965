//! What presses the finger, and how.

use crate::people::PeopleError;
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::indenter::IndenterError;
use papilla_fingertip::mesh::fingertip::{Density, Order};
use papilla_fingertip::mesh::grading::Contact;
use papilla_fingertip::scene::{
    EffectName, Geometry, MaterialSet, Motion, Pose, Scene, TissueTable,
};
use papilla_fingertip::simulation::body::rotation;
use papilla_fingertip::simulation::drive::{Approach, Drive};
use papilla_sdf::{Cylinder, IndenterSpec, Plate, Sphere};
use serde::{Deserialize, Serialize};

/// Laws and constants of the tissues.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Materials {
    /// The moduli at rest of Maeno 1998 and Chen, Shuai & Zhu, neo-Hookean.
    NeoHookean,
    /// Ogden's law with the constants of Chen, Shuai & Zhu for dermis and fat.
    Ogden,
    /// The set `people`: one Ogden term each in dermis and fat, fitted to people's fingers.
    People,
}

impl Materials {
    /// What it is called in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::NeoHookean => "neo-Hookean, moduli of Maeno 1998 and Chen, Shuai & Zhu",
            Self::Ogden => "Ogden, dermis and fat of Chen, Shuai & Zhu's Table 2",
            Self::People => "the set `people`, Ogden",
        }
    }

    /// The law of its soft tissues.
    #[must_use]
    pub const fn law(self) -> &'static str {
        match self {
            Self::NeoHookean => "neo-Hookean",
            Self::Ogden | Self::People => "Ogden's",
        }
    }

    /// The default finger with them.
    pub(crate) fn subject(self) -> Subject {
        let set = match self {
            Self::NeoHookean | Self::Ogden => MaterialSet::Papers,
            Self::People => MaterialSet::People,
        };
        let shape = FingertipShape::default();
        Subject { shape, table: set.table(), hyperelastic: self != Self::NeoHookean }
    }
}

/// The finger that is pressed: its shape, the constants of its tissues, and whether the laws of their
/// tables `ogden` are used.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Subject {
    pub shape: FingertipShape,
    pub table: TissueTable,
    pub hyperelastic: bool,
}

impl Subject {
    pub(crate) fn effects(&self) -> Vec<EffectName> {
        let mut effects = papilla_fingertip::scene::effects::usual();
        if self.hyperelastic {
            effects.extend(EffectName::named("hyperelastic"));
        }
        effects
    }

    /// The constants of what does not relax: a press is stored under what it was solved from.
    fn elastic(&self) -> TissueTable {
        let mut table = self.table.clone();
        for tissue in [&mut table.epidermis, &mut table.dermis, &mut table.subcutaneous] {
            tissue.prony = None;
        }
        table
    }
}

/// A rigid indenter that comes straight to the pad.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Press {
    /// Name of its files and in errors.
    pub name: String,
    pub indenter: IndenterSpec,
    pub pitch_deg: f64,
    /// Turn about the indenter's own axis, degrees.
    pub yaw_deg: f64,
    pub subject: Subject,
}

/// Greatest side of a plate, mm.
const PLATE_MM: f64 = 30.0;
/// How far before the end of the model a plate ends, mm.
const PLATE_ENDS_MM: f64 = 1.5;
/// Length of a cylinder, mm: it is longer than any finger is wide.
const CYLINDER_MM: f64 = 40.0;

/// The mesh that a press is solved on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Cells {
    pub density: Density,
    pub order: Order,
}

impl Cells {
    /// Split where the indenter touches, Hex27.
    pub(crate) const fn graded(density: Density) -> Self {
        Self { density, order: Order::Graded }
    }

    /// Even, Hex8: a tenth of the time.
    pub(crate) const COARSE: Self = Self { density: Density::Coarse, order: Order::Linear };
}

impl Press {
    /// A plate that is inclined tip first. It ends before the model does, which is about where people's
    /// fingers have the crease of the joint: what lies behind is not pressed by those who measure pads, and
    /// under a flat pad the cut there would bear half of 4 N.
    pub(crate) fn plate(pitch_deg: f64, subject: Subject) -> Self {
        let whole = Self::whole_plate(pitch_deg, subject);
        let Ok(touch) = whole.first_touch(&[1.0]) else { return whole };
        let along_mm = whole.subject.shape.length_mm - PLATE_ENDS_MM - touch.first[0];
        let half_mm = (along_mm / pitch_deg.to_radians().cos()).clamp(1.0, 0.5 * PLATE_MM);
        let size_mm = [2.0 * half_mm, PLATE_MM];
        Self { indenter: IndenterSpec::Plate(Plate { size_mm, ..Plate::default() }), ..whole }
    }

    fn whole_plate(pitch_deg: f64, subject: Subject) -> Self {
        let size_mm = [PLATE_MM, PLATE_MM];
        let indenter = IndenterSpec::Plate(Plate { size_mm, ..Plate::default() });
        let name = format!("plate-{pitch_deg}");
        Self { name, indenter, pitch_deg, yaw_deg: 0.0, subject }
    }

    /// A sphere of a curvature in 1/m; 0 is a plate.
    pub(crate) fn sphere(curvature_per_m: f64, subject: Subject) -> Self {
        if curvature_per_m == 0.0 {
            return Self { name: "sphere-0".into(), ..Self::plate(0.0, subject) };
        }
        let indenter = IndenterSpec::Sphere(Sphere { radius_mm: 1e3 / curvature_per_m });
        let name = format!("sphere-{curvature_per_m}");
        Self { name, indenter, ..Self::plate(0.0, subject) }
    }

    /// A cylinder that lies across the finger, turned about the normal of the pad.
    pub(crate) fn cylinder(curvature_per_m: f64, turn_deg: f64, subject: Subject) -> Self {
        let indenter = IndenterSpec::Cylinder(Cylinder {
            radius_mm: 1e3 / curvature_per_m,
            length_mm: CYLINDER_MM,
            ..Cylinder::default()
        });
        let name = format!("cylinder-{curvature_per_m}-{turn_deg}");
        Self { name, indenter, yaw_deg: turn_deg, ..Self::plate(0.0, subject) }
    }

    /// The scene that presses the finger, up to a depth.
    pub(crate) fn scene(&self, cells: Cells, depth_mm: f64) -> Scene {
        let Cells { density, order } = cells;
        Scene {
            geometry: Geometry::Fingertip {
                density,
                order,
                shape: self.subject.shape.clone(),
                finger: None,
            },
            materials: self.subject.elastic(),
            indenter: self.indenter.clone(),
            motion: Motion::to_depth(depth_mm, 1, self.pose()),
            effects: self.subject.effects(),
            ..Scene::usual()
        }
    }

    /// 1 if a positive turn carries the indenter's own y axis towards -x, else -1.
    pub(crate) fn turned_side(&self) -> f64 {
        let pose = Pose { yaw_deg: 1.0, ..Pose::default() };
        -rotation(pose)[0][1].signum()
    }

    fn pose(&self) -> Pose {
        Pose { pitch_deg: self.pitch_deg, yaw_deg: self.yaw_deg, ..Pose::default() }
    }

    /// The indenter in its pose.
    pub(crate) fn approach(&self) -> Result<Approach, PeopleError> {
        Approach::straight(&self.indenter, self.pose())
            .map_err(|source| PeopleError::Indenter { press: self.name.clone(), source })
    }

    /// Where it first touches the undeformed finger, on its way to some depths.
    pub(crate) fn first_touch(&self, depths_mm: &[f64]) -> Result<Contact, PeopleError> {
        let never = || PeopleError::Indenter {
            press: self.name.clone(),
            source: IndenterError::NeverTouches,
        };
        let drive = Drive::Depths(depths_mm.to_vec());
        self.approach()?.contact_with(&self.subject.shape, &drive).ok_or_else(never)
    }

    /// Radius of the sphere that Hertz' law would put in the place of the finger where it is first
    /// touched, mm: the geometric mean of its principal radii of curvature.
    pub(crate) fn finger_radius_mm(&self) -> Result<f64, PeopleError> {
        let contact = self.first_touch(&[1.0])?;
        Ok(radius_mm(&self.subject.shape, contact.first))
    }
}

/// Young's modulus of a finger that no press here is softer than by much, MPa.
const SOFT_MPA: f64 = 0.05;

impl Press {
    /// How deep Hertz' law goes at a force into a soft finger, mm.
    pub(crate) fn hertz_depth_mm(&self, force_n: f64) -> Result<f64, PeopleError> {
        let finger = 1.0 / self.finger_radius_mm()?;
        let curvature = match &self.indenter {
            IndenterSpec::Sphere(ball) => finger + 1.0 / ball.radius_mm,
            // Curved one way only.
            IndenterSpec::Cylinder(rod) => finger + 0.5 / rod.radius_mm,
            _ => finger,
        };
        Ok((0.75 * 0.75 * force_n * curvature.sqrt() / SOFT_MPA).powf(2.0 / 3.0))
    }
}

/// Radius of a finger where a plate first touches it, mm; see [`Press::finger_radius_mm`].
pub(crate) fn plate_radius_mm(pitch_deg: f64, subject: &Subject) -> Result<f64, PeopleError> {
    Press::plate(pitch_deg, subject.clone()).finger_radius_mm()
}

/// Distance over which normals are compared, mm.
const APART_MM: f64 = 0.2;

/// Geometric mean of the principal radii of the skin at one of its points, mm: the root of one over
/// the Gaussian curvature, from the normals beside it.
fn radius_mm(finger: &FingertipShape, at: [f64; 3]) -> f64 {
    let normal = finger.skin_normal(at);
    // Two directions along the skin, near to the finger's axis and across it.
    let along = |d: [f64; 3]| {
        let out: f64 = (0..3).map(|i| d[i] * normal[i]).sum();
        let t: [f64; 3] = std::array::from_fn(|i| d[i] - out * normal[i]);
        let size = papilla_vector::norm(t);
        t.map(|v| v / size)
    };
    let axes = [along([1.0, 0.0, 0.0]), along([0.0, 1.0, 0.0])];
    let mut turn = [[0.0; 2]; 2];
    for (j, axis) in axes.iter().enumerate() {
        let beside = |side: f64| {
            let p = std::array::from_fn(|i| at[i] + side * APART_MM * axis[i]);
            let on = finger.on_skin(p);
            (on, finger.skin_normal(on))
        };
        let (a, b) = (beside(-1.0), beside(1.0));
        let way: f64 = (0..3).map(|i| (b.0[i] - a.0[i]) * axis[i]).sum();
        for (k, other) in axes.iter().enumerate() {
            turn[k][j] = (0..3).map(|i| (b.1[i] - a.1[i]) * other[i]).sum::<f64>() / way;
        }
    }
    let gaussian = turn[0][0] * turn[1][1] - turn[0][1] * turn[1][0];
    gaussian.powf(-0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_radius_is_that_of_the_ellipses() {
        // Under the equator's lowest point: b^2 / a of the section and of the cap's profile, whose
        // other side is straight.
        let finger = FingertipShape { crease_depth_mm: 0.0, ..FingertipShape::default() };
        let half = [0.5 * finger.width_mm, 0.5 * finger.height_mm];
        let cap = finger.cap_length_mm;
        // On the cap alone, where both radii are finite.
        let x = 0.5 * cap;
        let z = -half[1] * (1.0 - (1.0 - x / cap).powi(2)).sqrt();
        // Of the ellipsoid x^2/a^2 + y^2/b^2 + z^2/c^2 = 1: K = 1 / (a b c s)^2,
        // s = x^2/a^4 + z^2/c^4.
        let s = (cap - x).powi(2) / cap.powi(4) + z * z / half[1].powi(4);
        let exact = cap * half[0] * half[1] * s;
        let found = radius_mm(&finger, [x, 0.0, z]);
        assert!((found / exact - 1.0).abs() < 2e-3, "{found} {exact}");
    }

    #[test]
    fn a_sphere_of_curvature_0_is_flat_and_one_of_694_small() {
        let flat = Press::sphere(0.0, Materials::NeoHookean.subject());
        assert_eq!(flat.indenter.name(), "plate");
        let IndenterSpec::Sphere(ball) = Press::sphere(694.0, Materials::Ogden.subject()).indenter
        else {
            panic!("no sphere")
        };
        assert!((ball.radius_mm - 1.441).abs() < 1e-3);
    }
}
