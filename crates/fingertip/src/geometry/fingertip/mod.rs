//! The fingertip as two smooth surfaces, skin and bone, over one parameter space.
//!
//! Frame, mm: `x` along the finger, 0 at the tip and growing towards the base;
//! `y` lateral; `z` dorsal, so the pad is at `z < 0`.
//!
//! Skin: a half-ellipsoid cap (super-ellipsoid with `cap_exponent`) whose
//! equator, the thickest section of the pulp, is the 17.44 x 13.06 mm ellipse of
//! Chen, Shuai & Zhu; behind it the palmar side sinks by `crease_depth_mm`
//! towards the joint, so a flat plate touches the pad and not the base.
//! Bone: elliptic rod with base, waist and tuft, its axis offset to the nail.
//!
//! A particular finger may have a [`SkinOffset`]: its skin then lies that far from this template's,
//! along the template's normals, and the layers below lie along the normals of its own skin.

mod check;
mod layer_map;
pub mod offset;

pub use check::{FingertipShapeError, SCALED_JACOBIAN_MIN};
pub use layer_map::{LayerMap, LayerMapError};
pub use offset::{SkinOffset, SkinOffsetError};

use check::GAP_MIN_MM;
use papilla_vector::{cross, norm};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::sync::Arc;

/// Dimensions of the fingertip, mm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FingertipShape {
    /// From the tip to the base plane.
    pub length_mm: f64,
    /// Width of the thickest section.
    pub width_mm: f64,
    /// Height of the thickest section.
    pub height_mm: f64,
    /// Tip to thickest section. 11.25 makes the tip 14.5 mm wide 5 mm from its end.
    pub cap_length_mm: f64,
    /// Exponent of the cap's profile along the finger; 2 is an ellipsoid.
    pub cap_exponent: f64,
    /// How far the palmar side rises from the pulp to the base.
    pub crease_depth_mm: f64,
    /// Thickness of the epidermis.
    pub epidermis_mm: f64,
    /// Thickness of the dermis; thinner where the bone is close.
    pub dermis_mm: f64,
    /// Bone: distance of its end from the tip.
    pub bone_tip_mm: f64,
    /// Bone: length of its rounded end.
    pub bone_cap_mm: f64,
    /// Bone: offset of its axis towards the nail.
    pub bone_offset_mm: f64,
    /// Bone: width and height at the tuft.
    pub bone_tuft_mm: [f64; 2],
    /// Bone: width and height at the waist.
    pub bone_waist_mm: [f64; 2],
    /// Bone: width and height at the base.
    pub bone_base_mm: [f64; 2],
    /// Where the waist is, as a fraction of the bone's length from its base.
    pub bone_waist_at: f64,
    /// Nail plate: width and length.
    pub nail_mm: [f64; 2],
    /// Nail plate: distance of its free edge from the tip.
    pub nail_tip_mm: f64,
    /// Nail plate: its thickness. Only an elastic nail has one.
    pub nail_thickness_mm: f64,
    /// Bone: thickness of its cortex, around an empty marrow cavity. Only an
    /// elastic bone has one.
    pub bone_cortex_mm: f64,
    /// How far the skin lies from this template's; a finger's own file gives it.
    #[serde(skip)]
    pub offset: Option<Arc<SkinOffset>>,
    /// How thick the epidermis is where; a finger's own file gives it. `epidermis_mm` is its
    /// thickness in the middle of the pad then.
    #[serde(skip)]
    pub epidermis_map: Option<Arc<LayerMap>>,
    /// The same of the dermis.
    #[serde(skip)]
    pub dermis_map: Option<Arc<LayerMap>>,
}

impl Default for FingertipShape {
    fn default() -> Self {
        Self {
            length_mm: 25.0,
            width_mm: 17.44,
            height_mm: 13.06,
            cap_length_mm: 11.25,
            cap_exponent: 2.0,
            crease_depth_mm: 2.5,
            epidermis_mm: 0.2,
            dermis_mm: 1.0,
            bone_tip_mm: 3.5,
            bone_cap_mm: 5.0,
            bone_offset_mm: 2.0,
            bone_tuft_mm: [7.5, 3.0],
            bone_waist_mm: [5.5, 4.0],
            bone_base_mm: [10.0, 6.5],
            bone_waist_at: 0.55,
            nail_mm: [11.0, 12.0],
            nail_tip_mm: 2.0,
            nail_thickness_mm: 0.5,
            bone_cortex_mm: 0.75,
            offset: None,
            epidermis_map: None,
            dermis_map: None,
        }
    }
}

/// A point of the parameter space shared by skin and bone.
#[derive(Clone, Copy, Debug)]
pub enum SurfaceParameter {
    /// On the cap: a unit vector with `x <= 0`.
    Cap([f64; 3]),
    /// On the body: unit vector in the section (`[y, z]`) and fraction of the
    /// way from the cap's equator to the base plane.
    Body([f64; 2], f64),
}

/// Steps towards the parameter of a point of a skin with an offset: each leaves some tenth of the
/// error, since an offset changes by about that over the way that it moves the skin.
const PARAMETER_STEPS: usize = 12;
/// Half the way over which directions along a skin with an offset are taken, mm.
const TANGENT_MM: f64 = 1e-4;

/// Share of the gap between skin and bone that epidermis and dermis may take.
const SKIN_SHARE_MAX: f64 = 0.75;

impl FingertipShape {
    /// Skin point of a parameter, mm.
    #[must_use]
    pub fn skin(&self, s: SurfaceParameter) -> [f64; 3] {
        let p = self.template_skin(s);
        let Some(offset) = &self.offset else { return p };
        let (n, by) = (self.template_normal(p), offset.at(s));
        std::array::from_fn(|i| p[i] + by * n[i])
    }

    /// Skin point of a parameter without the finger's own offset, mm.
    #[must_use]
    pub fn template_skin(&self, s: SurfaceParameter) -> [f64; 3] {
        match s {
            SurfaceParameter::Cap(d) => {
                let e = self.cap_exponent;
                let section = (d[1] * d[1] + d[2] * d[2]).sqrt();
                let scale = (section.powf(e) + d[0].abs().powf(e)).powf(-1.0 / e);
                [
                    self.cap_length_mm * (1.0 + d[0] * scale),
                    0.5 * self.width_mm * d[1] * scale,
                    0.5 * self.height_mm * d[2] * scale,
                ]
            }
            SurfaceParameter::Body(d, t) => {
                let x = self.cap_length_mm + t * (self.length_mm - self.cap_length_mm);
                let b = if d[1] < 0.0 { self.palmar_half_height(x) } else { 0.5 * self.height_mm };
                [x, 0.5 * self.width_mm * d[0], b * d[1]]
            }
        }
    }

    /// Parameter of the point of the skin that lies on the line from the finger's axis through
    /// `p` (mm); with an offset, of the point of the skin whose offset leads to `p` if it is on the
    /// skin, and near there if it is near.
    #[must_use]
    pub fn parameter_of(&self, p: [f64; 3]) -> SurfaceParameter {
        let mut s = self.template_parameter_of(p);
        let Some(offset) = &self.offset else { return s };
        for _ in 0..PARAMETER_STEPS {
            let (n, by) = (self.template_normal(self.template_skin(s)), offset.at(s));
            s = self.template_parameter_of(std::array::from_fn(|i| p[i] - by * n[i]));
        }
        s
    }

    fn template_parameter_of(&self, p: [f64; 3]) -> SurfaceParameter {
        let (y, x) = (p[1] / (0.5 * self.width_mm), p[0] - self.cap_length_mm);
        if x < 0.0 {
            let d = [x / self.cap_length_mm, y, p[2] / (0.5 * self.height_mm)];
            let size = norm(d);
            SurfaceParameter::Cap(d.map(|v| v / size))
        } else {
            let b = if p[2] < 0.0 { self.palmar_half_height(p[0]) } else { 0.5 * self.height_mm };
            let z = p[2] / b;
            let size = y.hypot(z);
            let t = (x / (self.length_mm - self.cap_length_mm)).min(1.0);
            SurfaceParameter::Body([y / size, z / size], t)
        }
    }

    /// The point of the skin that belongs to `p`, see [`Self::parameter_of`], mm.
    #[must_use]
    pub fn on_skin(&self, p: [f64; 3]) -> [f64; 3] {
        self.skin(self.parameter_of(p))
    }

    fn palmar_half_height(&self, x: f64) -> f64 {
        let t = (x - self.cap_length_mm) / (self.length_mm - self.cap_length_mm);
        0.5 * self.height_mm - self.crease_depth_mm * smoothstep(t)
    }

    /// Function that is 0 on the skin, negative inside.
    fn skin_level(&self, p: [f64; 3]) -> f64 {
        let b = if p[2] < 0.0 { self.palmar_half_height(p[0]) } else { 0.5 * self.height_mm };
        let section = (p[1] / (0.5 * self.width_mm)).powi(2) + (p[2] / b).powi(2);
        if p[0] < self.cap_length_mm {
            let e = self.cap_exponent;
            section.powf(0.5 * e) + ((self.cap_length_mm - p[0]) / self.cap_length_mm).powf(e) - 1.0
        } else {
            section - 1.0
        }
    }

    /// Outward unit normal of the skin at one of its points.
    #[must_use]
    pub fn skin_normal(&self, p: [f64; 3]) -> [f64; 3] {
        match &self.offset {
            None => self.template_normal(p),
            Some(_) => self.skin_normal_at(self.parameter_of(p)),
        }
    }

    /// Outward unit normal of the skin at a parameter.
    #[must_use]
    pub fn skin_normal_at(&self, s: SurfaceParameter) -> [f64; 3] {
        let p = self.template_skin(s);
        let n = self.template_normal(p);
        if self.offset.is_none() {
            return n;
        }
        let along = tangents(n).map(|t| {
            let on = |by: f64| {
                let q = std::array::from_fn(|i| p[i] + by * t[i]);
                self.skin(self.template_parameter_of(q))
            };
            let (a, b) = (on(TANGENT_MM), on(-TANGENT_MM));
            std::array::from_fn(|i| a[i] - b[i])
        });
        let [u, v]: [[f64; 3]; 2] = along;
        let across = cross(u, v);
        let size = norm(across);
        across.map(|c| c / size)
    }

    fn template_normal(&self, p: [f64; 3]) -> [f64; 3] {
        let h = 1e-5;
        let mut g: [f64; 3] = std::array::from_fn(|i| {
            let (mut a, mut b) = (p, p);
            a[i] += h;
            b[i] -= h;
            self.skin_level(a) - self.skin_level(b)
        });
        let length = norm(g);
        for v in &mut g {
            *v /= length;
        }
        g
    }

    /// Bone point of a parameter, mm.
    #[must_use]
    pub fn bone(&self, s: SurfaceParameter) -> [f64; 3] {
        self.bone_inset(s, 0.0)
    }

    /// Point of the marrow cavity's wall below a bone point, mm: every half size
    /// of the bone less its cortex.
    #[must_use]
    pub fn marrow(&self, s: SurfaceParameter) -> [f64; 3] {
        self.bone_inset(s, self.bone_cortex_mm)
    }

    fn bone_inset(&self, s: SurfaceParameter, inset_mm: f64) -> [f64; 3] {
        let neck = self.bone_tip_mm + self.bone_cap_mm;
        match s {
            SurfaceParameter::Cap(d) => [
                neck + (self.bone_cap_mm - inset_mm) * d[0],
                (0.5 * self.bone_tuft_mm[0] - inset_mm) * d[1],
                self.bone_offset_mm + (0.5 * self.bone_tuft_mm[1] - inset_mm) * d[2],
            ],
            SurfaceParameter::Body(d, t) => {
                let x = neck + t * (self.length_mm - neck);
                let half = |i: usize| 0.5 * self.bone_size(x, i) - inset_mm;
                [x, half(0) * d[0], self.bone_offset_mm + half(1) * d[1]]
            }
        }
    }

    /// Width (`i = 0`) or height (`i = 1`) of the bone's section at `x`.
    fn bone_size(&self, x: f64, i: usize) -> f64 {
        let neck = self.bone_tip_mm + self.bone_cap_mm;
        let waist = self.length_mm - self.bone_waist_at * (self.length_mm - self.bone_tip_mm);
        let (tuft, mid, base) = (self.bone_tuft_mm[i], self.bone_waist_mm[i], self.bone_base_mm[i]);
        if x < waist {
            tuft + (mid - tuft) * smoothstep((x - neck) / (waist - neck))
        } else {
            mid + (base - mid) * smoothstep((x - waist) / (self.length_mm - waist))
        }
    }

    /// How thick epidermis and dermis are below a skin point where nothing squeezes them, mm.
    #[must_use]
    pub fn thickness_mm(&self, s: SurfaceParameter) -> [f64; 2] {
        let of = |map: &Option<Arc<LayerMap>>, usual: f64| map.as_ref().map_or(usual, |m| m.at(s));
        [of(&self.epidermis_map, self.epidermis_mm), of(&self.dermis_map, self.dermis_mm)]
    }

    /// Points that bound the layers below a skin point: skin,
    /// epidermis-dermis interface, dermis-fat interface, bone.
    ///
    /// # Errors
    /// [`FingertipShapeError::BoneTooClose`] where the bone leaves no room.
    pub fn layers(&self, s: SurfaceParameter) -> Result<[[f64; 3]; 4], FingertipShapeError> {
        let skin = self.skin(s);
        let normal = self.skin_normal_at(s);
        let bone = self.bone(s);
        let gap: f64 = (0..3).map(|i| (skin[i] - bone[i]) * normal[i]).sum();
        if !(gap >= GAP_MIN_MM) {
            let [x_mm, y_mm, z_mm] = skin;
            return Err(FingertipShapeError::BoneTooClose { gap_mm: gap, x_mm, y_mm, z_mm });
        }
        let [epidermis, dermis] = self.thickness_mm(s);
        let total = epidermis + dermis;
        let squeeze = soft_min(1.0, SKIN_SHARE_MAX * gap / total);
        let inward = |depth: f64| std::array::from_fn(|i| skin[i] - depth * normal[i]);
        Ok([skin, inward(epidermis * squeeze), inward(total * squeeze), bone])
    }

    /// Whether a skin point lies under the nail plate.
    #[must_use]
    pub fn under_nail(&self, p: [f64; 3]) -> bool {
        let rounding_mm = 1e-10 * self.length_mm;
        p[2] > 0.25 * self.height_mm
            && p[1].abs() <= 0.5 * self.nail_mm[0] + rounding_mm
            && p[0] >= self.nail_tip_mm - rounding_mm
            && p[0] <= self.nail_tip_mm + self.nail_mm[1] + rounding_mm
    }
}

/// Rises from 0 at `t = 0` to 1 at 1, level at both.
pub(crate) fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Smooth minimum that equals the smaller argument when they are far apart:
/// thickness changes without a kink.
fn soft_min(a: f64, b: f64) -> f64 {
    let width = 0.1;
    let d = ((b - a) / width).clamp(-1.0, 1.0);
    a.min(b) - 0.25 * width * (1.0 - d.abs()).powi(2)
}

/// Two unit vectors across the unit vector `n`; their cross product is `n`.
pub(crate) fn tangents(n: [f64; 3]) -> [[f64; 3]; 2] {
    let k = (0..3).min_by(|&a, &b| n[a].abs().total_cmp(&n[b].abs())).unwrap_or(0);
    let u: [f64; 3] = std::array::from_fn(|i| f64::from(u8::from(i == k)) - n[k] * n[i]);
    let size = norm(u);
    let u = u.map(|v| v / size);
    [u, cross(n, u)]
}

/// Angle of a section direction from the palmar side, rad, in `(-pi, pi]`.
#[must_use]
pub fn azimuth_from_palmar(d: [f64; 2]) -> f64 {
    let a = d[0].atan2(-d[1]);
    if a <= -PI { PI } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tip_is_as_wide_as_the_design_says() {
        let shape = FingertipShape::default();
        // Half-width 5 mm from the tip on the widest line z = 0.
        let c = (shape.cap_length_mm - 5.0) / shape.cap_length_mm;
        let half_width = 0.5 * shape.width_mm * (1.0 - c * c).sqrt();
        assert!((2.0 * half_width - 14.5).abs() < 0.02, "{half_width}");
    }

    #[test]
    fn points_of_the_skin_have_their_parameter() {
        let shape = FingertipShape::default();
        for k in 0..24 {
            let a = f64::from(k) / 24.0 * 2.0 * PI;
            let (s, c) = a.sin_cos();
            for t in [0.0, 0.3, 1.0] {
                let p = shape.skin(SurfaceParameter::Body([s, -c], t));
                let q = shape.on_skin(p);
                assert!((0..3).all(|i| (p[i] - q[i]).abs() < 1e-12), "{p:?} {q:?}");
                let p = shape.skin(SurfaceParameter::Cap([-0.6, 0.8 * s, -0.8 * c]));
                let q = shape.on_skin(p);
                assert!((0..3).all(|i| (p[i] - q[i]).abs() < 1e-12), "{p:?} {q:?}");
            }
        }
    }

    #[test]
    fn layers_have_their_thickness_under_the_pad() {
        let shape = FingertipShape::default();
        let [skin, interface, fat, _] =
            shape.layers(SurfaceParameter::Body([0.0, -1.0], 0.0)).unwrap();
        assert!((skin[2] + 6.53).abs() < 1e-12);
        assert!((interface[2] - skin[2] - 0.2).abs() < 1e-9);
        assert!((fat[2] - skin[2] - 1.2).abs() < 1e-9);
    }

    #[test]
    fn normals_point_outward_and_match_both_formulas_at_the_equator() {
        let shape = FingertipShape::default();
        for k in 0..16 {
            let a = f64::from(k) / 16.0 * 2.0 * PI;
            let p = shape.skin(SurfaceParameter::Body([a.sin(), -a.cos()], 0.0));
            let n = shape.skin_normal(p);
            assert!(n[0].abs() < 1e-5 && n[1] * p[1] + n[2] * p[2] > 0.0);
        }
    }

    #[test]
    fn the_cortex_has_its_thickness_where_the_bone_is_round() {
        let shape = FingertipShape::default();
        let flat = [
            SurfaceParameter::Cap([-1.0, 0.0, 0.0]),
            SurfaceParameter::Body([0.0, -1.0], 0.4),
            SurfaceParameter::Body([1.0, 0.0], 1.0),
        ];
        for s in flat {
            let (bone, marrow) = (shape.bone(s), shape.marrow(s));
            let gap: [f64; 3] = std::array::from_fn(|i| bone[i] - marrow[i]);
            assert!((papilla_vector::norm(gap) - 0.75).abs() < 1e-12, "{s:?}");
        }
    }

    #[test]
    fn a_bone_through_the_skin_is_refused() {
        let shape = FingertipShape { bone_base_mm: [20.0, 12.0], ..Default::default() };
        let e = shape.layers(SurfaceParameter::Body([0.0, 1.0], 1.0)).unwrap_err();
        assert!(matches!(e, FingertipShapeError::BoneTooClose { .. }));
    }
}
