//! The figures, as SVG text.

use plotters::prelude::*;

use crate::page::PlotError;
use crate::page::plot::{BLUE, GRAY, GREEN, ORANGE, PURPLE};

/// A color for each depth; the last serves all further ones.
pub(super) const DEPTH_COLORS: [RGBColor; 5] = [BLUE, ORANGE, GREEN, PURPLE, GRAY];

const WIDTH: u32 = 940;
const HEIGHT: u32 = 420;

/// How points are marked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Circle,
    Diamond,
    Cross,
    /// A line through the points.
    Line,
    /// A dashed line through the points.
    Dashes,
}

/// Points of one kind.
pub(super) struct Series {
    /// Entry in the legend; series without a name have none.
    pub name: String,
    pub mark: Mark,
    pub color: RGBColor,
    pub points: Vec<(f64, f64)>,
}

/// A figure with its legend above it.
pub(super) fn figure(x_title: &str, y_title: &str, series: &[Series]) -> Result<String, PlotError> {
    draw(x_title, y_title, series).map(|svg| legend(series) + &svg)
}

pub(super) fn color(index: usize) -> RGBColor {
    DEPTH_COLORS[index.min(DEPTH_COLORS.len() - 1)]
}

fn legend(series: &[Series]) -> String {
    let key = |series: &Series| {
        let RGBColor(r, g, b) = series.color;
        let sign = match series.mark {
            Mark::Circle => "&#9679;",
            Mark::Diamond => "&#9670;",
            Mark::Cross => "&#10005;",
            Mark::Line => "&#8212;",
            Mark::Dashes => "- -",
        };
        format!("<span><b style=\"color:rgb({r},{g},{b})\">{sign}</b> {}</span>", series.name)
    };
    let keys: String = series.iter().filter(|series| !series.name.is_empty()).map(key).collect();
    format!("<p class=\"legend\">{keys}</p>")
}

fn draw(x_title: &str, y_title: &str, series: &[Series]) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, HEIGHT)).into_drawing_area();
        area.fill(&WHITE)?;
        let (x_end, y_range) = extent(series);
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .margin_right(24)
            .x_label_area_size(44)
            .y_label_area_size(72)
            .build_cartesian_2d(0.0..x_end, y_range)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(0xe3, 0xe6, 0xea))
            .x_labels(11)
            .x_label_formatter(&label)
            .y_label_formatter(&label)
            .y_labels(8)
            .x_desc(x_title)
            .y_desc(y_title)
            .label_style(("sans-serif", 15))
            .axis_desc_style(("sans-serif", 15))
            .draw()?;
        for Series { mark, color, points, .. } in series {
            let points = points.iter().copied();
            match mark {
                Mark::Circle => {
                    chart.draw_series(points.map(|at| Circle::new(at, 3, color.mix(0.75).filled())))?
                }
                Mark::Cross => {
                    chart.draw_series(points.map(|at| Cross::new(at, 5, color.stroke_width(2))))?
                }
                Mark::Diamond => chart.draw_series(points.map(|at| {
                    let corners = vec![(0, -7), (6, 0), (0, 7), (-6, 0)];
                    EmptyElement::at(at) + Polygon::new(corners, color.filled())
                }))?,
                Mark::Line => chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?,
                Mark::Dashes => {
                    chart.draw_series(DashedLineSeries::new(points, 6, 4, color.stroke_width(2)))?
                }
            };
        }
        area.present()?;
    }
    Ok(svg)
}

/// A number without the digits that rounding leaves.
fn label(value: &f64) -> String {
    ((value * 1e6).round() / 1e6).to_string()
}

/// Everything shown, with room above; zero is always in sight.
fn extent(series: &[Series]) -> (f64, std::ops::Range<f64>) {
    let points = || series.iter().flat_map(|series| &series.points);
    let x_end = points().map(|point| point.0).fold(0.0, f64::max);
    let (low, high) =
        points().map(|point| point.1).fold((0.0_f64, 0.0_f64), |(low, high), y| (low.min(y), high.max(y)));
    let room = 0.05 * (high - low).max(f64::MIN_POSITIVE);
    (x_end.max(f64::MIN_POSITIVE) * 1.03, if low < 0.0 { low - room } else { 0.0 }..high + room)
}
