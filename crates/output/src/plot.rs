//! Charts as SVG: lines and labelled points on linear or logarithmic axes.

use super::OutputError;
use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;
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
    /// A dot at each point, the series' name beside it.
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
/// Colours that stay apart for colour-blind eyes (Okabe & Ito 2008).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(120, 120, 120),
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
    let (x, y) = (range(&chart.x, &of(|p| p.0)), range(&chart.y, &of(|p| p.1)));
    let (xl, yl) = ((x.0..x.1).log_scale(), (y.0..y.1).log_scale());
    match (chart.x.log, chart.y.log) {
        (false, false) => draw_on(area, chart, x.0..x.1, y.0..y.1)?,
        (true, false) => draw_on(area, chart, xl, y.0..y.1)?,
        (false, true) => draw_on(area, chart, x.0..x.1, yl)?,
        (true, true) => draw_on(area, chart, xl, yl)?,
    }
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

fn draw_on<X, Y>(area: &Area<'_>, chart: &Chart, x: X, y: Y) -> Drawn
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    area.fill(&WHITE)?;
    let mut context = ChartBuilder::on(area)
        .caption(&chart.title, ("sans-serif", 20))
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(76)
        .build_cartesian_2d(x, y)?;
    let number = |v: &f64| {
        if *v == 0.0 || (1e-3..1e5).contains(&v.abs()) {
            let text = format!("{v:.4}");
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            format!("{v:.0e}")
        }
    };
    context
        .configure_mesh()
        .light_line_style(RGBColor(240, 240, 240))
        .x_desc(&chart.x.label)
        .y_desc(&chart.y.label)
        .x_label_formatter(&number)
        .y_label_formatter(&number)
        .label_style(("sans-serif", 14))
        .draw()?;
    for (i, series) in chart.series.iter().enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        let finite = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite();
        let points = series.points.iter().copied().filter(finite);
        if series.mark == Mark::Dots {
            let name = |at| {
                let text = Text::new(series.name.clone(), (8, -7), ("sans-serif", 14));
                EmptyElement::at(at) + Circle::new((0, 0), 5, colour.filled()) + text
            };
            context.draw_series(points.map(name))?;
            continue;
        }
        context
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(&series.name)
            .legend(move |(x, y)| Rectangle::new([(x, y - 4), (x + 16, y + 4)], colour.filled()));
    }
    if chart.series.iter().all(|s| s.mark == Mark::Dots) {
        return Ok(());
    }
    context
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .label_font(("sans-serif", 14))
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

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
