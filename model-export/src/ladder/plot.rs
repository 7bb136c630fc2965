//! The ladder as pictures: error against time, and the nail-base zone on the atlas.

use super::report;
use crate::metrics::Ground;
use papilla_engine::MAP_SIDE_PX;
use papilla_engine::ladder::{Kind, Ladder, Rung, front};
use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

const PANEL_PX: (u32, u32) = (760, 600);
const LEGEND_PX: u32 = 34;
const FONT_PX: i32 = 13;
const GREY: RGBColor = RGBColor(120, 120, 120);
const KINDS: [Kind; 5] =
    [Kind::ClosedForm, Kind::Operator, Kind::Network, Kind::S1Network, Kind::Fe];

/// Colours that stay apart for colour-blind eyes (Okabe & Ito 2008).
fn colour(kind: Kind) -> RGBColor {
    match kind {
        Kind::ClosedForm => RGBColor(204, 121, 167),
        Kind::Operator => RGBColor(0, 158, 115),
        Kind::Network => RGBColor(0, 114, 178),
        Kind::S1Network => RGBColor(213, 94, 0),
        Kind::Fe => RGBColor(60, 60, 60),
    }
}

/// One rung in a panel.
struct Point {
    name: String,
    kind: Kind,
    time_ms: f64,
    error: f64,
    on_front: bool,
    /// Drawn hollow: the error is the reference's own discretisation error.
    reference: bool,
}

/// The sets that get a panel: the reference, where all rungs meet, and the held-out presses;
/// without either, the first set that was measured.
fn panels(ladder: &Ladder) -> Vec<&str> {
    let measured = |set: &&papilla_engine::ladder::Set| set.samples > 0;
    let names: Vec<&str> =
        ladder.sets.iter().filter(measured).map(|set| set.name.as_str()).collect();
    let wanted = ["reference", "heldout-presses"];
    let found: Vec<&str> = wanted.into_iter().filter(|name| names.contains(name)).collect();
    if found.is_empty() { names.into_iter().take(1).collect() } else { found }
}

fn points(ladder: &Ladder, set: &str) -> Vec<Point> {
    let floor = ladder.discretisation_error.as_ref().map(|d| d.sed_relative_l2);
    let place = |rung: &Rung| {
        let error = if rung.reference { floor } else { rung.relative_l2(set) };
        // A logarithmic axis has no place for zero, nor for what is not known.
        Some((rung.time_ms()?, error?)).filter(|(t, e)| *t > 0.0 && *e > 0.0 && e.is_finite())
    };
    let places: Vec<Option<(f64, f64)>> = ladder.rungs.iter().map(place).collect();
    let on_front = front(&places);
    let all = ladder.rungs.iter().zip(places).zip(on_front);
    all.filter_map(|((rung, place), on_front)| {
        let (time_ms, error) = place?;
        rung.errors.contains_key(set).then(|| Point {
            name: rung.name.clone(),
            kind: rung.kind,
            time_ms,
            error,
            on_front,
            reference: rung.reference,
        })
    })
    .collect()
}

/// Error against time as SVG, one panel for each set of note.
///
/// # Errors
/// What the drawing library reports, in words.
pub fn error_against_time(ladder: &Ladder) -> Result<String, String> {
    let sets = panels(ladder);
    let mut text = String::new();
    let width = PANEL_PX.0 * sets.len().max(1) as u32;
    let drawn = {
        let size = (width, PANEL_PX.1 + LEGEND_PX);
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        draw(&root, ladder, &sets)
    };
    drawn.map_err(|error| error.to_string())?;
    Ok(text)
}

fn draw(root: &Area<'_>, ladder: &Ladder, sets: &[&str]) -> Drawn {
    root.fill(&WHITE)?;
    let (plots, foot) = root.split_vertically(PANEL_PX.1);
    for (area, set) in plots.split_evenly((1, sets.len().max(1))).iter().zip(sets) {
        panel(area, ladder, set)?;
    }
    let mut x = 90;
    for kind in KINDS.into_iter().filter(|kind| ladder.rungs.iter().any(|r| r.kind == *kind)) {
        foot.draw(&Circle::new((x, 14), 5, colour(kind).filled()))?;
        foot.draw(&Text::new(report::kind(kind), (x + 10, 8), font()))?;
        x += 130;
    }
    foot.draw(&PathElement::new([(x, 14), (x + 22, 14)], GREY.stroke_width(2)))?;
    foot.draw(&Text::new("Pareto front", (x + 28, 8), font()))?;
    root.present()?;
    Ok(())
}

fn font() -> TextStyle<'static> {
    ("sans-serif", FONT_PX).into_font().color(&RGBColor(40, 40, 40))
}

/// A range on a logarithmic axis with room for labels: a whole decade at least, or the axis
/// would have no number on it.
fn range(values: impl Iterator<Item = f64>, low: f64, high: f64) -> std::ops::Range<f64> {
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for value in values {
        (least, most) = (least.min(value), most.max(value));
    }
    if most <= 0.0 {
        return 0.1..1.0;
    }
    let (least, most) = (least / low, most * high);
    let decade = 10f64.powf(least.log10().floor());
    if most / least > 12.0 { least..most } else { decade..(10.0 * decade).max(most) }
}

fn panel(area: &Area<'_>, ladder: &Ladder, set: &str) -> Drawn {
    let points = points(ladder, set);
    let floor = ladder.discretisation_error.as_ref().filter(|_| set == "reference");
    let floor = floor.map(|d| d.sed_relative_l2).filter(|floor| *floor > 0.0);
    let times = range(points.iter().map(|p| p.time_ms), 2.0, 6.0);
    let errors = range(points.iter().map(|p| p.error).chain(floor), 1.6, 1.6);
    let title = match set {
        "reference" => "Against the reference solution (finest mesh)".to_owned(),
        _ => format!("On {set} (truth: the FE that taught the networks)"),
    };
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 17))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(70)
        .build_cartesian_2d(times.clone().log_scale(), errors.clone().log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(RGBColor(242, 242, 242))
        .x_desc("time of one map, ms (one core; FE: one state)")
        .y_desc("relative L2 error of SED, median")
        .x_label_formatter(&|ms| {
            if *ms < 1e3 { trimmed(*ms) } else { format!("{} s", trimmed(ms / 1e3)) }
        })
        .y_label_formatter(&|error| format!("{} %", trimmed(100.0 * error)))
        .label_style(("sans-serif", FONT_PX))
        .draw()?;
    let dashed =
        |from, to| DashedPathElement::new(vec![from, to], 4, 4, GREY.mix(0.8).stroke_width(1));
    if let Some(floor) = floor {
        chart.plotting_area().draw(&dashed((times.start, floor), (times.end, floor)))?;
    }
    let budgets = [(1.0, "1 kHz"), (11.1, "90 Hz")];
    for (ms, _) in budgets.iter().filter(|(ms, _)| times.contains(ms)) {
        chart.plotting_area().draw(&dashed((*ms, errors.start), (*ms, errors.end)))?;
    }
    let mut step: Vec<(f64, f64)> =
        points.iter().filter(|p| p.on_front).map(|p| (p.time_ms, p.error)).collect();
    step.sort_by(|a, b| a.0.total_cmp(&b.0));
    chart.draw_series(LineSeries::new(step, GREY.mix(0.7).stroke_width(2)))?;
    for point in &points {
        let colour = colour(point.kind);
        let style = if point.reference { colour.stroke_width(2) } else { colour.filled() };
        chart.plotting_area().draw(&Circle::new((point.time_ms, point.error), 5, style))?;
    }
    let at = |ms: f64, error: f64| chart.backend_coord(&(ms, error));
    let places: Vec<(i32, i32)> = points.iter().map(|p| at(p.time_ms, p.error)).collect();
    let base = area.get_base_pixel();
    let (width, height) = area.dim_in_pixel();
    let frame = [base.0, base.1, base.0 + width as i32, base.1 + height as i32];
    let mut labels = Labels::new(&places, frame);
    for (point, place) in points.iter().zip(&places) {
        let (x, y) = labels.place(*place, &point.name);
        area.draw(&Text::new(point.name.clone(), (x - base.0, y - base.1), font()))?;
    }
    for (ms, words) in budgets.iter().filter(|(ms, _)| times.contains(ms)) {
        let (x, y) = at(*ms, errors.end);
        area.draw(&Text::new(*words, (x - base.0 + 4, y - base.1 + 3), font()))?;
    }
    if let Some(floor) = floor {
        let (x, y) = at(times.start, floor);
        let words = "discretisation error of the reference";
        area.draw(&Text::new(words, (x - base.0 + 6, y - base.1 - 16), font()))?;
    }
    Ok(())
}

/// Two significant digits without needless zeros.
fn trimmed(value: f64) -> String {
    let digits = (1 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Finds places for names beside dots where they cover neither dots nor each other.
struct Labels {
    /// Left, top, right, bottom of what names must stay within.
    frame: [i32; 4],
    /// The same of what they must not cover.
    taken: Vec<[i32; 4]>,
}

impl Labels {
    fn new(dots: &[(i32, i32)], frame: [i32; 4]) -> Self {
        let taken = dots.iter().map(|(x, y)| [x - 6, y - 6, x + 6, y + 6]).collect();
        Self { frame, taken }
    }

    /// Top left corner of the name of the dot at `(x, y)`.
    fn place(&mut self, (x, y): (i32, i32), name: &str) -> (i32, i32) {
        // The fonts are the viewer's: a generous guess of the width.
        let width = (name.chars().count() as i32 * FONT_PX * 11) / 20;
        let height = FONT_PX + 1;
        let beside = |dx: i32, dy: i32| [x + dx, y + dy, x + dx + width, y + dy + height];
        let mut candidates = Vec::new();
        for lift in [0, 10, -10, 18, -18] {
            candidates.push(beside(9, lift - height / 2));
        }
        for lift in [0, 10, -10, 18, -18, 28, -28, 40, -40] {
            candidates.push(beside(-9 - width, lift - height / 2));
            candidates.push(beside(9, lift - height / 2));
        }
        let apart =
            |a: &[i32; 4], b: &[i32; 4]| a[2] < b[0] || b[2] < a[0] || a[3] < b[1] || b[3] < a[1];
        let inside = |c: &[i32; 4]| c[0] >= self.frame[0] && c[2] <= self.frame[2];
        let free = |c: &&[i32; 4]| inside(c) && self.taken.iter().all(|t| apart(c, t));
        let free = candidates.iter().find(free);
        let found = *free.unwrap_or(&candidates[0]);
        self.taken.push(found);
        (found[0], found[1])
    }
}

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

#[cfg(test)]
mod tests {
    use super::{Labels, trimmed};

    #[test]
    fn numbers_of_axes_are_short() {
        for (value, text) in
            [(0.5, "0.5"), (1.0, "1"), (11.1, "11"), (300.0, "300"), (0.02, "0.02")]
        {
            assert_eq!(trimmed(value), text);
        }
    }

    #[test]
    fn names_keep_clear_of_dots_and_each_other() {
        let dots = [(100, 100), (112, 102), (104, 95)];
        let mut labels = Labels::new(&dots, [0, 0, 400, 400]);
        for dot in dots {
            labels.place(dot, "some-name");
        }
        for (i, a) in labels.taken.iter().enumerate().skip(dots.len()) {
            for b in &labels.taken[..i] {
                assert!(a[2] < b[0] || b[2] < a[0] || a[3] < b[1] || b[3] < a[1], "{a:?} {b:?}");
            }
        }
    }
}
