//! `wade eval`.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use wade_core::model::Model;
use wade_core::model::kernel::Isa;
use wade_learn::dataset::split;
use wade_learn::evaluate::contest::{Contest, Contestants, enter};
use wade_learn::evaluate::report::{About, Report, VehicleReport};
use wade_learn::evaluate::{held_out, paper};
use wade_learn::train::report::Record;
use wade_learn::train::{self, Config, Published, Sides, Source, Trained, Variant};

use super::train::{Data, Progress, Rule, Served};
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
    variants: Vec<Served>,
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
        let report = match self.split {
            Some(rule) => self.anew(rule)?,
            None => self.of_bundles()?,
        };
        emit(&if self.json { format!("{:#}\n", json!(report)) } else { text(&report) })?;
        if let Some(page) = page {
            page.finish(&report.page()?)?;
        }
        Ok(ExitCode::SUCCESS)
    }

    fn of_bundles(&self) -> Result<Report> {
        if self.data.config.is_some() {
            usage_error(
                "--config goes with --split: without it the settings are those of the training report",
            );
        }
        let record = Record::read(&self.trained).context("which states were held out is not known")?;
        let loaded = self.data.load(&record.config, &self.data.vehicles.library()?)?;
        let source = loaded.source(&record.config)?;
        let split = held_out::of(&record, &loaded.file, &source)?;
        let (mut models, library) = (BTreeMap::new(), self.data.vehicles.library()?);
        for name in loaded.bundles.keys() {
            let bundle = library.read(name)?;
            let Some((weights, domain)) = bundle.trained else { bail!("{name}: the bundle has no weights") };
            held_out::check_weights(&record, name, &weights)?;
            let model = Model::new(bundle.vehicle, bundle.version, domain, weights, Isa::available()[0]);
            models.insert(name.clone(), vec![model]);
        }
        let rule = if record.split.by_sample { Rule::Sample } else { Rule::Case };
        let by = rule.by(record.config.held_out_share, record.config.parts);
        let sides = Sides { split: &split, by };
        let mut contest = Contest::new();
        let of_paper = match record.variant == train::anchored::NAME {
            true => {
                let Config { seed, front_rear, held_out_share, parts, .. } = record.config.clone();
                let suited = Served::Paper.settings(self.data.is_analytic());
                Config { seed, front_rear, held_out_share, parts, ..suited }
            }
            false => record.config.clone(),
        };
        self.enter(&mut contest, &source, sides, &of_paper, &models)?;
        let mut settings = self.ablation_settings(&of_paper);
        settings.insert(record.variant.clone(), record.config);
        let about = About {
            data: loaded.file,
            splits: vec![split.name.clone()],
            by_sample: record.split.by_sample,
            settings,
            history: record.history,
        };
        Ok(Report::new(&contest, &source.vehicles, about, PROGRAM)?)
    }

    /// One training a part; the held-out states of all parts are pooled.
    fn anew(&self, rule: Rule) -> Result<Report> {
        let first = self.variants.first().copied().unwrap_or(Served::Anchored);
        let config = self.data.settings(first)?;
        let of_paper = self.data.settings(Served::Paper)?;
        let mut settings = self.ablation_settings(&of_paper);
        let loaded = self.data.load(&config, &self.data.vehicles.library()?)?;
        let source = loaded.source(&config)?;
        let by = rule.by(config.held_out_share, config.parts);
        let splits = split::split(&source.data, by, config.seed).with_context(|| loaded.file.name.clone())?;
        let mut contest = Contest::new();
        for split in &splits {
            let sides = Sides { split, by };
            let mut models: BTreeMap<String, Vec<Model>> = BTreeMap::new();
            for variant in &self.variants {
                let config = self.data.settings(*variant)?;
                eprintln!("training {variant:?}, held out: {}", split.name);
                let learnt = variant.train(&loaded, &source, (sides, 1), &config, None)?;
                settings.insert(learnt.record.variant, learnt.record.config);
                for (name, (weights, domain)) in learnt.weights {
                    let vehicle = source.vehicles[&name].clone();
                    let model = Model::new(vehicle, 0, domain, weights, Isa::available()[0]);
                    models.entry(name).or_default().push(model);
                }
            }
            self.enter(&mut contest, &source, sides, &of_paper, &models)?;
        }
        let splits = splits.iter().map(|split| split.name.clone()).collect();
        let about = About {
            data: loaded.file,
            splits,
            by_sample: rule == Rule::Sample,
            settings,
            history: Vec::new(),
        };
        Ok(Report::new(&contest, &source.vehicles, about, PROGRAM)?)
    }

    /// Settings of the ablations, by their names.
    fn ablation_settings(&self, of_paper: &Config) -> BTreeMap<String, Config> {
        let ablations = Variant::ABLATIONS.iter().filter(|_| self.ablations);
        ablations.map(|variant| (variant.name().to_owned(), of_paper.clone())).collect()
    }

    fn enter(
        &self,
        contest: &mut Contest,
        source: &Source,
        sides: Sides<'_>,
        of_paper: &Config,
        models: &BTreeMap<String, Vec<Model>>,
    ) -> Result<()> {
        let mut ablations = Vec::new();
        if self.ablations {
            for variant in Variant::ABLATIONS {
                ablations.push(learn(source, sides, variant, of_paper)?);
            }
        }
        let contestants = Contestants { models, ablations: &ablations };
        Ok(enter(contest, source, sides.split, &contestants)?)
    }
}

fn learn(source: &Source, sides: Sides<'_>, variant: Variant, config: &Config) -> Result<Trained<Published>> {
    eprintln!("training {}, held out: {}", variant.name(), sides.split.name);
    let progress = Progress::new(config.epochs)?;
    Ok(train::train(source, sides, variant, config, None, &|epoch| progress.epoch(epoch))?)
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
