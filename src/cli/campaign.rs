//! `wade campaign`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use clap::builder::RangedU64ValueParser;
use clap::{Args, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use wade_core::vehicle::Vehicle;
use wade_learn::cfd::collect::{self, Collected};
use wade_learn::cfd::means;
use wade_learn::cfd::openfoam::OpenFoam;
use wade_learn::cfd::plan::{self, Plan, Set};
use wade_learn::cfd::report;
use wade_learn::cfd::run::{Event, Machine, Work};
use wade_learn::cfd::slurm;
use wade_learn::dataset;
use wade_learn::workflow::campaign::{Addition, Beginning, Folder, Selection};

use super::Vehicles;

/// Plan, run and collect a CFD campaign with OpenFOAM
#[derive(Debug, Args)]
#[command(after_help = "Example, from nothing to a data set:
  wade campaign plan --vehicle husky --set paper --out campaigns/husky
  nice wade campaign run campaigns/husky --jobs 2
  wade campaign collect campaigns/husky

What a model that was trained on parked, steady cases lacks, by cases that move:
  wade campaign trials campaigns/husky --set unsteady --out trials/
  wade gap --vehicle husky --trials trials/ --out gap/")]
pub struct CampaignCommand {
    #[command(subcommand)]
    command: Command,
}

/// The form of `--table`.
const TABLE: &str = "  speed_mps = { min = 0.5, max = 4.0 }      # through the water
  angle_deg = { min = 30.0, max = 90.0 }    # of the flow: 90 is straight ahead
  depth_m = { min = 0.10, max = 0.40 }      # at the body origin
  density_kgpm3 = { min = 1000.0, max = 1900.0 }
";

/// The form of `--settings`, with what holds without one.
const SETTINGS: &str = "  courant = 8.0                # largest Courant number
  interface_courant = 6.0      # and at the water's surface
  settle_lengths = 3.5         # time before the first window, lengths / speed
  settle_s = [2.0, 30.0]       # and its bounds [s]
  window_s = 2.0               # what is averaged [s]
  windows = 3                  # computed at most, until the mean has settled
  drift = 0.05                 # of a settled mean, over the dynamic force
  sample_s = 0.05              # between two samples of the forces [s]
  limit_s = 3600.0             # processor time of a program [s]; finer: more
  [mesh]
  cells_per_length = 6.1       # background cells along the vehicle
  wet_layer = 0.42             # height of wet background cells over length
  hull_level = 2               # halvings at the hull
  wheel_level = 3              # and at the wheels
  # channel_m = [6.0, 5.0, 1.5]  # length, width, height; default: the paper's
  # [flow_time]                # in lengths / speed, in place of the times above
  # lengths = [7.0, 9.0, 12.0, 8.0]  # at Fr < 0.4, < 0.6, < 1.3, above
  # window = 4.0               # depth and speed are measured ahead, means kept
  # shift = 2.0                # settled: as the window so much earlier
";

// What stood above a variant would replace all that its command says of itself.
#[derive(Debug, Subcommand)]
enum Command {
    Plan(PlanCommand),
    Run(Run),
    Collect(Collect),
    Trials(Trials),
    Report(Report),
}

impl CampaignCommand {
    /// Runs the subcommand.
    pub fn run(self) -> Result<ExitCode> {
        match self.command {
            Command::Plan(command) => command.run(),
            Command::Run(command) => command.run(),
            Command::Collect(command) => command.run(),
            Command::Trials(command) => command.run(),
            Command::Report(command) => command.run(),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SetName {
    Paper,
    Wide,
    Driving,
    Unsteady,
    Check,
    Mesh,
    Ahead,
    Drive,
}

impl From<SetName> for Set {
    fn from(name: SetName) -> Self {
        match name {
            SetName::Paper => Self::Paper,
            SetName::Wide => Self::Wide,
            SetName::Driving => Self::Driving,
            SetName::Unsteady => Self::Unsteady,
            SetName::Check => Self::Check,
            SetName::Mesh => Self::Mesh,
            SetName::Ahead => Self::Ahead,
            SetName::Drive => Self::Drive,
        }
    }
}

/// Add cases to a plan, or begin one
///
/// The same seed gives the same plan; called again on the same folder it adds cases and repeats none.
#[derive(Debug, Args)]
#[command(after_help = format!("\
Examples:
  wade campaign plan --vehicle husky --set paper --out campaigns/husky
  wade campaign plan --vehicle husky --set driving --cases 24 --out husky
  wade campaign plan --vehicle rover --set paper --table ranges.toml --out rover
  wade campaign plan --vehicle husky --set drive --cases 10 --out drive/husky

A file of ranges (--table), here the source paper's of the Warthog:
{TABLE}
Settings that a file (--settings) leaves out are these:
{SETTINGS}"))]
struct PlanCommand {
    /// Name of the vehicle's bundle
    #[arg(long)]
    vehicle: String,
    #[command(flatten)]
    vehicles: Vehicles,
    /// What to add: `paper` and `wide` are Latin hypercubes, `driving` the straightest steady cases with a moving bed,
    /// `unsteady`, `check`, `mesh` and `ahead` fixed lists, which take no `--cases`, `drive` a round of any course, attitude,
    /// water level and bed
    #[arg(long, value_enum)]
    set: SetName,
    /// Cases to add
    #[arg(long, default_value_t = 175, value_parser = RangedU64ValueParser::<usize>::from(1..=100_000))]
    cases: usize,
    /// Seed of the hypercube
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Ranges of the plan, TOML with speed_mps, angle_deg, density_kgpm3, depth_m, each { min, max }
    /// [default: the source paper's, for the shipped vehicles]
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Settings of every case, TOML; only when the plan is begun
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Campaign of the same vehicle; a round of `drive` repeats one of its unsettled cases of `paper` for every five new ones
    #[arg(long, value_name = "DIR")]
    repeat: Option<PathBuf>,
    /// Also write what another engine needs to run the plan: `slurm`, a job array
    #[arg(long, value_enum)]
    target: Option<Target>,
    /// Folder of the campaign
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Target {
    Slurm,
}

impl PlanCommand {
    fn run(self) -> Result<ExitCode> {
        let vehicle = self.vehicles.without_weights(&self.vehicle)?.vehicle;
        let beginning = Beginning {
            table: self.table.as_ref().map(read_toml).transpose()?,
            settings: self.settings.as_ref().map(read_toml).transpose()?,
        };
        let add = Addition { set: self.set.into(), cases: self.cases, seed: self.seed, repeat: self.repeat };
        let (plan, before) = Folder { path: &self.out, vehicle: &vehicle }.extend(beginning, add)?;
        println!(
            "{}: {} cases, {} of them new",
            self.out.display(),
            plan.cases.len(),
            plan.cases.len() - before
        );
        if let Some(Target::Slurm) = self.target {
            println!("{}: one task a case", slurm::write(&self.out, &plan)?.display());
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn read_toml<T: serde::de::DeserializeOwned>(path: &PathBuf) -> Result<T> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    toml::from_str(&text).with_context(|| path.display().to_string())
}

/// Compute the cases that are not done yet
///
/// Killed at any time it goes on where it was. A case that diverges is tried once more with smaller steps, then set
/// aside with its log and named at the end; `--again` tries those once more.
#[derive(Debug, Args)]
struct Run {
    /// Folder of the campaign
    campaign: PathBuf,
    #[command(flatten)]
    vehicles: Vehicles,
    /// Cases at a time, each on a core of its own
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// Only this set; may be given several times
    #[arg(long, value_enum)]
    set: Vec<SetName>,
    /// Only this case; may be given several times
    #[arg(long, value_name = "ID")]
    case: Vec<String>,
    /// Where the cases are computed [default: `work` in the folder of the campaign]
    #[arg(long, value_name = "DIR")]
    work: Option<PathBuf>,
    /// Keep the folders of cases that are done
    #[arg(long)]
    keep: bool,
    /// Try cases again that were set aside
    #[arg(long)]
    again: bool,
    /// Compute cases again that an older version of wade computed another way; `collect` then replaces them
    #[arg(long)]
    outdated: bool,
}

impl Run {
    fn run(self) -> Result<ExitCode> {
        let (plan, vehicle) = opened(&self.campaign, &self.vehicles)?;
        let folder = Folder { path: &self.campaign, vehicle: &vehicle };
        let work = Work { folder: work_folder(&self.campaign, self.work.as_ref()), keep: self.keep };
        let selection = Selection {
            sets: self.set.iter().map(|name| (*name).into()).collect(),
            cases: self.case,
            again: self.again,
            outdated: self.outdated,
        };
        let cases = folder.due(&plan, &work, &selection)?;
        let solver = OpenFoam::find()?;
        eprintln!("{}", solver.label());
        let mut progress = Progress::new(cases.len(), self.jobs)?;
        let mut failed = Vec::new();
        let campaign = &plan.campaign;
        let outdated = self.outdated;
        let machine = Machine { vehicle: &vehicle, campaign, solver: &solver, work: &work, outdated };
        machine.run(&cases, self.jobs, &mut |event| progress.hear(event, &mut failed))?;
        progress.finish();
        for (id, reason) in &failed {
            println!("set aside: {id}: {reason}");
        }
        println!("{} computed, {} set aside", progress.done, failed.len());
        if progress.left > 0 {
            println!("{} left to another run in {}", progress.left, work.folder.display());
        }
        let is_new = |id: &String| failed.iter().any(|(failed, _)| failed == id);
        let earlier = plan.cases.iter().filter(|case| work.failure_path(&case.id).exists());
        let earlier = earlier.filter(|case| !is_new(&case.id)).count();
        if earlier > 0 {
            println!("{earlier} set aside earlier were left alone: --again tries them once more");
        }
        Ok(if failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }
}

/// The plan of a campaign and the vehicle that it is about.
fn opened(campaign: &Path, vehicles: &Vehicles) -> Result<(Plan, Vehicle)> {
    let plan = Plan::read(campaign)?;
    let vehicle = vehicles.without_weights(&plan.campaign.vehicle)?.vehicle;
    plan.check_vehicle(campaign, &vehicle)?;
    Ok((plan, vehicle))
}

fn work_folder(campaign: &Path, stated: Option<&PathBuf>) -> PathBuf {
    stated.cloned().unwrap_or_else(|| campaign.join("work"))
}

/// Add the cases that are done to the campaign's data set
///
/// Writes `sections.parquet`, averages of 0.1 s for every surface in the form of `wade dataset`, and `cases.csv`, a row
/// a case. Where the settings have a `flow_time`, means are kept in place of sections: `surfaces.csv`. What is collected is done: `run` leaves it alone even when the work folder is gone.
#[derive(Debug, Args)]
struct Collect {
    /// Folder of the campaign
    campaign: PathBuf,
    #[command(flatten)]
    vehicles: Vehicles,
    /// Where the cases were computed [default: `work` in the folder of the campaign]
    #[arg(long, value_name = "DIR")]
    work: Option<PathBuf>,
    /// Also write what was collected as a data set for `wade train`, with the depth and the speed of the water ahead of the
    /// vehicle: measured, or by the balance of momentum in the channel (sections.parquet has those of the plan)
    #[arg(long, value_name = "FILE")]
    dataset: Option<PathBuf>,
}

impl Collect {
    fn run(self) -> Result<ExitCode> {
        let (plan, vehicle) = opened(&self.campaign, &self.vehicles)?;
        let work = Work { folder: work_folder(&self.campaign, self.work.as_ref()), keep: true };
        let new = collect::collect(&self.campaign, &plan, &vehicle, &work)?;
        let collected = Collected::read(&self.campaign, &plan)?;
        let all = collected.cases.len();
        println!("{}: {all} of {} cases, {new} of them new", self.campaign.display(), plan.cases.len());
        if let Some(path) = &self.dataset {
            dataset::write_compact(
                path,
                &collect::dataset_ahead(&self.campaign, &plan, &vehicle, &collected)?,
            )?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// Make trials of computed cases, for `wade gap`
///
/// A trial a case, a row a section of 0.1 s, labelled as computed. The effects of speed that changes are in `unsteady`; those
/// of a moving bed and turning wheels are in `driving` beside `paper`, which holds the same states over a parked bed; with
/// `--pairs` a parked flow is the prediction (`sim_*`) of its driving twin and of itself, so that the gap is what the bed does
/// and no more.
#[derive(Debug, Args)]
struct Trials {
    /// Folder of the campaign
    campaign: PathBuf,
    #[command(flatten)]
    vehicles: Vehicles,
    /// The sets of cases; may be given several times
    #[arg(long, value_enum, required = true)]
    set: Vec<SetName>,
    /// Only cases over a driving bed whose parked twin is computed too, both settled and not choked, and the twins: the mean of
    /// the twin is the prediction
    #[arg(long)]
    pairs: bool,
    /// Folder for the trials, which must not hold any yet
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Trials {
    fn run(self) -> Result<ExitCode> {
        let (plan, vehicle) = opened(&self.campaign, &self.vehicles)?;
        let sets: Vec<Set> = self.set.iter().map(|name| (*name).into()).collect();
        let folder = Folder { path: &self.campaign, vehicle: &vehicle };
        let count = folder.write_trials(&plan, &sets, self.pairs, &self.out)?;
        super::emit(&format!("{}: {count} trials\n", self.out.display()))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Show what the campaign covers and how far it can be trusted
#[derive(Debug, Args)]
struct Report {
    /// Folder of the campaign
    campaign: PathBuf,
    #[command(flatten)]
    vehicles: Vehicles,
    /// Also write a page with plots
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

impl Report {
    fn run(self) -> Result<ExitCode> {
        let files = [
            plan::PLAN_FILE,
            plan::CAMPAIGN_FILE,
            collect::CASES_FILE,
            collect::SECTIONS_FILE,
            means::SURFACES_FILE,
        ];
        let files = files.map(|name| self.campaign.join(name));
        let written = super::begin_page(self.html.as_deref(), files)?;
        let (plan, vehicle) = opened(&self.campaign, &self.vehicles)?;
        let report = report::Report::of(&self.campaign, &plan, &vehicle)?;
        if self.json {
            super::emit(&(serde_json::to_string_pretty(&report)? + "\n"))?;
        } else {
            super::emit(&report.text())?;
        }
        if let Some(written) = written {
            written.finish(&report.page(&self.campaign, &plan, &vehicle)?)?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// One line: cases done, cores busy, time left. Where no one watches, a line a case.
struct Progress {
    bar: ProgressBar,
    total: usize,
    done: usize,
    left: usize,
    busy: usize,
    jobs: usize,
    started: Instant,
}

impl Progress {
    fn new(total: usize, jobs: usize) -> Result<Self> {
        let bar = ProgressBar::new(total as u64);
        bar.set_style(ProgressStyle::with_template("{wide_bar} {pos}/{len} cases, {msg}")?);
        Ok(Self { bar, total, done: 0, left: 0, busy: 0, jobs, started: Instant::now() })
    }

    fn hear(&mut self, event: Event, failed: &mut Vec<(String, String)>) {
        let line = match event {
            Event::Started { .. } => {
                self.busy += 1;
                None
            }
            Event::Retried { id, reason } => Some(format!("{id}: once more with smaller steps: {reason}")),
            Event::Done { outcome } => {
                self.busy -= 1;
                self.done += 1;
                self.bar.inc(1);
                let settled = if outcome.settled { "" } else { ", not settled" };
                Some(format!(
                    "{}: {} cells, {} steps, {:.0} s{settled}",
                    outcome.case.id, outcome.cells, outcome.steps, outcome.core_s
                ))
            }
            Event::Left { id } => {
                self.busy -= 1;
                self.left += 1;
                Some(format!("{id}: left to another run in this folder"))
            }
            Event::Failed { id, reason } => {
                self.busy -= 1;
                let line = format!("{id}: set aside: {reason}");
                failed.push((id, reason));
                Some(line)
            }
        };
        self.bar.set_message(self.message(failed.len()));
        if let Some(line) = line {
            if self.bar.is_hidden() {
                eprintln!("{}/{} {line} ({})", self.done, self.total, self.message(failed.len()));
            } else if failed.last().is_some_and(|(id, _)| line.starts_with(id)) {
                self.bar.println(line);
            }
        }
    }

    fn message(&self, failed: usize) -> String {
        let ended = self.done + self.left + failed;
        let left = match ended {
            0 => "time left unknown".to_owned(),
            _ => {
                let each = self.started.elapsed().as_secs_f64() / ended as f64;
                let seconds = each * (self.total - ended) as f64;
                format!("{} left", indicatif::HumanDuration(Duration::from_secs_f64(seconds)))
            }
        };
        let aside = if failed > 0 { format!(", {failed} set aside") } else { String::new() };
        format!("{} of {} cores busy, {left}{aside}", self.busy, self.jobs)
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_help_shows_can_be_read_and_is_what_holds_without_it() {
        fn table(value: &impl serde::Serialize) -> toml::Table {
            toml::Table::try_from(value).expect("a table")
        }
        assert_eq!(toml::from_str(SETTINGS), Ok(table(&wade_learn::cfd::case::Settings::default())));
        assert_eq!(toml::from_str(TABLE), Ok(table(&wade_learn::parameter_table::ParameterTable::WARTHOG)));
    }
}
