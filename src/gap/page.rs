//! The report as one HTML page that needs no other file.

use std::fmt::Write;

use super::plot::{PlotError, trace};
use super::report::{Report, Verdict};
use crate::effects::Kind;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:960px;margin:24px auto;padding:0 10px;color:#1f2328}\
h1{font-size:22px;margin:0 0 4px}h2{font-size:17px;margin:28px 0 4px}p{margin:4px 0 8px}\
.verdict{padding:10px 14px;border-left:6px solid #1d5fb0;background:#eef4fb;margin:12px 0;font-size:17px}\
.nothing_missing{border-color:#2a8c4a;background:#eef8f0}.ambiguous{border-color:#d97a06;background:#fdf6ec}\
.no_candidate_fits{border-color:#b91c1c;background:#fdf0f0}.note{border-color:#d97a06;background:#fdf6ec;font-size:15px}\
.wide{overflow-x:auto}table{border-collapse:collapse;margin:8px 0}th,td{padding:4px 12px;border-bottom:1px solid #e3e6ea;\
text-align:right;white-space:nowrap}th{white-space:normal;vertical-align:bottom;font-weight:600}th:first-child,td:first-child{text-align:left;\
padding-left:0;white-space:normal}.text{text-align:left;white-space:normal}\
.bar{display:flex;height:26px;margin:8px 0;border-radius:4px;overflow:hidden}.bar div{color:#fff;font-size:13px;padding:3px 6px;white-space:nowrap;overflow:hidden}\
svg{max-width:100%;height:auto;display:block}.small{color:#57606a;font-size:13px}\
.key span{display:inline-block;width:18px;height:4px;vertical-align:middle;margin:0 6px 0 14px}";

/// The page.
pub(super) fn page(report: &Report) -> Result<String, PlotError> {
    let title = escape(&format!("wade gap: {}", report.vehicle));
    let verdict = verdict_name(report.verdict);
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <meta name=\"viewport\" content=\"width=device-width\"><style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n\
         <p class=\"small\">{} trials, {} samples; {} trials took no part in naming and fitting.</p>\n",
        report.trials,
        report.samples,
        report.gap.held_out_trials.len(),
    );
    if let Some(how) = &report.generated {
        let _ =
            write!(text, "<div class=\"verdict note\"><b>Generated, not measured.</b> {}</div>", escape(how));
    }
    let _ = writeln!(text, "<div class=\"verdict {verdict}\">{}</div>", escape(&report.summary));
    if let Some(experiment) = &report.separating_experiment {
        let _ = writeln!(
            text,
            "<div class=\"verdict note\"><b>To tell them apart:</b> {}</div>",
            escape(experiment)
        );
    }
    text.push_str(&shares(report));
    text.push_str(&effects(report));
    text.push_str(&held_out(report));
    text.push_str(&traces(report)?);
    text.push_str(&regions(report));
    text.push_str(&rejected(report));
    text.push_str(&excitation(report));
    text.push_str(&limits(report));
    Ok(text + "</body></html>\n")
}

fn verdict_name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NothingMissing => "nothing_missing",
        Verdict::Named => "named",
        Verdict::Ambiguous => "ambiguous",
        Verdict::NoCandidateFits => "no_candidate_fits",
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
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

/// A name for people.
fn plain(name: &str) -> String {
    name.replace('_', " ")
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

fn table(heads: &[&str], text_columns: &[usize], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut text = "<div class=\"wide\"><table><tr>".to_owned();
    let class = |column: usize| if text_columns.contains(&column) { " class=\"text\"" } else { "" };
    heads.iter().enumerate().for_each(|(i, head)| text += &format!("<th{}>{head}</th>", class(i)));
    text += "</tr>";
    for row in rows {
        text += "<tr>";
        for (column, cell) in row.iter().enumerate() {
            text += &format!("<td{}>{cell}</td>", class(column));
        }
        text += "</tr>";
    }
    text + "</table></div>\n"
}

fn shares(report: &Report) -> String {
    let mut bar = "<h2>What the gap is made of</h2><p>Shares of the squared gap, in averages over a tenth of a second, \
                   each component against its noise.</p><div class=\"bar\">"
        .to_owned();
    for (name, color) in [("noise", "#6b7280"), ("explained", "#1d5fb0"), ("unexplained", "#b91c1c")] {
        let share = report.gap.shares.get(name).copied().unwrap_or(0.0);
        if share > 0.002 {
            let _ = write!(
                bar,
                "<div style=\"width:{:.2}%;background:{color}\" title=\"{name} {}\">{name} {}</div>",
                100.0 * share,
                percent(share),
                percent(share)
            );
        }
    }
    bar += "</div>\n";
    if let Some(left) = &report.gap.unexplained {
        let _ = writeln!(bar, "<p>Left without a name: {}.</p>", escape(left));
    }
    bar
}

fn effects(report: &Report) -> String {
    if report.effects.is_empty() {
        return String::new();
    }
    let rows = report.effects.iter().flat_map(|effect| {
        effect.parameters.iter().map(move |(name, parameter)| {
            let kind = match effect.kind {
                Kind::Physics => "water",
                Kind::Sensor => "sensor",
                Kind::Drive => "drive",
            };
            let unit = if parameter.unit == "1" { "" } else { parameter.unit };
            let [low, high] = parameter.interval;
            let band = parameter
                .literature
                .map_or(String::new(), |band| against(band, parameter.value, [low, high]));
            vec![
                format!("{}{}", plain(effect.name), if effect.provisional { " (provisional)" } else { "" }),
                kind.into(),
                plain(name),
                format!("{} {unit}", number(parameter.value)),
                format!("{} to {}", number(low), number(high)),
                band,
                percent(effect.share_of_gap),
                percent(effect.placebo[1] / effect.placebo[0].max(f64::MIN_POSITIVE)),
            ]
        })
    });
    let heads = [
        "effect",
        "fault of",
        "parameter",
        "value",
        "90 % interval",
        "published",
        "share of gap",
        "best placebo",
    ];
    let mut text = format!(
        "<h2>Named effects</h2>{}<p class=\"small\">Share of gap: what comes back when the effect alone is left out. Best \
         placebo: the most that the same effect, shifted in time within each trial, explains of what the real one does. \
         Provisional: seen in one condition only.</p>\n",
        table(&heads, &[5], rows)
    );
    if !report.alternatives.is_empty() {
        let sets: Vec<String> = report.alternatives.iter().map(|set| plain(&set.join(" and "))).collect();
        let _ = writeln!(text, "<p>Explains as much: {}.</p>", escape(&sets.join("; ")));
    }
    for effect in report.effects.iter().filter(|effect| !effect.surfaces.is_empty()) {
        let surfaces: Vec<String> = effect
            .surfaces
            .iter()
            .map(|(name, share)| format!("{} {}", escape(name), percent(*share)))
            .collect();
        let _ = writeln!(
            text,
            "<p class=\"small\">{} is carried by: {}.</p>",
            plain(effect.name),
            surfaces.join(", ")
        );
    }
    text
}

/// A published band as a bar, with the estimate and its interval over it.
fn against(band: [f64; 2], value: f64, interval: [f64; 2]) -> String {
    const WIDTH: f64 = 120.0;
    let all = [band[0], band[1], interval[0], interval[1]];
    let (low, high) = all.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
    let at = |v: f64| 4.0 + (WIDTH - 8.0) * (v - low) / (high - low).max(f64::MIN_POSITIVE);
    let [a, b, c, d] = all.map(at);
    let color = if (band[0]..=band[1]).contains(&value) { "#1d5fb0" } else { "#b91c1c" };
    format!(
        "<svg width=\"{WIDTH}\" height=\"14\" style=\"display:inline-block;vertical-align:middle\"><rect x=\"{a:.1}\" y=\"3\" \
         width=\"{:.1}\" height=\"8\" fill=\"#d9dbdf\"/><path d=\"M{c:.1} 7H{d:.1}\" stroke=\"{color}\" stroke-width=\"2\"/>\
         <circle cx=\"{:.1}\" cy=\"7\" r=\"3.5\" fill=\"{color}\"/></svg> {} to {}{}",
        b - a,
        at(value),
        number(band[0]),
        number(band[1]),
        if (band[0]..=band[1]).contains(&value) { "" } else { " (outside)" }
    )
}

fn held_out(report: &Report) -> String {
    let rows = report.gap.held_out.iter().map(|(name, closure)| {
        let unit = match *name {
            "all" => "noise floors",
            name if name.starts_with('f') => "N",
            _ => "N m",
        };
        vec![
            format!("{name} [{unit}]"),
            number(closure.before),
            number(closure.after),
            number(closure.noise_floor),
            closure.closure.map_or("–".into(), percent),
            closure.interval.map_or("–".into(), |[a, b]| format!("{} to {}", percent(a), percent(b))),
        ]
    });
    let heads = ["component", "before", "after", "noise floor", "closure", "90 % interval"];
    let mut text = format!(
        "<h2>Before and after, on trials that took no part</h2>{}<p class=\"small\">Root mean square over samples. Closure: \
         (before - after) / (before - noise floor). Kept back: {}.</p>\n",
        table(&heads, &[], rows),
        escape(&report.gap.held_out_trials.join(", ")),
    );
    for worse in &report.gap.worse_regions {
        let _ = writeln!(
            text,
            "<div class=\"verdict note\">Worse where {}: {} before, {} after, in noise floors.</div>",
            escape(&worse.place),
            number(worse.before),
            number(worse.after)
        );
    }
    text
}

fn traces(report: &Report) -> Result<String, PlotError> {
    let mut text = "<h2>The trials with the largest gap</h2><p class=\"key small\"><span style=\"background:#b91c1c\"></span>\
                    gap <span style=\"background:#1d5fb0\"></span>gap with the named effects <span \
                    style=\"background:#d9dbdf;height:12px\"></span>two standard deviations of noise</p>\n"
        .to_owned();
    for one in &report.traces {
        let held = report.gap.held_out_trials.contains(&one.trial);
        let part = if held { "took no part in naming" } else { "took part in naming" };
        let _ = writeln!(
            text,
            "<p>{} ({part})</p>{}",
            escape(&one.trial),
            trace(one, !report.effects.is_empty())?
        );
    }
    Ok(text)
}

fn regions(report: &Report) -> String {
    if report.regions.is_empty() {
        return String::new();
    }
    let rows = report.regions.iter().map(|region| {
        vec![
            escape(&region.place),
            percent(region.share_of_gap),
            percent(region.share_of_samples),
            region.trials.to_string(),
            number(region.contrast),
            number(region.p_value),
        ]
    });
    let heads = ["where", "share of gap", "share of samples", "trials", "times the gap elsewhere", "p"];
    format!(
        "<h2>Where the gap is</h2>{}<p class=\"small\">Found on one half of the trials, estimated on the other; {} splits were \
         tried.</p>\n",
        table(&heads, &[], rows),
        report.regions_tried
    )
}

fn rejected(report: &Report) -> String {
    let shown = report.rejected.iter().filter(|r| r.share_alone > 0.01).take(10);
    let rows = shown.map(|r| {
        let why = match r.why {
            Some(super::Refusal::NotSignificant) => "as likely chance beside the named",
            Some(super::Refusal::OutOfBounds) => "physically impossible value",
            Some(super::Refusal::Irrelevant) => "too small to matter",
            Some(super::Refusal::SmallShare) => "explains too little of what is left",
            Some(super::Refusal::Unstable) => "not in most parts, or of changing sign",
            Some(super::Refusal::NotNew) => "says the same as the named",
            Some(super::Refusal::SharedNoise) => {
                "agrees from sample to sample alone, as noise of the motion does"
            }
            Some(super::Refusal::Placebo) => "no better than its placebos",
            None => "passes, but another set explains more",
        };
        vec![plain(r.name), percent(r.share_alone), percent(r.share_of_gap), why.into()]
    });
    let rows: Vec<Vec<String>> = rows.collect();
    if rows.is_empty() {
        return String::new();
    }
    let heads = ["effect", "explains alone", "beside the named", "why not"];
    format!("<h2>Rivals</h2>{}", table(&heads, &[3], rows.into_iter()))
}

fn excitation(report: &Report) -> String {
    let rows = report.excitation.iter().map(|e| {
        let smallest: Vec<String> = e
            .minimum_detectable
            .iter()
            .map(|(name, d)| {
                let unit = if d.unit == "1" { String::new() } else { format!(" {}", d.unit) };
                format!("{} {}{unit}", plain(name), number(d.value))
            })
            .collect();
        vec![
            plain(e.name),
            e.trials.to_string(),
            smallest.join(", "),
            e.not_testable.clone().unwrap_or_default(),
        ]
    });
    let heads = ["effect", "trials that excite it", "smallest that would have shown", "not testable because"];
    format!("<h2>What these trials can show</h2>{}", table(&heads, &[2, 3], rows))
}

fn limits(report: &Report) -> String {
    let range = |(name, [low, high]): (&&str, &[f64; 2])| {
        let (quantity, unit) = name.rsplit_once('_').unwrap_or((name, ""));
        let unit = unit.replace('p', "/").replace('2', "²").replace('3', "³");
        format!("{} {} to {} {unit}", plain(quantity), number(*low), number(*high))
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

impl Report {
    /// The page for people.
    pub fn page(&self) -> Result<String, PlotError> {
        page(self)
    }
}
