//! Gaps of the undeformed skin, given in place of objects.
//!
//! The gaps of neighbouring vertices give the direction of an object's surface. Their slope along
//! the skin is the tangential part of the outward normal, and the gradient of a distance has length
//! one. The gap of a vertex that is displaced by `u` is then `gap + n . u`. The curvature of the
//! object is not known.

use crate::error::ContactError;
use crate::model::ContactModel;
use crate::nearest::{Nearest, require_friction, require_stiffness};

/// How deep each vertex of the undeformed finger lies in things.
#[derive(Clone, Copy, Debug)]
pub struct Gaps<'a> {
    /// Depth of each vertex, mm of this person; negative in air.
    pub depth_mm: &'a [f32],
    /// As [`Object`](crate::Object)'s, of all things.
    pub stiffness_mpa_per_mm: f64,
    /// As [`Object`](crate::Object)'s, of all things.
    pub friction: f64,
    /// How far the thing at each vertex has moved since the last frame, mm of this person; what
    /// moves along its normal changes nothing. Empty: things rest.
    pub moved_mm: &'a [[f32; 3]],
}

impl<'a> Gaps<'a> {
    /// Of rigid things without friction.
    #[must_use]
    pub fn rigid(depth_mm: &'a [f32]) -> Self {
        Self { depth_mm, stiffness_mpa_per_mm: f64::INFINITY, friction: 0.0, moved_mm: &[] }
    }
}

/// Deepest, and farthest, that a vertex may be said to be, mm.
const DEPTH_MAX_MM: f32 = 1e5;
/// Largest slope along the skin that is taken for a distance's.
const SLOPE_MAX: f32 = 0.98;

/// Gaps and normals at the vertices, in the units of the reference finger.
#[derive(Debug, Default)]
pub(crate) struct Field {
    gap_mm: Vec<f32>,
    normal: Vec<[f32; 3]>,
    /// Area of the triangles that told each normal.
    area_mm2: Vec<f32>,
    stiffness_mpa_per_mm: f64,
    friction: f64,
    /// How far things have moved, mm of the person; empty if they rest.
    moved_mm: Vec<[f32; 3]>,
}

impl Field {
    /// Reads `gaps` as a finger `length` times as wide as the reference has them; normals are made
    /// where less than `reach_mm` is free.
    ///
    /// # Errors
    /// [`ContactError`] for another number of gaps than vertices, or what is no depth.
    pub(crate) fn read(
        &mut self,
        model: &ContactModel,
        gaps: Gaps<'_>,
        length: f64,
        reach_mm: f32,
    ) -> Result<(), ContactError> {
        let (found, expected) = (gaps.depth_mm.len(), model.vertices());
        if found != expected {
            return Err(ContactError::Gaps { found, expected });
        }
        if let Some(vertex) = gaps.depth_mm.iter().position(|d| !(d.abs() <= DEPTH_MAX_MM)) {
            return Err(ContactError::Depth { vertex, value: gaps.depth_mm[vertex] });
        }
        require_stiffness("stiffness_mpa_per_mm", gaps.stiffness_mpa_per_mm)?;
        require_friction("friction", gaps.friction)?;
        self.stiffness_mpa_per_mm = gaps.stiffness_mpa_per_mm;
        self.friction = gaps.friction;
        self.read_motion(gaps.moved_mm, expected)?;
        let per = (1.0 / length) as f32;
        self.gap_mm.clear();
        self.gap_mm.extend(gaps.depth_mm.iter().map(|d| -d * per));
        self.normal.clear();
        self.normal.resize(expected, [0.0; 3]);
        self.area_mm2.clear();
        self.area_mm2.resize(expected, 0.0);
        for (corners, slopes) in model.triangles.iter().zip(&model.slopes) {
            let gap = corners.map(|c| self.gap_mm[c as usize]);
            if !gap.iter().any(|g| *g < reach_mm) {
                continue;
            }
            let slope =
                [0, 1, 2].map(|i| (0..3).map(|k| gap[k] * slopes.corners[k][i]).sum::<f32>());
            for corner in corners {
                self.area_mm2[*corner as usize] += slopes.area_mm2;
                for (sum, s) in self.normal[*corner as usize].iter_mut().zip(slope) {
                    *sum += s;
                }
            }
        }
        for (vertex, normal) in self.normal.iter_mut().enumerate() {
            if self.gap_mm[vertex] < reach_mm {
                let own = model.normals[vertex];
                let slope = normal.map(|s| s / self.area_mm2[vertex].max(f32::MIN_POSITIVE));
                *normal = thing_normal(slope, own);
            }
        }
        Ok(())
    }

    fn read_motion(&mut self, moved_mm: &[[f32; 3]], expected: usize) -> Result<(), ContactError> {
        let found = moved_mm.len();
        if found != 0 && found != expected {
            return Err(ContactError::Gaps { found, expected });
        }
        for (vertex, moved) in moved_mm.iter().enumerate() {
            if let Some(value) = moved.iter().copied().find(|v| !(v.abs() <= DEPTH_MAX_MM)) {
                return Err(ContactError::Moved { vertex, value });
            }
        }
        self.moved_mm.clear();
        self.moved_mm.extend_from_slice(moved_mm);
        Ok(())
    }

    /// Coefficient of friction of all things.
    pub(crate) fn friction(&self) -> f64 {
        self.friction
    }

    /// How far the thing at a vertex has moved since the last frame, mm of the person.
    pub(crate) fn moved_mm(&self, vertex: usize) -> [f64; 3] {
        self.moved_mm.get(vertex).map_or([0.0; 3], |moved| moved.map(f64::from))
    }

    /// What lies at a vertex that has moved by `moved` (reference mm).
    #[inline]
    pub(crate) fn at(&self, vertex: usize, moved: [f64; 3]) -> Nearest {
        let normal = self.normal[vertex].map(f64::from);
        let along: f64 = (0..3).map(|i| normal[i] * moved[i]).sum();
        let gap_mm = f64::from(self.gap_mm[vertex]) + along;
        let stiffness_mpa_per_mm = self.stiffness_mpa_per_mm;
        let friction = self.friction;
        Nearest { gap_mm, normal, stiffness_mpa_per_mm, friction, object: 0, asked: 0 }
    }

    pub(crate) fn with_capacity(vertices: usize) -> Self {
        Self {
            gap_mm: Vec::with_capacity(vertices),
            normal: Vec::with_capacity(vertices),
            area_mm2: Vec::with_capacity(vertices),
            stiffness_mpa_per_mm: f64::INFINITY,
            friction: 0.0,
            moved_mm: Vec::with_capacity(vertices),
        }
    }
}

/// The outward normal of a thing whose distance has this slope along the skin; it faces the skin.
fn thing_normal(slope: [f32; 3], skin: [f32; 3]) -> [f32; 3] {
    let up: f32 = (0..3).map(|i| slope[i] * skin[i]).sum();
    let flat: [f32; 3] = std::array::from_fn(|i| slope[i] - up * skin[i]);
    let size = flat.iter().map(|v| v * v).sum::<f32>().sqrt();
    let part = if size > SLOPE_MAX { SLOPE_MAX / size } else { 1.0 };
    let down = (1.0 - (part * size).powi(2)).max(0.0).sqrt();
    std::array::from_fn(|i| part * flat[i] - down * skin[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_field_tells_the_plane() {
        let skin = [0.0, 0.0, -1.0];
        // A thing whose surface is tilted by 30 degrees: its distance rises by a half along x.
        let found = thing_normal([0.5, 0.0, 0.3], skin);
        let due = [0.5, 0.0, 0.75f32.sqrt()];
        assert!(found.iter().zip(due).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
        let steep = thing_normal([3.0, 4.0, 0.0], skin);
        assert!((steep.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-5, "{steep:?}");
    }
}
