//! Surfaces that are open, cross themselves or are turned the wrong way: the body that they mean, by
//! the generalised [winding number](super::winding).
//!
//! A place is inside where the number is above one half. A hole is closed by a fan of triangles whose
//! middle lies where the number of the open surface is one half: on the plane of the rim, if it is
//! plane. Triangles are cut where others cross them. Of the pieces those count that have the inside on
//! one side only, so that skin in the body sees no wall that is covered. The distance is that of the
//! nearest piece; its sign beside an edge or a corner is that of the winding number.

mod cut;
mod holes;
mod turn;

use super::check::{Checked, unchecked};
use super::error::MeshError;
use super::tree::Tree;
use super::winding::Winding;
use super::work::Work;
use super::{Mesh, normal};
use crate::beneath::SEAM_MM;
use papilla_vector::{along, norm, scaled_to_one};
use std::collections::HashMap;

/// Of an open surface some place has to be surrounded to this share: between a sheet, which has no
/// inside, and a closed one.
const SURE: f64 = 0.6;
/// Pieces smaller than this do not count, mm2.
const AREA_MIN_MM2: f64 = 1e-9;
/// What is looked at for a winding number, about.
const WORK_OF_WINDING: u64 = 64;

/// What was done to a surface to make a body of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mended {
    /// Holes that were closed.
    pub holes: usize,
    /// Rims, as of cracks, that were left: the surface goes round the body all the same.
    pub cracks: usize,
    /// Triangles that were turned.
    pub turned: usize,
    /// Triangles that lie inside the body, bound none or were there twice: wholly or in part.
    pub covered: usize,
}

impl std::fmt::Display for Mended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { holes, cracks, turned, covered } = *self;
        f.write_str("the mesh bounds no body as it is, so that inside was told from outside by its winding number")?;
        for (count, one, many) in [
            (holes, "hole was closed", "holes were closed"),
            (cracks, "open rim was left", "open rims were left"),
            (turned, "triangle was turned", "triangles were turned"),
            (
                covered,
                "triangle does not count, wholly or in part, since it lies inside the body or bounds none",
                "triangles do not count, wholly or in part, since they lie inside the body or bound none",
            ),
        ] {
            match count {
                0 => {}
                1 => write!(f, "; 1 {one}")?,
                _ => write!(f, "; {count} {many}")?,
            }
        }
        Ok(())
    }
}

/// A surface that bounds a body, and how to tell inside from outside beside its edges.
pub(super) struct Body {
    pub(super) checked: Checked,
    pub(super) winding: Winding,
    pub(super) mended: Mended,
}

/// Makes a body of a surface for as long as `go_on` says so, which is asked now and then.
///
/// # Errors
/// [`MeshError::NoInside`] where the surface is around nothing, [`MeshError::TooTangled`] where it
/// crosses itself too often.
pub(super) fn body(mesh: &Mesh, go_on: &dyn Fn() -> bool) -> Result<Body, MeshError> {
    let nothing = |_| MeshError::NoInside { percent: 0 };
    let Checked { corners_mm, mut triangles, .. } = unchecked(mesh).map_err(nothing)?;
    let doubled = turn::without_doubles(&mut triangles);
    let turned = turn::outward(&corners_mm, &mut triangles);
    let mut places: Vec<_> = triangles.iter().map(|t| t.map(|c| corners_mm[c as usize])).collect();
    let own = places.len();

    let rims = holes::rims(&triangles);
    let open = (!rims.is_empty()).then(|| Winding::new(places.clone()));
    let mut mended = Mended { turned, covered: doubled, ..Mended::default() };
    let mut work = Work::new(8 * own, go_on);
    if let Some(open) = &open {
        for rim in &rims {
            work.spend(holes::LOOKS * WORK_OF_WINDING)?;
            let rim: Vec<_> = rim.iter().map(|c| corners_mm[*c as usize]).collect();
            match holes::fan(&rim, open) {
                Some(fan) => {
                    places.extend(fan);
                    mended.holes += 1;
                }
                None => mended.cracks += 1,
            }
        }
    }
    let tree = Tree::new(&places);
    let pieces = cut::pieces(&places, &tree, &mut work)?;
    let winding = Winding::new(places);
    let kept = Kept::of(&pieces, [&winding, open.as_ref().unwrap_or(&winding)], own, &mut work)?;
    mended.covered += kept.covered;
    if kept.places.is_empty() || kept.most < SURE {
        return Err(MeshError::NoInside { percent: (100.0 * kept.most).clamp(0.0, 99.0) as u32 });
    }
    Ok(Body { checked: checked(&kept.places), winding, mended })
}

/// The pieces that bound the body.
struct Kept {
    places: Vec<[[f64; 3]; 3]>,
    covered: usize,
    /// The greatest winding number of the open surface beside it.
    most: f64,
}

impl Kept {
    fn of(
        pieces: &[cut::Piece],
        [winding, open]: [&Winding; 2],
        own: usize,
        work: &mut Work<'_>,
    ) -> Result<Self, MeshError> {
        let mut kept = Self { places: Vec::new(), covered: 0, most: 0.0 };
        let mut last_covered = usize::MAX;
        for cut::Piece { of, corners_mm } in pieces {
            let fan = || corners_mm[1..].windows(2).map(|w| [corners_mm[0], w[0], w[1]]);
            let twice_area = fan().fold([0.0; 3], |sum, place| along(sum, 1.0, normal(place)));
            let area_mm2 = 0.5 * norm(twice_area);
            if !(area_mm2 > AREA_MIN_MM2) {
                continue;
            }
            work.spend(2 * WORK_OF_WINDING)?;
            let n = scaled_to_one(twice_area);
            let count = corners_mm.len() as f64;
            let middle: [f64; 3] =
                std::array::from_fn(|i| corners_mm.iter().map(|p| p[i]).sum::<f64>() / count);
            let off = SEAM_MM.min(0.1 * area_mm2.sqrt());
            let sides = [off, -off].map(|off| along(middle, off, n));
            let inside = sides.map(|p| winding.is_inside(p));
            if inside[0] == inside[1] {
                // Of a triangle only once, and of what was added not at all.
                if *of < own && *of != last_covered {
                    kept.covered += 1;
                    last_covered = *of;
                }
                continue;
            }
            if *of < own {
                kept.most = kept.most.max(open.at(sides[usize::from(inside[1])]));
            }
            let outward = |[a, b, c]: [[f64; 3]; 3]| if inside[0] { [a, c, b] } else { [a, b, c] };
            kept.places.extend(fan().map(outward).filter(|place| norm(normal(*place)) > 0.0));
        }
        Ok(kept)
    }
}

/// Corners at the same place are one.
fn checked(places: &[[[f64; 3]; 3]]) -> Checked {
    let mut first = HashMap::new();
    let mut corners_mm = Vec::new();
    let triangles = places.iter().map(|place| {
        place.map(|p| {
            *first.entry(p.map(|v| (v + 0.0).to_bits())).or_insert_with(|| {
                corners_mm.push(p);
                corners_mm.len() as u32 - 1
            })
        })
    });
    let triangles = triangles.collect();
    Checked { corners_mm, triangles, tree: Tree::new(places) }
}

#[cfg(test)]
mod tests;
