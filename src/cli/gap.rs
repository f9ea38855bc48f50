//! `wade gap`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};
use serde_json::json;
use wade_core::bundle::{self, Library};
use wade_core::effects::{Body, EffectsFile};
use wade_core::forces::Forces;
use wade_core::model::kernel::Isa;
use wade_core::model::{Model, Workspace};
use wade_core::physics::{Memory, Motion, Physics};
use wade_gap::{Asked, Config, GapError, NotApplicable, Predicted, Report, effects_file};
use wade_learn::files::write_whole;
use wade_learn::trials::{SimIs, Trial, Trials};

use super::gap_bench::GapBench;
use super::running::Running;
use super::state::Terms;
use super::{Vehicles, check_report_folder, emit, usage_error};

/// The form of `--config`, with what holds without one; besides `library`, which names all effects.
const SETTINGS: &str = "  # library = [\"added_mass\", \"current\"]   # default: all effects
  absent = []                  # effects that the prediction leaves out
  ground_contact = \"wetted\"    # or \"dry\": water under the tires, or none
  seed = 1
  bin_s = 0.1                  # over which samples are averaged [s]
  block_s = 1.5                # unit of cross-validation [s]
  folds = 8
  held_out = 0.2               # share of the trials that is held out
  least_trials = 4
  significance = 1e-6          # probability of a false alarm of one effect
  share_of_remaining = 0.1     # least share of the gap above the noise floor
  share_of_gap = 0.01          # least share of the explained gap
  relevance = 0.08             # least size over the noise of a sample
  most_effects = 4             # named together
  bootstrap = 400              # draws
  coverage = 0.6               # least share of the structure that is explained
";

/// Find where a model and measured trials disagree, name the missing effect, and show the gap shrink
///
/// Says `nothing_missing`, `named`, `ambiguous` (with the trial that would tell the candidates apart) or
/// `no_candidate_fits`. Trials with sim_fx ... columns are compared with that simulator, on any body that trials.toml
/// describes; others against the model of the vehicle's bundle, without the effects that were added to it before.
/// Exit status 1: --apply was asked for and no verdict allows it.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = format!("Examples:
  wade gap --vehicle warthog --trials trials/ --out gap/
  wade gap --vehicle warthog --trials trials/ --out gap/ --apply
  wade gap locate --vehicle warthog --trials trials/ --json
  wade gap bench --cases 69 --out bench/

  Restore the version before:
  wade vehicle rollback warthog

Output:
  OUT holds report.json and index.html, with --apply also effects.toml: the
  physical effects, their standard errors, and the ranges in which they were
  seen. Faults of sensors and of the drive are never in it. --apply writes it
  into the bundle as the next version and keeps the version before. It replaces
  the effects of earlier runs, and only a verdict of `named` is applied.
  With sim_ columns the gap is another simulator's: effects.toml is written to
  OUT alone. With sim_is = \"control\" the effects go into the bundle, and those
  of trials of another kind cannot stand beside them.

Trials: a folder with one CSV file a trial, in SI units and body axes (forward,
left, up), and trials.toml. Columns:
  t                        time, needed
  vx vy vz wx wy wz        velocity over ground, angular velocity, needed
  depth                    water above the ground, needed; or in its place
  water_level              still water above the body origin along up
  bed_clearance            bed below the ground-contact plane
  bed                      0 parked in a current, 1 driving
  roll pitch yaw           attitude
  ax ay az alx aly alz     accelerations without gravity; else differentiated
  cx cy cz rho             known current, density
  wheel_fl fr rl rr        wheel speeds
  fx fy fz mx my mz        measured wrench about the center of mass, any of it
  sim_fx .. sim_mz         another simulator's, instead of the bundle's

Keys of trials.toml; only the vehicle is needed:
  vehicle = \"warthog\"
  fluid_density = 1000.0
  mass = 280.0             # where the wrench is inferred
  inertia = [[20, 0, 0], [0, 40, 0], [0, 0, 50]]   # where moments are, kg m2
  channel_width = 6.0
  [channel_widths]         # by trial
  run07 = inf              # open water
  [measured]
  method = \"load_cell\"     # or inverse_dynamics, cfd
  columns = [\"fx\"]
  repeats = [[\"run01\", \"run07\"]]
  dry_twins = {{ run03 = \"dry03\" }}
  other_forces = [\"drive_fx\"]   # known forces, for inverse_dynamics
  known_loads = [\"hung_fz\"]     # what the load cell bears besides the water
  sim_is = \"control\"     # the same trial without the effect in question
                           # [default: simulator]
  [sensor_noise]           # standard deviation of one sample
  fx = 4.0
  [trial_offset]           # standard deviation of the offset between runs
  [trial_offsets.run07]    # the same of one run that differs
  [body]                   # with sim_ columns: length, width, draft, mass,
                           # displaced_volume, center_of_mass

Settings that a file (--config) leaves out are these:
{SETTINGS}"))]
pub struct Gap {
    #[command(subcommand)]
    step: Option<Step>,
    #[command(flatten)]
    source: Source,
    /// Folder for report.json and index.html; those of an earlier run are replaced
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// Add the physical effects to the bundle, as its next version
    #[arg(long)]
    apply: bool,
    #[command(flatten)]
    adding: Adding,
}

/// How effects are added to a bundle.
#[derive(Debug, Args)]
struct Adding {
    /// Also add effects that were observed in one condition only
    #[arg(long)]
    provisional: bool,
    /// Take effects out that other trials gave and these do not
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    running: Running,
}

/// One step of the workflow; each reads the trials again, and only the last two write.
#[derive(Debug, Subcommand)]
enum Step {
    /// Where the gap is: regions of the state space
    Locate(Source),
    /// Which effects explain it, what else could, and which trials would separate them
    Name(Source),
    /// The parameters of the named effects with their intervals
    Fit(Source),
    /// The report on held-out trials, as files
    Report {
        #[command(flatten)]
        source: Source,
        /// Folder for report.json and index.html; those of an earlier run are replaced
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// The same, and the physical effects into the bundle as its next version
    Apply {
        #[command(flatten)]
        source: Source,
        /// Folder for report.json and index.html; those of an earlier run are replaced
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        #[command(flatten)]
        adding: Adding,
    },
    Bench(GapBench),
}

#[derive(Debug, Args)]
struct Source {
    /// Name of the vehicle
    // optional only beside a step, which has its own
    #[arg(long, required = true)]
    vehicle: Option<String>,
    /// Folder of trials
    #[arg(long, value_name = "DIR", required = true)]
    trials: Option<PathBuf>,
    /// Settings, TOML
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// How much of the bundle's physical base predicts; effects that were found against less are not applied [default: physics of
    /// trials.toml, else full]
    #[arg(long, value_enum)]
    physics: Option<Terms>,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    vehicles: Vehicles,
}

impl Gap {
    /// Reads and checks everything before anything is written.
    pub fn run(self) -> Result<ExitCode> {
        match (self.step, self.out) {
            (Some(Step::Locate(source)), _) => source.locate(),
            (Some(Step::Name(source)), _) => source.name(),
            (Some(Step::Fit(source)), _) => source.fit(),
            (Some(Step::Report { source, out }), _) => source.report(&out, None),
            (Some(Step::Apply { source, out, adding }), _) => source.report(&out, Some(&adding)),
            (Some(Step::Bench(bench)), _) => bench.run(),
            (None, Some(_)) if !self.apply && (self.adding.provisional || self.adding.replace) => {
                usage_error("--provisional and --replace go with --apply")
            }
            (None, Some(out)) => self.source.report(&out, self.apply.then_some(&self.adding)),
            (None, None) => usage_error("give --vehicle, --trials and --out, or a step"),
        }
    }
}

impl Source {
    fn settings(&self) -> Result<Config> {
        let Some(path) = &self.config else { return Ok(Config::default()) };
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let config: Config = toml::from_str(&text).with_context(|| path.display().to_string())?;
        config.check().with_context(|| path.display().to_string())?;
        Ok(config)
    }

    fn run(&self, library: &Library, is_applied: bool) -> Result<(Report, Trials)> {
        let (Some(vehicle), Some(folder)) = (&self.vehicle, &self.trials) else {
            usage_error("give --vehicle and --trials")
        };
        let config = self.settings()?;
        let trials = Trials::read(folder)?;
        if is_applied && self.physics_of(&trials) != Physics::Full {
            usage_error(
                "what is applied must be what the whole base lacks: leave --physics and physics of trials.toml out",
            );
        }
        if trials.manifest.vehicle != *vehicle {
            let (trials, asked) = (trials.manifest.vehicle.clone(), vehicle.clone());
            return Err(GapError::Vehicle { trials, asked }.into());
        }
        let has_bundle = library.has(vehicle);
        let report = if has_bundle {
            let model = library.model(vehicle, Isa::available()[0])?;
            let body = Body::of_vehicle(model.vehicle());
            let physics = self.physics_of(&trials);
            let config = if is_anothers(&trials) { config } else { config.predicted_by(physics) };
            wade_gap::run(&trials, &body, &mut predictor(&model, physics), &config)
        } else {
            let alone = trials.trials.iter().find(|trial| !trial.is_simulated());
            let nothing = || format!("there is no vehicle `{vehicle}` ({})", library.origin());
            if let Some(trial) = alone {
                let (trial, vehicle) = (trial.name.clone(), vehicle.clone());
                return Err(GapError::NoPrediction { trial, vehicle }).with_context(nothing);
            }
            let body = wade_gap::body_of(&trials).with_context(nothing)?;
            wade_gap::run(&trials, &body, &mut |_| Predicted::default(), &config)
        };
        match &report {
            Ok(report) => report.remarks.iter().for_each(|remark| eprintln!("{remark}")),
            Err(_) => trials.remarks().iter().for_each(|remark| eprintln!("{remark}")),
        }
        let mut report = report.with_context(|| folder.display().to_string())?;
        report.sources.model = if is_anothers(&trials) || !has_bundle {
            "the sim_ columns of the trials".into()
        } else {
            library.digest(vehicle)?
        };
        report.sources.tool = format!("wade {} ({})", env!("CARGO_PKG_VERSION"), env!("WADE_COMMIT"));
        Ok((report, trials))
    }

    /// How much of the base predicts.
    fn physics_of(&self, trials: &Trials) -> Physics {
        self.physics.map(Physics::from).or(trials.manifest.physics).unwrap_or_default()
    }

    fn locate(&self) -> Result<ExitCode> {
        let (report, _) = self.run(&self.vehicles.library()?, false)?;
        let text = match self.json {
            true => pretty(&json!({ "regions": report.regions, "regions_tried": report.regions_tried }))?,
            false => regions(&report),
        };
        emit(&text)?;
        Ok(ExitCode::SUCCESS)
    }

    fn name(&self) -> Result<ExitCode> {
        let (report, _) = self.run(&self.vehicles.library()?, false)?;
        let names: Vec<&str> = report.effects.iter().map(|effect| effect.name).collect();
        let text = match self.json {
            true => pretty(&json!({
                "verdict": report.verdict,
                "effects": names,
                "alternatives": report.alternatives,
                "separating_experiment": report.separating_experiment,
                "next_step": report.next_step,
                "not_testable": report.not_testable,
                "rejected": report.rejected,
            }))?,
            false => verdict(&report),
        };
        emit(&text)?;
        Ok(ExitCode::SUCCESS)
    }

    fn fit(&self) -> Result<ExitCode> {
        let (report, _) = self.run(&self.vehicles.library()?, false)?;
        let text = match self.json {
            true => pretty(&json!({ "verdict": report.verdict, "effects": report.effects }))?,
            false => parameters(&report),
        };
        emit(&text)?;
        Ok(ExitCode::SUCCESS)
    }

    fn report(&self, out: &Path, apply: Option<&Adding>) -> Result<ExitCode> {
        check_report_folder(out)?;
        let library = match apply {
            Some(_) => self.vehicles.library_to_write()?,
            None => self.vehicles.library()?,
        };
        let (report, trials) = self.run(&library, apply.is_some())?;
        let json = serde_json::to_string_pretty(&report)? + "\n";
        let page = report.page()?;
        let effects = apply.map(|apply| effects_file(&report, &trials, apply.provisional));
        let to_bundle = library.has(&report.vehicle) && !is_anothers(&trials);
        if let (Some(Ok(effects)), true, Some(apply)) = (&effects, to_bundle, apply) {
            let before = library.read(&report.vehicle)?.effects.filter(|_| !apply.replace);
            check_loss(effects, before, &library.source(&report.vehicle)?, has_control(&trials))?;
        }
        std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
        write(&out.join("report.json"), Some(&json))?;
        write(&out.join("index.html"), Some(&page))?;
        // one from an earlier run would pass for this one's
        let text = effects.iter().flatten().next().map(EffectsFile::to_toml);
        write(&out.join("effects.toml"), text.as_deref())?;
        let text = format!(
            "{}{}{}{}\n",
            verdict(&report),
            regions(&report),
            parameters(&report),
            out.join("index.html").display()
        );
        emit(if self.json { &json } else { &text })?;
        match (effects, to_bundle, apply) {
            (Some(Ok(effects)), true, Some(apply)) => {
                let (bundle, version) = library.apply(&report.vehicle, effects)?;
                eprintln!(
                    "{}: version {version}; `wade vehicle rollback {}` restores the previous version",
                    bundle.display(),
                    report.vehicle
                );
                apply.running.reload(&report.vehicle, &bundle);
                Ok(ExitCode::SUCCESS)
            }
            (Some(Ok(_)), false, _) => {
                let why = if is_anothers(&trials) {
                    "the gap is another simulator's"
                } else {
                    "there is no bundle"
                };
                eprintln!("{why}: {}", out.join("effects.toml").display());
                Ok(ExitCode::SUCCESS)
            }
            (Some(Err(why)), ..) => {
                eprintln!("nothing applied: {why}");
                Ok(ExitCode::from(u8::from(why != NotApplicable::NothingMissing)))
            }
            _ => Ok(ExitCode::SUCCESS),
        }
    }
}

/// True where the gap is another simulator's, and what explains it has no place in a bundle.
fn is_anothers(trials: &Trials) -> bool {
    trials.trials.iter().any(Trial::is_simulated) && !has_control(trials)
}

fn has_control(trials: &Trials) -> bool {
    trials.manifest.measured.sim_is == SimIs::Control
}

/// Effects that other trials gave must not go unnoticed because these trials do not show them.
fn check_loss(
    effects: &EffectsFile,
    before: Option<EffectsFile>,
    source: &bundle::Source,
    has_control: bool,
) -> Result<()> {
    let Some(before) = before else { return Ok(()) };
    let stays = |name| effects.effects.iter().any(|effect| effect.effect() == name);
    let lost: Vec<&str> = before
        .effects
        .iter()
        .filter(|effect| !stays(effect.effect()))
        .map(|effect| effect.effect().name())
        .collect();
    if lost.is_empty() || before.evidence.trials_sha256 == effects.evidence.trials_sha256 {
        return Ok(());
    }
    // trials with a control and others cannot lie in one folder
    let way_out = if has_control { "" } else { "put all trials into one folder, or " };
    bail!(
        "{}: {} came from other trials ({}), and these do not name it: {way_out}take it out with --replace",
        source.path().join("effects.toml").display(),
        lost.join(" and "),
        before.evidence.trials.join(", ")
    )
}

/// The model's answers with its uncertainty. What waves remember starts with each run.
pub(super) fn predictor(model: &Model, physics: Physics) -> impl FnMut(&Asked<'_>) -> Predicted {
    let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
    let mut memory = Memory::of_recording();
    move |asked| {
        if asked.time_step == 0.0 {
            memory = Memory::of_recording();
        }
        let motion = Motion {
            wheel_speeds: &model.wheel_speeds(asked.wheel_speeds.as_ref()),
            time_step: asked.time_step,
            implicit_added_mass: false,
            physics,
            waters: None,
        };
        model.evaluate_moving(asked.condition, (&motion, Some(&mut memory)), &mut workspace, &mut forces);
        let (force, moment) = (forces.uncertainty, forces.moment_uncertainty);
        Predicted {
            wrench: forces.wrench,
            uncertainty: [force.x, force.y, force.z, moment.x, moment.y, moment.z],
            outside: !forces.outside.is_inside(),
        }
    }
}

/// Puts a file in its place as a whole, or takes it away.
fn write(path: &Path, text: Option<&str>) -> Result<()> {
    let context = || path.display().to_string();
    match text {
        Some(text) => write_whole(path, text.as_bytes()).with_context(context),
        None => match std::fs::remove_file(path) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(error).with_context(context),
            _ => Ok(()),
        },
    }
}

fn pretty(value: &serde_json::Value) -> Result<String> {
    Ok(serde_json::to_string_pretty(value)? + "\n")
}

fn verdict(report: &Report) -> String {
    let mut text = format!("{}\n", report.summary);
    if let Some(experiment) = &report.separating_experiment {
        text += &format!("To separate them: {experiment}.\n");
    }
    if let Some(step) = &report.next_step {
        text += &format!("Next: {step}.\n");
    }
    if let Some(left) = &report.gap.unexplained {
        text += &format!("Left without a name: {left}.\n");
    }
    for missing in &report.not_testable {
        text += &format!("not testable: {}, {}\n", missing.name, missing.why);
    }
    text
}

fn regions(report: &Report) -> String {
    if report.regions.is_empty() {
        return "The gap stands out in no region.\n".into();
    }
    let line = |region: &wade_gap::Region| {
        format!(
            "where {}: {:.0} % of the gap in {:.0} % of the samples, {} trials; on {}\n",
            region.place,
            100.0 * region.share_of_gap,
            100.0 * region.share_of_samples,
            region.trials,
            wade_gap::in_shares(&region.surfaces)
        )
    };
    report.regions.iter().map(line).collect()
}

fn parameters(report: &Report) -> String {
    let mut text = String::new();
    for effect in &report.effects {
        for (name, p) in &effect.parameters {
            let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
            text += &format!(
                "{} {name} = {:.4} +- {:.4}{unit}{}\n",
                effect.name,
                p.value,
                p.std,
                if effect.provisional { " (provisional: one condition only)" } else { "" }
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    use wade::states::{Row, WheelColumns};
    use wade_core::served::{ServedVehicle, Session};
    use wade_core::wrench::Wrench;
    use wade_wire::{Evaluator, State};

    #[test]
    fn what_the_help_shows_can_be_read_and_is_what_holds_without_it() {
        let mut settings = toml::Table::try_from(Config::default()).expect("a table");
        assert!(settings.remove("library").is_some());
        assert_eq!(toml::from_str(SETTINGS), Ok(settings));
    }

    /// What `wade predict` answers to a table of states that are one run.
    fn by_predict(served: &ServedVehicle, table: &str) -> Vec<Wrench> {
        let mut reader = csv::Reader::from_reader(table.as_bytes());
        let headers = reader.headers().expect("a header").clone();
        let wheels = WheelColumns::of_model(served.model(), &headers);
        let (mut evaluator, mut session) = (Evaluator::default(), Session::of_recording());
        let mut before = None;
        let mut answer = |record: csv::Result<csv::StringRecord>| {
            let row = Row::read(&record.expect("a row"), &headers, &wheels).expect("numbers");
            let t = row.t.expect("a time");
            let time_step = before.map_or(0.0, |before| t - before) as f32;
            before = Some(t);
            let state = State { time_step, ..row.state() }.check().expect("a state");
            evaluator.evaluate(served, &state, Some(&mut session)).forces.wrench
        };
        reader.records().map(&mut answer).collect()
    }

    #[test]
    fn the_model_is_asked_about_level_and_bed_as_predict_asks_it() {
        // numbers that are the same in single precision, so that the answers must be the same bits
        let table = |index: u32, level: bool, bed: &str| {
            let mut text = format!(
                "t,vx,vy,vz,wx,wy,wz,ax,ay,az,alx,aly,alz,{},fx",
                if level { "water_level" } else { "depth" }
            );
            text += if bed.is_empty() { "\n" } else { ",bed_clearance,bed\n" };
            for i in 0..64 {
                let t = f64::from(i) / 64.0;
                let vx = 0.5 + 0.125 * f64::from(index) + 0.25 * t;
                let water = if level { 0.0625 } else { 0.25 };
                text += &format!("{t},{vx},0,0,0,0,0,0.25,0,0,0,0,0,{water},{i}{bed}\n");
            }
            text
        };
        let library = Library::open(Some(Path::new("vehicles"))).expect("the vehicles");
        let isa = Isa::available()[0];
        let (model, served) =
            (library.model("husky", isa).expect("sound"), library.served("husky", isa).expect("sound"));
        let mut first = Vec::new();
        for (level, bed) in [(false, ""), (true, ""), (true, ",0.25,0.5"), (true, ",0,0.5")] {
            let folder = tempfile::tempdir().expect("a folder");
            std::fs::write(
                folder.path().join("trials.toml"),
                "vehicle = \"husky\"\n[measured]\nmethod = \"cfd\"\n",
            )
            .expect("written");
            let tables: Vec<String> = (0..4).map(|index| table(index, level, bed)).collect();
            for (index, table) in tables.iter().enumerate() {
                std::fs::write(folder.path().join(format!("run{index}.csv")), table).expect("written");
            }
            let trials = Trials::read(folder.path()).expect("sound");
            let mut by_gap = Vec::new();
            let mut predict = predictor(&model, Physics::Full);
            let mut asked = |asked: &Asked<'_>| {
                let answer = predict(asked);
                by_gap.push(answer.wrench);
                answer
            };
            // four short trials are too few for a verdict, not for a prediction
            let _ =
                wade_gap::run(&trials, &Body::of_vehicle(model.vehicle()), &mut asked, &Config::default());
            let by_predict: Vec<Wrench> =
                tables.iter().flat_map(|table| by_predict(&served, table)).collect();
            // then it is asked in states that effects move it to
            by_gap.truncate(by_predict.len());
            assert_eq!(by_gap, by_predict, "level {level}, bed {bed}");
            first.push(by_gap[0]);
        }
        assert!(first.windows(2).all(|pair| pair[0] != pair[1]), "each of them counts: {first:?}");
    }
}
