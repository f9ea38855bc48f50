//! Arguments in, one function a subcommand, exit codes out: 0 success, 1 what was asked for does not hold, 2 usage.

mod campaign;
mod dataset;
mod doctor;
mod eval;
mod fmu;
mod gap;
mod gap_bench;
mod import;
mod interrupt;
mod log;
mod log_limit;
mod outside;
mod predict;
mod progress;
mod query;
mod running;
mod serve;
mod shell;
mod soak;
mod soak_server;
mod stability;
mod state;
mod token;
mod train;
mod trust;
mod validate;
mod vehicle;

use std::io::Write;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::{Args, Parser, Subcommand};
use wade_core::bundle::{Bundle, Library};
use wade_core::model::Model;
use wade_core::model::kernel::Isa;
use wade_core::served::ServedVehicle;
use wade_learn::files::StagedFile;

/// This program, its version and commit, as reports name it.
const PROGRAM: &str = concat!("wade ", env!("CARGO_PKG_VERSION"), " (", env!("WADE_COMMIT"), ")");

/// Hydrodynamic forces on wading ground vehicles.
#[derive(Debug, Parser)]
#[command(version = concat!(env!("CARGO_PKG_VERSION"), " (", env!("WADE_COMMIT"), ")"), propagate_version = true)]
#[command(after_help = "Examples:
  Serve the shipped vehicles on this machine:
  wade serve
  One query; it needs no server:
  wade query --vehicle husky --speed 0.8 --depth 0.18
  Latency at 1000 requests a second for 300 s:
  wade soak --vehicle husky --transport shm-spin --out soak/")]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

// What stood above a variant would replace all that its command says of itself.
#[derive(Debug, Subcommand)]
enum Command {
    Serve(serve::Serve),
    Query(query::Query),
    Predict(predict::Predict),
    Stability(stability::StabilityCommand),
    Soak(soak::Soak),
    Campaign(campaign::CampaignCommand),
    Dataset(dataset::Dataset),
    Train(train::Train),
    Eval(eval::Eval),
    Validate(validate::Validate),
    Gap(gap::Gap),
    Vehicle(vehicle::Vehicle),
    Fmu(fmu::FmuCommand),
    Token(token::TokenCommand),
    Doctor(doctor::Doctor),
    Completions(shell::Completions),
    Man(shell::Man),
    /// Serve shared memory for a server, which starts this by itself
    #[command(hide = true)]
    ServeShm,
}

impl Cli {
    /// Runs the subcommand.
    pub fn run(self) -> Result<ExitCode> {
        match self.command {
            Command::Serve(command) => command.run(),
            Command::Query(command) => command.run(),
            Command::Predict(command) => command.run(),
            Command::Stability(command) => command.run(),
            Command::Soak(command) => command.run(),
            Command::Campaign(command) => command.run(),
            Command::Dataset(command) => command.run(),
            Command::Train(command) => command.run(),
            Command::Eval(command) => command.run(),
            Command::Validate(command) => command.run(),
            Command::Gap(command) => command.run(),
            Command::Vehicle(command) => command.run(),
            Command::Fmu(command) => command.run(),
            Command::Token(command) => command.run(),
            Command::Doctor(command) => command.run(),
            Command::Completions(command) => command.run(),
            Command::Man(command) => command.run(),
            Command::ServeShm => serve::serve_shm(),
        }
    }
}

/// Prints to standard output; a reader that has seen enough, such as head, is no failure.
fn emit(text: &str) -> Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        outcome => Ok(outcome?),
    }
}

/// Ends the program as clap does for arguments that do not go together.
fn usage_error(message: &str) -> ! {
    use clap::CommandFactory;
    Cli::command().error(clap::error::ErrorKind::ArgumentConflict, message).exit()
}

/// Where the bundles are, for commands that read them themselves.
#[derive(Debug, Args)]
struct Vehicles {
    /// Folder of the vehicle bundles [default: the first that exists of $XDG_DATA_HOME/wade/vehicles (~/.local/share),
    /// vehicles beside the program and ../share/wade/vehicles; vehicles that it lacks are those that wade carries]
    #[arg(long, value_name = "DIR", env = "WADE_VEHICLES", value_parser = path_or_nothing)]
    vehicles: Option<PathBuf>,
}

impl Vehicles {
    fn named(&self) -> Option<&Path> {
        self.vehicles.as_deref().filter(|folder| !folder.as_os_str().is_empty())
    }

    fn library(&self) -> Result<Library> {
        Ok(Library::open(self.named())?)
    }

    /// For commands that write bundles: the folder that was named need not be there yet.
    fn library_to_write(&self) -> Result<Library> {
        Ok(Library::open_to_write(self.named())?)
    }

    /// The model without the effects that were added to it.
    fn model(&self, name: &str) -> Result<Model> {
        Ok(self.library()?.model(name, Isa::available()[0])?)
    }

    /// What a server would serve.
    fn served(&self, name: &str) -> Result<ServedVehicle> {
        Ok(self.library()?.served(name, Isa::available()[0])?)
    }

    /// Everything in a bundle but its weights.
    fn without_weights(&self, name: &str) -> Result<Bundle> {
        Ok(self.library()?.read_without_weights(name)?)
    }
}

/// The parser of paths refuses the empty string, which here means none.
fn path_or_nothing(text: &str) -> Result<PathBuf, std::convert::Infallible> {
    Ok(PathBuf::from(text))
}

/// Refuses a folder for reports that holds a bundle: a file of either would pass for one of the other.
fn check_report_folder(folder: &Path) -> Result<()> {
    if folder.join(wade_core::bundle::VEHICLE_FILE).exists() {
        bail!("{} holds a vehicle bundle: name another folder for the report", folder.display());
    }
    Ok(())
}

/// Refuses to write over a file that is read, whatever the two are called.
fn keep_inputs(out: &Path, inputs: impl IntoIterator<Item = impl AsRef<Path>>) -> Result<()> {
    let place = |path: &Path| std::fs::metadata(path).ok().map(|file| (file.dev(), file.ino()));
    let Some(target) = place(out) else { return Ok(()) };
    for input in inputs {
        let input = input.as_ref();
        if place(input) == Some(target) {
            bail!("{} would be written over {}, which is read: name another", out.display(), input.display());
        }
    }
    Ok(())
}

/// A page that is written once the work is done.
struct Page {
    file: StagedFile,
    place: PathBuf,
}

/// Begins a page, so that a place that cannot be written to is known before the work, and that of a file that is read.
fn begin_page(
    place: Option<&Path>,
    inputs: impl IntoIterator<Item = impl AsRef<Path>>,
) -> Result<Option<Page>> {
    let Some(place) = place else { return Ok(None) };
    keep_inputs(place, inputs)?;
    let file = StagedFile::new(place).with_context(|| format!("cannot write {}", place.display()))?;
    Ok(Some(Page { file, place: place.to_owned() }))
}

impl Page {
    fn finish(self, text: &str) -> Result<()> {
        let Self { mut file, place } = self;
        let written = file.write_all(text.as_bytes()).and_then(|()| file.finish());
        written.with_context(|| place.display().to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns of a plain terminal.
    const WIDTH: usize = 80;

    /// Lines of the help of a command and of all below it that do not fit, with the name of the command.
    fn too_wide(command: &mut clap::Command, faults: &mut Vec<String>) {
        let name = command.get_bin_name().unwrap_or_default().to_owned();
        let (long, short) = (command.render_long_help().to_string(), command.render_help().to_string());
        // of a longer line clap would put the rest on a line of its own, which breaks a table in two
        let written = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let lines = [long, short, written];
        let wide = lines.iter().flat_map(|text| text.lines()).filter(|line| line.chars().count() > WIDTH);
        faults.extend(wide.map(|line| format!("{name}: {line}")));
        command.get_subcommands_mut().for_each(|command| too_wide(command, faults));
    }

    #[test]
    fn every_help_can_be_read_at_80_columns() {
        use clap::CommandFactory;
        let (mut command, mut faults) = (Cli::command().term_width(WIDTH), Vec::new());
        command.build();
        too_wide(&mut command, &mut faults);
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }
}
