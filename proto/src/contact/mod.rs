//! Frames that say where objects are, in place of pressure, and the section `touch` of answers.
//!
//! A hello says what its frames hold with `input`, and announces objects and fingers.
//!
//! | `input` | kind | width x height | payload |
//! |---|---|---|---|
//! | `pressure` | 1 | a window, or vertices x 1 | samples, Pa |
//! | `objects` | 4 | 7 x objects | a [`Pose`] of each object of the hello, f32 |
//! | `gaps` | 5 | 224 x 224, or vertices x 1 | depth of the undeformed skin, mm; f32 or f16 |
//! | `pressure` with `traction` | 1 | 4 vertices x 1 | pressures, then traction along the skin at each vertex, x y z Pa; f32 or f16 |
//! | `gaps` with `velocity` | 5 | 4 vertices x 1 | depths, then how fast the thing at each vertex moves, x y z mm/s |
//!
//! With `force_target` a row of seven f32 more follows poses, and so many samples gaps: a unit
//! vector, the net force along it, N (0: none is asked), and three to be ignored. An answer to
//! objects or gaps begins with a [`Touch`].

mod method;

use papilla_sdf::AnnouncedShape;
use serde::{Deserialize, Serialize};

pub use method::{ContactErrors, ContactMethod, MethodError, MethodErrors, Spread};

/// Numbers of a pose, or of a net force.
pub const ROW: usize = 7;
/// Bytes of a pose.
pub const POSE_LEN: usize = 4 * ROW;
/// Bytes of a touch on the wire: sixteen little-endian f32.
pub const TOUCH_LEN: usize = 64;
/// Most objects of a session.
pub const OBJECTS_MAX: usize = 16;
/// Most fingers of a session.
pub const FINGERS_MAX: usize = 10;

/// What frames hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Input {
    /// Pressure on the skin, Pa.
    #[default]
    Pressure,
    /// How deep the undeformed skin lies in things, mm; negative in air.
    Gaps,
    /// Poses of the objects.
    Objects,
}

/// Where samples are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SampleLayout {
    /// Pixels of the 224 x 224 map.
    #[default]
    Map,
    /// Vertices of the atlas.
    Vertices,
}

/// An object that a hello announces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnnouncedObject {
    /// Its shape, as in scene files, or a closed mesh.
    pub shape: AnnouncedShape,
    /// Pressure over how far its surface gives way, MPa/mm; none: it is rigid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_mpa_per_mm: Option<f64>,
    /// Coulomb's coefficient of friction with the skin, 0 to 10; none: it is slippery.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<f64>,
}

/// The finger that a hello means where it names none.
pub const DEFAULT_FINGER: &str = "default";

/// A finger of the hand.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AnnouncedFinger {
    /// Whose it is: the name of a finger that the service has; none: [`DEFAULT_FINGER`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Width over that of the finger that is named.
    pub width: f64,
    /// Stiffness of its tissue over that of the finger that is named.
    pub stiffness: f64,
}

impl Default for AnnouncedFinger {
    fn default() -> Self {
        Self { name: None, width: 1.0, stiffness: 1.0 }
    }
}

impl AnnouncedFinger {
    /// The name of the finger that is meant.
    #[must_use]
    pub fn name(&self) -> &str {
        self.name.as_deref().unwrap_or(DEFAULT_FINGER)
    }
}

/// Where an object is in the finger's frame: 28 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Its origin, mm.
    pub origin_mm: [f32; 3],
    /// Its turn as a unit quaternion, x y z w.
    pub quaternion: [f32; 4],
}

impl Default for Pose {
    fn default() -> Self {
        Self { origin_mm: [0.0; 3], quaternion: [0.0, 0.0, 0.0, 1.0] }
    }
}

impl Pose {
    /// The bytes on the wire.
    #[must_use]
    pub fn encode(&self) -> [u8; POSE_LEN] {
        let [x, y, z] = self.origin_mm;
        let [a, b, c, d] = self.quaternion;
        floats_to_bytes([x, y, z, a, b, c, d])
    }

    /// Reads the first [`POSE_LEN`] bytes; none if there are fewer.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let [x, y, z, a, b, c, d] = floats::<ROW>(bytes)?;
        Some(Self { origin_mm: [x, y, z], quaternion: [a, b, c, d] })
    }

    /// The rotation matrix, rows first; none if the quaternion misses length one by more than a
    /// thousandth.
    #[must_use]
    pub fn rotation(&self) -> Option<[[f64; 3]; 3]> {
        let q = self.quaternion.map(f64::from);
        let square: f64 = q.iter().map(|v| v * v).sum();
        if !((square - 1.0).abs() <= 2e-3) {
            return None;
        }
        let [x, y, z, w] = q.map(|v| v / square.sqrt());
        Some([
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)],
        ])
    }
}

/// What pushes back on a finger, in its frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Touch {
    /// At 0: force on the finger, N.
    pub force_n: [f32; 3],
    /// At 12: its torque about the frame's origin, N mm.
    pub torque_n_mm: [f32; 3],
    /// At 24: area in contact on the deformed skin, mm2.
    pub area_mm2: f32,
    /// At 28: centre of pressure on the deformed skin, mm; the origin without contact.
    pub centre_mm: [f32; 3],
    /// At 40: deepest vertex left inside a thing, mm.
    pub penetration_mm: f32,
    /// At 44: change of force for a small travel of the things along it, N/mm; 0 if it was not
    /// asked for or not found.
    pub stiffness_n_per_mm: f32,
    /// At 48: how far things travelled to meet the net force, mm.
    pub travel_mm: f32,
    /// At 52: greatest pressure, Pa.
    pub pressure_max_pa: f32,
    /// At 56: share of the second order in the displacement.
    pub share: f32,
    /// At 60: time of the contact solve, us.
    pub solve_us: f32,
}

impl Touch {
    /// The bytes on the wire.
    #[must_use]
    pub fn encode(&self) -> [u8; TOUCH_LEN] {
        let [fx, fy, fz] = self.force_n;
        let [tx, ty, tz] = self.torque_n_mm;
        let [cx, cy, cz] = self.centre_mm;
        let Self { area_mm2, penetration_mm, stiffness_n_per_mm, travel_mm, .. } = *self;
        let Self { pressure_max_pa, share, solve_us, .. } = *self;
        floats_to_bytes([
            fx,
            fy,
            fz,
            tx,
            ty,
            tz,
            area_mm2,
            cx,
            cy,
            cz,
            penetration_mm,
            stiffness_n_per_mm,
            travel_mm,
            pressure_max_pa,
            share,
            solve_us,
        ])
    }

    /// Reads the first [`TOUCH_LEN`] bytes; none if there are fewer.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let v = floats::<16>(bytes)?;
        Some(Self {
            force_n: [v[0], v[1], v[2]],
            torque_n_mm: [v[3], v[4], v[5]],
            area_mm2: v[6],
            centre_mm: [v[7], v[8], v[9]],
            penetration_mm: v[10],
            stiffness_n_per_mm: v[11],
            travel_mm: v[12],
            pressure_max_pa: v[13],
            share: v[14],
            solve_us: v[15],
        })
    }
}

/// The first `N` little-endian f32.
fn floats<const N: usize>(bytes: &[u8]) -> Option<[f32; N]> {
    let (all, _) = bytes.as_chunks::<4>();
    let first: &[[u8; 4]; N] = all.first_chunk()?;
    Some(first.map(f32::from_le_bytes))
}

fn floats_to_bytes<const N: usize, const B: usize>(values: [f32; N]) -> [u8; B] {
    let mut bytes = [0; B];
    for (room, value) in bytes.chunks_exact_mut(4).zip(values) {
        room.copy_from_slice(&value.to_le_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_pose_and_a_touch_come_back(v in prop::array::uniform16(-1e6f32..1e6)) {
            let bytes: [u8; TOUCH_LEN] = floats_to_bytes(v);
            let touch = Touch::decode(&bytes).unwrap();
            prop_assert_eq!(touch.encode(), bytes);
            let pose = Pose::decode(&bytes).unwrap();
            prop_assert_eq!(&pose.encode()[..], &bytes[..POSE_LEN]);
        }

        #[test]
        fn a_unit_quaternion_is_a_rotation(v in prop::array::uniform4(-1.0f32..1.0)) {
            let size = v.iter().map(|c| c * c).sum::<f32>().sqrt();
            prop_assume!(size > 0.1);
            let pose = Pose { quaternion: v.map(|c| c / size), ..Pose::default() };
            let r = pose.rotation().unwrap();
            for i in 0..3 {
                for j in 0..3 {
                    let dot: f64 = (0..3).map(|k| r[i][k] * r[j][k]).sum();
                    let due = f64::from(u8::from(i == j));
                    prop_assert!((dot - due).abs() < 1e-12);
                }
            }
            let twice = Pose { quaternion: pose.quaternion.map(|c| 2.0 * c), ..pose };
            prop_assert!(twice.rotation().is_none());
        }
    }

    #[test]
    fn a_quarter_turn_about_z_takes_x_to_y() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let r = Pose { quaternion: [0.0, 0.0, half, half], ..Pose::default() }.rotation().unwrap();
        assert!((r[1][0] - 1.0).abs() < 1e-6 && (r[0][1] + 1.0).abs() < 1e-6, "{r:?}");
        let nan = Pose { quaternion: [f32::NAN; 4], ..Pose::default() };
        assert!(nan.rotation().is_none() && Pose::decode(&[0; 27]).is_none());
    }
}
