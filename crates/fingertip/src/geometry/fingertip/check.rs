//! Shapes that no finger has: refused, with the field to blame.

use super::offset::{at_uv, uv};
use super::{FingertipShape, SKIN_SHARE_MAX, SurfaceParameter};

/// Least scaled Jacobian of soft tissue that is accepted; Newton's method needs but a positive one.
pub const SCALED_JACOBIAN_MIN: f64 = 0.03;

/// Why a shape was refused.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum FingertipShapeError {
    /// A length is not positive, or absurd.
    #[error(
        "geometry.shape.{field} = {value} mm has to be above 0 and at most {LENGTH_MAX_MM}{}",
        if *value > LENGTH_MAX_MM { ": lengths are in mm, was um meant?" } else { "" }
    )]
    NotPositive {
        /// Field name in the scene.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// A whole finger smaller than a grain.
    #[error(
        "geometry.shape.{field} = {value} mm is not believed of a finger, {LENGTH_MIN_MM} mm is the least: \
         lengths are in mm, was m meant?"
    )]
    TooSmall {
        /// Field name in the scene.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// The bone comes through the skin.
    #[error(
        "the bone is only {gap_mm:.3} mm below the skin at x = {x_mm:.2}, y = {y_mm:.2}, z = {z_mm:.2} mm; \
         make it thinner or the finger thicker ({GAP_MIN_MM} mm is the least)"
    )]
    BoneTooClose {
        /// Gap along the normal.
        gap_mm: f64,
        /// Skin point.
        x_mm: f64,
        /// Skin point.
        y_mm: f64,
        /// Skin point.
        z_mm: f64,
    },
    /// A solid bone's cortex fills the bone.
    #[error(
        "geometry.shape.bone_cortex_mm = {cortex_mm} leaves no marrow cavity: an elastic bone's cortex may take \
         {most_mm:.3} mm of this bone at most; make the cortex thinner, the bone thicker or rigid"
    )]
    CortexTooThick {
        /// Thickness asked for.
        cortex_mm: f64,
        /// Most that the bone's sizes allow.
        most_mm: f64,
    },
    /// A solid nail has no element.
    #[error(
        "geometry.shape.nail_mm: the nail plate covers no whole face of the skin; make it larger, the mesh \
         denser or the nail rigid"
    )]
    NailTooSmall,
    /// Elements between skin and bone turn inside out.
    #[error(
        "geometry.shape.{field} = {value} folds the elements between skin and bone: with the other \
         dimensions as they are it has to be at {} {}",
        if *least { "least" } else { "most" }, rounded(*limit, *least)
    )]
    Folds {
        /// Field name in the scene.
        field: String,
        /// Its value.
        value: f64,
        /// The nearest value that is known to do.
        limit: f64,
        /// Whether it has to be at least that, or at most.
        least: bool,
    },
    /// Elements are folded, or nearly, at a place.
    #[error(
        "the {tissue} folds at the {region} (u = {u:.2}, v = {v:.2}; x = {:.1}, y = {:.1}, z = {:.1} mm): scaled \
         Jacobian {scaled_jacobian:.3}, {} is the least. Smooth the skin there, or make the layers thinner, the \
         bone slimmer",
        at_mm[0], at_mm[1], at_mm[2], SCALED_JACOBIAN_MIN
    )]
    Distorted {
        /// Which layer.
        tissue: &'static str,
        /// Where on the finger, in words.
        region: &'static str,
        /// Turns round the finger, from the palmar line.
        u: f64,
        /// 0 at the tip's pole, 1 at the cap's equator, 2 at the base plane.
        v: f64,
        /// The place.
        at_mm: [f64; 3],
        /// The least of an element there.
        scaled_jacobian: f64,
    },
    /// Epidermis and dermis are thicker than what lies between skin and bone.
    #[error(
        "epidermis and dermis are {layers_mm:.2} mm thick, and the skin of the pad is only {gap_mm:.2} mm above the \
         bone at x = {x_mm:.2}, y = {y_mm:.2}, z = {z_mm:.2} mm: they may take {most_mm:.2} mm there. Make them thinner, the \
         bone slimmer or further from the pad"
    )]
    LayersTooThick {
        /// Both layers.
        layers_mm: f64,
        /// From skin to bone along the normal.
        gap_mm: f64,
        /// What they may take.
        most_mm: f64,
        /// Skin point.
        x_mm: f64,
        /// Skin point.
        y_mm: f64,
        /// Skin point.
        z_mm: f64,
    },
    /// Lengths contradict each other.
    #[error("geometry.shape: {0}")]
    Inconsistent(&'static str),
}

/// To two digits behind the point, on the side that is allowed.
fn rounded(limit: f64, least: bool) -> f64 {
    let hundredths = 100.0 * limit;
    (if least { hundredths.ceil() } else { hundredths.floor() }) / 100.0
}

impl FingertipShapeError {
    /// The field of a scene that is to blame, dotted.
    #[must_use]
    pub fn field(&self) -> String {
        let name = match self {
            Self::NotPositive { field, .. } | Self::TooSmall { field, .. } => *field,
            Self::CortexTooThick { .. } => "bone_cortex_mm",
            Self::NailTooSmall => "nail_mm",
            Self::Folds { field, .. } => field.as_str(),
            Self::LayersTooThick { .. } => "dermis_mm",
            Self::BoneTooClose { .. } | Self::Distorted { .. } => return "geometry.shape".into(),
            Self::Inconsistent(rule) => rule.split(' ').find(|w| w.contains('_')).unwrap_or(""),
        };
        format!("geometry.shape.{name}")
    }
}

/// Beyond it a length in mm must have been meant in another unit.
const LENGTH_MAX_MM: f64 = 100.0;
/// A finger below it must have been meant in another unit.
const LENGTH_MIN_MM: f64 = 1.0;
/// Least gap between skin and bone, mm.
pub(super) const GAP_MIN_MM: f64 = 0.3;
/// Share of the bone's least half size that its cortex may take: what is left
/// keeps the cavity's elements from degenerating.
const CORTEX_SHARE_MAX: f64 = 0.8;

impl FingertipShape {
    /// Checks every length.
    ///
    /// # Errors
    /// Names the first field that is not positive, or the contradiction.
    pub fn validate(&self) -> Result<(), FingertipShapeError> {
        let positive = [
            ("length_mm", self.length_mm),
            ("width_mm", self.width_mm),
            ("height_mm", self.height_mm),
            ("cap_length_mm", self.cap_length_mm),
            ("cap_exponent", self.cap_exponent),
            ("epidermis_mm", self.epidermis_mm),
            ("dermis_mm", self.dermis_mm),
            ("bone_tip_mm", self.bone_tip_mm),
            ("bone_cap_mm", self.bone_cap_mm),
            ("bone_tuft_mm[0]", self.bone_tuft_mm[0]),
            ("bone_tuft_mm[1]", self.bone_tuft_mm[1]),
            ("bone_waist_mm[0]", self.bone_waist_mm[0]),
            ("bone_waist_mm[1]", self.bone_waist_mm[1]),
            ("bone_base_mm[0]", self.bone_base_mm[0]),
            ("bone_base_mm[1]", self.bone_base_mm[1]),
            ("nail_mm[0]", self.nail_mm[0]),
            ("nail_mm[1]", self.nail_mm[1]),
            ("nail_tip_mm", self.nail_tip_mm),
            ("nail_thickness_mm", self.nail_thickness_mm),
            ("bone_cortex_mm", self.bone_cortex_mm),
        ];
        for (field, value) in positive {
            if !(value > 0.0 && value <= LENGTH_MAX_MM) {
                return Err(FingertipShapeError::NotPositive { field, value });
            }
        }
        for (field, value) in &positive[..3] {
            if *value < LENGTH_MIN_MM {
                return Err(FingertipShapeError::TooSmall { field, value: *value });
            }
        }
        if !(self.cap_length_mm < self.length_mm) {
            return Err(FingertipShapeError::Inconsistent("cap_length_mm must be below length_mm"));
        }
        if !(self.bone_tip_mm + self.bone_cap_mm < self.length_mm) {
            return Err(FingertipShapeError::Inconsistent(
                "bone_tip_mm and bone_cap_mm put the bone's end beyond the base plane",
            ));
        }
        if !(self.bone_waist_at > 0.0 && self.bone_waist_at < 1.0) {
            return Err(FingertipShapeError::Inconsistent("bone_waist_at must be in (0, 1)"));
        }
        if !(self.bone_offset_mm.abs() < self.height_mm) {
            return Err(FingertipShapeError::Inconsistent(
                "bone_offset_mm must be within height_mm of the axis",
            ));
        }
        if !(self.crease_depth_mm >= 0.0 && self.crease_depth_mm < 0.5 * self.height_mm) {
            return Err(FingertipShapeError::Inconsistent(
                "crease_depth_mm must be in [0, height_mm / 2)",
            ));
        }
        Ok(())
    }

    /// Checks that the bone lies below the skin everywhere, and that epidermis and dermis fit
    /// between them under the middle of the pad; those of a map, under all of the pad. Elsewhere they
    /// may be squeezed: under the nail and at the tip skin is thinner.
    ///
    /// # Errors
    /// [`FingertipShapeError::BoneTooClose`] or [`FingertipShapeError::LayersTooThick`] with the
    /// worst place.
    pub fn validate_layers(&self) -> Result<(), FingertipShapeError> {
        const STEPS: u32 = 48;
        let mut worst: Option<(f64, FingertipShapeError)> = None;
        for k in 0..=STEPS * STEPS {
            let [i, j] = [k / STEPS, k % STEPS].map(|n| f64::from(n) / f64::from(STEPS));
            if let Err(error @ FingertipShapeError::BoneTooClose { gap_mm, .. }) =
                self.layers(at_uv([j, 2.0 * i]))
                && worst.as_ref().is_none_or(|(gap, _)| gap_mm < *gap)
            {
                worst = Some((gap_mm, error));
            }
        }
        if let Some((_, error)) = worst {
            return Err(error);
        }
        let mut places = vec![SurfaceParameter::Body([0.0, -1.0], 0.0)];
        if self.epidermis_map.is_some() || self.dermis_map.is_some() {
            let all = (0..=STEPS * STEPS).map(|k| {
                let [i, j] = [k / STEPS, k % STEPS].map(|n| f64::from(n) / f64::from(STEPS));
                at_uv([j, 2.0 * i])
            });
            places.extend(all.filter(|s| self.region(*s) == "pad"));
        }
        let too_thick = places.into_iter().filter_map(|s| self.too_thick(s));
        too_thick.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(Ok(()), |(_, error)| Err(error))
    }

    /// By how much epidermis and dermis are too thick at a place, mm; none if they are not.
    fn too_thick(&self, s: SurfaceParameter) -> Option<(f64, FingertipShapeError)> {
        let (skin, bone, normal) = (self.skin(s), self.bone(s), self.skin_normal_at(s));
        let gap_mm: f64 = (0..3).map(|i| (skin[i] - bone[i]) * normal[i]).sum();
        let (layers_mm, most_mm) =
            (self.thickness_mm(s).iter().sum::<f64>(), SKIN_SHARE_MAX * gap_mm);
        let [x_mm, y_mm, z_mm] = skin;
        let error =
            FingertipShapeError::LayersTooThick { layers_mm, gap_mm, most_mm, x_mm, y_mm, z_mm };
        (layers_mm > most_mm).then_some((layers_mm - most_mm, error))
    }

    /// Where a place of the skin is on the finger, in words.
    #[must_use]
    pub fn region(&self, s: SurfaceParameter) -> &'static str {
        const FOLD_MM: f64 = 2.0;
        let (p, [u, v]) = (self.template_skin(s), uv(s));
        let beside = p[1].abs() - 0.5 * self.nail_mm[0];
        let along = (p[0] - self.nail_tip_mm).min(self.nail_tip_mm + self.nail_mm[1] - p[0]);
        let dorsal = p[2] > 0.25 * self.height_mm;
        if dorsal && beside.abs() <= FOLD_MM && along >= -FOLD_MM {
            "nail fold"
        } else if dorsal && beside < 0.0 && along.abs() <= FOLD_MM {
            "nail's end"
        } else if self.under_nail(p) {
            "nail bed"
        } else if v < 0.5 {
            "tip"
        } else if v > 1.8 {
            "base plane"
        } else if u.min(1.0 - u) < 0.15 {
            "pad"
        } else if dorsal {
            "back"
        } else {
            "side"
        }
    }

    /// Checks that a solid bone's cortex leaves a marrow cavity. Not part of
    /// [`FingertipShape::validate`]: a rigid bone may be as thin as it likes.
    ///
    /// # Errors
    /// [`FingertipShapeError::CortexTooThick`] says how thick it may be.
    pub fn validate_cortex(&self) -> Result<(), FingertipShapeError> {
        let sizes = [self.bone_tuft_mm, self.bone_waist_mm, self.bone_base_mm];
        let least = sizes.as_flattened().iter().map(|v| 0.5 * v).fold(self.bone_cap_mm, f64::min);
        let (cortex_mm, most_mm) = (self.bone_cortex_mm, CORTEX_SHARE_MAX * least);
        if cortex_mm <= most_mm {
            Ok(())
        } else {
            Err(FingertipShapeError::CortexTooThick { cortex_mm, most_mm })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cortex_without_a_cavity_is_refused() {
        let shape = FingertipShape { bone_tuft_mm: [7.5, 1.5], ..Default::default() };
        assert!(shape.validate().is_ok(), "a rigid bone may be thin");
        let e = shape.validate_cortex().unwrap_err();
        assert!(e.to_string().contains("bone_cortex_mm = 0.75") && e.to_string().contains("0.600"));
    }
}
