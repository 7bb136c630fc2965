//! The template's bone fitted to a surface of the bone.

use crate::ScanError;
use crate::least_squares::{Parameter, minimise};
use crate::placed::Placed;
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::geometry::fingertip::offset::at_uv;
use papilla_fingertip::scene::finger::FIELDS;

/// How far a bone may reach out of the skin by the noise of both surfaces, mm.
const OUT_MAX_MM: f64 = 0.1;

/// Fits the bone's dimensions; `skin` is the finger's surface.
///
/// # Errors
/// [`ScanError::BoneOutside`] names the place.
pub(crate) fn fit(
    shape: &mut FingertipShape,
    bone: &Placed,
    skin: &Placed,
    done: &mut Vec<String>,
) -> Result<(), ScanError> {
    let outside = (bone.corners_mm().into_iter())
        .filter(|p| p[0] < shape.length_mm)
        .map(|p| (skin.gap_mm(p), p))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((out_mm, at_mm)) = outside.filter(|(gap, _)| *gap > OUT_MAX_MM) {
        return Err(ScanError::BoneOutside { out_mm, at_mm });
    }
    const NAMES: [(&str, usize); 10] = [
        ("bone_tip_mm", 0),
        ("bone_cap_mm", 0),
        ("bone_offset_mm", 0),
        ("bone_tuft_mm", 0),
        ("bone_tuft_mm", 1),
        ("bone_waist_mm", 0),
        ("bone_waist_mm", 1),
        ("bone_base_mm", 0),
        ("bone_base_mm", 1),
        ("bone_waist_at", 0),
    ];
    let own = shape.clone();
    let parameters: Vec<Parameter> = NAMES
        .iter()
        .filter_map(|(name, index)| {
            let field = FIELDS.iter().find(|f| f.shape == *name)?;
            let start = field.values(&own)[*index].clamp(field.range[0], field.range[1]);
            Some(Parameter { start, range: field.range, step: 1e-3 })
        })
        .collect();
    let with = |x: &[f64]| FingertipShape {
        bone_tip_mm: x[0],
        bone_cap_mm: x[1].min(own.length_mm - x[0] - 1.0),
        bone_offset_mm: x[2],
        bone_tuft_mm: [x[3], x[4]],
        bone_waist_mm: [x[5], x[6]],
        bone_base_mm: [x[7], x[8]],
        bone_waist_at: x[9],
        ..own.clone()
    };
    const ROWS: u32 = 20;
    const COLUMNS: u32 = 16;
    let residuals = |x: &[f64]| -> Vec<f64> {
        let shape = with(x);
        let place = |n: u32| {
            let v = 1.94 * (f64::from(n / COLUMNS) + 0.5) / f64::from(ROWS);
            bone.gap_mm(shape.bone(at_uv([f64::from(n % COLUMNS) / f64::from(COLUMNS), v])))
        };
        (0..ROWS * COLUMNS).map(place).collect()
    };
    let x = minimise(&parameters, &residuals);
    let left = residuals(&x);
    let rms = (left.iter().map(|r| r * r).sum::<f64>() / left.len() as f64).sqrt();
    done.push(format!(
        "the bone was fitted to its surface: {rms:.2} mm are left (root of the mean square)"
    ));
    *shape = with(&x);
    Ok(())
}
