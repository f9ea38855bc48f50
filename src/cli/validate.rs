//! `wade validate`.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{ArgGroup, Args};
use wade_core::model::Model;
use wade_learn::recordings::{Recordings, generated, trials_from_recordings};
use wade_learn::trials::Trials;
use wade_learn::validate::{self, About, Config, OutFolder, Report, Source, Subject};

use super::{Vehicles, emit};

/// The form of `--config`, with what holds without one.
const SETTINGS: &str = "  ground_contact = \"wetted\"    # or \"dry\": water under the tires, or none
  [mocap]
  rate_hz = 111.0              # after resampling
  window = 9                   # of the Savitzky-Golay filter [samples]
  order = 2                    # of its polynomial
  [planar]
  duration_s = 0.2             # a section lasts longer,
  samples = 20                 # has more samples,
  vertical_speed_mps = 0.05    # rises or sinks less,
  depth_tolerance_m = 0.01     # stays within this of its most frequent depth
  least_speed_mps = 0.1        # and moves
  [pairs]
  speed_tolerance_mps = 0.3    # between two sections that are compared
  least_speed_mps = 0.6        # of both
  [groups]
  depth_m = 0.02               # depths that differ by more are two fills
  speed_mps = 0.5              # width of a bin of speed
  [thresholds]
  drag_r2 = 0.9                # least R2 of |Fx| against v^2 at every depth
  ratio_difference = 0.3       # largest between mean ratio of pairs and of fits
  f0_r2 = 0.95                 # least R2 of F0 against depth
  sections = 3                 # fewest from which a depth is judged
";

/// Test a vehicle's model by two laws of physics along the motion of trials
///
/// Test 1: drag grows with the square of the speed. Test 2: the vertical force is buoyancy, which grows with depth, plus
/// lift. Only motion is needed, no measured force. Exit status 1: a check does not hold.
#[derive(Debug, Args)]
#[command(override_usage = "wade validate [OPTIONS] --vehicle <VEHICLE> --out <DIR>
       <--trials <DIR>|--mocap <DIR>|--generated <SEED>>")]
#[command(group = ArgGroup::new("source").required(true))]
#[command(after_help = format!("Examples:
  wade validate --vehicle warthog --generated 1 --out validation/
  wade validate --vehicle warthog --mocap recordings/ --out validation/ --json
  wade validate --vehicle warthog --trials trials/ --out validation/

A folder of recordings holds recordings.toml and one CSV a recording: t, x y z,
qw qx qy qz of the marker frame, z up. --generated writes one to OUT/recordings.
A folder of trials holds trials.toml and one CSV a trial: t, vx vy vz, wx wy wz,
roll pitch yaw, depth or water_level, bed_clearance, bed and more. Trials made
from recordings go to OUT/trials.

Settings that a file (--config) leaves out are these:
{SETTINGS}"))]
pub struct Validate {
    /// Name of the vehicle
    #[arg(long)]
    vehicle: String,
    /// Folder of trials
    #[arg(long, value_name = "DIR", group = "source")]
    trials: Option<PathBuf>,
    /// Folder of motion-capture recordings
    #[arg(long, value_name = "DIR", group = "source")]
    mocap: Option<PathBuf>,
    /// Generates recordings after the paper's table of 71 trials, labelled as generated
    #[arg(long, value_name = "SEED", group = "source")]
    generated: Option<u64>,
    /// Folder for report.json and index.html; an earlier report there is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Settings and thresholds, TOML
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print the JSON too
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    vehicles: Vehicles,
}

impl Validate {
    /// Writes the report as a whole, or nothing.
    pub fn run(self) -> Result<ExitCode> {
        let config = self.settings()?;
        let model = self.vehicles.model(&self.vehicle)?;
        let folder = OutFolder::stage(&self.out, self.trials.as_deref().or(self.mocap.as_deref()))?;
        let (trials, source) = self.trials(&model, &config, &folder)?;
        trials.remarks().iter().for_each(|remark| eprintln!("{remark}"));
        let mut predict = validate::predictor(&model);
        let tests = validate::run(&trials, model.vehicle(), &config, &mut predict)?;
        let (subject, commit) = (Subject::new(&model), env!("WADE_COMMIT"));
        let report = Report::new(tests, &trials, About { source, subject, config: &config, commit });
        let json = serde_json::to_string_pretty(&report)? + "\n";
        folder.place(&json, &report.page()?)?;
        emit(&if self.json { json } else { self.summary(&report) })?;
        report.failures.iter().for_each(|failure| eprintln!("error: {failure}"));
        Ok(ExitCode::from(u8::from(!report.passed)))
    }

    fn settings(&self) -> Result<Config> {
        let config: Config = match &self.config {
            Some(path) => {
                let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
                toml::from_str(&text).with_context(|| path.display().to_string())?
            }
            None => Config::default(),
        };
        config.check()?;
        Ok(config)
    }

    /// Reads the trials, made first where there are recordings or a seed only.
    fn trials(&self, model: &Model, config: &Config, folder: &OutFolder) -> Result<(Trials, Source)> {
        if let Some(trials) = &self.trials {
            return Ok((Trials::read(trials)?, Source::Trials));
        }
        if let Some(seed) = self.generated {
            let place = folder.recordings();
            generated::write(&place, model.vehicle(), seed).with_context(|| place.display().to_string())?;
        }
        let source = if self.generated.is_some() { Source::Generated } else { Source::Mocap };
        let recordings = self.mocap.clone().unwrap_or_else(|| folder.recordings());
        let recordings = Recordings::read(&recordings)?;
        trials_from_recordings(&recordings, model.vehicle(), &config.mocap, &folder.trials())?;
        let trials = Trials::read(&folder.trials()).map_err(|error| {
            // the folder that the error names is gone when the user reads it
            let file = error.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let recording = recordings.directory.join(file);
            let fault = error.fault;
            anyhow::anyhow!(
                "{}, after resampling to {} Hz: {fault}",
                recording.display(),
                config.mocap.rate_hz
            )
        })?;
        Ok((trials, source))
    }

    fn summary(&self, report: &Report) -> String {
        let mut text = format!(
            "{}, bundle version {}, weights: {}; {} planar sections of {} trials{}, {:.0} % of the samples in domain\n",
            report.subject.vehicle,
            report.subject.version,
            report.subject.weights,
            report.data.planar_sections,
            report.data.trials,
            if report.data.generated.is_some() { ", generated" } else { "" },
            100.0 * report.data.in_domain,
        );
        text.push_str("depth [m]  sections  C_D,eff      R2    C_D     F0 [N]  mesh at rest [N]\n");
        for (drag, fz) in report.drag_scaling.depths.iter().zip(&report.vertical_force.depths) {
            let number = |value: Option<f64>, digits: usize| {
                value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
            };
            text.push_str(&format!(
                "{:9.4}  {:8}  {:>7}  {:>6}  {:>5}  {:>9}  {:>16.0}\n",
                drag.depth_m,
                drag.sections,
                number(drag.c_d_eff, 1),
                number(drag.r2, 4),
                number(drag.c_d, 3),
                number(fz.f0_n, 0),
                fz.mesh_wetted_n,
            ));
        }
        for check in report.checks.iter().filter(|check| check.holds != Some(false)) {
            let mark = if check.holds.is_some() { "holds" } else { "not tested" };
            text.push_str(&format!("{mark}: {}\n", check.finding));
        }
        text + &format!("{}\n", self.out.join("index.html").display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_help_shows_can_be_read_and_is_what_holds_without_it() {
        assert_eq!(toml::from_str(SETTINGS), Ok(toml::Table::try_from(Config::default()).expect("a table")));
    }
}
