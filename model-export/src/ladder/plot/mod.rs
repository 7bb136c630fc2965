//! The ladder as pictures: error against time, and the nail-base zone on the atlas.

mod zone;

use super::report;
use papilla_engine::ladder::{Kind, Ladder, REFERENCE_SET, Rung};
use papilla_output::plot::labels;
use papilla_output::plot::palette::{self, GREY};
use plotters::coord::Shift;
use plotters::coord::combinators::LogCoord;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{Pos, VPos};

pub use zone::nail_base_zone;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

const PANEL_PX: (u32, u32) = (760, 600);
const LEGEND_PX: u32 = 34;
const FONT_PX: i32 = 13;
const KINDS: [Kind; 5] =
    [Kind::ClosedForm, Kind::Operator, Kind::Network, Kind::PublishedUNet, Kind::Fe];

fn colour(kind: Kind) -> RGBColor {
    match kind {
        Kind::ClosedForm => palette::PURPLE,
        Kind::Operator => palette::GREEN,
        Kind::Network => palette::BLUE,
        Kind::PublishedUNet => palette::VERMILION,
        // Floors have no time and are not drawn.
        Kind::Fe | Kind::Floor => palette::DARK,
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

/// The sets that get a panel: the reference, where all rungs meet, and the held-out indentations;
/// without either, the first set that was measured.
fn panels(ladder: &Ladder) -> Vec<&str> {
    let measured = |set: &&papilla_engine::ladder::Set| set.samples > 0;
    let names: Vec<&str> =
        ladder.sets.iter().filter(measured).map(|set| set.name.as_str()).collect();
    let wanted = [REFERENCE_SET, "heldout-presses"];
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
    let all = ladder.rungs.iter().zip(places).zip(ladder.front(set));
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

/// A range on a logarithmic axis with room for labels: two thirds of a decade at least.
fn range(values: impl Iterator<Item = f64>, low: f64, high: f64) -> Span {
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for value in values {
        (least, most) = (least.min(value), most.max(value));
    }
    if most <= 0.0 {
        return 0.1..1.0;
    }
    let (least, most) = (least / low, most * high);
    let grow = (4.6 * least / most).sqrt().max(1.0);
    least / grow..most * grow
}

fn panel(area: &Area<'_>, ladder: &Ladder, set: &str) -> Drawn {
    let points = points(ladder, set);
    let floor = ladder.discretisation_error.as_ref().filter(|_| set == REFERENCE_SET);
    let floor = floor.map(|d| d.sed_relative_l2).filter(|floor| *floor > 0.0);
    let times = range(points.iter().map(|p| p.time_ms), 2.0, 6.0);
    let errors = range(points.iter().map(|p| p.error).chain(floor), 1.6, 1.6);
    let title = match set {
        REFERENCE_SET => "SED, median relative L2 error against the finest mesh".to_owned(),
        _ => format!("SED, median relative L2 error on {set}"),
    };
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 17))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(52)
        .build_cartesian_2d(times.clone().log_scale(), errors.clone().log_scale())?;
    axes(area, &chart, &times, &errors)?;
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
    chart.draw_series(LineSeries::new(step.clone(), GREY.mix(0.7).stroke_width(2)))?;
    for point in &points {
        let colour = colour(point.kind);
        let style = if point.reference { colour.stroke_width(2) } else { colour.filled() };
        chart.plotting_area().draw(&Circle::new((point.time_ms, point.error), 5, style))?;
    }
    let at = |ms: f64, error: f64| chart.backend_coord(&(ms, error));
    let base = area.get_base_pixel();
    let (left, top) = at(times.start, errors.end);
    let (_, bottom) = at(times.end, errors.start);
    let (width, _) = area.dim_in_pixel();
    let within = [left, top, base.0 + width as i32, bottom];
    let dots: Vec<((i32, i32), &str)> =
        points.iter().map(|p| (at(p.time_ms, p.error), p.name.as_str())).collect();
    let front = step.windows(2).map(|ends| [ends[0], ends[1]]);
    let floor_line = floor.map(|floor| [(times.start, floor), (times.end, floor)]);
    let upright = budgets.iter().map(|(ms, _)| [(*ms, errors.start), (*ms, errors.end)]);
    let lines = front.chain(floor_line).chain(upright);
    let lines: Vec<labels::Line> =
        lines.map(|ends| ends.map(|(ms, error)| at(ms, error))).collect();
    for ((_, name), place) in dots.iter().zip(labels::places(within, FONT_PX, &dots, &lines)) {
        let (x, y) = place.anchor;
        let style = font().pos(Pos::new(place.side, VPos::Center));
        area.draw(&Text::new(*name, (x - base.0, y - base.1), style))?;
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

type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<LogCoord<f64>, LogCoord<f64>>>;

/// Grid, numbers and names of the axes; the library's own logarithmic grid is too dense over
/// many decades and bare within one.
fn axes(area: &Area<'_>, chart: &Chart<'_, '_>, times: &Span, errors: &Span) -> Drawn {
    let line = RGBColor(225, 225, 225);
    let base = area.get_base_pixel();
    let (_, height) = area.dim_in_pixel();
    let at = |ms: f64, error: f64| {
        let (x, y) = chart.backend_coord(&(ms, error));
        (x - base.0, y - base.1)
    };
    let (left, bottom) = at(times.start, errors.start);
    let (right, top) = at(times.end, errors.end);
    for ms in ticks(times) {
        let (x, _) = at(ms, errors.start);
        area.draw(&PathElement::new([(x, top), (x, bottom)], line))?;
        let words = if ms < 1e3 { trimmed(ms) } else { format!("{} s", trimmed(ms / 1e3)) };
        let shift = words.len() as i32 * FONT_PX / 4;
        area.draw(&Text::new(words, (x - shift, bottom + 6), font()))?;
    }
    for error in ticks(errors) {
        let (_, y) = at(times.start, error);
        area.draw(&PathElement::new([(left, y), (right, y)], line))?;
        let words = format!("{} %", trimmed(100.0 * error));
        let shift = words.len() as i32 * FONT_PX * 11 / 20 + 6;
        area.draw(&Text::new(words, (left - shift, y - FONT_PX / 2), font()))?;
    }
    area.draw(&PathElement::new([(left, top), (left, bottom), (right, bottom)], GREY))?;
    let words = "time of one map, ms (one core; FE: one state)";
    area.draw(&Text::new(words, ((left + right) / 2 - 140, height as i32 - 20), font()))?;
    Ok(())
}

type Span = std::ops::Range<f64>;

/// 1, 2, 5 within every decade, or the decades alone where there are many.
fn ticks(span: &Span) -> Vec<f64> {
    let steps: &[f64] =
        if (span.end / span.start).log10() < 2.6 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let first = span.start.log10().floor() as i32;
    let decades = first..=span.end.log10().ceil() as i32;
    let all = decades.flat_map(|power| steps.iter().map(move |step| step * 10f64.powi(power)));
    all.filter(|tick| (span.start..=span.end).contains(tick)).collect()
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

#[cfg(test)]
mod tests {
    use super::{range, ticks, trimmed};

    #[test]
    fn numbers_of_axes_are_short() {
        for (value, text) in
            [(0.5, "0.5"), (1.0, "1"), (11.1, "11"), (300.0, "300"), (0.02, "0.02")]
        {
            assert_eq!(trimmed(value), text);
        }
    }

    #[test]
    fn every_axis_has_numbers() {
        for (span, due) in
            [(0.3..6.0, vec![0.5, 1.0, 2.0, 5.0]), (0.3..3e3, vec![1.0, 10.0, 100.0, 1e3])]
        {
            let found = ticks(&span);
            assert!(found.iter().zip(&due).all(|(f, d)| (f / d - 1.0).abs() < 1e-9), "{found:?}");
            assert_eq!(found.len(), due.len());
        }
        for values in [vec![0.35], vec![0.35, 0.36], vec![0.01, 2e6]] {
            let span = range(values.into_iter(), 1.6, 1.6);
            assert!(ticks(&span).len() >= 2, "{span:?}");
        }
    }
}
