//! Charts as SVG: lines and labelled points on linear or logarithmic axes.

pub mod labels;
pub mod palette;
mod scale;
mod ticks;

use super::OutputError;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{Pos, VPos};
use scale::Scale;
use std::path::Path;

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Logarithmic; values have to be positive then.
    pub log: bool,
}

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), log: false }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn log(label: impl Into<String>) -> Self {
        Self { label: label.into(), log: true }
    }
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A line through its points.
    Line,
    /// A dot at each point, the series' name beside it where there is room.
    Dots,
}

/// Named points.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// `(x, y)`.
    pub points: Vec<(f64, f64)>,
    /// How it is drawn.
    pub mark: Mark,
}

/// A chart.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Heading.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, in the legend's order.
    pub series: Vec<Series>,
}

const SIZE_PX: (u32, u32) = (880, 560);
/// Height of the names of dots, px.
const TEXT_PX: i32 = 14;
/// Dashes and the gaps between them, px.
const DASH_PX: i32 = 8;
const GAP_PX: i32 = 5;
/// Colours of the series, in their order; further series have them again, with dashed lines.
const COLOURS: [RGBColor; 8] = [
    palette::BLUE,
    palette::VERMILION,
    palette::GREEN,
    palette::PURPLE,
    palette::SKY,
    palette::ORANGE,
    BLACK,
    palette::GREY,
];

/// Writes a chart as SVG.
///
/// # Errors
/// [`OutputError`] if the file cannot be written.
pub fn write_svg(path: &Path, chart: &Chart) -> Result<(), OutputError> {
    let mut text = String::new();
    let drawn = draw(&SVGBackend::with_string(&mut text, SIZE_PX).into_drawing_area(), chart);
    drawn.map_err(|e| OutputError::Encode { what: "SVG", message: e.to_string() })?;
    super::atomic::write(path, text.as_bytes())
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

fn draw(area: &Area<'_>, chart: &Chart) -> Drawn {
    let of = |pick: fn(&(f64, f64)) -> f64| -> Vec<f64> {
        chart.series.iter().flat_map(|s| s.points.iter().map(pick)).collect()
    };
    let scale = |axis: &Axis, pick| Scale::new(range(axis, &of(pick)), axis.log);
    draw_on(area, chart, scale(&chart.x, |p| p.0), scale(&chart.y, |p| p.1))?;
    area.present()?;
    Ok(())
}

/// Range of finite values with a margin.
fn range(axis: &Axis, values: &[f64]) -> (f64, f64) {
    let fits = |v: &f64| v.is_finite() && (!axis.log || *v > 0.0);
    let low = values.iter().copied().filter(fits).fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().filter(fits).fold(f64::NEG_INFINITY, f64::max);
    if low > high {
        return (0.1, 1.0);
    }
    if axis.log {
        return (low / 1.6, high * 1.6);
    }
    let margin = if high > low { 0.04 * (high - low) } else { 0.5 };
    (if low >= 0.0 { 0.0 } else { low - margin }, high + margin)
}

fn draw_on(area: &Area<'_>, chart: &Chart, x: Scale, y: Scale) -> Drawn {
    area.fill(&WHITE)?;
    let mut context = ChartBuilder::on(area)
        .caption(&chart.title, ("sans-serif", 20))
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(76)
        .build_cartesian_2d(x, y)?;
    context
        .configure_mesh()
        .light_line_style(RGBColor(240, 240, 240))
        .x_desc(&chart.x.label)
        .y_desc(&chart.y.label)
        .x_label_formatter(&|v| ticks::text(*v))
        .y_label_formatter(&|v| ticks::text(*v))
        .label_style(("sans-serif", 14))
        .draw()?;
    let (xs, ys) = context.plotting_area().get_pixel_range();
    let is_finite = |p: &&(f64, f64)| p.0.is_finite() && p.1.is_finite();
    let dots = chart.series.iter().filter(|s| s.mark == Mark::Dots);
    let dots: Vec<((i32, i32), &str)> = dots
        .flat_map(|series| {
            let points = series.points.iter().filter(is_finite);
            points.map(|p| (context.backend_coord(p), series.name.as_str()))
        })
        .collect();
    let within = [xs.start, ys.start, xs.end, ys.end];
    let mut places = labels::places(within, TEXT_PX, &dots, &[]).into_iter();
    for (i, series) in chart.series.iter().enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        let points = series.points.iter().filter(is_finite).copied();
        if series.mark == Mark::Dots {
            for (at, place) in points.zip(&mut places) {
                let (x, y) = context.backend_coord(&at);
                let from = (place.anchor.0 - x, place.anchor.1 - y);
                let style = ("sans-serif", TEXT_PX).into_text_style(area);
                let style = style.pos(Pos::new(place.side, VPos::Center));
                let text = Text::new(series.name.clone(), from, style);
                let dot = Circle::new((0, 0), labels::DOT_PX, colour.filled());
                context.draw_series([EmptyElement::at(at) + dot + text])?;
            }
            continue;
        }
        let style = colour.stroke_width(2);
        // Colours that come again are told by dashes.
        if i < COLOURS.len() {
            let box_of =
                move |(x, y)| Rectangle::new([(x, y - 4), (x + 16, y + 4)], colour.filled());
            context.draw_series(LineSeries::new(points, style))?.label(&series.name).legend(box_of);
        } else {
            let part = move |from| Rectangle::new([(from, -4), (from + 6, 4)], colour.filled());
            let line = DashedLineSeries::new(points, DASH_PX, GAP_PX, style);
            context
                .draw_series(line)?
                .label(&series.name)
                .legend(move |at| EmptyElement::at(at) + part(0) + part(10));
        }
    }
    if chart.series.iter().all(|s| s.mark == Mark::Dots) {
        return Ok(());
    }
    // The legend stands on the side of the upper half that fewer points pass.
    let points = chart.series.iter().flat_map(|s| &s.points);
    let places = points.map(|p| context.backend_coord(p));
    let upper = places.filter(|place| place.1 < (ys.start + ys.end) / 2);
    let (right, left): (Vec<_>, Vec<_>) = upper.partition(|at| at.0 > (xs.start + xs.end) / 2);
    let corner = if right.len() > left.len() {
        SeriesLabelPosition::UpperLeft
    } else {
        SeriesLabelPosition::UpperRight
    };
    context
        .configure_series_labels()
        .position(corner)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font(("sans-serif", 14))
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where texts of an SVG begin and end, px, and what they say; a letter is taken as .6 em.
    fn texts(svg: &str) -> Vec<(f64, f64, String)> {
        let of = |tag: &str, name: &str| -> f64 {
            let value = tag.split(&format!("{name}=\"")).nth(1).unwrap();
            value.split('"').next().unwrap().parse().unwrap()
        };
        let read = |part: &str| {
            let (tag, rest) = part.split_once('>').unwrap();
            let tag = format!(" {tag}");
            let said = rest.split('<').next().unwrap().trim().to_owned();
            let width = 0.6 * of(&tag, "font-size") * said.chars().count() as f64;
            let x = of(&tag, " x");
            let middle = tag.contains("\"middle\"");
            let left = if middle { x - 0.5 * width } else { x };
            let left = if tag.contains("\"end\"") { x - width } else { left };
            (left, left + width, said)
        };
        svg.split("<text ").skip(1).map(read).collect()
    }

    #[test]
    fn no_name_of_a_dot_is_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.svg");
        let names = ["a rather long name beside its dot", "another one, at the other end"];
        let series = |(i, name): (usize, &str)| Series {
            name: name.into(),
            points: vec![(1.0 + 2.0 * i as f64, 1.0), (2.0, 1.01)],
            mark: Mark::Dots,
        };
        let chart = Chart {
            title: "heading".into(),
            x: Axis::log("x"),
            y: Axis::linear("y"),
            series: names.into_iter().enumerate().map(series).collect(),
        };
        write_svg(&path, &chart).unwrap();
        let found = texts(&std::fs::read_to_string(&path).unwrap());
        let of = found.iter().filter(|(.., said)| names.contains(&said.as_str()));
        assert_eq!(of.clone().count(), 4);
        for (left, right, said) in of {
            assert!(*left >= 0.0 && *right <= f64::from(SIZE_PX.0), "{said}: {left} to {right}");
        }
    }

    #[test]
    fn every_series_and_axis_is_named_in_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.svg");
        let series = |name: &str, mark| Series {
            name: name.into(),
            points: vec![(0.1, 2.0), (1.0, 0.5), (10.0, f64::NAN)],
            mark,
        };
        for (x, y) in [(true, true), (false, true), (true, false), (false, false)] {
            let chart = Chart {
                title: "heading".into(),
                x: Axis { label: "seconds".into(), log: x },
                y: Axis { label: "error".into(), log: y },
                series: vec![series("first", Mark::Line), series("second", Mark::Dots)],
            };
            write_svg(&path, &chart).unwrap();
            let text = std::fs::read_to_string(&path).unwrap();
            for word in ["heading", "seconds", "error", "first", "second"] {
                assert!(text.contains(word), "{word}");
            }
            assert!(!text.contains("NaN"), "{text}");
        }
    }
}
