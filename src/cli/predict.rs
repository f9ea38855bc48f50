//! `wade predict`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;
use wade::forces::Forces;
use wade::model::Model;
use wade::service::Evaluator;
use wade::service::wire::State;

use super::Vehicles;
use super::state::gravity;

/// Forces for every row of a table of states
///
/// Columns: vx vy vz and depth; optionally wx wy wz, roll pitch, ax ay az, alx aly alz, rho, in SI units and radians.
/// Adds fx fy fz mx my mz about the centre of mass and in_domain (1 or 0); other columns are kept.
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
        let mut reader = csv::Reader::from_path(&self.states).with_context(|| states.to_string())?;
        let headers = reader.headers().with_context(|| states.to_string())?.clone();
        let columns = Columns::find(&headers).with_context(|| states.to_string())?;
        let staged = self.out.with_extension("partial");
        let mut writer = csv::Writer::from_path(&staged).with_context(|| staged.display().to_string())?;
        writer.write_record(headers.iter().map(str::to_owned).chain(self.names(&model)))?;
        let mut evaluator = Evaluator::default();
        for (row, record) in reader.records().enumerate() {
            let at = || format!("{states}, row {}", row + 2);
            let record = record.with_context(at)?;
            let state = columns.state(&record).with_context(at)?;
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

/// Where the columns are.
struct Columns {
    velocity: [Option<usize>; 3],
    angular_velocity: [Option<usize>; 3],
    acceleration: [Option<usize>; 3],
    angular_acceleration: [Option<usize>; 3],
    roll: Option<usize>,
    pitch: Option<usize>,
    depth: Option<usize>,
    density: Option<usize>,
}

impl Columns {
    fn find(headers: &csv::StringRecord) -> Result<Self> {
        let find = |name: &str| headers.iter().position(|header| header.trim() == name);
        if let Some(missing) = ["vx", "vy", "vz", "depth"].into_iter().find(|name| find(name).is_none()) {
            bail!(
                "column {missing} is missing; there are: {}",
                headers.iter().collect::<Vec<_>>().join(", ")
            );
        }
        if let Some(taken) = NET.into_iter().find(|name| find(name).is_some()) {
            bail!("column {taken} is there already: forces are what this adds");
        }
        Ok(Self {
            velocity: ["vx", "vy", "vz"].map(find),
            angular_velocity: ["wx", "wy", "wz"].map(find),
            acceleration: ["ax", "ay", "az"].map(find),
            angular_acceleration: ["alx", "aly", "alz"].map(find),
            roll: find("roll"),
            pitch: find("pitch"),
            depth: find("depth"),
            density: find("rho"),
        })
    }

    fn state(&self, record: &csv::StringRecord) -> Result<State> {
        let number = |column: Option<usize>, default: f64| {
            let Some(text) = column.and_then(|column| record.get(column)) else { return Ok(default) };
            text.trim()
                .parse::<f64>()
                .with_context(|| format!("\"{text}\" in column {}", column.unwrap_or(0) + 1))
        };
        let vector = |columns: [Option<usize>; 3]| {
            let [x, y, z] = columns.map(|column| number(column, 0.0));
            Ok::<_, anyhow::Error>([x? as f32, y? as f32, z? as f32])
        };
        let default = State::default();
        Ok(State {
            velocity: vector(self.velocity)?,
            angular_velocity: vector(self.angular_velocity)?,
            acceleration: vector(self.acceleration)?,
            angular_acceleration: vector(self.angular_acceleration)?,
            gravity: gravity(number(self.roll, 0.0)?, number(self.pitch, 0.0)?),
            depth: number(self.depth, 0.0)? as f32,
            density: number(self.density, f64::from(default.density))? as f32,
            ..default
        })
    }
}
