//! Maps as images: gray with a recorded scale for programs, colour for people.

use super::canvas::{BLACK, Canvas, TEXT_HEIGHT_PX, TEXT_WIDTH_PX, viridis};
use super::png_file::encode_png;
use super::{OutputError, atomic};
use papilla_atlas::{MAP_LEN, MAP_SIDE_PX};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a map shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// True (Cauchy) contact pressure on the skin.
    Pressure,
    /// Strain energy density at the interface, per undeformed volume.
    Sed,
}

impl Quantity {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pressure => "pressure",
            Self::Sed => "sed",
        }
    }

    /// Heading of a picture.
    pub fn title(self) -> &'static str {
        match self {
            Self::Pressure => "Pressure on the skin",
            Self::Sed => "SED at the interface",
        }
    }

    /// Unit, in ASCII.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Pressure => "Pa",
            Self::Sed => "J/m3",
        }
    }

    /// A value with its unit and an SI prefix: `12.3 kPa`.
    pub fn label(self, value: f64) -> String {
        let unit = match self {
            Self::Pressure => "Pa",
            Self::Sed => "J/m³",
        };
        let (scaled, prefix) = match value.abs() {
            v if v >= 1e6 => (value / 1e6, "M"),
            v if v >= 1e3 => (value / 1e3, "k"),
            _ => (value, ""),
        };
        let digits = match scaled.abs() {
            v if v >= 99.95 => 0,
            v if v >= 9.995 => 1,
            v if v > 0.0 => 2,
            _ => 0,
        };
        format!("{scaled:.digits$} {prefix}{unit}")
    }
}

/// Bits per pixel of a gray image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Bits {
    /// 256 levels.
    Eight,
    /// 65536 levels.
    Sixteen,
}

impl Bits {
    /// The code of full white.
    pub fn white(self) -> f64 {
        match self {
            Self::Eight => 255.0,
            Self::Sixteen => 65535.0,
        }
    }

    fn depth(self) -> png::BitDepth {
        match self {
            Self::Eight => png::BitDepth::Eight,
            Self::Sixteen => png::BitDepth::Sixteen,
        }
    }
}

/// How a gray image turns back into physical values:
/// `value = code * unit_per_intensity`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MapScale {
    /// What the image shows.
    pub quantity: Quantity,
    /// Its unit: `Pa` or `J/m3`.
    pub unit: String,
    /// Physical units per unit of intensity.
    pub unit_per_intensity: f64,
    /// Value of full white, in `unit`.
    pub white: f64,
    /// The code of full white: 255 or 65535.
    pub white_code: u32,
    /// Length of one pixel on the finger, mm.
    pub mm_per_px: f64,
}

/// One map to be drawn.
#[derive(Clone, Copy, Debug)]
pub struct MapView<'a> {
    /// What it shows.
    pub quantity: Quantity,
    /// 224 x 224 values in the quantity's unit, row-major from the top.
    pub pixels: &'a [f32],
    /// 224 x 224: inside the patch?
    pub mask: &'a [bool],
    /// Length of one pixel on the finger, mm.
    pub mm_per_px: f64,
    /// The value of full white (the map's or the dataset's maximum), above 0.
    pub white: f64,
}

/// A usable white for a map: its maximum, or 1 for a map of zeros.
pub fn white_of(pixels: &[f32]) -> f64 {
    let max = f64::from(pixels.iter().copied().fold(0.0, f32::max));
    if max > 0.0 { max } else { 1.0 }
}

impl MapView<'_> {
    fn check(&self) -> Result<(), OutputError> {
        for (what, found) in [("map", self.pixels.len()), ("mask", self.mask.len())] {
            if found != MAP_LEN {
                let what = format!("{what} of {}", self.quantity.name());
                return Err(OutputError::Length { what, found, expected: MAP_LEN });
            }
        }
        let refuse = |what: &str, value: f64| {
            let what = format!("{what} of {}", self.quantity.name());
            Err(OutputError::NotDrawable { what, value })
        };
        if !(self.white.is_finite() && self.white > 0.0) {
            return refuse("white", self.white);
        }
        // A clipped value would be a silently wrong one; rounding is not clipping.
        let highest = self.white * (1.0 + 1e-6);
        match self.pixels.iter().find(|p| !(f64::from(**p) <= highest && **p >= 0.0)) {
            Some(bad) => refuse("a pixel (allowed: 0 to white)", f64::from(*bad)),
            None => Ok(()),
        }
    }

    /// The scale that [`Self::encode_gray`] records.
    pub fn scale(&self, bits: Bits) -> MapScale {
        MapScale {
            quantity: self.quantity,
            unit: self.quantity.unit().to_string(),
            unit_per_intensity: self.white / bits.white(),
            white: self.white,
            white_code: bits.white() as u32,
            mm_per_px: self.mm_per_px,
        }
    }

    /// The map as a gray PNG, rounded to the nearest code, with its scale in
    /// tEXt chunks (`papilla:quantity`, `papilla:unit`,
    /// `papilla:unit_per_intensity`, `papilla:mm_per_px`).
    ///
    /// # Errors
    /// [`OutputError::NotDrawable`] for values outside 0 to `white`,
    /// [`OutputError::Length`] for a map that is not 224 x 224.
    pub fn encode_gray(&self, bits: Bits) -> Result<Vec<u8>, OutputError> {
        self.check()?;
        let factor = bits.white() / self.white;
        let codes = self.pixels.iter().map(|p| (f64::from(*p) * factor).round().min(bits.white()));
        let bytes: Vec<u8> = match bits {
            Bits::Eight => codes.map(|c| c as u8).collect(),
            Bits::Sixteen => codes.flat_map(|c| (c as u16).to_be_bytes()).collect(),
        };
        let scale = self.scale(bits);
        let text = [
            ("papilla:quantity", scale.quantity.name().to_string()),
            ("papilla:unit", scale.unit.clone()),
            ("papilla:unit_per_intensity", scale.unit_per_intensity.to_string()),
            ("papilla:mm_per_px", scale.mm_per_px.to_string()),
        ];
        let size = (MAP_SIDE_PX, MAP_SIDE_PX);
        encode_png(size, (png::ColorType::Grayscale, bits.depth()), &bytes, &text)
    }

    /// The map as a picture with colour bar, scale bar, heading and units.
    ///
    /// # Errors
    /// As [`Self::encode_gray`].
    pub fn encode_color(&self) -> Result<Vec<u8>, OutputError> {
        self.check()?;
        let side = 2 * MAP_SIDE_PX;
        let (left, top) = (16, 34);
        let mut canvas = Canvas::new(left + side + 140, top + side + 40);
        canvas.text((left, 10), self.quantity.title(), BLACK);
        self.draw(&mut canvas, (left, top), side);
        self.color_bar(&mut canvas, (left + side + 16, top), side);
        self.scale_bar(&mut canvas, (left, top + side + 12), side);
        canvas.encode_png()
    }

    /// Draws the bare map in colour, `side` pixels wide.
    pub fn draw(&self, canvas: &mut Canvas, corner: (usize, usize), side: usize) {
        canvas.map(corner, side, MAP_SIDE_PX, |i| {
            self.mask[i].then(|| f64::from(self.pixels[i]) / self.white)
        });
    }

    fn color_bar(&self, canvas: &mut Canvas, (x, y): (usize, usize), height: usize) {
        for row in 0..height {
            let unit = 1.0 - row as f64 / (height - 1) as f64;
            canvas.fill((x, y + row), (18, 1), viridis(unit));
        }
        for tick in 0..=4 {
            let row = tick * (height - 1) / 4;
            canvas.fill((x + 18, y + row), (5, 1), BLACK);
            let value = self.white * (4 - tick) as f64 / 4.0;
            let text_y = (y + row).saturating_sub(TEXT_HEIGHT_PX / 2);
            canvas.text((x + 27, text_y), &self.quantity.label(value), BLACK);
        }
    }

    fn scale_bar(&self, canvas: &mut Canvas, (x, y): (usize, usize), side: usize) {
        let px_per_mm = side as f64 / MAP_SIDE_PX as f64 / self.mm_per_px;
        // The longest round length that takes at most a third of the map.
        let fits = |mm: &f64| mm * px_per_mm <= side as f64 / 3.0;
        let lengths = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
        let Some(mm) = lengths.into_iter().rev().find(fits) else { return };
        let length = (mm * px_per_mm).round() as usize;
        canvas.fill((x, y + 6), (length, 3), BLACK);
        for end in [x, x + length] {
            canvas.fill((end, y + 2), (1, 11), BLACK);
        }
        canvas.text((x + length + 8, y), &format!("{mm} mm"), BLACK);
        let note = "fingertip up, seen from outside";
        let note_x = (x + side).saturating_sub(note.len() * TEXT_WIDTH_PX);
        canvas.text((note_x, y), note, [110; 3]);
    }

    /// Writes `stem.png` (16-bit gray), `stem-color.png` and `stem.json` (the
    /// [`MapScale`]) into `folder`, each atomically.
    ///
    /// # Errors
    /// As [`Self::encode_gray`] and [`atomic::write`].
    pub fn write(&self, folder: &Path, stem: &str) -> Result<(), OutputError> {
        let gray = self.encode_gray(Bits::Sixteen)?;
        atomic::write(&folder.join(format!("{stem}.png")), &gray)?;
        atomic::write(&folder.join(format!("{stem}-color.png")), &self.encode_color()?)?;
        atomic::write_json(&folder.join(format!("{stem}.json")), &self.scale(Bits::Sixteen))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn ramp() -> (Vec<f32>, Vec<bool>) {
        let pixels: Vec<f32> = (0..MAP_LEN).map(|i| 20_000.0 * i as f32 / MAP_LEN as f32).collect();
        let mask = pixels.iter().map(|p| *p > 0.0).collect();
        (pixels, mask)
    }

    fn view<'a>(pixels: &'a [f32], mask: &'a [bool]) -> MapView<'a> {
        let white = white_of(pixels);
        MapView { quantity: Quantity::Pressure, pixels, mask, mm_per_px: 0.1, white }
    }

    /// Reads codes and scale back with nothing but the file.
    fn decode(bytes: &[u8]) -> (Vec<u32>, f64) {
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        let mut buffer = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut buffer).unwrap();
        let codes = match frame.bit_depth {
            png::BitDepth::Sixteen => {
                buffer.chunks(2).map(|c| u32::from(c[0]) << 8 | u32::from(c[1])).collect()
            }
            _ => buffer.iter().map(|c| u32::from(*c)).collect(),
        };
        let text = &reader.info().uncompressed_latin1_text;
        let chunk = text.iter().find(|t| t.keyword == "papilla:unit_per_intensity").unwrap();
        (codes, chunk.text.parse().unwrap())
    }

    #[test]
    fn values_come_back_to_half_a_code() {
        let (pixels, mask) = ramp();
        for bits in [Bits::Eight, Bits::Sixteen] {
            let (codes, unit) = decode(&view(&pixels, &mask).encode_gray(bits).unwrap());
            assert_eq!(codes.iter().max(), Some(&(bits.white() as u32)));
            for (code, value) in codes.iter().zip(&pixels) {
                let error = (f64::from(*code) * unit - f64::from(*value)).abs();
                assert!(error <= 0.5 * unit * (1.0 + 1e-6), "{error} at {value}");
            }
        }
    }

    #[test]
    fn nothing_is_clipped_in_silence() {
        let (mut pixels, mask) = ramp();
        let white = white_of(&pixels);
        for bad in [f32::NAN, -1.0, 3e4, f32::INFINITY] {
            pixels[100] = bad;
            let view = MapView { white, ..view(&pixels, &mask) };
            assert!(view.encode_gray(Bits::Sixteen).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_map_of_zeros_can_be_written() {
        let (pixels, mask) = (vec![0.0; MAP_LEN], vec![true; MAP_LEN]);
        let folder = tempfile::tempdir().unwrap();
        view(&pixels, &mask).write(folder.path(), "pressure").unwrap();
        let scale: MapScale = atomic::read_json(&folder.path().join("pressure.json")).unwrap();
        assert!(scale.unit_per_intensity > 0.0);
        assert!(folder.path().join("pressure-color.png").exists());
    }

    #[test]
    fn labels_carry_prefix_and_unit() {
        assert_eq!(Quantity::Pressure.label(12_345.0), "12.3 kPa");
        assert_eq!(Quantity::Sed.label(999.96), "1000 J/m³");
        assert_eq!(Quantity::Sed.label(0.0), "0 J/m³");
        assert_eq!(Quantity::Pressure.label(1.5e6), "1.50 MPa");
    }
}
