//! How deep a body is on its way in, and whether it is narrow.

use super::Survey;
use super::look::{Asked, SLANT};
use crate::answer::Effort;
use crate::held::Front;
use papilla_vector::dot;

/// Cosine between the skin's and a body's outward normals below which the nearest surface tells the
/// depth.
pub(super) const FACING: f64 = -0.7;
/// How far it has to go on behind the skin.
pub(super) const BEHIND_MM: f64 = 0.1;
/// How many times as deep on its way as its nearest surface tells a narrow body is.
const NARROW: f64 = 2.0;

impl Asked<'_> {
    /// How deep a body is on its way, and whether it is narrow. Of the vertex that is said to be deepest
    /// in it, its nearest surface tells the depth and how it faces the skin.
    pub(super) fn depth(
        &self,
        way: [f64; 3],
        vertex: u32,
        told: [f64; 2],
        effort: &mut Effort,
    ) -> (f64, bool) {
        let (deep, is_narrow) = self.deep_on(way, vertex, told, effort);
        if !is_narrow || self.body.len() > 1 {
            return (deep, is_narrow);
        }
        // Of an object of several parts candidates know lower bounds of depths: it is narrow if it is so
        // where it is deepest indeed.
        let mut deepest = (told[0], vertex, told[1]);
        for (_, vertex) in self.candidates.iter().filter(|(free, _)| *free < 0.0) {
            let (gap_mm, normal) = self.nearest(*vertex, effort);
            if -gap_mm > deepest.0 {
                deepest = (-gap_mm, *vertex, dot(normal, self.normal(*vertex)));
            }
        }
        let (depth_mm, at, facing) = deepest;
        if at == vertex {
            return (deep, is_narrow);
        }
        let (there, is_narrow) = self.deep_on(way, at, [depth_mm, facing], effort);
        (deep.max(there), is_narrow)
    }

    /// The same by one vertex: whether the nearest surface tells too little of the depth.
    fn deep_on(
        &self,
        way: [f64; 3],
        vertex: u32,
        [depth_mm, facing]: [f64; 2],
        effort: &mut Effort,
    ) -> (f64, bool) {
        let (mut deep, mut is_narrow) = (depth_mm, false);
        for at in [vertex, self.outermost(vertex, way)] {
            self.alone().count_look(effort);
            if let Front::Met { ahead_mm, along, .. } = self.front(at, way, 0.0) {
                deep = deep.max(ahead_mm * along.max(SLANT));
                // Springs know no displaced skin, which would lie before the front.
                is_narrow |= self.at_rest && at == vertex && facing > FACING && along > SLANT;
            }
        }
        // Vertices in a narrow body are nearer to its sides than to its front; pixels see that.
        is_narrow |= !self.fine && deep > NARROW * depth_mm + BEHIND_MM;
        (deep, is_narrow)
    }

    /// Whether a held body is still narrow: let go, it would be held again in the next frame.
    pub(super) fn is_narrow(&self, survey: Survey, way: [f64; 3], effort: &mut Effort) -> bool {
        let Some((depth_mm, vertex)) = survey.deepest else { return false };
        let (gap_mm, normal) = self.nearest(vertex, effort);
        let told = [depth_mm.max(-gap_mm), dot(normal, self.normal(vertex))];
        self.depth(way, vertex, told, effort).1
    }
}
