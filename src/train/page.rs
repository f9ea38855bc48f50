//! The record of a training as one HTML page that needs no other file.

use std::fmt::Write;

use super::plot::{PlotError, Series, curves, escape};
use super::report::Record;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1240px;margin:24px auto;padding:0 10px;color:#1f2328}\
h1{font-size:22px;margin:0 0 4px}h2{font-size:18px;margin:32px 0 4px}h3{font-size:15px;margin:18px 0 2px}\
.wide{overflow-x:auto}table{border-collapse:collapse;margin:6px 0}\
th,td{padding:3px 11px;border-bottom:1px solid #e3e6ea;text-align:right;white-space:nowrap}\
th:first-child,td:first-child{text-align:left;padding-left:0}td.paper,th.paper{color:#8a5a00;background:#fdf9f1}\
figure{display:inline-block;margin:0 6px 6px 0}.legend span{margin-right:16px}\
.legend i{display:inline-block;width:9px;height:9px;border-radius:5px;margin-right:5px}\
.notice{padding:10px 14px;border-left:6px solid #d97a06;background:#fdf6ec;margin:12px 0}\
.small{color:#57606a;font-size:13px}svg{max-width:100%;height:auto;display:block}pre{font-size:13px;overflow-x:auto}";

/// The look of this page, and of that of an evaluation.
pub(crate) fn style() -> &'static str {
    STYLE
}

/// The page.
pub(super) fn page(record: &Record) -> Result<String, PlotError> {
    let title = format!("wade train: {} on {}", record.variant, record.data.name);
    let title = escape(&title);
    let curve = |name: &str, of: fn(&super::fit::Epoch) -> f64| Series {
        name: name.to_owned(),
        points: record.history.iter().map(|epoch| (f64::from(epoch.number), of(epoch))).collect(),
    };
    let losses = [curve("training", |e| e.training_loss), curve("held out", |e| e.held_out_loss)];
    let rate = [curve("learning rate", |e| e.learning_rate)];
    Ok(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <meta name=\"viewport\" content=\"width=device-width\"><style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n\
         {}{}<h2>Loss</h2>{}<h2>Learning rate</h2>{}<h2>Held-out cases</h2><p class=\"small\">{}</p>\
         <h2>Settings</h2><pre>{}</pre><p class=\"small\">{}</p></body></html>\n",
        summary(record),
        table(record),
        curves("epoch", "loss", &losses)?,
        curves("epoch", "learning rate", &rate)?,
        escape(&record.split.held_out_cases.iter().cloned().collect::<Vec<_>>().join(", ")),
        escape(&toml::to_string(&record.config).unwrap_or_default()),
        escape(&record.program),
    ))
}

fn summary(record: &Record) -> String {
    let split = &record.split;
    let time = record.epoch_s.map_or_else(String::new, |s| format!(", {s:.2} s an epoch"));
    let mut text = format!(
        "<p>Loads: {}. Held out: {}. {} samples to learn from, {} held out. {} epochs{time}; weights of epoch {} kept.</p>\n",
        escape(&record.data.label()),
        escape(&split.name),
        split.training_samples,
        split.held_out_samples,
        record.history.len(),
        record.kept_epoch,
    );
    let leaks = split.training_cases.intersection(&split.held_out_cases).count();
    if leaks > 0 {
        let _ = writeln!(
            text,
            "<div class=\"notice\">{leaks} cases are on both sides: this split tests interpolation within known runs only.</div>"
        );
    }
    text
}

fn table(record: &Record) -> String {
    let mut text =
        "<table><tr><th>held-out net force</th><th>samples</th><th></th><th>MAE [N]</th><th>RMSE [N]</th>\
                    <th>spread of the target [N]</th></tr>"
            .to_owned();
    for vehicle in record.vehicles.iter().filter(|vehicle| vehicle.score.samples > 0) {
        for (c, axis) in ["Fx", "Fy", "Fz"].into_iter().enumerate() {
            let score = &vehicle.score;
            let (mae, rms, spread) = (score.mae[c], score.rms[c], score.spread[c]);
            let (name, samples) = (escape(&vehicle.name), score.samples);
            let _ = writeln!(
                text,
                "<tr><td>{name}</td><td>{samples}</td><td>{axis}</td><td>{mae:.3}</td><td>{rms:.3}</td><td>{spread:.1}</td></tr>"
            );
        }
    }
    text + "</table>\n"
}
