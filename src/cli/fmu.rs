//! `wade fmu`.

use std::io::Cursor;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;
use wade_client::Address;
use wade_core::model::kernel::Isa;
use wade_fmu::{Fmu, LIBRARY};
use wade_learn::files::write_whole;

use super::{Vehicles, emit};

/// Write a functional mock-up unit (FMI 3.0 co-simulation) of a vehicle in water
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  A unit that answers by itself:
  wade fmu --vehicle husky --embedded
  One that asks the server on this machine:
  wade fmu --vehicle husky --connect shm:wade --out husky-shm.fmu")]
pub struct FmuCommand {
    /// Name of the vehicle
    #[arg(long)]
    vehicle: String,
    /// Carry the bundle: no server is needed
    #[arg(long, required_unless_present = "connect", conflicts_with = "connect")]
    embedded: bool,
    /// Ask this server: host:port, https://host:port, unix:PATH or shm:NAMESPACE
    #[arg(long, value_name = "ADDRESS")]
    connect: Option<Address>,
    /// Give the load of each surface too
    #[arg(long)]
    surfaces: bool,
    /// Where to write it [default: VEHICLE.fmu]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// The library that simulators load [default: libwade_fmu.so beside the program or in ../lib]
    #[arg(long, value_name = "FILE")]
    library: Option<PathBuf>,
    #[command(flatten)]
    vehicles: Vehicles,
}

impl FmuCommand {
    pub fn run(self) -> Result<ExitCode> {
        let library = match &self.library {
            Some(library) => library.clone(),
            None => found()?,
        };
        let bundles = self.vehicles.library()?;
        let bundle = bundles.read(&self.vehicle)?;
        let model = bundles.model(&self.vehicle, Isa::available()[0])?;
        let digest = bundles.digest(&self.vehicle)?;
        let out = self.out.clone().unwrap_or_else(|| format!("{}.fmu", self.vehicle).into());
        let mut unit = Cursor::new(Vec::new());
        let fmu = Fmu {
            bundle: &bundle,
            model: &model,
            digest: &digest,
            address: self.connect.as_ref(),
            surface_loads: self.surfaces,
        };
        wade_fmu::write(&fmu, &library, &mut unit)?;
        write_whole(&out, unit.get_ref()).with_context(|| out.display().to_string())?;
        let answers = match &self.connect {
            Some(address) => format!("asks {address}"),
            None => format!("carries version {} of {}", model.version(), self.vehicle),
        };
        emit(&format!("{}: {answers}\n", out.display()))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// The library as it was installed or built with this program.
fn found() -> Result<PathBuf> {
    let program = std::env::current_exe().context("finding this program")?;
    let folder = program.parent().unwrap_or(&program);
    let places = [folder.join(LIBRARY), folder.join("../lib").join(LIBRARY)];
    if let Some(place) = places.iter().find(|place| place.is_file()) {
        return Ok(place.clone());
    }
    bail!(
        "{LIBRARY} is neither beside {} nor in ../lib: build it (cargo build --release -p wade-fmu) and name it with --library",
        program.display()
    )
}
