//! A white sheet with pixels and 8 x 8 letters.

use font8x8::UnicodeFonts;
use image::{Rgb, RgbImage};

const LETTER: usize = 8;
const INK: [u8; 3] = [30, 30, 30];

pub(super) struct Canvas(RgbImage);

impl Canvas {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self(RgbImage::from_pixel(width as u32, height as u32, Rgb([255; 3])))
    }

    pub(super) fn into_image(self) -> RgbImage {
        self.0
    }

    /// Colours a pixel; nothing happens outside the sheet.
    pub(super) fn set(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        if let Some(pixel) = self.0.get_pixel_mut_checked(x as u32, y as u32) {
            *pixel = Rgb(colour);
        }
    }

    /// Width of a line of text, pixels.
    pub(super) fn text_width(text: &str) -> usize {
        text.chars().count() * LETTER
    }

    /// Writes a line with its upper left corner at (x, y).
    pub(super) fn text(&mut self, x: usize, y: usize, text: &str) {
        for (i, letter) in text.chars().enumerate() {
            let glyph = font8x8::BASIC_FONTS.get(letter).unwrap_or_default();
            for (row, bits) in glyph.iter().enumerate() {
                for column in (0..LETTER).filter(|column| bits >> column & 1 == 1) {
                    self.set(x + i * LETTER + column, y + row, INK);
                }
            }
        }
    }
}
