//! Surfaces that tests make.

use papilla_fingertip::geometry::fingertip::FingertipShape;
use papilla_fingertip::geometry::fingertip::offset::at_uv;
use papilla_scan::ScanError;
use papilla_scan::Surface;
use papilla_scan::fit::{Fitted, Inside, Where, fit};

/// Rings along the finger and corners round it.
pub(crate) const FINE: [u32; 2] = [60, 80];

/// Rings of triangles through places of (u, v) up to the base plane, which stays open.
pub(crate) fn rings([rows, columns]: [u32; 2], at: impl Fn([f64; 2]) -> [f64; 3]) -> Surface {
    let mut surface = Surface { vertices_mm: vec![at([0.0, 0.0])], triangles: vec![] };
    for i in 1..=rows {
        let v = 2.0 * f64::from(i) / f64::from(rows);
        surface
            .vertices_mm
            .extend((0..columns).map(|j| at([f64::from(j) / f64::from(columns), v])));
    }
    let corner = |i: u32, j: u32| if i == 0 { 0 } else { 1 + (i - 1) * columns + j % columns };
    for j in 0..columns {
        surface.triangles.push([0, corner(1, j + 1), corner(1, j)]);
        for i in 1..rows {
            let [a, b, c, d] =
                [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            surface.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    surface
}

/// The skin of a finger, in its own frame.
pub(crate) fn skin(shape: &FingertipShape, size: [u32; 2]) -> Surface {
    rings(size, |uv| shape.skin(at_uv(uv)))
}

/// How a scanner saw it: turned and moved.
pub(crate) fn moved(p: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = p;
    let (s, c) = 0.7_f64.sin_cos();
    let (x, y) = (c * x - s * y, s * x + c * y);
    let (s, c) = (-0.4_f64).sin_cos();
    let (y, z) = (c * y - s * z, s * y + c * z);
    [x + 31.0, y - 12.0, z + 5.0]
}

/// The same of a direction.
pub(crate) fn turned(d: [f64; 3]) -> [f64; 3] {
    let (a, b) = (moved(d), moved([0.0; 3]));
    std::array::from_fn(|i| a[i] - b[i])
}

pub(crate) fn scanned(mut surface: Surface) -> Surface {
    surface.vertices_mm.iter_mut().for_each(|p| *p = moved(*p));
    surface
}

/// Where a scanned finger is, roughly: what somebody reads off a mesh viewer.
pub(crate) fn where_it_is() -> Where {
    Where {
        tip_mm: moved([0.4, 0.5, -0.6]),
        axis: turned([1.0, 0.06, -0.05]),
        nail: Some(turned([0.1, 0.1, 1.0])),
        length_mm: None,
    }
}

pub(crate) const NOTHING: Inside<'_> =
    Inside { numbers: None, bone: None, nail: None, epidermis: None, dermis: None };

pub(crate) fn fit_of(surface: &Surface) -> Result<Fitted, ScanError> {
    fit(surface, &where_it_is(), &NOTHING)
}
