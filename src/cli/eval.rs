//! `wade eval`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::Args;
use serde_json::json;
use wade_learn::evaluate::baseline::KNOWN;
use wade_learn::evaluate::paper;
use wade_learn::evaluate::report::{ModelReport, Report, VehicleReport};
use wade_learn::train::report::Record;
use wade_learn::workflow::{Evaluation, Event, ModelKind};

use super::train::{Data, Kind, Progress, Rule};
use super::{PROGRAM, begin_page, emit, usage_error};

/// Judge the weights of the bundles by the states that their training held out
///
/// The model is asked as it is served, with the ground contact of the data set. Beside it stand three simple models that
/// are fitted to the same training states, and the paper's figures, which are of other data. States that the weights were
/// trained on are refused: the report of the training says which these are.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade eval --data cfd.parquet --trained training --html eval.html
  wade eval --data cfd.parquet --trained training --ablations --html eval.html
  Train one model for each depth held out; this leaves the bundles alone:
  wade eval --data cfd.parquet --split depth --json")]
pub struct Eval {
    #[command(flatten)]
    data: Data,
    /// Folder of the report that wade train wrote
    #[arg(long, value_name = "DIR", default_value = "training")]
    trained: PathBuf,
    /// Train for each held-out part in turn, with the settings of --config, instead of judging the bundles
    #[arg(long, value_enum, conflicts_with = "trained")]
    split: Option<Rule>,
    /// Kinds of model to train; the first is the one under evaluation
    #[arg(long, value_enum, value_delimiter = ',', default_value = "anchored", requires = "split")]
    variants: Vec<Kind>,
    /// Trains the paper's three ablations on the same split, with the settings of the paper's network
    #[arg(long)]
    ablations: bool,
    /// Write a page with tables and plots
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Eval {
    /// Prints the tables and writes the page.
    pub fn run(self) -> Result<ExitCode> {
        let record = Record::path(&self.trained);
        let page = begin_page(self.html.as_deref(), [&self.data.data, &record])?;
        let report = self.report()?;
        emit(&if self.json { format!("{:#}\n", json!(report)) } else { text(&report) })?;
        if let Some(page) = page {
            page.finish(&report.page()?)?;
        }
        Ok(ExitCode::SUCCESS)
    }

    fn report(&self) -> Result<Report> {
        if self.split.is_none() && self.data.config.is_some() {
            usage_error(
                "--config goes with --split: without it the settings are those of the training report",
            );
        }
        let (data, library) = (self.data.source(), self.data.vehicles.library()?);
        let settings = self.data.config.as_deref();
        let evaluation = Evaluation { data: &data, settings, ablations: self.ablations, program: PROGRAM };
        let progress = Progress::default();
        let hear = |event: Event<'_>| progress.hear(event);
        Ok(match self.split {
            Some(rule) => {
                let kinds: Vec<ModelKind> = self.variants.iter().map(|kind| (*kind).into()).collect();
                evaluation.by_split(rule.into(), &kinds, &library, &hear)?
            }
            None => evaluation.of_bundles(&self.trained, &library, &hear)?,
        })
    }
}

fn text(report: &Report) -> String {
    let mut text =
        format!("loads: {}\nheld out: {}\n", report.about.data.label(), report.about.splits.join("; "));
    if report.about.by_sample {
        text.push_str(
            "sections and images of one case are on both sides: this tests interpolation within known runs\n",
        );
    }
    report.vehicles.iter().for_each(|vehicle| text.push_str(&vehicle_text(vehicle)));
    text
}

/// Errors of a model by set and kind of motion, in shares of the dynamic load.
fn regimes_text(model: &ModelReport) -> String {
    let percent = |x: f64| format!("{:7.0}", 100.0 * x);
    let mut text = format!(
        "  {:30}{:>7}{:>12}{:>10}{:>24}\n",
        format!("{} [%]", model.name),
        "cases",
        "horizontal",
        "vertical",
        "moment x y z"
    );
    for regime in &model.regimes {
        let horizontal = regime.horizontal.map_or_else(|| "-".to_owned(), |x| format!("{:.1}", 100.0 * x));
        let moment = regime.moment.map_or_else(String::new, |moment| moment.map(percent).concat());
        text.push_str(&format!(
            "    {:28}{:>7}{horizontal:>12}   {}   {moment}\n",
            regime.name,
            regime.cases,
            percent(regime.vertical)
        ));
    }
    text
}

fn vehicle_text(vehicle: &VehicleReport) -> String {
    let three = |values: [f64; 3]| values.map(|x| format!("{x:9.2}")).concat();
    let mut text =
        format!("\n{}: {} held-out cases, {} states\n", vehicle.name, vehicle.cases, vehicle.samples);
    text.push_str(&format!(
        "{:32}{:>27}{:>27}{:>27}\n",
        "net force, x y z", "MAE [N]", "RMSE [N]", "sMAPE [%]"
    ));
    let mut line = |name: &str, mae, rmse, smape| {
        text.push_str(&format!("  {name:30}{}{}{}\n", three(mae), three(rmse), three(smape)));
    };
    for model in &vehicle.models {
        line(&model.name, model.force.mae, model.force.rmse, model.force.smape);
    }
    if let Some(theirs) = vehicle.paper {
        line(&format!("({})", paper::LABEL), theirs.mae, theirs.rmse, theirs.smape);
    }
    if let Some(moment) = vehicle.mean_moment_nm {
        for model in &vehicle.models {
            if let Some(mae) = model.moment_mae_nm {
                text.push_str(&format!("  {:30}{}   MAE of the net moment [N m]\n", model.name, three(mae)));
            }
        }
        text.push_str(&format!("  {:30}{}   mean magnitude [N m]\n", "the net moment itself", three(moment)));
    }
    // those of the other models are in the report
    let known = vehicle.models.iter().skip(1).filter(|model| model.name == KNOWN);
    for model in vehicle.models.iter().take(1).chain(known) {
        text.push_str(&regimes_text(model));
    }
    for kind in &vehicle.kinds {
        let (mae, share) = (three(kind.mae_n), 100.0 * kind.share);
        text.push_str(&format!(
            "  {:30}{mae}   MAE on a surface [N]; {share:.1} % of the force\n",
            kind.name
        ));
    }
    for slice in &vehicle.slices {
        let (name, mae) = (format!("{} ({:.3})", slice.name, slice.bound), three(slice.mae_n));
        text.push_str(&format!("  {name:30}{mae}   MAE [N] of {} states\n", slice.samples));
    }
    if let Some(calibration) = &vehicle.calibration {
        let [one, two] =
            [calibration.within_one, calibration.within_two].map(|s| three(s.map(|x| 100.0 * x)));
        text.push_str(&format!("  {:30}{one}{two}\n", "means within 1 and 2 deviations [%]"));
    }
    text
}
