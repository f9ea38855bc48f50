//! The record of a training as one HTML page that needs no other file.

use std::fmt::Write;

use super::fit::Epoch;
use super::report::Record;
use crate::page::plot::{Series, curves};
use crate::page::{PlotError, document, escape};

/// The page.
pub(super) fn page(record: &Record) -> Result<String, PlotError> {
    let title = format!("wade train: {} on {}", record.variant, record.data.name);
    let body = format!(
        "{}{}<h2>Loss and learning rate</h2>{}<h2>Held-out cases</h2><p class=\"small\">{}</p>\
         <h2>Settings</h2><pre>{}</pre><p class=\"small\">{}</p>",
        summary(record),
        table(record),
        losses(&record.history)?,
        escape(&record.split.held_out_cases.iter().cloned().collect::<Vec<_>>().join(", ")),
        escape(&toml::to_string(&record.config).unwrap_or_default()),
        escape(&record.program),
    );
    Ok(document(&title, &body))
}

/// Loss and learning rate, epoch by epoch.
pub(crate) fn losses(history: &[Epoch]) -> Result<String, PlotError> {
    let curve = |name: &str, of: fn(&Epoch) -> f64| Series {
        name: name.to_owned(),
        points: history.iter().map(|epoch| (f64::from(epoch.number), of(epoch))).collect(),
    };
    let losses = [curve("training", |e| e.training_loss), curve("validation", |e| e.validation_loss)];
    let rate = [curve("learning rate", |e| e.learning_rate)];
    Ok(curves("epoch", "loss", &losses)? + &curves("epoch", "learning rate", &rate)?)
}

fn summary(record: &Record) -> String {
    let split = &record.split;
    let time = record.epoch_s.map_or_else(String::new, |s| format!(", {s:.2} s an epoch"));
    let mut text = format!(
        "<p>Loads: {}. Held out: {}. {} training samples, {} held out. {} epochs{time}; weights of epoch {} kept.</p>\n",
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
            "<div class=\"verdict notice\">{leaks} cases are on both sides: this split tests interpolation within known runs only.</div>"
        );
    }
    text
}

fn table(record: &Record) -> String {
    let mut text =
        "<table><tr><th>held-out net force</th><th>number</th><th></th><th>MAE [N]</th><th>RMSE [N]</th>\
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
    text + "</table>\n" + &format!("<p class=\"small\">Errors of {}.</p>\n", record.judged())
}
