//! A contact sheet: pressure and SED of many indentations on one picture.

use super::{Dataset, DatasetError, Field, Maps};
use papilla_atlas::MAP_LEN;
use papilla_output::atomic;
use papilla_output::canvas::{BLACK, Canvas, TEXT_HEIGHT_PX};
use papilla_output::map_image::{MapView, Quantity, white_of};
use std::path::Path;

/// Indentations shown at most, spread over the campaign.
const ROWS_MAX: usize = 8;
/// Depths shown per indentation at most, the deepest among them.
const PAIRS_MAX: usize = 4;
const CELL_PX: usize = 150;
const GAP_PX: usize = 8;
const HEAD_PX: usize = 2 * TEXT_HEIGHT_PX + 14;
const LABEL_PX: usize = 118;

/// `count` whole numbers spread evenly over 0..total, the last one included.
fn spread(count: usize, total: usize) -> Vec<usize> {
    let count = count.min(total);
    (1..=count).map(|i| i * total / count - 1).collect()
}

/// Writes a PNG of pressure/SED pairs: a row for each of some indentations, a pair
/// of maps for each of some depths. Each map has its own scale, from 0 to the
/// maximum printed above it.
///
/// # Errors
/// [`DatasetError`] when a shard is damaged or the file cannot be written.
pub fn contact_sheet(dataset: &Dataset, path: &Path) -> Result<(), DatasetError> {
    let presses = &dataset.manifest().presses;
    let rows = spread(ROWS_MAX, presses.len());
    let pairs = presses.iter().map(|p| p.samples).max().unwrap_or(0).min(PAIRS_MAX);
    let row_px = CELL_PX + TEXT_HEIGHT_PX + 2 * GAP_PX;
    let width = LABEL_PX + pairs * 2 * (CELL_PX + GAP_PX) + GAP_PX;
    let mut canvas = Canvas::new(width, HEAD_PX + rows.len() * row_px + GAP_PX);
    let title = "Pressure on the skin (left of each pair) and SED at the interface, dermis side";
    canvas.text((GAP_PX, 6), title, BLACK);
    let note = "each map from 0 (dark) to its own maximum, printed above it; fingertip up";
    canvas.text((GAP_PX, 6 + TEXT_HEIGHT_PX), note, [110; 3]);
    let maps = Maps::read(dataset.folder(), dataset.atlas())?;
    for (row, &index) in rows.iter().enumerate() {
        let press = &presses[index];
        let shard = dataset.shard(press)?;
        let of_shard = maps.of(&shard);
        let y = HEAD_PX + row * row_px;
        let lines = [
            format!("press {}", press.id),
            press.indenter.chars().take(14).collect(),
            format!("pitch {:.1}", press.pose.pitch_deg),
            format!("roll {:.1}", press.pose.roll_deg),
            format!("yaw {:.1}", press.pose.yaw_deg),
        ];
        for (i, line) in lines.iter().enumerate() {
            canvas.text((GAP_PX, y + (i + 1) * (TEXT_HEIGHT_PX + 2)), line, BLACK);
        }
        for (pair, sample) in spread(pairs, shard.len()).into_iter().enumerate() {
            let x = LABEL_PX + pair * 2 * (CELL_PX + GAP_PX);
            let depth_mm = shard.depth_mm[sample];
            let fields = [(Quantity::Pressure, Field::Pressure), (Quantity::Sed, Field::SedDermis)];
            for (i, (quantity, field)) in fields.into_iter().enumerate() {
                let corner = (x + i * (CELL_PX + GAP_PX), y);
                let before = if i == 0 { format!("{depth_mm} mm ") } else { String::new() };
                let mut pixels = vec![0.0; MAP_LEN];
                of_shard.draw(field, sample, &mut pixels)?;
                let view = MapView {
                    quantity,
                    pixels: &pixels,
                    mask: maps.raster(field.patch()).mask(),
                    mm_per_px: f64::from(dataset.atlas().mm_per_px()),
                    white: white_of(&pixels),
                };
                cell(&mut canvas, &view, corner, &before);
            }
        }
    }
    Ok(atomic::write(path, &canvas.encode_png()?)?)
}

fn cell(canvas: &mut Canvas, view: &MapView<'_>, (x, y): (usize, usize), before: &str) {
    canvas.text((x, y), &format!("{before}{}", view.quantity.label(view.white)), BLACK);
    view.draw(canvas, (x, y + TEXT_HEIGHT_PX + 2), CELL_PX);
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn choices_are_spread_and_end_with_the_last() {
        assert_eq!(spread(4, 8), [1, 3, 5, 7]);
        assert_eq!(spread(8, 3), [0, 1, 2]);
        assert_eq!(spread(4, 0), [0usize; 0]);
    }
}
