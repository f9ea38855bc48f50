//! The plots, as SVG text.

use hdrhistogram::{Counter, Histogram};
use plotters::prelude::*;

use wade_learn::page::PlotError;

/// A named line through points of x and microseconds.
pub(super) struct Line {
    pub name: &'static str,
    pub color: RGBColor,
    pub points: Vec<(f64, f64)>,
}

const WIDTH: u32 = 940;
const SHORTEST_US: f64 = 0.1;

/// What stands around the lines.
pub(super) struct Frame<'a> {
    pub height: u32,
    pub x_title: &'a str,
    pub x_end: f64,
    pub x_label: &'a dyn Fn(&f64) -> String,
    /// The most labels on the x axis.
    pub x_labels: usize,
    /// Horizontal limits with their names [us].
    pub limits: &'a [(String, f64)],
}

/// Lines over a common x axis and a logarithmic axis of time, under a legend that hides none of them.
pub(super) fn plot(frame: &Frame<'_>, lines: &[Line]) -> Result<String, PlotError> {
    draw(frame, lines).map(|svg| legend(frame, lines) + &svg)
}

fn legend(frame: &Frame<'_>, lines: &[Line]) -> String {
    let solid = |line: &Line| {
        let (RGBColor(r, g, b), name) = (line.color, line.name);
        format!("<span><i style=\"background:rgb({r},{g},{b})\"></i>{name}</span>")
    };
    let limits = frame.limits.iter().map(|(name, _)| format!("<span><i class=\"dash\"></i>{name}</span>"));
    let keys: String = lines.iter().map(solid).chain(limits).collect();
    format!("<p class=\"legend\">{keys}</p>")
}

fn draw(frame: &Frame<'_>, lines: &[Line]) -> Result<String, PlotError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, frame.height)).into_drawing_area();
        area.fill(&WHITE)?;
        let (low, high) = range(frame, lines);
        let mut chart = ChartBuilder::on(&area)
            .margin(8)
            .margin_right(24)
            .x_label_area_size(44)
            .y_label_area_size(72)
            .build_cartesian_2d(0.0..frame.x_end, (low..high).log_scale())?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(RGBColor(0xe3, 0xe6, 0xea))
            .x_labels(frame.x_labels)
            .y_labels(8)
            .x_desc(frame.x_title)
            .x_label_formatter(frame.x_label)
            .y_label_formatter(&|us| time(*us))
            .label_style(("sans-serif", 15))
            .axis_desc_style(("sans-serif", 15))
            .draw()?;
        for (_, us) in frame.limits {
            let ends = [(0.0, *us), (frame.x_end, *us)];
            chart.draw_series(DashedLineSeries::new(ends, 6, 4, BLACK.stroke_width(1)))?;
        }
        for line in lines {
            let points = line.points.iter().map(|&(x, us)| (x, us.max(SHORTEST_US)));
            chart.draw_series(LineSeries::new(points, line.color.stroke_width(2)))?;
        }
        area.present()?;
    }
    Ok(svg)
}

/// Whole decades around everything shown [us].
fn range(frame: &Frame<'_>, lines: &[Line]) -> (f64, f64) {
    let limits = frame.limits.iter().map(|(_, us)| *us);
    let shown = lines.iter().flat_map(|line| line.points.iter().map(|p| p.1)).chain(limits);
    let (low, high) =
        shown.fold((f64::MAX, SHORTEST_US), |(low, high), us| (low.min(us.max(SHORTEST_US)), high.max(us)));
    let low = 10_f64.powf(low.min(high).log10().floor());
    (low, 10_f64.powf(high.log10().ceil()).max(low * 10.0))
}

/// Microseconds in the unit that reads best.
pub(super) fn time(us: f64) -> String {
    match us {
        us if us >= 1e6 => format!("{} s", round(us / 1e6)),
        us if us >= 1e3 => format!("{} ms", round(us / 1e3)),
        us if us >= 1.0 || us == 0.0 => format!("{} us", round(us)),
        us => format!("{} ns", round(us * 1e3)),
    }
}

fn round(value: f64) -> String {
    let digits = if value >= 100.0 {
        0
    } else if value >= 10.0 {
        1
    } else {
        2
    };
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A distribution as a line: x is the number of nines, 2 for the 99th percentile, up to the last request.
pub(super) fn distribution<T: Counter>(name: &'static str, color: RGBColor, times: &Histogram<T>) -> Line {
    let end = nines(times.len());
    let points = (0..)
        .map(|step| f64::from(step) * 0.02)
        .take_while(|x| *x < end)
        .chain((!times.is_empty()).then_some(end))
        .map(|x| (x, times.value_at_quantile(1.0 - 10_f64.powf(-x)) as f64 * 1e-3));
    Line { name, color, points: points.collect() }
}

/// How far into the tail a number of requests reaches.
pub(super) fn nines(count: u64) -> f64 {
    (count as f64).log10().max(0.0)
}

/// The percentile at a number of nines, as people write it.
pub(super) fn percentile(nines: &f64) -> String {
    let digits = (nines.ceil() as usize).saturating_sub(2);
    format!("{:.digits$} %", 100.0 * (1.0 - 10_f64.powf(-nines)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_percentiles_read_as_people_write_them() {
        let times = [0.1, 8.6, 10.0, 99.96, 1000.0, 17_320.0, 2e6].map(time);
        assert_eq!(times, ["100 ns", "8.6 us", "10 us", "100 us", "1 ms", "17.3 ms", "2 s"]);
        let percentiles = [0.0, 1.0, 2.0, 3.0, 5.0].map(|nines| percentile(&nines));
        assert_eq!(percentiles, ["0 %", "90 %", "99 %", "99.9 %", "99.999 %"]);
    }

    #[test]
    fn a_distribution_ends_at_the_slowest_request() {
        let mut times = Histogram::<u64>::new(3).expect("valid");
        (1..=1000).for_each(|us| times.record(us * 1000).expect("in range"));
        let line = distribution("response", BLUE, &times);
        let (nines, slowest) = *line.points.last().expect("has points");
        assert!((nines - 3.0).abs() < 1e-9 && slowest >= 999.0, "{nines} {slowest}");
        assert!(distribution("none", BLUE, &Histogram::<u64>::new(3).expect("valid")).points.is_empty());
    }
}
