//! The baseline: an independent spring at each vertex.
//!
//! The pressure is `p = k max(0, d - relief d_max)^n`, with the depth `d` of the undeformed vertex
//! in the object and the greatest depth `d_max`. How the constants were fitted:
//! `studies/reports/penetration.md`.

use crate::answer::{Aside, Contact, Person};
use crate::model::ContactModel;
use crate::objects::View;

const STIFFNESS_PA: f64 = 20090.0;
const EXPONENT: f64 = 0.6;
const RELIEF: f64 = 0.35;
/// Cosine between the skin's and an object's outward normals above which a spring does not push in,
/// and the part of the force by such springs above which an answer is rough.
const TURNED: f64 = -0.3;
const TURNED_MAX: f64 = 0.03;

/// Presses the vertices `candidates`.
pub(crate) fn press(
    model: &ContactModel,
    view: View<'_>,
    person: Person,
    candidates: &[(f64, u32)],
    out: &mut Contact,
) {
    let depth = |&(_, vertex): &(f64, u32)| {
        let at = model.positions_mm[vertex as usize];
        (at, view.nearest(model, vertex as usize, [0.0; 3]))
    };
    let deepest = candidates.iter().map(|v| -depth(v).1.gap_mm).fold(0.0, f64::max);
    let (mut size_n, mut turned_n, mut aside) = (0.0, 0.0, Aside::default());
    for candidate in candidates {
        let (at, nearest) = depth(candidate);
        let vertex = candidate.1;
        let d = -nearest.gap_mm - RELIEF * deepest;
        if d > 0.0 {
            let pressure = person.stiffness * STIFFNESS_PA * d.powf(EXPONENT);
            let area = f64::from(model.areas_mm2[vertex as usize]);
            let size = pressure / person.stiffness * area * 1e-6;
            out.press(vertex, pressure as f32);
            let force = nearest.normal.map(|n| size * n);
            out.add(at, force, size, area);
            size_n += size;
            let skin = model.normals[vertex as usize];
            aside.add(force, skin);
            let facing: f64 = (0..3).map(|i| f64::from(skin[i]) * nearest.normal[i]).sum();
            turned_n += if facing > TURNED { size } else { 0.0 };
        }
    }
    // Skin deep in what is narrow is nearer to its sides: springs push it there.
    out.quality.settled &= turned_n <= TURNED_MAX * size_n;
    aside.judge(&mut out.quality);
    view.count(2 * candidates.len() as u32, &mut out.effort);
    out.penetration_mm = deepest;
    out.finish(person, size_n);
}
