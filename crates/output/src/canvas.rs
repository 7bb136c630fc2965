//! A small RGB canvas: rectangles, maps in colour, text.

use super::OutputError;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

/// Width of a character, pixels.
pub const TEXT_WIDTH_PX: usize = get_raster_width(FontWeight::Regular, RasterHeight::Size16);
/// Height of a line of text, pixels.
pub const TEXT_HEIGHT_PX: usize = 16;

/// Red, green, blue.
pub type Rgb = [u8; 3];
/// Paper.
pub const WHITE: Rgb = [255; 3];
/// Ink.
pub const BLACK: Rgb = [20; 3];
/// What lies outside a map's mask.
pub const OUTSIDE: Rgb = [225; 3];

/// An RGB image, row-major from the top left.
pub struct Canvas {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

/// The colour of a value from 0 (dark) to 1 (bright): viridis, even in
/// lightness and legible to the colour-blind. Values outside are clamped.
pub fn viridis(unit: f64) -> Rgb {
    let color = colorous::VIRIDIS.eval_continuous(unit.clamp(0.0, 1.0));
    [color.r, color.g, color.b]
}

impl Canvas {
    /// A white canvas of the given size in pixels.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, rgb: vec![255; width * height * 3] }
    }

    /// Colour of a pixel; `None` outside the canvas.
    pub fn pixel(&self, x: usize, y: usize) -> Option<Rgb> {
        let at = (y * self.width + x) * 3;
        (x < self.width && y < self.height)
            .then(|| [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]])
    }

    /// Sets a pixel; outside the canvas it does nothing.
    pub fn set(&mut self, x: usize, y: usize, color: Rgb) {
        if x < self.width && y < self.height {
            let at = (y * self.width + x) * 3;
            self.rgb[at..at + 3].copy_from_slice(&color);
        }
    }

    /// Fills a rectangle whose top left corner is (x, y).
    pub fn fill(&mut self, (x, y): (usize, usize), (width, height): (usize, usize), color: Rgb) {
        for row in y..y + height {
            for column in x..x + width {
                self.set(column, row, color);
            }
        }
    }

    /// Draws one line of text from its top left corner. Characters that the
    /// font lacks become a question mark.
    pub fn text(&mut self, (x, y): (usize, usize), text: &str, color: Rgb) {
        for (i, character) in text.chars().enumerate() {
            let glyph = get_raster(character, FontWeight::Regular, RasterHeight::Size16)
                .or_else(|| get_raster('?', FontWeight::Regular, RasterHeight::Size16));
            for (row, line) in glyph.iter().flat_map(|g| g.rows().enumerate()) {
                for (column, &ink) in line.iter().enumerate().filter(|(_, ink)| **ink > 0) {
                    let (px, py) = (x + i * TEXT_WIDTH_PX + column, y + row);
                    let Some(paper) = self.pixel(px, py) else { continue };
                    let mix = |c: usize| {
                        let (ink, from, to) =
                            (u16::from(ink), u16::from(paper[c]), u16::from(color[c]));
                        ((from * (255 - ink) + to * ink) / 255) as u8
                    };
                    self.set(px, py, [mix(0), mix(1), mix(2)]);
                }
            }
        }
    }

    /// Draws a square map of `side` pixels from its top left corner: each
    /// canvas pixel shows the mean of the block of map pixels it covers, or
    /// one map pixel covers several. `value(i)` is the map's pixel i in 0 to 1,
    /// `None` outside the mask.
    pub fn map(
        &mut self,
        (x, y): (usize, usize),
        size: usize,
        side: usize,
        value: impl Fn(usize) -> Option<f64>,
    ) {
        for row in 0..size {
            for column in 0..size {
                let span = |i: usize| (i * side / size, ((i + 1) * side).div_ceil(size).min(side));
                let ((r0, r1), (c0, c1)) = (span(row), span(column));
                let (mut sum, mut count) = (0.0, 0usize);
                for r in r0..r1 {
                    for v in (c0..c1).filter_map(|c| value(r * side + c)) {
                        sum += v;
                        count += 1;
                    }
                }
                let color = if count == 0 { OUTSIDE } else { viridis(sum / count as f64) };
                self.set(x + column, y + row, color);
            }
        }
    }

    /// The canvas as an RGB PNG.
    ///
    /// # Errors
    /// [`OutputError::Encode`] for an empty canvas.
    pub fn encode_png(&self) -> Result<Vec<u8>, OutputError> {
        super::png_file::encode_png(
            (self.width, self.height),
            (png::ColorType::Rgb, png::BitDepth::Eight),
            &self.rgb,
            &[],
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viridis_runs_from_dark_to_bright() {
        let lightness = |u: f64| viridis(u).iter().map(|c| u32::from(*c)).sum::<u32>();
        assert!(lightness(0.0) < lightness(0.5) && lightness(0.5) < lightness(1.0));
        assert_eq!(viridis(7.0), viridis(1.0));
    }

    #[test]
    fn text_leaves_ink_and_stays_on_the_canvas() {
        let mut canvas = Canvas::new(40, 16);
        canvas.text((0, 0), "J/m³ and far more than fits", BLACK);
        let dark = canvas.rgb.iter().filter(|c| **c < 128).count();
        assert!(dark > 50, "{dark} dark samples");
    }

    #[test]
    fn a_map_keeps_its_orientation() {
        let mut canvas = Canvas::new(4, 4);
        // 2 x 2 map: bright at the top right, outside at the bottom left.
        canvas.map((0, 0), 4, 2, |i| [Some(0.0), Some(1.0), None, Some(0.0)][i]);
        assert_eq!(canvas.pixel(3, 0), Some(viridis(1.0)));
        assert_eq!(canvas.pixel(0, 0), Some(viridis(0.0)));
        assert_eq!(canvas.pixel(1, 3), Some(OUTSIDE));
    }
}
