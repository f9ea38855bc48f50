//! The report as one HTML page that needs no other file.

use std::fmt::Write;

use super::carriers::in_shares;
use super::holdout::Closure;
use super::judge::Refusal;
use super::noise::FloorSource;
use super::report::{NamedEffect, Report, Trace, Verdict};
use wade_core::effects::{Kind, RegionLimit, RegionQuantity};
use wade_learn::page::plot::{BLUE, GRAY, RED, Series, scatter, traces};
use wade_learn::page::{PlotError, document, escape, table};

/// No column is the source paper's.
const NO_PAPER: usize = usize::MAX;

impl Report {
    /// The page for people.
    pub fn page(&self) -> Result<String, PlotError> {
        // the answer first, then what it rests on
        let class = match self.verdict {
            Verdict::NothingMissing => "pass",
            Verdict::Named => "",
            Verdict::Ambiguous => "notice",
            Verdict::NoCandidateFits => "fail",
        };
        let mut body = verdict(class, &format!("<b>{}</b>", escape(&self.summary)));
        if let Some(experiment) = &self.separating_experiment {
            body += &verdict("notice", &format!("<b>To separate them:</b> {}.", escape(&plain(experiment))));
        }
        if let Some(step) = &self.next_step {
            body += &verdict("notice", &format!("<b>Next:</b> {}.", escape(&plain(step))));
        }
        let _ = writeln!(
            body,
            "<p class=\"small\">{} trials, {} samples; {} trials are held out from naming and fitting.</p>",
            self.trials,
            self.samples,
            self.gap.held_out_trials.len(),
        );
        if let Some(how) = &self.generated {
            body += &verdict(
                "notice",
                &format!("<b>Generated, not measured.</b> These trials are {}", escape(how)),
            );
        }
        body += &shares(self);
        body += &explanations(self);
        body += &effects(self);
        body += &held_out(self);
        body += &drawn(self)?;
        body += &trends(self)?;
        body += &sizes(self);
        body += &regions(self);
        body += &rivals(self);
        body += &excitation(self);
        body += &limits(self);
        Ok(document(&format!("wade gap: {}", self.vehicle), &body))
    }
}

fn verdict(class: &str, html: &str) -> String {
    format!("<div class=\"verdict {class}\">{html}</div>\n")
}

/// A cell that is text: to the left, in several lines where it is long.
fn prose(text: &str) -> String {
    format!("<div class=\"text\">{}</div>", escape(text))
}

/// Three significant digits.
fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "–".into() };
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// A value with its unit, where it has one.
fn with_unit(value: f64, unit: &str) -> String {
    if unit == "1" { number(value) } else { format!("{} {}", number(value), escape(unit)) }
}

/// A name for people.
fn plain(name: &str) -> String {
    name.replace('_', " ")
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

fn interval([low, high]: [f64; 2], show: impl Fn(f64) -> String) -> String {
    format!("{} to {}", show(low), show(high))
}

/// A component of the wrench with its unit.
fn component(name: &str) -> String {
    match name {
        "all" => "all [noise floors]".into(),
        name if name.starts_with('f') => format!("{name} [N]"),
        name => format!("{name} [N m]"),
    }
}

fn shares(report: &Report) -> String {
    let (mut bar, mut legend) = (String::new(), String::new());
    for (name, color) in [("noise", GRAY), ("explained", BLUE), ("unexplained", RED)] {
        let share = report.gap.shares.get(name).copied().unwrap_or(0.0);
        let color = format!("background:rgb({},{},{})", color.0, color.1, color.2);
        let _ = write!(bar, "<div style=\"width:{:.2}%;{color}\"></div>", 100.0 * share);
        let _ = write!(legend, "<span><i style=\"{color}\"></i>{name} {}</span>", percent(share));
    }
    let mut text = format!(
        "<h2>What the gap is made of</h2><div class=\"bar\">{bar}</div><p class=\"legend\">{legend}</p>\
         <p class=\"small\">Shares of the squared gap, in averages over {} s, each component against its \
         noise.</p>\n",
        number(report.bin_s)
    );
    if let Some(left) = &report.gap.unexplained {
        let _ = writeln!(text, "<p>Left without a name: {}.</p>", escape(left));
    }
    text
}

fn explanations(report: &Report) -> String {
    let rows = report.explanations.iter().map(|e| vec![prose(&e.in_words()), probability(e.probability)]);
    let heads = [prose("explanation"), "probability".to_owned()];
    format!(
        "<h2>Explanations</h2>{}<p class=\"small\">By how well each predicts parts of the trials that its fit left out, over a \
         Bayesian bootstrap of the trials. A name also has to pass every check below.</p>\n",
        table(&[&heads[0], &heads[1]], NO_PAPER, rows)
    )
}

/// A probability with two digits, or a bound where these would be 0.00 or 1.00.
pub(super) fn probability(probability: f64) -> String {
    match probability {
        p if p < 0.005 => "below 0.01".to_owned(),
        p if p > 0.995 => "above 0.99".to_owned(),
        p => format!("{p:.2}"),
    }
}

fn effects(report: &Report) -> String {
    if report.effects.is_empty() {
        return String::new();
    }
    let rows = report.effects.iter().flat_map(parameters);
    let published = prose("published");
    let heads = ["effect", "fault of", "parameter", "value", "90 % interval", &published, "share of gap"];
    let mut text = format!(
        "<h2>Named effects</h2>{}<p class=\"small\">Share of gap: increase of the gap if this effect alone is removed. \
         Provisional: observed in one condition only. Published: range of the literature in gray, the estimate with its \
         interval over it.</p>\n",
        table(&heads, NO_PAPER, rows)
    );
    if !report.alternatives.is_empty() {
        let sets: Vec<String> = report.alternatives.iter().map(|set| plain(&set.join(" and "))).collect();
        let _ = writeln!(text, "<p>Explains as much: {}.</p>", escape(&sets.join("; ")));
    }
    for effect in report.effects.iter().filter(|effect| effect.surfaces.keys().any(|name| name != "hull")) {
        let surfaces = escape(&in_shares(&effect.surfaces));
        let _ = writeln!(text, "<p class=\"small\">{}, by surface: {surfaces}.</p>", plain(effect.name));
    }
    text
}

/// A row for each parameter of an effect.
fn parameters(effect: &NamedEffect) -> impl Iterator<Item = Vec<String>> + '_ {
    let kind = match effect.kind {
        Kind::Physics => "water",
        Kind::Sensor => "sensor",
        Kind::Drive => "drive",
    };
    let name = format!("{}{}", plain(effect.name), if effect.provisional { " (provisional)" } else { "" });
    let borders = borders(effect, &name, kind);
    let parameters = effect.parameters.iter().map(move |(parameter, p)| {
        let band = p.literature.map(|band| against(band, p.value, p.interval));
        vec![
            name.clone(),
            kind.into(),
            plain(parameter),
            with_unit(p.value, p.unit),
            interval(p.interval, number),
            format!("<div class=\"text\">{}</div>", band.unwrap_or_else(|| "no band".into())),
            percent(effect.share_of_gap),
        ]
    });
    parameters.chain(borders)
}

/// A row for each border of the region in which an effect acts.
fn borders(effect: &NamedEffect, name: &str, kind: &str) -> Vec<Vec<String>> {
    let row = |quantity: RegionQuantity, side: &str, [low, high]: [f64; 2]| {
        vec![
            name.to_owned(),
            kind.into(),
            prose(&plain(&format!("acts {side} this {}", quantity.name()))),
            with_unit(0.5 * (low + high), quantity.unit()),
            interval([low, high], number),
            prose("no band"),
            percent(effect.share_of_gap),
        ]
    };
    let of = |limit: &RegionLimit| {
        let above = limit.above.map(|border| row(limit.quantity, "above", border));
        above.into_iter().chain(limit.at_most.map(|border| row(limit.quantity, "up to", border)))
    };
    effect.region.limits.iter().flat_map(of).collect()
}

/// A published band as a bar, with the estimate and its interval over it.
fn against(band: [f64; 2], value: f64, around: [f64; 2]) -> String {
    const WIDTH: f64 = 120.0;
    let all = [band[0], band[1], around[0], around[1]];
    let (low, high) = all.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    let at = |v: f64| 4.0 + (WIDTH - 8.0) * (v - low) / (high - low).max(f64::MIN_POSITIVE);
    let [a, b, c, d] = all.map(at);
    let inside = (band[0]..=band[1]).contains(&value);
    let (color, outside) = if inside { (BLUE, "") } else { (RED, " (outside)") };
    let color = format!("rgb({},{},{})", color.0, color.1, color.2);
    format!(
        "<svg width=\"{WIDTH}\" height=\"14\" style=\"display:inline-block;vertical-align:middle\"><rect x=\"{a:.1}\" y=\"3\" \
         width=\"{:.1}\" height=\"8\" fill=\"#d0d4d9\"/><path d=\"M{c:.1} 7H{d:.1}\" stroke=\"{color}\" stroke-width=\"2\"/>\
         <circle cx=\"{:.1}\" cy=\"7\" r=\"3.5\" fill=\"{color}\"/></svg> {}{outside}",
        b - a,
        at(value),
        interval(band, number),
    )
}

/// Instead of a closure: no gap above the floor, or a gap whose share is not defined.
fn nothing(closure: &Closure) -> &'static str {
    if closure.before > closure.noise_floor { "–" } else { "no gap" }
}

fn held_out(report: &Report) -> String {
    let rows = report.gap.held_out.iter().map(|(name, closure)| {
        vec![
            component(name),
            number(closure.before),
            number(closure.after),
            number(closure.noise_floor),
            closure.closure.map_or_else(|| nothing(closure).into(), percent),
            closure.interval.map_or("–".into(), |around| interval(around, percent)),
        ]
    });
    let heads = ["component", "before", "after", "noise floor", "closure", "90 % interval"];
    let mut text = format!(
        "<h2>Before and after, on held-out trials</h2>{}<p class=\"small\">Root mean square over samples. Closure: \
         (before - after) / (before - noise floor). Held out: {}.</p>\n",
        table(&heads, NO_PAPER, rows),
        escape(&report.gap.held_out_trials.join(", ")),
    );
    for worse in &report.gap.worse_regions {
        text += &verdict("notice", &escape(&plain(&format!("Worse: {worse}."))));
    }
    text
}

fn drawn(report: &Report) -> Result<String, PlotError> {
    let mut text = format!(
        "<h2>Trials over time</h2><p class=\"small\">The trials with the largest gap, and the one whose gap is the median: what was \
         measured and predicted, and the difference, in averages over {} s. Gray: two standard deviations of the noise of a \
         point.</p>\n",
        number(report.bin_s)
    );
    for trace in &report.traces {
        let part = if trace.is_held { "held out" } else { "used for naming" };
        let kind = if trace.is_typical { "typical" } else { "among the largest gaps" };
        let figures = figures(trace, !report.effects.is_empty())?;
        let _ = writeln!(text, "<h3>{} ({part}, {kind})</h3>{figures}", escape(&trace.trial));
    }
    Ok(text)
}

/// A trial as it was measured and predicted, and its gap before and after.
fn figures(trace: &Trace, changed: bool) -> Result<String, PlotError> {
    let line = |name: &str, values: Vec<f64>| Series {
        name: name.to_owned(),
        points: trace.t.iter().copied().zip(values).collect(),
    };
    let less = |gap: &[f64]| trace.measured.iter().zip(gap).map(|(measured, gap)| measured - gap).collect();
    let mut overlaid = vec![line("measured", trace.measured.clone()), line("model", less(&trace.before))];
    let mut gaps = vec![line("gap of the model", trace.before.clone())];
    if changed {
        overlaid.push(line("with the named effects", less(&trace.after)));
        gaps.push(line("gap with the named effects", trace.after.clone()));
    }
    let of = component(trace.component);
    let overlaid = traces("time [s]", &of, 0.0, &overlaid)?;
    Ok(overlaid + &traces("time [s]", &format!("gap of {of}"), 2.0 * trace.noise, &gaps)?)
}

fn trends(report: &Report) -> Result<String, PlotError> {
    let Some(first) = report.trends.first() else { return Ok(String::new()) };
    let mut text = format!(
        "<h2>How the gap goes with the state</h2><p class=\"small\">Mean gap of {}, where it is largest beside noise, of all \
         trials.</p>\n<div class=\"row\">",
        escape(&component(first.component))
    );
    for trend in &report.trends {
        let line = |name: &str, values: &[f64]| Series {
            name: name.to_owned(),
            points: trend.at.iter().copied().zip(values.iter().copied()).collect(),
        };
        let mut series = vec![line("gap of the model", &trend.before)];
        if !report.effects.is_empty() {
            series.push(line("with the named effects", &trend.after));
        }
        let x_title = format!("{} [{}]", trend.quantity, trend.unit);
        text += &scatter(&x_title, &format!("gap of {}", component(trend.component)), &series)?;
    }
    Ok(text + "</div>\n")
}

fn sizes(report: &Report) -> String {
    let rows = report.gap.size.iter().map(|(name, size)| {
        let floor = report.gap.floors.get(name);
        let of = |value: Option<f64>| value.map_or("–".into(), number);
        let source = floor.map_or("", |floor| match floor.source {
            FloorSource::Repeats => "trials that repeat each other",
            FloorSource::HighFrequency => "changes from sample to sample",
            FloorSource::Stated => "stated in trials.toml",
        });
        vec![
            component(name),
            number(size.rms),
            interval(size.interval, number),
            number(size.expected_at_most),
            of(floor.map(|floor| floor.sample)),
            of(floor.map(|floor| floor.offset)),
            of(floor.map(|floor| floor.model)),
            prose(source),
        ]
    });
    let source = prose("noise known from");
    let heads = [
        "component",
        "gap",
        "90 % interval",
        "expected at most",
        "noise of a sample",
        "zero from trial to trial",
        "predicted std. dev. of the model",
        &source,
    ];
    format!(
        "<h2>Gap and noise, all trials</h2>{}<p class=\"small\">Gap: root mean square, with its interval by a bootstrap over \
         trials. Expected at most: noise and model error with nothing missing, in 19 of 20 cases. The others are standard \
         deviations.</p>\n",
        table(&heads, NO_PAPER, rows)
    )
}

fn regions(report: &Report) -> String {
    if report.regions.is_empty() {
        return String::new();
    }
    let rows = report.regions.iter().map(|region| {
        vec![
            prose(&plain(&region.place)),
            percent(region.share_of_gap),
            percent(region.share_of_samples),
            region.trials.to_string(),
            number(region.contrast),
            region.p_value.map_or_else(|| "–".into(), number),
            prose(&plain(&in_shares(&region.surfaces))),
        ]
    });
    let heads = ["where", "share of gap", "share of samples", "trials", "times the gap elsewhere", "p", "on"];
    format!(
        "<h2>Where the gap is</h2>{}<p class=\"small\">Found on one half of the trials, estimated on the other; without a p \
         fitted to all of them. {} splits were tried. On: the surfaces that carry what is named there; where nothing is, those that \
         meet the flow, or that the water lifts.</p>\n",
        table(&heads, NO_PAPER, rows),
        report.regions_tried
    )
}

fn rivals(report: &Report) -> String {
    let shown = report.rejected.iter().filter(|rival| rival.share_alone > 0.01).take(10);
    let rows: Vec<Vec<String>> = shown
        .map(|rival| {
            let why = rival.why.map_or("passes, but another set explains more", refusal);
            vec![plain(rival.name), percent(rival.share_alone), percent(rival.share_of_gap), prose(why)]
        })
        .collect();
    if rows.is_empty() {
        return String::new();
    }
    let why = prose("why not");
    let heads = ["effect", "explains alone", "in addition to the named", &why];
    format!("<h2>Rejected alternatives</h2>{}", table(&heads, NO_PAPER, rows))
}

pub(super) fn refusal(why: Refusal) -> &'static str {
    match why {
        Refusal::NotSignificant => "not significant in addition to the named effects",
        Refusal::OutOfBounds => "physically impossible value",
        Refusal::Irrelevant => "smaller than the noise of a sample",
        Refusal::SmallShare => "explains too little of the remaining gap",
        Refusal::Unstable => "absent in most folds, or its sign changes",
        Refusal::NotNew => "collinear with the named effects",
        Refusal::SharedNoise => "correlates only from sample to sample, as noise of the motion does",
        Refusal::Incomplete => "passes, but all passing effects together explain too little",
    }
}

fn excitation(report: &Report) -> String {
    let rows = report.excitation.iter().map(|e| {
        let smallest = e.minimum_detectable.iter();
        let smallest: Vec<String> =
            smallest.map(|(name, d)| format!("{} {}", plain(name), with_unit(d.value, d.unit))).collect();
        let why = e.not_testable.as_deref().unwrap_or_default();
        vec![plain(e.name), e.trials.to_string(), prose(&smallest.join(", ")), prose(why)]
    });
    let (smallest, why) = (prose("smallest that would have shown"), prose("not testable because"));
    let heads = ["effect", "trials that excite it", &smallest, &why];
    format!("<h2>What these trials can show</h2>{}", table(&heads, NO_PAPER, rows))
}

fn limits(report: &Report) -> String {
    let range = |(name, around): (&&str, &[f64; 2])| {
        let (quantity, unit) = match *name {
            "depth_m" => ("depth", "m"),
            "speed_mps" => ("speed", "m/s"),
            "acceleration_mps2" => ("acceleration", "m/s²"),
            "angular_speed_radps" => ("angular speed", "rad/s"),
            "density_kgpm3" => ("density", "kg/m³"),
            other => (other, ""),
        };
        format!("{quantity} {} {unit}", interval(*around, number))
    };
    let ranges: Vec<String> = report.validity.iter().map(range).collect();
    let mut text = format!("<h2>Limits</h2><p>Seen within: {}.</p>", escape(&ranges.join(", ")));
    for remark in &report.remarks {
        let _ = write!(text, "<p class=\"small\">{}</p>", escape(remark));
    }
    let sources = &report.sources;
    let _ = writeln!(
        text,
        "<p class=\"small\">trials {} · model {} · {}</p>",
        escape(&sources.trials),
        escape(&sources.model),
        escape(&sources.tool)
    );
    text
}
