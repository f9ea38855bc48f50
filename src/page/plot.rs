//! Plain figures, as SVG text under a legend.

use std::io;
use std::ops::Range;

use plotters::{coord::Shift, drawing::DrawingAreaErrorKind, prelude::*};

use super::escape;

/// A figure could not be drawn.
pub type PlotError = DrawingAreaErrorKind<io::Error>;

/// Blue, the first color of a figure.
pub const BLUE: RGBColor = RGBColor(0x1b, 0x5e, 0xa8);
/// Orange, the second.
pub const ORANGE: RGBColor = RGBColor(0xd9, 0x7a, 0x06);
/// Green, the third.
pub const GREEN: RGBColor = RGBColor(0x2a, 0x8c, 0x4a);
/// Purple, the fourth.
pub const PURPLE: RGBColor = RGBColor(0x8a, 0x5a, 0xa8);
/// Red, the fifth.
pub const RED: RGBColor = RGBColor(0xb9, 0x1c, 0x1c);
/// Gray, the last.
pub const GRAY: RGBColor = RGBColor(0x77, 0x7d, 0x85);

/// In the order in which a figure takes them.
const COLORS: [RGBColor; 6] = [BLUE, ORANGE, GREEN, PURPLE, RED, GRAY];
const GRID: RGBColor = RGBColor(0xe3, 0xe6, 0xea);

/// Points of one color, with the name in the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Entry in the legend.
    pub name: String,
    /// The points.
    pub points: Vec<(f64, f64)>,
}

/// Points over two linear axes.
pub fn scatter(x_title: &str, y_title: &str, series: &[Series]) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = canvas(&mut svg, (470, 320))?;
        let range =
            |of: fn(&(f64, f64)) -> f64| padded(extent(series.iter().flat_map(|s| &s.points).map(of)));
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .margin_right(16)
            .x_label_area_size(42)
            .y_label_area_size(62)
            .build_cartesian_2d(range(|p| p.0), range(|p| p.1))?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .x_labels(7)
            .y_labels(7)
            .x_desc(x_title)
            .y_desc(y_title)
            .label_style(("sans-serif", 13))
            .axis_desc_style(("sans-serif", 13))
            .draw()?;
        for (s, color) in series.iter().zip(COLORS.iter().cycle()) {
            chart.draw_series(s.points.iter().map(|&p| Circle::new(p, 2, color.filled())))?;
        }
        area.present()?;
    }
    Ok(format!("<figure>{}{svg}</figure>", legend(series)))
}

/// Lines over a linear axis; the other is logarithmic and leaves out what is not positive.
pub fn curves(x_title: &str, y_title: &str, series: &[Series]) -> Result<String, PlotError> {
    let positive = |s: &Series| s.points.iter().copied().filter(|p| p.1 > 0.0).collect::<Vec<_>>();
    let lines: Vec<Vec<(f64, f64)>> = series.iter().map(positive).collect();
    let mut svg = String::new();
    {
        let area = canvas(&mut svg, (720, 320))?;
        let x = extent(lines.iter().flatten().map(|p| p.0)).unwrap_or((0.0, 1.0));
        let y = extent(lines.iter().flatten().map(|p| p.1)).unwrap_or((1e-3, 1.0));
        let x = x.0..x.1.max(x.0 + 1.0);
        let y = (y.0 / 1.2..y.1 * 1.2).log_scale();
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .margin_right(16)
            .x_label_area_size(42)
            .y_label_area_size(74)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .y_label_formatter(&|value| format!("{value:.0e}"))
            .x_desc(x_title)
            .y_desc(y_title)
            .label_style(("sans-serif", 13))
            .axis_desc_style(("sans-serif", 13))
            .draw()?;
        for (points, color) in lines.into_iter().zip(COLORS.iter().cycle()) {
            chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?;
        }
        area.present()?;
    }
    Ok(format!("<figure>{}{svg}</figure>", legend(series)))
}

/// Lines over linear axes, and a gray band from `-band` to `band`.
pub fn traces(x_title: &str, y_title: &str, band: f64, series: &[Series]) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = canvas(&mut svg, (960, 250))?;
        let points = || series.iter().flat_map(|s| &s.points);
        let (start, end) = extent(points().map(|p| p.0)).unwrap_or((0.0, 1.0));
        let y = padded(extent(points().map(|p| p.1).chain([-1.2 * band, 1.2 * band])));
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .margin_right(16)
            .x_label_area_size(42)
            .y_label_area_size(66)
            .build_cartesian_2d(start..end.max(start + 1e-3), y)?;
        chart.draw_series([Rectangle::new([(start, -band), (end, band)], GRAY.mix(0.25).filled())])?;
        chart
            .configure_mesh()
            .light_line_style(WHITE.mix(0.0))
            .bold_line_style(GRID)
            .x_labels(11)
            .y_labels(7)
            .x_desc(x_title)
            .y_desc(y_title)
            .label_style(("sans-serif", 13))
            .axis_desc_style(("sans-serif", 13))
            .draw()?;
        for (s, color) in series.iter().zip(COLORS.iter().cycle()) {
            chart.draw_series(LineSeries::new(s.points.iter().copied(), color.stroke_width(2)))?;
        }
        area.present()?;
    }
    Ok(format!("<figure>{}{svg}</figure>", legend(series)))
}

/// Points over equal axes with the line on which both agree.
pub fn parity(x_title: &str, y_title: &str, series: &[Series]) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = canvas(&mut svg, (400, 380))?;
        let values = series.iter().flat_map(|s| &s.points).flat_map(|p| [p.0, p.1]);
        let range = padded(extent(values));
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .margin_right(16)
            .x_label_area_size(42)
            .y_label_area_size(66)
            .build_cartesian_2d(range.clone(), range.clone())?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(GRID)
            .x_labels(5)
            .y_labels(6)
            .x_desc(x_title)
            .y_desc(y_title)
            .label_style(("sans-serif", 13))
            .axis_desc_style(("sans-serif", 13))
            .draw()?;
        let diagonal = [(range.start, range.start), (range.end, range.end)];
        chart.draw_series(DashedLineSeries::new(diagonal, 5, 4, BLACK.stroke_width(1)))?;
        for (s, color) in series.iter().zip(COLORS.iter().cycle()) {
            chart.draw_series(s.points.iter().map(|&p| Circle::new(p, 2, color.mix(0.6).filled())))?;
        }
        area.present()?;
    }
    Ok(format!("<figure>{}{svg}</figure>", legend(series)))
}

fn canvas(svg: &mut String, size: (u32, u32)) -> Result<DrawingArea<SVGBackend<'_>, Shift>, PlotError> {
    let area = SVGBackend::with_string(svg, size).into_drawing_area();
    area.fill(&WHITE)?;
    Ok(area)
}

fn legend(series: &[Series]) -> String {
    let key = |(series, RGBColor(r, g, b)): (&Series, &RGBColor)| {
        format!("<span><i style=\"background:rgb({r},{g},{b})\"></i>{}</span>", escape(&series.name))
    };
    let keys: String = series.iter().zip(COLORS.iter().cycle()).map(key).collect();
    format!("<figcaption class=\"legend\">{keys}</figcaption>")
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |range, x| match range {
        Some((low, high)) => Some((x.min(low), x.max(high))),
        None => Some((x, x)),
    })
}

/// With room around it, also where all values are the same or there is none.
fn padded(extent: Option<(f64, f64)>) -> Range<f64> {
    let Some((low, high)) = extent else { return 0.0..1.0 };
    let room = if high > low { 0.05 * (high - low) } else { 0.5 * high.abs().max(1.0) };
    low - room..high + room
}
