//! The figures of the page, as SVG.

use plotters::prelude::*;

use super::report::Trace;

/// A figure could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("a figure could not be drawn: {0}")]
pub struct PlotError(String);

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for PlotError {
    fn from(error: DrawingAreaErrorKind<E>) -> Self {
        Self(error.to_string())
    }
}

const BEFORE: RGBColor = RGBColor(0xb9, 0x1c, 0x1c);
const AFTER: RGBColor = RGBColor(0x1d, 0x5f, 0xb0);
const BAND: RGBColor = RGBColor(0x6b, 0x72, 0x80);

/// The gap of a trial before and after, over a band of two standard deviations of noise.
pub(super) fn trace(trace: &Trace, changed: bool) -> Result<String, PlotError> {
    let unit = if trace.component.starts_with('f') { "N" } else { "N m" };
    let end = trace.t.last().copied().unwrap_or(1.0).max(1e-3);
    let size = trace.before.iter().chain(&trace.after).fold(2.5 * trace.noise, |size, v| size.max(v.abs()));
    let size = 1.1 * size.max(1e-9);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (900, 260)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .x_label_area_size(38)
            .y_label_area_size(64)
            .build_cartesian_2d(0.0..end, -size..size)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .x_desc("time [s]")
            .y_desc(format!("gap of {} [{unit}]", trace.component))
            .label_style(("sans-serif", 14))
            .y_labels(7)
            .draw()?;
        let band = [(0.0, -2.0 * trace.noise), (end, 2.0 * trace.noise)];
        chart.draw_series([Rectangle::new(band, BAND.mix(0.25).filled())])?;
        let line = |values: &[f64]| trace.t.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>();
        chart.draw_series(LineSeries::new(line(&trace.before), BEFORE.stroke_width(2)))?;
        if changed {
            chart.draw_series(LineSeries::new(line(&trace.after), AFTER.stroke_width(2)))?;
        }
        area.present()?;
    }
    Ok(svg)
}
