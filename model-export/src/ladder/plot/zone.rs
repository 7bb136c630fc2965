//! The nail-base zone on the atlas.

use super::{Area, Drawn, font};
use crate::metrics::Ground;
use papilla_engine::MAP_SIDE_PX;
use plotters::prelude::*;

/// The nail-base zone on the interface's map, as SVG.
///
/// # Errors
/// What the drawing library reports, in words.
pub fn nail_base_zone(ground: &Ground) -> Result<String, String> {
    let mut text = String::new();
    let drawn = {
        let root = SVGBackend::with_string(&mut text, (640, 480)).into_drawing_area();
        draw_zone(&root, ground)
    };
    drawn.map_err(|error| error.to_string())?;
    Ok(text)
}

fn draw_zone(root: &Area<'_>, ground: &Ground) -> Drawn {
    const ZOOM: usize = 2;
    const LEFT: i32 = 10;
    root.fill(&WHITE)?;
    let side = (ZOOM * MAP_SIDE_PX) as i32;
    root.draw(&Rectangle::new([(LEFT, 10), (LEFT + side, 10 + side)], RGBColor(215, 215, 215)))?;
    for row in 0..MAP_SIDE_PX {
        let class = |column: usize| {
            let i = row * MAP_SIDE_PX + column;
            u8::from(ground.mask[i]) + u8::from(ground.nail_base[i])
        };
        let mut column = 0;
        while column < MAP_SIDE_PX {
            let start = column;
            while column < MAP_SIDE_PX && class(column) == class(start) {
                column += 1;
            }
            let shade = match class(start) {
                0 => continue,
                1 => RGBColor(205, 214, 222),
                _ => RGBColor(213, 94, 0),
            };
            let corner = |c: usize, r: usize| (LEFT + (ZOOM * c) as i32, 10 + (ZOOM * r) as i32);
            let run = Rectangle::new([corner(start, row), corner(column, row + 1)], shade.filled());
            root.draw(&run)?;
        }
    }
    let x = LEFT + side + 14;
    for (y, shade, words) in
        [(30, RGBColor(205, 214, 222), "interface"), (54, RGBColor(213, 94, 0), "nail-base zone")]
    {
        root.draw(&Rectangle::new([(x, y), (x + 14, y + 14)], shade.filled()))?;
        root.draw(&Text::new(words, (x + 20, y), font()))?;
    }
    for (y, words) in [(90, "tip of the finger up,"), (108, "pad seen from outside")] {
        root.draw(&Text::new(words, (x, y), font()))?;
    }
    root.present()?;
    Ok(())
}
