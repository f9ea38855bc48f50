//! Scatter plots, as SVG text.

use std::io;

use plotters::{drawing::DrawingAreaErrorKind, prelude::*};

/// A plot could not be drawn.
pub type PlotError = DrawingAreaErrorKind<io::Error>;

const SIZE: (u32, u32) = (470, 320);
const COLORS: [RGBColor; 6] = [
    RGBColor(0x1b, 0x5e, 0xa8),
    RGBColor(0xd9, 0x7a, 0x06),
    RGBColor(0x2a, 0x8c, 0x4a),
    RGBColor(0x8a, 0x5a, 0xa8),
    RGBColor(0xb9, 0x1c, 0x1c),
    RGBColor(0x77, 0x7d, 0x85),
];

/// Points of one color, with the name in the legend.
pub(super) struct Group {
    pub name: String,
    pub points: Vec<(f64, f64)>,
}

/// Points over two linear axes, under a legend.
pub(super) fn scatter(x_title: &str, y_title: &str, groups: &[Group]) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        area.fill(&WHITE)?;
        let points = || groups.iter().flat_map(|group| group.points.iter().copied());
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .margin_right(16)
            .x_label_area_size(42)
            .y_label_area_size(62)
            .build_cartesian_2d(padded(points().map(|p| p.0)), padded(points().map(|p| p.1)))?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(0xe3, 0xe6, 0xea))
            .x_labels(7)
            .y_labels(7)
            .x_desc(x_title)
            .y_desc(y_title)
            .label_style(("sans-serif", 13))
            .axis_desc_style(("sans-serif", 13))
            .draw()?;
        for (group, color) in groups.iter().zip(COLORS.iter().cycle()) {
            chart.draw_series(group.points.iter().map(|&p| Circle::new(p, 2, color.filled())))?;
        }
        area.present()?;
    }
    Ok(format!("<figure>{}{svg}</figure>", legend(groups)))
}

fn legend(groups: &[Group]) -> String {
    let key = |(group, RGBColor(r, g, b)): (&Group, &RGBColor)| {
        format!("<span><i style=\"background:rgb({r},{g},{b})\"></i>{}</span>", escape(&group.name))
    };
    let keys: String = groups.iter().zip(COLORS.iter().cycle()).map(key).collect();
    format!("<figcaption class=\"legend\">{keys}</figcaption>")
}

pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The range of the values with room around it, also where they are all the same or there is none.
fn padded(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
    if low > high {
        return 0.0..1.0;
    }
    let room = if high > low { 0.05 * (high - low) } else { 0.5 * high.abs().max(1.0) };
    low - room..high + room
}
