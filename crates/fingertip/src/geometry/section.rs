//! The fingertip's cross-section in plane strain, after Chen, Shuai & Zhu.
//!
//! Frame, mm: `x` lateral, `y` dorsal, origin in the middle of the skin's
//! ellipse: the pad is at `y < 0`, the nail at `y > 0`. The section is symmetric
//! about `x = 0`; only `x >= 0` is described.
//!
//! Points are named by the **eccentric angle** from the pad's lowest point: skin
//! `(a sin, -b cos)`, bone the same about its own centre, both at `x = 0` for 0
//! and pi.
//!
//! Their nail is 1.2 mm thick, exactly epidermis and dermis together (a real plate
//! is near 0.5), so it is taken to stand in place of the skin, its outer side
//! on the ellipse. The bone's size is not printed there. The default is that of
//! the design's rod at the fingertip's thickest section, which is this section.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Dimensions of the section, mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SectionShape {
    /// Width of the skin's ellipse.
    pub width_mm: f64,
    /// Height of the skin's ellipse.
    pub height_mm: f64,
    /// Thickness of the epidermis.
    pub epidermis_mm: f64,
    /// Thickness of the dermis.
    pub dermis_mm: f64,
    /// Width and height of the bone's ellipse.
    pub bone_mm: [f64; 2],
    /// Offset of the bone's centre towards the nail.
    pub bone_offset_mm: f64,
    /// Width of the nail plate, between its edges on the skin.
    pub nail_width_mm: f64,
    /// Thickness of the nail plate. Where it differs from epidermis and dermis
    /// together, these blend into it over [`BLEND_MM`] before its edge.
    pub nail_thickness_mm: f64,
}

impl Default for SectionShape {
    fn default() -> Self {
        Self {
            width_mm: 17.44,
            height_mm: 13.06,
            epidermis_mm: 0.2,
            dermis_mm: 1.0,
            bone_mm: [10.0, 6.5],
            bone_offset_mm: 2.0,
            nail_width_mm: 11.0,
            nail_thickness_mm: 1.2,
        }
    }
}

/// Length along the skin over which its layers blend into a nail of another
/// thickness, mm.
pub const BLEND_MM: f64 = 2.0;
/// Least thickness of the tissue between the inner side of skin or nail and bone, mm.
const GAP_MIN_MM: f64 = 0.05;
/// Eccentric angles at which the gap is checked.
const GAP_CHECKS: u32 = 256;

/// Why a section was refused.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum SectionShapeError {
    /// A length is not a positive finite number.
    #[error("geometry.shape.{field} = {value} mm must be positive and finite")]
    NotPositive {
        /// Field name in the scene.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// The bone's offset is not a finite number.
    #[error("geometry.shape.bone_offset_mm = {0} must be finite")]
    Offset(f64),
    /// The nail is as wide as the finger.
    #[error("geometry.shape.nail_width_mm = {nail_mm} must be less than width_mm = {width_mm}")]
    NailTooWide {
        /// Width of the nail.
        nail_mm: f64,
        /// Width of the section.
        width_mm: f64,
    },
    /// Skin and bone leave no room between them.
    #[error(
        "only {gap_mm:.3} mm of tissue are left between the bone and the skin or nail at x = {x_mm:.2}, y = \
         {y_mm:.2} mm ({GAP_MIN_MM} mm is the least); make bone, skin layers or nail thinner"
    )]
    BoneTooClose {
        /// Gap, along the skin's normal.
        gap_mm: f64,
        /// Inner side of skin or nail.
        x_mm: f64,
        /// Inner side of skin or nail.
        y_mm: f64,
    },
}

impl SectionShapeError {
    /// The field that is to blame, dotted.
    #[must_use]
    pub fn field(&self) -> String {
        match self {
            Self::NotPositive { field, .. } => format!("geometry.shape.{field}"),
            Self::Offset(_) => "geometry.shape.bone_offset_mm".into(),
            Self::NailTooWide { .. } => "geometry.shape.nail_width_mm".into(),
            Self::BoneTooClose { .. } => "geometry.shape".into(),
        }
    }
}

impl SectionShape {
    /// Checks every length and the room between skin and bone.
    ///
    /// # Errors
    /// [`SectionShapeError`] names the first field or place that is wrong.
    pub fn validate(&self) -> Result<(), SectionShapeError> {
        let positive = [
            ("width_mm", self.width_mm),
            ("height_mm", self.height_mm),
            ("epidermis_mm", self.epidermis_mm),
            ("dermis_mm", self.dermis_mm),
            ("bone_mm[0]", self.bone_mm[0]),
            ("bone_mm[1]", self.bone_mm[1]),
            ("nail_width_mm", self.nail_width_mm),
            ("nail_thickness_mm", self.nail_thickness_mm),
        ];
        for (field, value) in positive {
            if !(value.is_finite() && value > 0.0) {
                return Err(SectionShapeError::NotPositive { field, value });
            }
        }
        if !self.bone_offset_mm.is_finite() {
            return Err(SectionShapeError::Offset(self.bone_offset_mm));
        }
        if !(self.nail_width_mm < self.width_mm) {
            let (nail_mm, width_mm) = (self.nail_width_mm, self.width_mm);
            return Err(SectionShapeError::NailTooWide { nail_mm, width_mm });
        }
        for k in 0..=GAP_CHECKS {
            let angle = PI * f64::from(k) / f64::from(GAP_CHECKS);
            let [_, _, inner, bone] = self.layers(angle);
            let n = self.skin_normal(angle);
            let gap_mm = (inner[0] - bone[0]) * n[0] + (inner[1] - bone[1]) * n[1];
            if !(gap_mm >= GAP_MIN_MM) {
                let [x_mm, y_mm] = inner;
                return Err(SectionShapeError::BoneTooClose { gap_mm, x_mm, y_mm });
            }
        }
        Ok(())
    }

    /// Half axes of the skin's ellipse.
    fn half(&self) -> [f64; 2] {
        [0.5 * self.width_mm, 0.5 * self.height_mm]
    }

    /// Skin point of an eccentric angle.
    #[must_use]
    pub fn skin(&self, angle: f64) -> [f64; 2] {
        on_ellipse(self.half(), 0.0, angle)
    }

    /// Bone point of an eccentric angle.
    #[must_use]
    pub fn bone(&self, angle: f64) -> [f64; 2] {
        on_ellipse(self.bone_mm.map(|v| 0.5 * v), self.bone_offset_mm, angle)
    }

    /// Outward unit normal of the skin.
    #[must_use]
    pub fn skin_normal(&self, angle: f64) -> [f64; 2] {
        let [a, b] = self.half();
        let [x, y] = on_ellipse([b, a], 0.0, angle);
        let length = x.hypot(y);
        [x / length, y / length]
    }

    /// The point `depth_mm` straight below the skin.
    #[must_use]
    pub fn below_skin(&self, angle: f64, depth_mm: f64) -> [f64; 2] {
        let (p, n) = (self.skin(angle), self.skin_normal(angle));
        [p[0] - depth_mm * n[0], p[1] - depth_mm * n[1]]
    }

    /// Eccentric angle of the pad's skin point at `x` (0 to half the width).
    #[must_use]
    pub fn pad_angle(&self, x_mm: f64) -> f64 {
        (x_mm / self.half()[0]).clamp(-1.0, 1.0).asin()
    }

    /// Eccentric angle of the nail's edge.
    #[must_use]
    pub fn nail_angle(&self) -> f64 {
        PI - self.pad_angle(0.5 * self.nail_width_mm)
    }

    /// Length of skin from the pad's lowest point, mm.
    #[must_use]
    pub fn arc_mm(&self, angle: f64) -> f64 {
        // Three-point Gauss on 128 parts: rounding is the larger error.
        const PARTS: u32 = 128;
        let step = angle / f64::from(PARTS);
        let [a, b] = self.half();
        let mut sum = 0.0;
        for k in 0..PARTS {
            for (x, w) in papilla_fem::element::reference::GAUSS_3 {
                let (s, c) = (step * (f64::from(k) + 0.5 * (1.0 + x))).sin_cos();
                sum += 0.5 * w * (a * c).hypot(b * s);
            }
        }
        sum * step
    }

    /// Eccentric angle at a length of skin from the pad's lowest point; inverse of
    /// [`Self::arc_mm`].
    #[must_use]
    pub fn angle_at_arc(&self, arc_mm: f64) -> f64 {
        let [a, b] = self.half();
        let mut angle = PI * arc_mm / self.arc_mm(PI);
        // Newton on a function whose slope stays between a and b: it converges.
        for _ in 0..20 {
            let slope = (a * angle.cos()).hypot(b * angle.sin());
            angle -= (self.arc_mm(angle) - arc_mm) / slope;
        }
        angle
    }

    /// Depths of the epidermis' and of the dermis' (or nail's) inner side.
    fn depths(&self, angle: f64) -> [f64; 2] {
        let skin = self.epidermis_mm + self.dermis_mm;
        let before_nail = self.arc_mm(self.nail_angle()) - self.arc_mm(angle);
        let t = smoothstep(1.0 - before_nail / BLEND_MM);
        let scale = 1.0 + t * (self.nail_thickness_mm / skin - 1.0);
        [self.epidermis_mm * scale, skin * scale]
    }

    /// Points that bound the layers: skin, epidermis-dermis interface, inner side
    /// of the dermis (or nail), bone.
    #[must_use]
    pub fn layers(&self, angle: f64) -> [[f64; 2]; 4] {
        let [epidermis, inner] = self.depths(angle);
        let at = |depth| self.below_skin(angle, depth);
        [self.skin(angle), at(epidermis), at(inner), self.bone(angle)]
    }
}

/// `(a sin, offset - b cos)`, exactly on the axis of symmetry for 0 and pi.
fn on_ellipse([a, b]: [f64; 2], offset: f64, angle: f64) -> [f64; 2] {
    let s = if angle < PI { angle.sin() } else { 0.0 };
    [a * s, offset - b * angle.cos()]
}

fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_default_is_the_printed_section() {
        let shape = SectionShape::default();
        shape.validate().unwrap();
        let [skin, interface, inner, bone] = shape.layers(0.0);
        assert_eq!(skin, [0.0, -6.53]);
        for (p, y) in [(interface, -6.33), (inner, -5.33)] {
            assert!(p[0] == 0.0 && (p[1] - y).abs() < 1e-12, "{p:?}");
        }
        assert!((bone[1] + 0.5 * shape.bone_mm[1] - shape.bone_offset_mm).abs() < 1e-12);
        assert_eq!(shape.skin(PI), [0.0, 6.53]);
        assert!((shape.skin(shape.nail_angle())[0] - 5.5).abs() < 1e-12);
        assert!(shape.skin(shape.nail_angle())[1] > 0.0);
    }

    #[test]
    fn arc_length_of_a_circle_is_closed_form() {
        let shape = SectionShape { width_mm: 10.0, height_mm: 10.0, ..Default::default() };
        assert!((shape.arc_mm(PI) - 5.0 * PI).abs() < 1e-13);
        // Ramanujan's second formula, good to 1e-9 for this ellipse.
        let (a, b) = (8.72f64, 6.53f64);
        let h = ((a - b) / (a + b)).powi(2);
        let half = 0.5 * PI * (a + b) * (1.0 + 3.0 * h / (10.0 + (4.0 - 3.0 * h).sqrt()));
        assert!((SectionShape::default().arc_mm(PI) / half - 1.0).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn angles_and_arcs_are_inverse(angle in 0.0f64..PI) {
            let shape = SectionShape::default();
            prop_assert!((shape.angle_at_arc(shape.arc_mm(angle)) - angle).abs() < 1e-12);
        }

        #[test]
        fn layers_lie_along_the_normal(angle in 0.0f64..2.0) {
            let shape = SectionShape::default();
            let [skin, interface, inner, _] = shape.layers(angle);
            let distance = |p: [f64; 2]| (p[0] - skin[0]).hypot(p[1] - skin[1]);
            prop_assert!((distance(interface) - 0.2).abs() < 1e-12);
            prop_assert!((distance(inner) - 1.2).abs() < 1e-12);
            // The normal is the ellipse's: level sets grow fastest along it.
            let n = shape.skin_normal(angle);
            let [a, b] = shape.half();
            let gradient = [skin[0] / (a * a), skin[1] / (b * b)];
            prop_assert!((gradient[0] * n[1] - gradient[1] * n[0]).abs() < 1e-12);
            prop_assert!(gradient[0] * n[0] + gradient[1] * n[1] > 0.0);
        }
    }

    #[test]
    fn a_thin_nail_thins_the_skin_before_its_edge_and_nowhere_else() {
        let shape = SectionShape { nail_thickness_mm: 0.5, ..Default::default() };
        shape.validate().unwrap();
        let edge = shape.arc_mm(shape.nail_angle());
        assert_eq!(shape.depths(0.0), [0.2, 1.2]);
        let [epidermis, inner] = shape.depths(shape.nail_angle());
        assert!((inner - 0.5).abs() < 1e-9 && (epidermis - 0.2 * 0.5 / 1.2).abs() < 1e-9);
        let before = shape.depths(shape.angle_at_arc(edge - BLEND_MM - 0.01));
        assert_eq!(before, [0.2, 1.2]);
    }

    #[test]
    fn bad_lengths_are_named() {
        let error = |s: SectionShape| s.validate().unwrap_err();
        let d = SectionShape::default();
        assert!(matches!(
            error(SectionShape { epidermis_mm: -0.2, ..d }),
            SectionShapeError::NotPositive { field: "epidermis_mm", .. }
        ));
        assert!(matches!(
            error(SectionShape { nail_width_mm: 18.0, ..d }),
            SectionShapeError::NailTooWide { .. }
        ));
        assert!(matches!(
            error(SectionShape { bone_mm: [16.0, 6.5], ..d }),
            SectionShapeError::BoneTooClose { .. }
        ));
        assert!(matches!(
            error(SectionShape { bone_offset_mm: f64::NAN, ..d }),
            SectionShapeError::Offset(_)
        ));
    }
}
