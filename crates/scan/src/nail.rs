//! The nail plate's size and place from a surface of it.

use crate::placed::Placed;
use crate::{ScanError, Surface};
use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::scene::finger::FIELDS;
use papilla_sdf::Placement;
use papilla_vector::dot;

/// How far the plate's surface may be from the skin's, mm: a plate's thickness, a free edge, noise.
const AWAY_MAX_MM: f64 = 3.0;
/// How far the plate's middle may be from the finger's before it is said, mm.
const ASIDE_MM: f64 = 1.0;

/// Sets width, length and place of the nail; `nail` lies in the scan's frame.
///
/// # Errors
/// [`ScanError::NailElsewhere`] names a place of it that is not on the back of the finger.
pub(crate) fn fit(
    shape: &mut FingertipShape,
    nail: &Surface,
    placement: &Placement,
    skin: &Placed,
    done: &mut Vec<String>,
) -> Result<(), ScanError> {
    let Placement { rotation, origin_mm } = placement;
    let used: std::collections::BTreeSet<u32> = nail.triangles.iter().flatten().copied().collect();
    let own: Vec<[f64; 3]> = (used.iter().map(|&c| nail.vertices_mm[c as usize]))
        .map(|p| std::array::from_fn(|i| dot(rotation[i], p) + origin_mm[i]))
        .collect();
    // Before the tip and behind the base plane there is no skin to be near to.
    let beside = own.iter().filter(|p| 0.0 < p[0] && p[0] < shape.length_mm);
    let away = |p: &[f64; 3]| if p[2] > 0.0 { skin.gap_mm(*p).abs() } else { f64::INFINITY };
    let worst = beside.map(|p| (away(p), *p)).max_by(|a, b| a.0.total_cmp(&b.0));
    match worst {
        Some((away_mm, _)) if away_mm <= AWAY_MAX_MM => {}
        Some((_, at_mm)) => return Err(ScanError::NailElsewhere { at_mm, most_mm: AWAY_MAX_MM }),
        None => {
            let at_mm = own.first().copied().unwrap_or_default();
            return Err(ScanError::NailElsewhere { at_mm, most_mm: AWAY_MAX_MM });
        }
    }
    let extent = |i: usize| {
        let low = own.iter().map(|p| p[i]).fold(f64::INFINITY, f64::min);
        [low, own.iter().map(|p| p[i]).fold(low, f64::max)]
    };
    let ([front, back], [left, right]) = (extent(0), extent(1));
    // A long nail's free edge is no part of the model.
    let field = FIELDS.iter().find(|field| field.shape == "nail_tip_mm");
    let least_mm = field.map_or(0.0, |field| field.range[0]);
    let tip_mm = front.max(least_mm);
    let back = back.min(shape.length_mm);
    shape.nail_tip_mm = tip_mm;
    shape.nail_mm = [right - left, back - tip_mm];
    let [wide, long] = shape.nail_mm;
    done.push(format!(
        "the nail was taken from its surface: {wide:.1} mm wide, {long:.1} mm long, {tip_mm:.1} mm behind the tip"
    ));
    let aside_mm = 0.5 * (left + right);
    if aside_mm.abs() > ASIDE_MM {
        done.push(format!(
            "the nail's middle is {aside_mm:+.1} mm beside the finger's: the model has it in the middle"
        ));
    }
    Ok(())
}
