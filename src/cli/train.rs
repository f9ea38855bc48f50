//! `wade train`.

use std::cell::RefCell;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use wade_learn::train::checkpoint::Checkpoint;
use wade_learn::train::fit::Epoch;
use wade_learn::train::report::VehicleRecord;
use wade_learn::workflow::{DataSource, Event, ModelKind, SplitRule, Training, WorkflowError, Written};

use super::running::Running;
use super::{PROGRAM, Vehicles, usage_error};

/// Train one network for the vehicles of a data set and write it into their bundles
///
/// Splits the data set, adds mirror images, and standardizes by the training side. Writes the weights into the bundles as
/// their next version, with the origin of the loads, and keeps the version before (wade vehicle rollback). "analytic"
/// stands for hydrostatics, form drag and skin friction by formula over the paper's parameter table, generated here.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade train --data cfd.parquet
  wade train --data cfd.parquet --checkpoint training.ckpt
  wade train --data cfd.parquet --checkpoint training.ckpt --resume
  wade train --data cfd.parquet --vehicles copy --split depth --part 5
  wade train --data analytic --variant paper --vehicles copy

Settings that a file (--config) leaves out:
  seed = 1
  epochs = 150
  batch = 16
  held_out_batch = 64
  learning_rate = 1e-3
  patience = 5                 # epochs without a better validation loss after
                               # which the learning rate is halved
  least_learning_rate = 1e-6   # ends training before the last epoch
  keep = \"last\"                # or \"best\" by the validation loss
  front_rear = false           # also mirror a hull that is not symmetric
  held_out_share = 0.2         # by case and by sample
  validation_share = 0.1       # of what is not held out; --variant paper alone
  parts = 5                    # folds, depths, headings
  threads = 2
  weight_decay = 0.01
  [loss]
  alpha = 0.5
  epsilon = 0.01
  net_weight = 0.1
  dry_weight = 0.5
  [anchored]
  between = 40                 # interpolated states a case for distillation
  outside = 8                  # the same on lines through two cases and beyond
  [anchored.loss]
  net_weight = 10.0
  moment_weight = 1.0          # of each surface's moment
  net_moment_weight = 10.0
  delta = 0.1                  # error up to which the loss is a square
  exponent = 0.5               # 0: errors in newtons, 1: in shares of the load
  floor = 0.01
--variant paper takes epochs = 1000, patience = 20, least_learning_rate = 0 and
weight_decay = 0; with --data analytic epochs = 2000, patience = 60 and
least_learning_rate = 1e-6.")]
pub struct Train {
    #[command(flatten)]
    data: Data,
    /// Kind of model; `anchored` is what the shipped vehicles have
    #[arg(long, value_enum, default_value = "anchored")]
    variant: Kind,
    /// Epochs at most
    #[arg(long)]
    epochs: Option<u32>,
    /// Seed
    #[arg(long)]
    seed: Option<u64>,
    /// What is held out
    #[arg(long, value_enum, default_value = "case")]
    split: Rule,
    /// Which part is held out, from 1, where a split has several: by folds, depth, heading and vehicle
    #[arg(long, value_name = "N", default_value_t = 1)]
    part: usize,
    /// Folder for report.json and index.html
    #[arg(long, value_name = "DIR", default_value = "training")]
    out: PathBuf,
    /// Writes the state of the training there every ten epochs, and removes it at the end
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Goes on from the checkpoint, with the bits of a run that was never stopped
    #[arg(long, requires = "checkpoint")]
    resume: bool,
    #[command(flatten)]
    running: Running,
}

/// The training data, for commands that train.
#[derive(Debug, Args)]
pub struct Data {
    /// Data set, or "analytic" for loads by formula
    #[arg(long, value_name = "FILE")]
    pub data: PathBuf,
    /// Settings of the training, TOML
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    #[command(flatten)]
    pub vehicles: Vehicles,
}

impl Data {
    /// Where the loads come from.
    pub fn source(&self) -> DataSource {
        if self.data == Path::new("analytic") {
            DataSource::Analytic
        } else {
            DataSource::File(self.data.clone())
        }
    }
}

/// A kind of model that can be trained and served.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// Exact hydrostatics, a simple drag, and a learned dimensionless remainder
    Anchored,
    /// The paper's network as published
    Paper,
}

impl From<Kind> for ModelKind {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Anchored => Self::Anchored,
            Kind::Paper => Self::Paper,
        }
    }
}

/// What is held out.
#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
pub enum Rule {
    /// A share of the cases of each vehicle
    Case,
    /// A share of the samples, as the paper seems to: sections and images of one case are then on both sides
    Sample,
    /// Groups of cases, each in turn
    Folds,
    /// Parts of the range of depths, each in turn
    Depth,
    /// Parts of the range of flow angles, each in turn
    Heading,
    /// Each vehicle in turn
    Vehicle,
}

impl From<Rule> for SplitRule {
    fn from(rule: Rule) -> Self {
        match rule {
            Rule::Case => Self::Case,
            Rule::Sample => Self::Sample,
            Rule::Folds => Self::Folds,
            Rule::Depth => Self::Depth,
            Rule::Heading => Self::Heading,
            Rule::Vehicle => Self::Vehicle,
        }
    }
}

impl Train {
    /// Writes the next version of each bundle and the report.
    pub fn run(self) -> Result<ExitCode> {
        let (data, kind) = (self.data.source(), ModelKind::from(self.variant));
        let mut config = data.settings(kind, self.data.config.as_deref())?;
        config.epochs = self.epochs.unwrap_or(config.epochs);
        config.seed = self.seed.unwrap_or(config.seed);
        let library = self.data.vehicles.library_to_write()?;
        let training = Training {
            data: &data,
            kind,
            config: &config,
            split: self.split.into(),
            part: self.part,
            out: &self.out,
            checkpoint: self.checkpoint.map(|path| Checkpoint { path, resume: self.resume }),
            program: PROGRAM,
        };
        let progress = Progress::default();
        let Written { record, bundles } =
            training.run(&library, &|event| progress.hear(event)).map_err(|error| match error {
                WorkflowError::Part { parts, .. } => {
                    usage_error(&format!("--part must be 1 to {parts}: the split has no other part"))
                }
                error => error,
            })?;
        for (of_vehicle, (place, version)) in record.vehicles.iter().zip(bundles) {
            report(of_vehicle, record.judged(), version);
            println!("  written to {}", place.display());
            self.running.reload(&of_vehicle.name, &place);
        }
        let time = record.epoch_s.map_or_else(String::new, |s| format!(", {s:.3} s each"));
        println!("{} epochs{time}; weights of epoch {}", record.history.len(), record.kept_epoch);
        println!("{}", self.out.join("index.html").display());
        Ok(ExitCode::SUCCESS)
    }
}

/// Shows what a training says: a bar on a terminal, a line now and then elsewhere.
#[derive(Default)]
pub struct Progress(RefCell<Option<Epochs>>);

impl Progress {
    /// Shows an event.
    pub fn hear(&self, event: Event<'_>) {
        match event {
            Event::NoTable { vehicle } => {
                eprintln!("{vehicle}: left as it is, there is no parameter table for it");
            }
            Event::Begins { model, held_out, samples, epochs } => {
                eprintln!("training {model}, held out: {held_out}; {samples} training samples");
                *self.0.borrow_mut() = Some(Epochs::new(epochs));
            }
            Event::Epoch(epoch) => {
                if let Some(epochs) = self.0.borrow_mut().as_mut() {
                    epochs.show(epoch);
                }
            }
            Event::EffectsRemoved { vehicle } => {
                eprintln!("{vehicle}: its effects are taken out with its former weights; run wade gap again");
            }
        }
    }
}

/// The epochs of one training.
struct Epochs {
    bar: ProgressBar,
    begun: Instant,
    spoken: Duration,
    first: Option<u32>,
    epochs: u32,
}

/// Seconds between two lines where there is no terminal.
const LINE_S: u64 = 30;

impl Epochs {
    fn new(epochs: u32) -> Self {
        let bar = ProgressBar::new(epochs.into());
        if let Ok(style) = ProgressStyle::with_template("{wide_bar} {pos}/{len} epochs, {eta} left, {msg}") {
            bar.set_style(style);
        }
        Self { bar, begun: Instant::now(), spoken: Duration::ZERO, first: None, epochs }
    }

    fn show(&mut self, epoch: &Epoch) {
        // a run that goes on from a checkpoint has not spent the time of the epochs before
        let first = *self.first.get_or_insert_with(|| {
            self.bar.set_position(u64::from(epoch.number - 1));
            self.bar.reset_eta();
            epoch.number
        });
        self.bar.set_position(epoch.number.into());
        let elapsed = self.begun.elapsed();
        if !std::io::stderr().is_terminal() && elapsed - self.spoken >= Duration::from_secs(LINE_S) {
            self.spoken = elapsed;
            let each = elapsed.as_secs_f64() / f64::from(epoch.number - first + 1);
            eprintln!("{}", line(epoch, self.epochs, each));
        }
        self.bar.set_message(said(epoch));
    }
}

fn said(epoch: &Epoch) -> String {
    let Epoch { training_loss, validation_loss, learning_rate, .. } = epoch;
    format!("loss {training_loss:.3e}, validation {validation_loss:.3e}, learning rate {learning_rate:.1e}")
}

/// The line of an epoch, one of which takes so many seconds.
fn line(epoch: &Epoch, epochs: u32, each: f64) -> String {
    let left = each * f64::from(epochs - epoch.number);
    format!("epoch {} of {epochs}, {left:.0} s left at most, {}", epoch.number, said(epoch))
}

fn report(trained: &VehicleRecord, judged: &str, version: u32) {
    let score = &trained.score;
    println!("{}, version {version}: {} held-out {judged}", trained.name, score.samples);
    if score.samples == 0 {
        println!("  none is held out");
        return;
    }
    for (c, axis) in ["Fx", "Fy", "Fz"].into_iter().enumerate() {
        let (mae, rms, spread) = (score.mae[c], score.rms[c], score.spread[c]);
        println!("  {axis}: MAE {mae:.2} N, RMSE {rms:.2} N, spread of the target {spread:.1} N");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_tells_the_losses_the_rate_and_the_time_left() {
        let epoch = Epoch { number: 30, training_loss: 0.0123, validation_loss: 0.0456, learning_rate: 5e-4 };
        let expected =
            "epoch 30 of 100, 105 s left at most, loss 1.230e-2, validation 4.560e-2, learning rate 5.0e-4";
        assert_eq!(line(&epoch, 100, 1.5), expected);
    }
}
