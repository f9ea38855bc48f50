//! `wade train`.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use wade_core::bundle::{self, Bundle, Library};
use wade_core::digest::sha256_of;
use wade_core::domain::Domain;
use wade_core::model::Weights;
use wade_learn::dataset::split::{self, By};
use wade_learn::dataset::{self, Dataset};
use wade_learn::files::StagedFile;
use wade_learn::train::checkpoint::Checkpoint;
use wade_learn::train::fit::Epoch;
use wade_learn::train::report::{DataFile, Record, VehicleRecord};
use wade_learn::train::{self, Config, Sides, Source, Trained, TrainedVehicle, Variant, anchored};

use super::running::Running;
use super::{PROGRAM, Vehicles, check_report_folder, usage_error};

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
    variant: Served,
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

/// What can be learnt and served.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Served {
    /// Exact hydrostatics, a simple drag, and a learned dimensionless remainder
    Anchored,
    /// The paper's network as published
    Paper,
}

/// What a training comes to: weights for each vehicle, and its record without that of the data.
pub struct Learnt {
    /// Weights and domain by vehicle.
    pub weights: BTreeMap<String, (Weights, Domain)>,
    /// The record of it.
    pub record: Record,
}

impl Served {
    /// Trains it.
    pub fn train(
        self,
        loaded: &Loaded,
        source: &Source,
        (sides, part): (Sides<'_>, usize),
        config: &Config,
        checkpoint: Option<&Checkpoint>,
    ) -> Result<Learnt> {
        let progress = Progress::new(config.epochs)?;
        let epoch = |epoch: &Epoch| progress.epoch(epoch);
        let label = loaded.file.label();
        Ok(match self {
            Self::Paper => {
                let trained = train::train(source, sides, Variant::Paper, config, checkpoint, &epoch)?;
                let contact = loaded.data.meta.ground_contact;
                let weights = |of_vehicle: &_| trained.weights(of_vehicle, contact, label.clone());
                loaded.learnt(&trained, weights, source, (sides, part), config)
            }
            Self::Anchored => {
                let trained = anchored::train(source, sides, config, checkpoint, &epoch)?;
                let weights = |of_vehicle: &_| trained.weights(of_vehicle, label.clone());
                loaded.learnt(&trained, weights, source, (sides, part), config)
            }
        })
    }

    /// The settings that suit it.
    pub fn settings(self, analytic: bool) -> Config {
        match self {
            Self::Anchored => Config::anchored(),
            Self::Paper if analytic => Config::analytic(),
            Self::Paper => Config::default(),
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

impl Rule {
    /// With a share for those that have one, and a number of parts for the others.
    pub fn by(self, share: f64, parts: usize) -> By {
        match self {
            Self::Case => By::Case { share },
            Self::Sample => By::Sample { share },
            Self::Folds => By::Folds { count: parts },
            Self::Depth => By::Depth { bins: parts },
            Self::Heading => By::Heading { bins: parts },
            Self::Vehicle => By::Vehicle,
        }
    }
}

/// A data set with all that a training needs besides.
pub struct Loaded {
    /// What it is.
    pub file: DataFile,
    /// The bundles of its vehicles, by name, without the weights in place.
    pub bundles: BTreeMap<String, Bundle>,
    /// Its samples.
    pub data: Dataset,
    /// Ranges that the states were drawn from, where that is known.
    pub domains: BTreeMap<String, Domain>,
}

impl Data {
    /// True where loads by formula are learnt from.
    pub fn is_analytic(&self) -> bool {
        self.data == Path::new("analytic")
    }

    /// The settings that suit the data and what is learnt, and over them those of the file.
    pub fn settings(&self, variant: Served) -> Result<Config> {
        let suited = variant.settings(self.is_analytic());
        let Some(path) = &self.config else { return Ok(suited) };
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        // as a whole first: its errors know their lines
        let _: Config = toml::from_str(&text).with_context(|| path.display().to_string())?;
        let mut whole = toml::Table::try_from(&suited)?;
        lay_over(&mut whole, toml::from_str(&text)?);
        whole.try_into().with_context(|| path.display().to_string())
    }

    /// Reads or generates the data set, and reads the bundles of its vehicles but for their weights.
    pub fn load(&self, config: &Config, library: &Library) -> Result<Loaded> {
        config.validate()?;
        if self.is_analytic() { self.generate(config, library) } else { self.read(library) }
    }

    fn generate(&self, config: &Config, library: &Library) -> Result<Loaded> {
        let tables = &config.analytic.tables;
        let (known, unknown): (Vec<_>, Vec<_>) =
            library.names()?.into_iter().partition(|name| tables.contains_key(name));
        unknown
            .iter()
            .for_each(|name| eprintln!("{name}: left as it is, there is no parameter table for it"));
        let bundles = bundles(library, known.iter())?;
        let vehicles = bundles.iter().map(|(name, bundle)| (name.clone(), bundle.vehicle.clone())).collect();
        let data = train::analytic::dataset(&vehicles, &config.analytic, config.seed)?;
        let provenance = data.meta.provenance.clone();
        let domains = known.iter().map(|name| (name.clone(), tables[name].domain())).collect();
        let file = DataFile { name: "analytic".to_owned(), sha256: None, provenance };
        Ok(Loaded { file, bundles, data, domains })
    }

    fn read(&self, library: &Library) -> Result<Loaded> {
        let data = dataset::read(&self.data)?;
        let sha256 = Some(sha256_of(&self.data).with_context(|| self.data.display().to_string())?);
        // its folder is of this machine alone
        let name = self.data.file_name().unwrap_or(self.data.as_os_str());
        let (name, provenance) = (name.to_string_lossy().into_owned(), data.meta.provenance.clone());
        let bundles = bundles(library, data.meta.vehicles.keys())?;
        let file = DataFile { name, sha256, provenance };
        Ok(Loaded { file, bundles, data, domains: BTreeMap::new() })
    }
}

fn bundles<'a>(
    library: &Library,
    names: impl Iterator<Item = &'a String>,
) -> Result<BTreeMap<String, Bundle>> {
    names.map(|name| Ok((name.clone(), library.read_without_weights(name)?))).collect()
}

/// Lays what a table states over another, key by key.
fn lay_over(under: &mut toml::Table, over: toml::Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(toml::Value::Table(under)), toml::Value::Table(over)) => lay_over(under, over),
            (_, value) => {
                under.insert(key, value);
            }
        }
    }
}

impl Loaded {
    /// The samples with their mirror images.
    pub fn source(&self, config: &Config) -> Result<Source> {
        let vehicles =
            self.bundles.iter().map(|(name, bundle)| (name.clone(), bundle.vehicle.clone())).collect();
        let source = Source::new(self.data.clone(), &vehicles, config.front_rear);
        source.with_context(|| self.file.name.clone())
    }

    /// Weights of each vehicle with the ranges that their states were drawn from, and the record.
    fn learnt<L>(
        &self,
        trained: &Trained<L>,
        weights: impl Fn(&TrainedVehicle) -> Weights,
        source: &Source,
        (sides, part): (Sides<'_>, usize),
        config: &Config,
    ) -> Learnt {
        let of = |of_vehicle: &TrainedVehicle| {
            let domain = self.domains.get(&of_vehicle.name).copied().unwrap_or(of_vehicle.domain);
            (of_vehicle.name.clone(), (weights(of_vehicle), domain))
        };
        Learnt {
            weights: trained.vehicles.iter().map(of).collect(),
            record: Record::new(trained, source, sides, part, self.file.clone(), (config, PROGRAM)),
        }
    }
}

impl Train {
    /// Writes the next version of each bundle and the report.
    pub fn run(self) -> Result<ExitCode> {
        let mut config = self.data.settings(self.variant)?;
        config.epochs = self.epochs.unwrap_or(config.epochs);
        config.seed = self.seed.unwrap_or(config.seed);
        let library = self.data.vehicles.library_to_write()?;
        let loaded = self.data.load(&config, &library)?;
        let source = loaded.source(&config)?;
        let by = self.split.by(config.held_out_share, config.parts);
        let splits = split::split(&source.data, by, config.seed).with_context(|| loaded.file.name.clone())?;
        let Some(split) = self.part.checked_sub(1).and_then(|index| splits.get(index)) else {
            usage_error(&format!("--part must be 1 to {}: the split has no other part", splits.len()));
        };
        // a long training is not to end in a folder that cannot be written
        check_report_folder(&self.out)?;
        std::fs::create_dir_all(&self.out).with_context(|| self.out.display().to_string())?;
        let names: Vec<&str> = loaded.bundles.keys().map(String::as_str).collect();
        for (place, name) in library.targets(&names)?.iter().zip(names) {
            bundle::check_place(place, name)?;
        }
        if let Some(path) = &self.checkpoint {
            StagedFile::new(path).with_context(|| path.display().to_string())?;
        }
        let sides = Sides { split, by };
        eprintln!("held out: {}; {} training samples", split.name, split.training.len());
        let checkpoint =
            self.checkpoint.as_ref().map(|path| Checkpoint { path: path.clone(), resume: self.resume });
        let learnt =
            self.variant.train(&loaded, &source, (sides, self.part), &config, checkpoint.as_ref())?;
        let record = &learnt.record;
        let mut next = Vec::with_capacity(record.vehicles.len());
        for of_vehicle in &record.vehicles {
            let name = &of_vehicle.name;
            let (Some(bundle), Some(weights)) = (loaded.bundles.get(name), learnt.weights.get(name)) else {
                bail!("{name}: there is no bundle of it");
            };
            // effects close the gap of the weights that they were fitted to
            if bundle.effects.is_some() {
                eprintln!("{name}: its effects are taken out with its former weights; run wade gap again");
            }
            let bundle = Bundle { trained: Some(weights.clone()), effects: None, ..bundle.clone() };
            next.push(bundle);
        }
        let placed = library.succeed_together(next)?;
        for (of_vehicle, (place, version)) in record.vehicles.iter().zip(placed) {
            report(of_vehicle, record.judged(), version);
            println!("  written to {}", place.display());
            self.running.reload(&of_vehicle.name, &place);
        }
        // the last of all: who finds it finds the weights that it is about
        record.write(&self.out)?;
        if let Some(checkpoint) = &checkpoint {
            checkpoint.remove().with_context(|| checkpoint.path.display().to_string())?;
        }
        let time = record.epoch_s.map_or_else(String::new, |s| format!(", {s:.3} s each"));
        println!("{} epochs{time}; weights of epoch {}", record.history.len(), record.kept_epoch);
        println!("{}", self.out.join("index.html").display());
        Ok(ExitCode::SUCCESS)
    }
}

/// A bar on a terminal, a line now and then elsewhere.
pub struct Progress {
    bar: ProgressBar,
    begun: Instant,
    spoken: Cell<Duration>,
    first: Cell<Option<u32>>,
    epochs: u32,
}

/// Seconds between two lines where there is no terminal.
const LINE_S: u64 = 30;

impl Progress {
    /// Begins to count.
    pub fn new(epochs: u32) -> Result<Self> {
        let bar = ProgressBar::new(epochs.into());
        bar.set_style(ProgressStyle::with_template("{wide_bar} {pos}/{len} epochs, {eta} left, {msg}")?);
        let (begun, spoken) = (Instant::now(), Cell::new(Duration::ZERO));
        Ok(Self { bar, begun, spoken, first: Cell::new(None), epochs })
    }

    /// Takes note of an epoch.
    pub fn epoch(&self, epoch: &Epoch) {
        let text = said(epoch);
        // a run that goes on from a checkpoint has not spent the time of the epochs before
        let first = self.first.get().unwrap_or_else(|| {
            self.bar.set_position(u64::from(epoch.number - 1));
            self.bar.reset_eta();
            epoch.number
        });
        self.first.set(Some(first));
        self.bar.set_position(epoch.number.into());
        let elapsed = self.begun.elapsed();
        if !std::io::stderr().is_terminal() && elapsed - self.spoken.get() >= Duration::from_secs(LINE_S) {
            self.spoken.set(elapsed);
            let each = elapsed.as_secs_f64() / f64::from(epoch.number - first + 1);
            eprintln!("{}", line(epoch, self.epochs, each));
        }
        self.bar.set_message(text);
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
