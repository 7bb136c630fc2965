//! Pictures of a sample: pressure, truth, prediction and error side by side.

mod colour;

use crate::ExportError;
use crate::dataset::Dataset;
use crate::evaluate::{Maps, Sample};
use colour::Scale;
use papilla_output::canvas::{BLACK, Canvas, OUTSIDE, TEXT_WIDTH_PX};
use papilla_proto::{MAP_LEN, MAP_SIDE_PX, atlas::Patch};
use std::path::Path;

/// Pixels of the picture for one pixel of a map.
const ZOOM: usize = 2;
const PANEL: usize = MAP_SIDE_PX * ZOOM;
const GAP: usize = 16;
/// Room above a panel: two lines of text.
const HEAD: usize = 52;
/// Room below a panel: the colour bar and its labels.
const FOOT: usize = 56;
const BAR: usize = 14;

struct Panel<'a> {
    title: String,
    values: Vec<f32>,
    mask: &'a [bool],
    /// Values at the two ends of the colour bar.
    ends: [f32; 2],
    unit: &'static str,
    scale: Scale,
}

/// Draws one sample. `heading` stands above, such as `worst of 200`.
#[must_use]
pub fn draw(heading: &str, sample: &Sample, maps: &Maps, dataset: &Dataset) -> Canvas {
    let pressure = maps.pressure_pa.iter().map(|v| v / 1e3).collect::<Vec<_>>();
    let (truth, predicted) = (maps.truth_j_per_m3.clone(), maps.predicted_j_per_m3.clone());
    let error: Vec<f32> = (0..MAP_LEN).map(|i| predicted[i] - truth[i]).collect();
    let greatest = |map: &[f32]| map.iter().fold(0.0f32, |m, v| m.max(v.abs()));
    // Truth and prediction share a scale: equal colours are equal values.
    let sed_max = greatest(&truth).max(greatest(&predicted));
    let (pressure_max, error_max) = (greatest(&pressure), greatest(&error));
    let inside = dataset.maps.raster(Patch::Interface).mask();
    let panel = |title: &str, values, mask, ends, unit, scale| Panel {
        title: title.to_owned(),
        values,
        mask,
        ends,
        unit,
        scale,
    };
    let panels = [
        panel(
            "pressure",
            pressure,
            dataset.maps.raster(Patch::Skin).mask(),
            [0.0, pressure_max],
            "kPa",
            Scale::Rising,
        ),
        panel("SED, finite elements", truth, inside, [0.0, sed_max], "J/m3", Scale::Rising),
        panel("SED, model", predicted, inside, [0.0, sed_max], "J/m3", Scale::Rising),
        panel(
            "model - finite elements",
            error,
            inside,
            [-error_max, error_max],
            "J/m3",
            Scale::Signed,
        ),
    ];
    laid_out(&describe(heading, sample), &panels)
}

/// A map of values from 0 up.
pub struct Picture<'a> {
    /// Above it.
    pub title: String,
    /// Value of each pixel.
    pub values: Vec<f32>,
    /// Which pixels have one.
    pub mask: &'a [bool],
    /// Where the colours end.
    pub max: f32,
    /// Of the values.
    pub unit: &'static str,
}

/// Draws maps side by side.
#[must_use]
pub fn sheet<const N: usize>(heading: &str, pictures: [Picture<'_>; N]) -> Canvas {
    let panels = pictures.map(|Picture { title, values, mask, max, unit }| Panel {
        title,
        values,
        mask,
        ends: [0.0, max],
        unit,
        scale: Scale::Rising,
    });
    laid_out(heading, &panels)
}

fn laid_out(heading: &str, panels: &[Panel<'_>]) -> Canvas {
    let width = panels.len() * PANEL + (panels.len() + 1) * GAP;
    let mut canvas = Canvas::new(width, HEAD + PANEL + FOOT);
    canvas.text((GAP, 8), heading, BLACK);
    for (i, panel) in panels.iter().enumerate() {
        draw_panel(&mut canvas, GAP + i * (PANEL + GAP), panel);
    }
    canvas
}

/// Writes a picture as PNG.
///
/// # Errors
/// [`ExportError::Picture`], [`ExportError::Io`].
pub fn write_png(picture: &Canvas, path: &Path) -> Result<(), ExportError> {
    let refused = |source| ExportError::Picture { path: path.to_owned(), source };
    crate::write(path, &picture.encode_png().map_err(refused)?)
}

fn describe(heading: &str, sample: &Sample) -> String {
    let m = &sample.metrics;
    let far = m.far_field_relative_l2.map_or("-".to_owned(), |v| format!("{:.1} %", 100.0 * v));
    format!(
        "{heading}: indentation {}, depth {:.2} mm, pitch {:.1}, roll {:.1}, yaw {:.1} deg; relative L2 {:.1} %, \
         far field {far}, peak {:.1} %, energy {:.1} %, SSIM {:.4}",
        sample.indentation,
        sample.depth_mm,
        sample.pitch_deg,
        sample.roll_deg,
        sample.yaw_deg,
        100.0 * m.relative_l2,
        100.0 * m.peak_error,
        100.0 * m.total_energy_error,
        m.ssim,
    )
}

fn draw_panel(canvas: &mut Canvas, left: usize, panel: &Panel<'_>) {
    canvas.text((left, 32), &panel.title, BLACK);
    let [low, high] = panel.ends;
    // A map of one value has the colour of the lower end.
    let span = if high > low { high - low } else { 1.0 };
    for (i, (value, is_inside)) in panel.values.iter().zip(panel.mask).enumerate() {
        let (row, column) = (i / MAP_SIDE_PX, i % MAP_SIDE_PX);
        let colour = if *is_inside { panel.scale.colour((value - low) / span) } else { OUTSIDE };
        canvas.fill((left + ZOOM * column, HEAD + ZOOM * row), (ZOOM, ZOOM), colour);
    }
    let top = HEAD + PANEL + 8;
    for column in 0..PANEL {
        let colour = panel.scale.colour(column as f32 / (PANEL - 1) as f32);
        canvas.fill((left + column, top), (1, BAR), colour);
    }
    let middle = 0.5 * (low + high);
    for (place, value) in [(0.0, low), (0.5, middle), (1.0, high)] {
        let label =
            if place > 0.9 { format!("{} {}", number(value), panel.unit) } else { number(value) };
        let free = PANEL - label.chars().count() * TEXT_WIDTH_PX;
        canvas.text((left + (place * free as f32) as usize, top + BAR + 6), &label, BLACK);
    }
}

/// Three significant digits.
fn number(value: f32) -> String {
    let digits = if value.abs() < 1e-12 { 0 } else { 2 - value.abs().log10().floor() as i32 };
    format!("{value:.*}", usize::try_from(digits.clamp(0, 6)).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn labels_have_three_digits() {
        for (value, label) in [
            (0.0, "0"),
            (23.456, "23.5"),
            (0.001_234, "0.00123"),
            (-1.5, "-1.50"),
            (1234.0, "1234"),
        ] {
            assert_eq!(number(value), label);
        }
    }
}
