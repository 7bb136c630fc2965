//! Poses of engines and robots to poses in the finger's frame, and forces back
//! (docs/reference/frames-and-units.md).
//!
//! The finger's frame: its origin is the foremost point of the skin, x runs back along the finger, y
//! to the right as the finger points ahead with the nail up, z out of the nail; mm, right-handed.
//!
//! ```
//! use papilla_client::frames::{Convention, Place};
//!
//! let finger = Place { at: [0.0, 1.0, 0.0], ..Place::default() };
//! let ball = Place { at: [0.0, 0.984, 0.01125], ..Place::default() };
//! let pose = Convention::OPENXR.pose(finger, ball, 1.0)?;   // for `Session::send_poses`
//! assert_eq!(pose.origin_mm.map(f32::round), [11.0, 0.0, -16.0]);
//! # Ok::<(), papilla_client::frames::PlaceError>(())
//! ```

use papilla_proto::contact::{Pose, Touch};
use papilla_vector::{cross, dot, minus};

type Three = [f64; 3];
/// x y z w.
type Quaternion = [f64; 4];

/// Quaternions shorter than this are no turn.
const SIZE_MIN: f64 = 1e-6;
/// Joints nearer to each other than this are the same, mm.
const APART_MIN_MM: f64 = 1.0;

/// What is no place, and so no pose: while the hand is not tracked, say so with `send_not_tracked`.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlaceError {
    /// The hand is not tracked, as a rule.
    #[error("{of}: a number is not finite; while the hand is not tracked call send_not_tracked")]
    NotFinite {
        /// `finger`, `object`, `distal` or `tip`.
        of: &'static str,
    },
    /// The hand is not tracked, as a rule.
    #[error("{of}: the quaternion is zero; while the hand is not tracked call send_not_tracked")]
    NoTurn {
        /// `finger`, `object`, `distal` or `tip`.
        of: &'static str,
    },
    /// A scale that is none.
    #[error("scale says how many times as large as life all is drawn; it is {0}")]
    Scale(f64),
    /// The joints do not say where the finger points.
    #[error("distal and tip are the same place; they are OpenXR's joints of these names")]
    SamePlace,
    /// The joint does not say where the nail is.
    #[error(
        "up points along the finger; it is the distal joint's axis that points out of the nail"
    )]
    Along,
}

/// An engine's axes and its unit of length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convention {
    /// Member i along the finger's axes is `sign[i]` times the engine's member `from[i]`; an object's
    /// axes and its shape's are related in the same way.
    from: [usize; 3],
    sign: Three,
    handed: f64,
    unit_mm: f64,
}

/// Where a body is in the engine's world. The quaternion need not be of length one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// In the engine's unit.
    pub at: Three,
    /// x y z w.
    pub turn: Quaternion,
}

impl Default for Place {
    fn default() -> Self {
        Self { at: [0.0; 3], turn: [0.0, 0.0, 0.0, 1.0] }
    }
}

/// What pushes back on the finger, in the engine's world; an object feels the opposite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Felt {
    /// N.
    pub force_n: Three,
    /// N m about the finger's origin; in a left-handed world by the left hand's rule.
    pub torque_n_m: Three,
    /// Centre of the pressure, in the engine's unit.
    pub centre: Three,
}

impl Place {
    fn checked(self, of: &'static str) -> Result<Self, PlaceError> {
        let size = self.turn.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !(self.at.iter().all(|v| v.is_finite()) && size.is_finite()) {
            return Err(PlaceError::NotFinite { of });
        }
        if size < SIZE_MIN {
            return Err(PlaceError::NoTurn { of });
        }
        Ok(Self { at: self.at, turn: self.turn.map(|v| v / size) })
    }
}

impl Convention {
    /// The finger's own axes in metres: robots, and all else where you say how a body's axes lie.
    pub const METRES: Self =
        Self { from: [0, 1, 2], sign: [1.0, 1.0, 1.0], handed: 1.0, unit_mm: 1000.0 };
    /// x right, y up, -z ahead, to the fingertip: OpenXR, WebXR, Godot. Metres.
    pub const OPENXR: Self =
        Self { from: [2, 0, 1], sign: [1.0, 1.0, 1.0], handed: 1.0, unit_mm: 1000.0 };
    /// x right, y up, z ahead, left-handed: Unity. Metres.
    pub const UNITY: Self =
        Self { from: [2, 0, 1], sign: [-1.0, 1.0, 1.0], handed: -1.0, unit_mm: 1000.0 };
    /// x ahead, y right, z up, left-handed: Unreal. Centimetres.
    pub const UNREAL: Self =
        Self { from: [0, 1, 2], sign: [-1.0, 1.0, 1.0], handed: -1.0, unit_mm: 10.0 };

    /// Where an object is in the finger's frame. `scale`: how many times as large as life all is drawn.
    ///
    /// # Errors
    /// A number that is not finite, a quaternion of zero, a scale not above 0.
    pub fn pose(&self, finger: Place, object: Place, scale: f64) -> Result<Pose, PlaceError> {
        let mm = self.unit_mm / checked_scale(scale)?;
        let (finger, object) = (finger.checked("finger")?, object.checked("object")?);
        let back = inverse(finger.turn);
        let at = self.to_frame(turned(back, minus(object.at, finger.at)));
        let [x, y, z, w] = times(back, object.turn);
        // A turn's axis is mirrored with the axes, and its sense once more.
        let [x, y, z] = self.to_frame([x, y, z]).map(|v| self.handed * v);
        Ok(Pose {
            origin_mm: at.map(|v| (v * mm) as f32),
            quaternion: [x, y, z, w].map(|v| v as f32),
        })
    }

    /// The finger of two tracked joints: that of the distal phalanx and the tip. It points from the one
    /// to the other, its nail the way of the distal joint's axis `up` (none: the engine's own, which is
    /// OpenXR's y). The tip's joint is the frame's origin, or lies `inside_mm` behind it. Left and right
    /// hands are the same: the model's finger is symmetric.
    ///
    /// # Errors
    /// A joint that is no place, the same place twice, an `up` along the finger.
    pub fn finger_of_joints(
        &self,
        distal: Place,
        tip: Place,
        up: Option<[f64; 3]>,
        inside_mm: f64,
    ) -> Result<Place, PlaceError> {
        let (distal, tip) = (distal.checked("distal")?, tip.checked("tip")?);
        let back = minus(distal.at, tip.at);
        let length = dot(back, back).sqrt();
        if !(length * self.unit_mm >= APART_MIN_MM) {
            return Err(PlaceError::SamePlace);
        }
        let back = back.map(|v| v / length);
        let nail = turned(distal.turn, up.unwrap_or(self.to_engine([0.0, 0.0, 1.0])));
        let along = dot(nail, back);
        let nail = minus(nail, back.map(|v| along * v));
        let size = dot(nail, nail).sqrt();
        if !(size >= 1e-3) {
            return Err(PlaceError::Along);
        }
        let nail = nail.map(|v| v / size);
        let frame = [back, cross(nail, back).map(|v| self.handed * v), nail];
        // Where the engine's axes of the finger point in the world.
        let mut columns = [[0.0; 3]; 3];
        for (i, axis) in frame.iter().enumerate() {
            columns[self.from[i]] = axis.map(|v| self.sign[i] * v);
        }
        let inside = inside_mm / self.unit_mm;
        Place { at: minus(tip.at, back.map(|v| inside * v)), turn: of_columns(columns) }
            .checked("tip")
    }

    /// What pushes back on the finger, in the engine's world.
    ///
    /// # Errors
    /// As of [`Self::pose`].
    pub fn felt(&self, finger: Place, touch: &Touch, scale: f64) -> Result<Felt, PlaceError> {
        let units = checked_scale(scale)? / self.unit_mm;
        let finger = finger.checked("finger")?;
        let out = |v: [f32; 3]| turned(finger.turn, self.to_engine(v.map(f64::from)));
        let centre = out(touch.centre_mm);
        Ok(Felt {
            force_n: out(touch.force_n),
            torque_n_m: out(touch.torque_n_mm).map(|v| 1e-3 * self.handed * v),
            centre: std::array::from_fn(|i| finger.at[i] + units * centre[i]),
        })
    }

    /// A vertex of an object's mesh, in its own axes in the engine, for the `vertices_mm` of a hello.
    /// Triangles of Unity and Godot are clockwise seen from outside: turn them.
    #[must_use]
    pub fn vertex_mm(&self, point: [f64; 3]) -> [f64; 3] {
        self.to_frame(point).map(|v| v * self.unit_mm)
    }

    /// A place of the finger's frame, as of the atlas, in the drawn finger's own axes.
    #[must_use]
    pub fn vertex_drawn(&self, point_mm: [f64; 3]) -> [f64; 3] {
        self.to_engine(point_mm).map(|v| v / self.unit_mm)
    }

    fn to_frame(self, v: Three) -> Three {
        std::array::from_fn(|i| self.sign[i] * v[self.from[i]])
    }

    fn to_engine(self, v: Three) -> Three {
        let mut out = [0.0; 3];
        for (i, v) in v.iter().enumerate() {
            out[self.from[i]] = self.sign[i] * v;
        }
        out
    }
}

fn checked_scale(scale: f64) -> Result<f64, PlaceError> {
    if scale > 0.0 && scale.is_finite() { Ok(scale) } else { Err(PlaceError::Scale(scale)) }
}

fn inverse([x, y, z, w]: Quaternion) -> Quaternion {
    [-x, -y, -z, w]
}

/// Hamilton's product: turns by b, then by a.
fn times([x, y, z, w]: Quaternion, [p, q, r, s]: Quaternion) -> Quaternion {
    [
        w * p + s * x + y * r - z * q,
        w * q + s * y + z * p - x * r,
        w * r + s * z + x * q - y * p,
        w * s - x * p - y * q - z * r,
    ]
}

/// `turn` is of length one.
fn turned([a, b, c, w]: Quaternion, v: Three) -> Three {
    let doubled = cross([a, b, c], v).map(|v| 2.0 * v);
    let more = cross([a, b, c], doubled);
    std::array::from_fn(|i| v[i] + w * doubled[i] + more[i])
}

/// The rotation whose matrix has these columns, of any length.
fn of_columns([x, y, z]: [Three; 3]) -> Quaternion {
    let trace = x[0] + y[1] + z[2];
    if trace > 0.0 {
        [y[2] - z[1], z[0] - x[2], x[1] - y[0], 1.0 + trace]
    } else if x[0] >= y[1] && x[0] >= z[2] {
        [1.0 + x[0] - y[1] - z[2], x[1] + y[0], x[2] + z[0], y[2] - z[1]]
    } else if y[1] >= z[2] {
        [x[1] + y[0], 1.0 - x[0] + y[1] - z[2], y[2] + z[1], z[0] - x[2]]
    } else {
        [x[2] + z[0], y[2] + z[1], 1.0 - x[0] - y[1] + z[2], x[1] - y[0]]
    }
}

#[cfg(test)]
mod tests;
