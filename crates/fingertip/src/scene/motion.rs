//! The table `[motion]` of a scene: how the indenter moves, to a depth, to a force or along a path.

use super::error::{SceneError, is_length, require};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Orientation of an indenter relative to the finger.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Pitch about y (lateral), degrees; tip first is positive.
    pub pitch_deg: f64,
    /// Roll about x (the finger's axis), degrees.
    pub roll_deg: f64,
    /// Yaw about the plate's normal, degrees.
    pub yaw_deg: f64,
}

/// How the indenter moves. Exactly one of `depth_mm`, `force_n` and `path` is given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Straight to this depth from first touch, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<f64>,
    /// Straight until this force along the motion, N.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<f64>,
    /// Depth over time, from the origin of both.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<Vec<PathPoint>>,
    /// Equally spaced depths or forces at which the state is stored; of a path
    /// times between each two points.
    #[serde(default = "one")]
    pub increments: usize,
    /// Where the indenter's axis meets the skin, mm along its own x and y from the
    /// skin point that a flat plate in this pose would touch first.
    #[serde(default)]
    pub offset_mm: [f64; 2],
    /// Pitch about y, degrees; tip first is positive. Of a plane section the
    /// indenter's turn in the plane.
    #[serde(default)]
    pub pitch_deg: f64,
    /// Roll about x, degrees.
    #[serde(default)]
    pub roll_deg: f64,
    /// Yaw about the indenter's axis, degrees.
    #[serde(default)]
    pub yaw_deg: f64,
}

fn one() -> usize {
    1
}

impl Default for Motion {
    /// None at all.
    fn default() -> Self {
        Self { depth_mm: None, ..Self::to_depth(0.0, one(), Pose::default()) }
    }
}

/// A point of a path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PathPoint {
    /// Time since first touch, s.
    pub time_s: f64,
    /// Depth from first touch, mm.
    pub depth_mm: f64,
    /// Displacement along the indenter's own x and y, mm.
    #[serde(default)]
    pub shift_mm: [f64; 2],
}

/// Most stored increments of one indentation.
const INCREMENTS_MAX: usize = 1000;
/// Most points of a path.
const PATH_MAX: usize = 1000;
/// Beyond it a force in N must have been meant in another unit.
const FORCE_MAX_N: f64 = 1000.0;
/// Beyond it a length in mm must have been meant in another unit.
const DEPTH_MAX_MM: f64 = 100.0;

impl Motion {
    /// Straight to a depth.
    #[must_use]
    pub fn to_depth(depth_mm: f64, increments: usize, pose: Pose) -> Self {
        Self {
            depth_mm: Some(depth_mm),
            force_n: None,
            path: None,
            increments,
            offset_mm: [0.0; 2],
            pitch_deg: pose.pitch_deg,
            roll_deg: pose.roll_deg,
            yaw_deg: pose.yaw_deg,
        }
    }

    /// Orientation of the indenter.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose { pitch_deg: self.pitch_deg, roll_deg: self.roll_deg, yaw_deg: self.yaw_deg }
    }

    pub(super) fn validate(&self) -> Result<(), SceneError> {
        let given = [self.depth_mm.is_some(), self.force_n.is_some(), self.path.is_some()];
        if given.iter().filter(|g| **g).count() != 1 {
            return Err(SceneError::Fields {
                field: "motion",
                rule: "give exactly one of depth_mm, force_n and path",
            });
        }
        if let Some(depth) = self.depth_mm {
            let ok = is_length(depth) && depth <= DEPTH_MAX_MM;
            require(ok, "motion.depth_mm", &depth, "has to be above 0 and at most 100 mm")?;
        }
        if let Some(force) = self.force_n {
            let ok = is_length(force) && force <= FORCE_MAX_N;
            require(ok, "motion.force_n", &force, "has to be above 0 and at most 1000 N")?;
        }
        require(
            (1..=INCREMENTS_MAX).contains(&self.increments),
            "motion.increments",
            &self.increments,
            "has to be 1 to 1000",
        )?;
        for (field, value) in [
            ("motion.pitch_deg", self.pitch_deg),
            ("motion.roll_deg", self.roll_deg),
            ("motion.yaw_deg", self.yaw_deg),
        ] {
            require(value.abs() <= 180.0, field, &value, "has to be within -180 to 180")?;
        }
        require(
            self.offset_mm.iter().all(|v| v.is_finite() && v.abs() <= DEPTH_MAX_MM),
            "motion.offset_mm",
            &self.offset_mm,
            "has to be within 100 mm",
        )?;
        self.path.as_deref().map_or(Ok(()), validate_path)
    }
}

fn validate_path(path: &[PathPoint]) -> Result<(), SceneError> {
    require(
        (1..=PATH_MAX).contains(&path.len()),
        "motion.path",
        &path.len(),
        "has to have 1 to 1000 points",
    )?;
    let mut last = 0.0;
    for (i, p) in path.iter().enumerate() {
        let field = |name: &str| format!("motion.path[{i}].{name}");
        let inside = p.time_s == 0.0 && p.depth_mm > 0.0;
        require(
            !inside,
            field("depth_mm"),
            &p.depth_mm,
            "at time 0 starts the indenter inside the finger: a path starts at first touch, \
             depth 0 at time 0 without a point of its own; give this point a later time_s",
        )?;
        require(
            p.time_s.is_finite() && p.time_s > last,
            field("time_s"),
            &p.time_s,
            "has to rise from 0, s",
        )?;
        last = p.time_s;
        let sane = |v: f64| v.is_finite() && v.abs() <= DEPTH_MAX_MM;
        require(sane(p.depth_mm), field("depth_mm"), &p.depth_mm, "has to be within 100 mm")?;
        require(
            p.shift_mm.iter().all(|v| sane(*v)),
            field("shift_mm"),
            &p.shift_mm,
            "has to be within 100 mm",
        )?;
    }
    let deepest = path.iter().map(|p| p.depth_mm).fold(0.0, f64::max);
    require(
        deepest > 0.0,
        "motion.path",
        &deepest,
        "mm is the deepest point, which never touches: give a point a depth_mm above 0",
    )
}
