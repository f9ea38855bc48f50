//! The report as one HTML page that needs no other file.

use std::fmt::Write;

use super::{
    hlog::control_by_interval,
    plot::{Frame, Line, distribution, nines, percentile, plot, time},
    record::{Interval, Percentiles},
    report::{Figures, Outcome, Report, sentence},
};
use wade_learn::page::plot::{BLUE, GRAY, GREEN, ORANGE, PURPLE, RED, tick};
use wade_learn::page::{PlotError, document, escape};

/// The page.
pub(super) fn page(report: &Report) -> Result<String, PlotError> {
    let body = format!(
        "{}\n{}\n{}\n\
         <h2>How often is it how slow?</h2>\n<p>To the right the rare, slow requests: at 99.9 % one request in a \
         thousand took longer than the line shows. Where the control is as high as the response time, the machine \
         is the cause and not the server.</p>\n{}\n\
         <h2>When was it slow?</h2>\n<p>{}</p>\n{}\n\
         <p>The machine alone, over the same time. A peak above that has its twin here came from the machine.</p>\n\
         {}\n{}",
        summary(report),
        verdict(report),
        table(report),
        tail(report)?,
        match report.details.recording.interval_ns / 1_000_000_000 {
            1 => "Response time in each second of the run.".to_owned(),
            seconds => format!("Response time in each {seconds} s of the run."),
        },
        timeline(report)?,
        control_timeline(report)?,
        footer(report),
    );
    Ok(document(&format!("wade soak: {} over {}", report.vehicle, report.transport), &body))
}

fn summary(report: &Report) -> String {
    let rate = match report.target_rate_hz {
        Some(hz) => format!("{hz} requests a second requested, {:.1} answered", report.rate_hz),
        None => format!(
            "as fast as the answers came (closed loop, so a stall delays one request only), {:.1} a second",
            report.rate_hz
        ),
    };
    format!(
        "<p class=\"small\">{} · {:.1} s after {} s of warm-up · {rate} · {} · {} input, {} a request</p>",
        report.started_at,
        report.duration_s,
        report.warm_up.duration_s,
        if report.clients == 1 { "1 client".to_owned() } else { format!("{} clients", report.clients) },
        report.input,
        if report.batch == 1 { "1 state".to_owned() } else { format!("{} states", report.batch) },
    )
}

fn verdict(report: &Report) -> String {
    let counts = format!(
        "{} sent, {} answered, {} refused, {} lost.",
        report.sent, report.answered, report.errors, report.lost
    );
    let mut text = if report.passed {
        format!("<div class=\"verdict pass\"><b>Passed.</b> {counts}")
    } else {
        format!("<div class=\"verdict fail\"><b>Failed.</b> {counts}<ul>")
    };
    for failure in &report.failures {
        let _ = write!(text, "<li>{}</li>", escape(failure));
    }
    if let Some(error) = &report.first_error {
        let _ = write!(text, "<li>The first error was: {}</li>", escape(error));
    }
    text.push_str(if report.passed { "<ul>" } else { "" });
    for (name, outcome) in report.slo.iter().filter(|(_, outcome)| outcome.holds) {
        let _ = write!(text, "<li>{}</li>", sentence(name, outcome));
    }
    text + "</ul></div>"
}

fn table(report: &Report) -> String {
    let rows = [
        ("Response time", &report.response_time_us, "from when the request was due to its answer"),
        ("Service time", &report.service_time_us, "from the actual send to the answer"),
        ("Server compute", &report.server_compute_us, "what the server says it computed"),
        ("Send lag", &report.send_lag_us, "from when it was due to when it was sent"),
        ("Generator's share", &report.generator_lag_us, "of the send lag: the load generator's own delay"),
        ("Control", &report.control_us, "how late a thread woke that only sleeps"),
        ("Generator stalls", &report.generator_stall_us, "longest pause between two looks at the clock"),
    ];
    let mut text =
        "<div class=\"wide\"><table><tr><th></th><th>p50</th><th>p95</th><th>p99</th><th>p99.9</th><th>max</th><th></th></tr>"
            .to_owned();
    for (name, Percentiles { p50, p95, p99, p99_9, max }, note) in rows {
        let _ = write!(text, "<tr><td>{name}</td>");
        for us in [p50, p95, p99, p99_9, max] {
            let _ = write!(text, "<td>{}</td>", time(*us));
        }
        let _ = write!(text, "<td class=\"text\">{note}</td></tr>");
    }
    text + "</table></div>"
}

fn limits(report: &Report) -> Vec<(String, f64)> {
    let limit = |(name, outcome): (&String, &Outcome)| match outcome.figures {
        Figures::Time { limit_us, .. } => Some((format!("limit on {name}"), limit_us)),
        Figures::Rate { .. } | Figures::Errors { .. } => None,
    };
    report.slo.iter().filter_map(limit).collect()
}

fn tail(report: &Report) -> Result<String, PlotError> {
    let totals = &report.details.recording.measured;
    let lines = [
        distribution("response time", BLUE, &totals.response),
        distribution("service time", GREEN, &totals.service),
        distribution("server compute", ORANGE, &totals.server),
        distribution("control", GRAY, &report.details.control),
    ];
    let frame = Frame {
        height: 420,
        x_title: "share of requests that were faster",
        x_end: nines(totals.response.len()).max(1.0),
        x_labels: nines(totals.response.len()) as usize + 1,
        x_label: &percentile,
        limits: &limits(report),
    };
    plot(&frame, &lines)
}

fn timeline(report: &Report) -> Result<String, PlotError> {
    let at =
        |quantile| move |interval: &Interval| interval.response.value_at_quantile(quantile) as f64 * 1e-3;
    let used = |interval: &Interval| !interval.response.is_empty();
    let lines = [
        by_interval(report, "p50", BLUE, used, at(0.5)),
        by_interval(report, "p99", ORANGE, used, at(0.99)),
        by_interval(report, "max", RED, used, at(1.0)),
    ];
    plot(&time_frame(report, 300, &limits(report)), &lines)
}

fn control_timeline(report: &Report) -> Result<String, PlotError> {
    let recording = &report.details.recording;
    let control = control_by_interval(recording, &report.details.hiccups);
    let longest = control.iter().enumerate().filter(|(_, times)| !times.is_empty());
    let longest = longest.map(|(index, times)| (middle_s(report, index), times.max() as f64 * 1e-3));
    let lines = [
        Line { name: "longest oversleep of the control", color: GRAY, points: longest.collect() },
        by_interval(
            report,
            "longest stall of the generator",
            PURPLE,
            |i| i.stall > 0,
            |i| i.stall as f64 * 1e-3,
        ),
    ];
    plot(&time_frame(report, 220, &[]), &lines)
}

fn time_frame<'a>(report: &Report, height: u32, limits: &'a [(String, f64)]) -> Frame<'a> {
    let x_label = &tick;
    Frame {
        height,
        x_title: "seconds of the measured part",
        x_end: report.duration_s,
        x_label,
        x_labels: 11,
        limits,
    }
}

fn by_interval(
    report: &Report,
    name: &'static str,
    color: plotters::style::RGBColor,
    used: impl Fn(&Interval) -> bool,
    value: impl Fn(&Interval) -> f64,
) -> Line {
    let intervals = report.details.recording.intervals.iter().enumerate();
    let points = intervals.filter(|(_, i)| used(i)).map(|(index, i)| (middle_s(report, index), value(i)));
    Line { name, color, points: points.collect() }
}

fn middle_s(report: &Report, index: usize) -> f64 {
    ((index as f64 + 0.5) * report.details.recording.interval_ns as f64 * 1e-9).min(report.duration_s)
}

fn footer(report: &Report) -> String {
    let machine = &report.machine;
    format!(
        "<p class=\"small\">{}, {} cores, Linux {} · commit {} · a request that was lost, or never sent for a slow \
         server, counts with the time it had waited; a refused one has no response time · soak.hlog opens in \
         HdrHistogram log tools (nanoseconds)</p>",
        escape(&machine.cpu),
        machine.cores,
        escape(&machine.kernel),
        escape(&report.commit),
    )
}
