//! Plain figures, as SVG text under a legend.

use std::io;
use std::ops::Range;

use plotters::chart::MeshStyle;
use plotters::coord::Shift;
use plotters::coord::ranged1d::Ranged;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

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
const LETTERS: (&str, u32) = ("sans-serif", 13);

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
    figure((470, 320), series, |area| {
        let range =
            |of: fn(&(f64, f64)) -> f64| padded(extent(series.iter().flat_map(|s| &s.points).map(of)));
        let mut chart = chart(area, 62).build_cartesian_2d(range(|p| p.0), range(|p| p.1))?;
        styled(&mut chart.configure_mesh(), [x_title, y_title]).x_labels(7).y_labels(7).draw()?;
        for (s, color) in series.iter().zip(COLORS.iter().cycle()) {
            chart.draw_series(s.points.iter().map(|&p| Circle::new(p, 2, color.filled())))?;
        }
        Ok(())
    })
}

/// Lines over a linear axis; the other is logarithmic and leaves out what is not positive.
pub fn curves(x_title: &str, y_title: &str, series: &[Series]) -> Result<String, PlotError> {
    let positive = |s: &Series| s.points.iter().copied().filter(|p| p.1 > 0.0).collect::<Vec<_>>();
    let lines: Vec<Vec<(f64, f64)>> = series.iter().map(positive).collect();
    figure((720, 320), series, |area| {
        let x = extent(lines.iter().flatten().map(|p| p.0)).unwrap_or((0.0, 1.0));
        let y = extent(lines.iter().flatten().map(|p| p.1)).unwrap_or((1e-3, 1.0));
        let x = x.0..x.1.max(x.0 + 1.0);
        let y = (y.0 / 1.2..y.1 * 1.2).log_scale();
        let mut chart = chart(area, 74).build_cartesian_2d(x, y)?;
        let power = |value: &f64| format!("{value:.0e}");
        styled(&mut chart.configure_mesh(), [x_title, y_title]).y_label_formatter(&power).draw()?;
        for (points, color) in lines.into_iter().zip(COLORS.iter().cycle()) {
            chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?;
        }
        Ok(())
    })
}

/// Lines over linear axes, and a gray band from `-band` to `band`.
pub fn traces(x_title: &str, y_title: &str, band: f64, series: &[Series]) -> Result<String, PlotError> {
    figure((960, 250), series, |area| {
        let points = || series.iter().flat_map(|s| &s.points);
        let (start, end) = extent(points().map(|p| p.0)).unwrap_or((0.0, 1.0));
        let y = padded(extent(points().map(|p| p.1).chain([-1.2 * band, 1.2 * band])));
        let mut chart = chart(area, 66).build_cartesian_2d(start..end.max(start + 1e-3), y)?;
        chart.draw_series([Rectangle::new([(start, -band), (end, band)], GRAY.mix(0.25).filled())])?;
        let mut mesh = chart.configure_mesh();
        // lines between the labelled ones would hide the band
        styled(&mut mesh, [x_title, y_title])
            .light_line_style(TRANSPARENT)
            .x_labels(11)
            .y_labels(7)
            .draw()?;
        for (s, color) in series.iter().zip(COLORS.iter().cycle()) {
            chart.draw_series(LineSeries::new(s.points.iter().copied(), color.stroke_width(2)))?;
        }
        Ok(())
    })
}

/// Points over equal axes with the line on which both agree.
pub fn parity(x_title: &str, y_title: &str, series: &[Series]) -> Result<String, PlotError> {
    figure((400, 380), series, |area| {
        let values = series.iter().flat_map(|s| &s.points).flat_map(|p| [p.0, p.1]);
        let range = padded(extent(values));
        let mut chart = chart(area, 66).build_cartesian_2d(range.clone(), range.clone())?;
        styled(&mut chart.configure_mesh(), [x_title, y_title]).x_labels(5).y_labels(6).draw()?;
        let diagonal = [(range.start, range.start), (range.end, range.end)];
        chart.draw_series(DashedLineSeries::new(diagonal, 5, 4, BLACK.stroke_width(1)))?;
        for (s, color) in series.iter().zip(COLORS.iter().cycle()) {
            chart.draw_series(s.points.iter().map(|&p| Circle::new(p, 2, color.mix(0.6).filled())))?;
        }
        Ok(())
    })
}

type Canvas<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// What is drawn on a white canvas, under the legend.
fn figure(
    size: (u32, u32),
    series: &[Series],
    draw: impl FnOnce(&Canvas<'_>) -> Result<(), PlotError>,
) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE)?;
        draw(&area)?;
        area.present()?;
    }
    Ok(format!("<figure>{}{svg}</figure>", legend(series)))
}

/// With room for the labels; those of the y axis are `width` wide.
fn chart<'a, 'b>(area: &'a Canvas<'b>, width: u32) -> ChartBuilder<'a, 'a, SVGBackend<'b>> {
    let mut chart = ChartBuilder::on(area);
    chart.margin(8).margin_right(16).x_label_area_size(42).y_label_area_size(width);
    chart
}

/// A number at an axis: without what rounding leaves, without zeros at the end, and never -0.
pub fn tick(value: &f64) -> String {
    if *value != 0.0 && !(1e-4..1e6).contains(&value.abs()) && value.abs() > 1e-12 {
        return format!("{value:.3e}");
    }
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// The grid and letters of every figure.
fn styled<'m, 'a, 'b, X, Y, DB>(
    mesh: &'m mut MeshStyle<'a, 'b, X, Y, DB>,
    [x_title, y_title]: [&str; 2],
) -> &'m mut MeshStyle<'a, 'b, X, Y, DB>
where
    X: Ranged<ValueType = f64>,
    Y: Ranged<ValueType = f64>,
    DB: DrawingBackend,
{
    mesh.light_line_style(WHITE)
        .bold_line_style(GRID)
        .x_desc(x_title)
        .y_desc(y_title)
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .label_style(LETTERS)
        .axis_desc_style(LETTERS)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_as_people_write_them() {
        let texts = [0.0, -0.0, -1e-17, 0.1 + 0.2, -2.5, 1500.0, 2e7, 3e-5].map(|value| tick(&value));
        assert_eq!(texts, ["0", "0", "0", "0.3", "-2.5", "1500", "2.000e7", "3.000e-5"]);
    }
}
