//! A picture of the fit: distances over (u, v), and two sections with their layers.

use crate::fit::Fitted;
use crate::skin::SAMPLES;
use papilla_fingertip::geometry::fingertip::SurfaceParameter;
use papilla_fingertip::geometry::fingertip::offset::at_uv;
use papilla_output::OutputError;
use papilla_output::canvas::{BLACK, Canvas, OUTSIDE, Rgb, TEXT_HEIGHT_PX, viridis};

const SIZE_PX: [usize; 2] = [1120, 900];
const MAP_PX: usize = 384;
const MARGIN_PX: usize = 40;
/// Pixels of a millimetre in the sections.
const PX_PER_MM: f64 = 15.0;
/// Skin, interface of epidermis and dermis, inner side of the dermis, bone.
const COLOURS: [Rgb; 4] = [BLACK, [0, 114, 178], [0, 158, 115], [213, 94, 0]];
const SURFACE: Rgb = [204, 121, 167];

/// The picture as PNG.
///
/// # Errors
/// [`OutputError`] if it cannot be encoded.
pub fn draw(fitted: &Fitted) -> Result<Vec<u8>, OutputError> {
    let mut canvas = Canvas::new(SIZE_PX[0], SIZE_PX[1]);
    let skin = &fitted.skin;
    let maps = [
        ("surface from template", &skin.of_template_mm),
        ("surface from fitted skin", &skin.of_skin_mm),
    ];
    for (k, (title, values)) in maps.into_iter().enumerate() {
        let x = MARGIN_PX + k * (MAP_PX + 3 * MARGIN_PX);
        map(&mut canvas, (x, MARGIN_PX), title, values);
    }
    let top = MARGIN_PX + MAP_PX + 4 * TEXT_HEIGHT_PX;
    canvas.text((MARGIN_PX, top), "section along the finger, y = 0", BLACK);
    section(
        &mut canvas,
        fitted,
        (MARGIN_PX, top + 230),
        |p| [p[0], p[2]],
        |n| {
            let (half, v) = (n % 2, f64::from(n / 2) / 600.0);
            Some(at_uv([0.5 * f64::from(half), 2.0 * v]))
        },
    );
    let right = MARGIN_PX + 640;
    canvas.text((right, top), "thickest section", BLACK);
    section(
        &mut canvas,
        fitted,
        (right + 150, top + 230),
        |p| [p[1], p[2]],
        |n| {
            let (y, z) = (std::f64::consts::TAU * f64::from(n) / 1200.0).sin_cos();
            Some(SurfaceParameter::Body([y, -z], 0.0))
        },
    );
    let words = ["skin", "interface", "dermis ends", "bone"];
    let mut x = MARGIN_PX;
    for (word, colour) in words.into_iter().zip(COLOURS).chain([("the surface", SURFACE)]) {
        canvas.fill((x, SIZE_PX[1] - 30), (12, 12), colour);
        canvas.text((x + 18, SIZE_PX[1] - 32), word, BLACK);
        x += 180;
    }
    canvas.encode_png()
}

/// Distances over u (to the right, the palmar line in the middle) and v (downward).
fn map(canvas: &mut Canvas, (x, y): (usize, usize), title: &str, values: &[Option<f64>]) {
    let [rows, columns] = SAMPLES;
    let most = values.iter().flatten().fold(1e-3_f64, |most, v| most.max(v.abs()));
    let px = MAP_PX / columns;
    canvas.text((x, y - TEXT_HEIGHT_PX - 4), title, BLACK);
    for i in 0..rows {
        for j in 0..columns {
            let at = (j + columns / 2) % columns;
            let colour =
                values[i * columns + at].map_or(OUTSIDE, |v| viridis(0.5 + 0.5 * v / most));
            canvas.fill((x + j * px, y + i * px), (px, px), colour);
        }
    }
    let text = format!("dark -{most:.3} mm (inside) to bright +{most:.3} mm");
    canvas.text((x, y + MAP_PX + 4), &text, BLACK);
    let text = "right: u, pad in the middle, nail at the sides; down: v, tip to base";
    canvas.text((x, y + MAP_PX + 4 + TEXT_HEIGHT_PX), text, BLACK);
}

/// The layers' outlines through places of the skin, and where the surface is.
fn section(
    canvas: &mut Canvas,
    fitted: &Fitted,
    (x, y): (usize, usize),
    flat: impl Fn([f64; 3]) -> [f64; 2],
    place: impl Fn(u32) -> Option<SurfaceParameter>,
) {
    let mut dot = |p: [f64; 3], colour: Rgb| {
        let [a, b] = flat(p);
        let (px, py) = (x as f64 + PX_PER_MM * a, y as f64 - PX_PER_MM * b);
        if px >= 0.0 && py >= 0.0 {
            canvas.fill((px as usize, py as usize), (2, 2), colour);
        }
    };
    let shape = &fitted.finger.shape;
    for s in (0..1200).filter_map(place) {
        if let Ok(bounds) = shape.layers(s) {
            let (p, n) = (bounds[0], shape.skin_normal_at(s));
            let gap = fitted.surface.gap_mm(p);
            dot(std::array::from_fn(|i| p[i] - gap * n[i]), SURFACE);
            bounds.into_iter().zip(COLOURS).for_each(|(p, colour)| dot(p, colour));
        }
    }
}
