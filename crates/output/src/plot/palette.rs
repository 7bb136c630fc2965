//! Colours that stay apart for colour-blind eyes (Okabe & Ito 2008), and two greys.

use plotters::style::RGBColor;

/// Blue.
pub const BLUE: RGBColor = RGBColor(0, 114, 178);
/// Vermilion.
pub const VERMILION: RGBColor = RGBColor(213, 94, 0);
/// Bluish green.
pub const GREEN: RGBColor = RGBColor(0, 158, 115);
/// Reddish purple.
pub const PURPLE: RGBColor = RGBColor(204, 121, 167);
/// Sky blue.
pub const SKY: RGBColor = RGBColor(86, 180, 233);
/// Orange.
pub const ORANGE: RGBColor = RGBColor(230, 159, 0);
/// Grey, for lines that guide the eye.
pub const GREY: RGBColor = RGBColor(120, 120, 120);
/// Dark grey, for a series beside the coloured ones.
pub const DARK: RGBColor = RGBColor(60, 60, 60);
