//! `wade train`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use wade::analytic;
use wade::bundle::{self, Bundle};
use wade::condition::GroundContact;
use wade::model::Weights;
use wade::train::{self, Config, TrainedVehicle};

use super::{Vehicles, bundle_names};

/// Train one network for the vehicles of a folder and write it into their bundles
///
/// The analytic loads are hydrostatics, form drag and skin friction by formula: weights learnt from them are labelled
/// "analytic" wherever they answer.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  wade train --data analytic --vehicles vehicles")]
pub struct Train {
    /// What to learn from
    #[arg(long, value_enum)]
    data: Data,
    #[command(flatten)]
    vehicles: Vehicles,
    /// Settings of the training, TOML
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Epochs at most
    #[arg(long)]
    epochs: Option<u32>,
    /// Seed
    #[arg(long)]
    seed: Option<u64>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Data {
    /// Loads by formula over the paper's parameter table
    Analytic,
}

impl Train {
    /// Writes the next version of each bundle.
    pub fn run(self) -> Result<ExitCode> {
        let Data::Analytic = self.data;
        let mut config: Config = match &self.config {
            Some(path) => {
                let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
                toml::from_str(&text).with_context(|| path.display().to_string())?
            }
            None => Config::default(),
        };
        for (vehicle, table) in Config::default().tables {
            config.tables.entry(vehicle).or_insert(table);
        }
        config.epochs = self.epochs.unwrap_or(config.epochs);
        config.seed = self.seed.unwrap_or(config.seed);
        let directory = self.vehicles.directory();
        let (known, unknown): (Vec<_>, Vec<_>) =
            bundle_names(&directory)?.into_iter().partition(|name| config.tables.contains_key(name));
        unknown
            .iter()
            .for_each(|name| eprintln!("{name}: left as it is, there is no parameter table for it"));
        let paths: Vec<_> = known.iter().map(|name| directory.join(name)).collect();
        let mut bundles: Vec<Bundle> =
            paths.iter().map(|path| bundle::read(path)).collect::<Result<_, _>>()?;
        let vehicles: Vec<_> = bundles.iter().map(|bundle| bundle.vehicle.clone()).collect();

        let bar = ProgressBar::new(config.epochs.into());
        bar.set_style(ProgressStyle::with_template("{wide_bar} {pos}/{len} epochs, {eta} left, {msg}")?);
        let trained = train::train(&vehicles, &config, &|epoch| {
            bar.set_position(epoch.number.into());
            let (loss, rate) = (epoch.held_out_loss, epoch.learning_rate);
            bar.set_message(format!("held-out loss {loss:.3e}, learning rate {rate:.1e}"));
        })?;
        bar.finish_and_clear();

        for ((bundle, path), of_vehicle) in bundles.iter_mut().zip(&paths).zip(&trained.vehicles) {
            let weights = Weights {
                network: trained.network.clone(),
                scaling: trained.scaling.clone(),
                provenance: analytic::PROVENANCE.into(),
                ground_contact: GroundContact::Wetted,
                held_out_rms: of_vehicle.held_out_rms,
            };
            bundle.trained = Some((weights, of_vehicle.domain));
            bundle.version += 1;
            bundle::write(path, bundle)?;
            report(of_vehicle, bundle.version);
        }
        println!("{} epochs", trained.history.len());
        Ok(ExitCode::SUCCESS)
    }
}

fn report(trained: &TrainedVehicle, version: u32) {
    let score = &trained.score;
    println!("{}, version {version}: {} held-out states", trained.name, score.samples);
    for (c, axis) in ["Fx", "Fy", "Fz"].into_iter().enumerate() {
        let (mae, rms, spread) = (score.mae[c], score.rms[c], score.spread[c]);
        println!("  {axis}: MAE {mae:.2} N, RMSE {rms:.2} N, spread of the target {spread:.1} N");
    }
}
