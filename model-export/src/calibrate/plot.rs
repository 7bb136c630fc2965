//! The reliability diagram: true errors over the bounds that were stated for them.

use super::{Fitted, GROUPS};
use crate::metrics::quantile;
use papilla_output::plot::palette::{self, GREY};
use plotters::coord::Shift;
use plotters::prelude::*;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

const PANEL_PX: (u32, u32) = (560, 500);
const LEGEND_PX: u32 = 40;
/// Colours of the groups, in their order.
const COLOURS: [RGBColor; 5] =
    [palette::BLUE, palette::ORANGE, palette::VERMILION, palette::GREEN, palette::DARK];
/// Least and greatest of both axes, %.
const AXIS: std::ops::Range<f64> = 2.0..200.0;
/// Answers are put into so many bins of equal count.
const BINS: usize = 8;

/// True error against stated bound of these errors, a panel for each, as SVG.
///
/// # Errors
/// What the drawing library reports, in words.
pub fn reliability(fitted: &[&Fitted]) -> Result<String, String> {
    let mut text = String::new();
    let size = (PANEL_PX.0 * fitted.len().max(1) as u32, PANEL_PX.1 + LEGEND_PX);
    let drawn = draw(&SVGBackend::with_string(&mut text, size).into_drawing_area(), fitted);
    drawn.map_err(|error| error.to_string())?;
    Ok(text)
}

fn draw(root: &Area<'_>, fitted: &[&Fitted]) -> Drawn {
    root.fill(&WHITE)?;
    let (plots, foot) = root.split_vertically(PANEL_PX.1);
    for (area, fitted) in plots.split_evenly((1, fitted.len().max(1))).iter().zip(fitted) {
        panel(area, fitted)?;
    }
    let mut x = 70;
    for (group, colour) in GROUPS.into_iter().zip(COLOURS) {
        foot.draw(&Circle::new((x, 16), 4, colour.filled()))?;
        foot.draw(&Text::new(group, (x + 9, 10), font()))?;
        x += 130;
    }
    foot.draw(&PathElement::new([(x, 16), (x + 22, 16)], BLACK.stroke_width(3)))?;
    foot.draw(&Text::new("90th percentile of the true errors", (x + 28, 10), font()))?;
    root.present()?;
    Ok(())
}

fn font() -> TextStyle<'static> {
    ("sans-serif", 13).into_font().color(&RGBColor(40, 40, 40))
}

fn panel(area: &Area<'_>, fitted: &Fitted) -> Drawn {
    let name = fitted.series.name().replace('`', "");
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .caption(name, ("sans-serif", 15))
        .x_label_area_size(42)
        .y_label_area_size(54)
        .build_cartesian_2d(AXIS.log_scale(), AXIS.log_scale())?;
    chart
        .configure_mesh()
        .x_desc("stated 90 % bound, %")
        .y_desc("true error, %")
        .label_style(font())
        .axis_desc_style(font())
        .light_line_style(RGBColor(240, 240, 240))
        .x_label_formatter(&|v| format!("{v}"))
        .y_label_formatter(&|v| format!("{v}"))
        .draw()?;
    let inside = |percent: f64| percent.clamp(AXIS.start, AXIS.end);
    chart.draw_series(LineSeries::new([AXIS.start, AXIS.end].map(|v| (v, v)), GREY))?;
    for (group, [_, p90], error) in &fitted.points {
        let colour = GROUPS.iter().position(|of| of == group).map_or(BLACK, |at| COLOURS[at]);
        let at = (inside(100.0 * p90), inside(100.0 * error));
        chart.draw_series([Circle::new(at, 3, colour.mix(0.6).filled())])?;
    }
    let mut sorted: Vec<(f64, f64)> =
        fitted.points.iter().map(|(_, [_, p90], error)| (*p90, *error)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let bins = sorted.chunks(sorted.len().div_ceil(BINS).max(1));
    let line = bins.filter_map(|bin| {
        let of = |part: fn(&(f64, f64)) -> f64, share| {
            quantile(&bin.iter().map(part).collect::<Vec<f64>>(), share)
        };
        Some((inside(100.0 * of(|p| p.0, 0.5)?), inside(100.0 * of(|p| p.1, 0.9)?)))
    });
    chart.draw_series(LineSeries::new(line, BLACK.stroke_width(3)))?;
    Ok(())
}
