//! `wade predict`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;
use wade::forces::Forces;
use wade::model::Model;
use wade::service::Evaluator;
use wade::states::{Row, unknown_columns};

use super::Vehicles;

/// Forces for every row of a table of states
///
/// Columns: vx vy vz and depth; optionally wx wy wz, roll pitch, ax ay az, alx aly alz, rho, in SI units and radians.
/// Adds fx fy fz mx my mz about the center of mass and in_domain (1 or 0); other columns are kept.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  wade predict --vehicle warthog --states in.csv --out out.csv --per-surface")]
pub struct Predict {
    /// Name of the vehicle
    #[arg(long)]
    vehicle: String,
    /// Table of states
    #[arg(long, value_name = "CSV")]
    states: PathBuf,
    /// Table of states with forces
    #[arg(long, value_name = "CSV")]
    out: PathBuf,
    /// Adds the forces of each surface
    #[arg(long)]
    per_surface: bool,
    #[command(flatten)]
    vehicles: Vehicles,
}

const NET: [&str; 6] = ["fx", "fy", "fz", "mx", "my", "mz"];

impl Predict {
    /// Writes the table beside its place and renames it, so that a failure leaves no half of it.
    pub fn run(self) -> Result<ExitCode> {
        let model = self.vehicles.model(&self.vehicle)?;
        let states = self.states.display();
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_path(&self.states)
            .with_context(|| states.to_string())?;
        let headers = reader.headers().with_context(|| states.to_string())?.clone();
        check_columns(&headers).with_context(|| states.to_string())?;
        let staged = self.out.with_extension("partial");
        let mut writer = csv::Writer::from_path(&staged).with_context(|| staged.display().to_string())?;
        writer.write_record(headers.iter().map(str::to_owned).chain(self.names(&model)))?;
        let mut evaluator = Evaluator::default();
        for (row, record) in reader.records().enumerate() {
            let at = || format!("{states}, row {}", row + 2);
            let record = record.with_context(at)?;
            let state = Row::read(&record, &headers).with_context(at)?.state();
            let evaluated = evaluator.evaluate(&model, &state).with_context(at)?;
            let added = self.values(evaluated.forces);
            writer.write_record(record.iter().map(str::to_owned).chain(added))?;
        }
        writer.flush()?;
        std::fs::rename(&staged, &self.out).with_context(|| self.out.display().to_string())?;
        Ok(ExitCode::SUCCESS)
    }

    fn names(&self, model: &Model) -> Vec<String> {
        let net = NET.into_iter().chain(["in_domain"]).map(str::to_owned);
        let surfaces = model.vehicle().surfaces.iter().filter(|_| self.per_surface);
        net.chain(surfaces.flat_map(|s| ["fx", "fy", "fz"].map(|axis| format!("{}_{axis}", s.name))))
            .collect()
    }

    fn values(&self, forces: &Forces) -> Vec<String> {
        let wrench = forces.wrench.force.iter().chain(forces.wrench.moment.iter()).map(f64::to_string);
        let in_domain = u8::from(forces.outside.is_inside()).to_string();
        let surfaces = forces.surfaces.iter().filter(|_| self.per_surface);
        wrench
            .chain([in_domain])
            .chain(surfaces.flat_map(|load| load.force.iter().map(f64::to_string)))
            .collect()
    }
}

/// Refuses a table without a state or with forces already, and names the columns that nobody reads.
fn check_columns(headers: &csv::StringRecord) -> Result<()> {
    let has = |name: &str| headers.iter().any(|header| header.trim() == name);
    if let Some(missing) = ["vx", "vy", "vz", "depth"].into_iter().find(|name| !has(name)) {
        bail!("column {missing} is missing; there are: {}", headers.iter().collect::<Vec<_>>().join(", "));
    }
    if let Some(taken) = NET.into_iter().find(|name| has(name)) {
        bail!("column {taken} is there already: forces are what this adds");
    }
    unknown_columns(headers).iter().for_each(|column| eprintln!("column {column} is kept and not used"));
    Ok(())
}
