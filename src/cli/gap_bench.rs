//! `wade gap bench`.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::builder::RangedU64ValueParser;
use clap::{Args, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use wade_core::condition::Condition;
use wade_core::effects::Body;
use wade_core::physics::Physics;
use wade_core::vehicle::{Vehicle, shipped};
use wade_gap::{Asked, Config, GapError, Predicted};
use wade_gap_bench::answer::Answer;
use wade_gap_bench::baselines::Method;
use wade_gap_bench::case::{Case, Family, cases};
use wade_gap_bench::generate::generate;
use wade_gap_bench::motion;
use wade_gap_bench::real::{falling_balls, kvlcc2, rm2_rotor};
use wade_gap_bench::score::{Row, rows, table};
use wade_gap_bench::{
    Hull, Modeled, Outcome, Prediction, Progress, Schedule, Setup, Simulator, Tool, ToolError, Wrench6,
    command_tool, folder, run,
};
use wade_learn::trials::Trials;

use super::gap::predictor;
use super::{Vehicles, emit};

/// Hide effects in generated trials; score what the workflow and plain regressions say of them
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
#[command(after_help = "Examples:
  wade gap bench --cases 69 --seed 1 --out bench/
  wade gap bench --cases 6 --families null,single --size slice --out bench/
  wade gap bench --cases 69 --only squat --no-baselines --keep --out bench/
  wade gap bench --vehicle warthog --size slice --out bench/
  wade gap bench --motion --copies 5 --seed 1 --out bench/
  wade gap bench --tool 'mytool --trials {trials} --out {out}' --out bench/
  wade gap bench import kvlcc2 --from kvlcc2_roll_decay/ --out trials/

All trials are generated and labelled so. OUT/results.json holds the table and
every case.")]
pub struct GapBench {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    bench: Bench,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make a folder of trials from published measurements
    Import(Import),
}

#[derive(Debug, Args)]
struct Import {
    #[arg(value_enum)]
    source: Source,
    /// Folder of the published files
    #[arg(long, value_name = "DIR")]
    from: PathBuf,
    /// Folder for the trials
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Source {
    /// Roll decay of a ship model beside inviscid simulations
    Kvlcc2,
    /// A towed rotor against the same without blades
    Rm2Rotor,
    /// Falling balls, a folder of trials each
    FallingBalls,
}

impl Import {
    fn run(self) -> Result<ExitCode> {
        let import = match self.source {
            Source::Kvlcc2 => kvlcc2::import,
            Source::Rm2Rotor => rm2_rotor::import,
            Source::FallingBalls => falling_balls::import,
        };
        import(&self.from, &self.out)?;
        emit(&format!("{}\n", self.out.display()))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// What every result says of its data.
const GENERATED: &str = "all trials are generated; nothing of them was measured";

/// A number of cases that a machine can hold.
fn count() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(..=10_000)
}

#[derive(Debug, Args)]
struct Bench {
    /// Cases of each family; 69 are all effects at all strengths once
    #[arg(long, value_name = "N", default_value_t = 69, value_parser = count())]
    cases: usize,
    /// Seed of all that is random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Families of cases [default: all but timing]
    #[arg(long, value_delimiter = ',')]
    families: Vec<FamilyName>,
    /// A vehicle whose bundle predicts, with the error that it states, in place of a generated box without one
    #[arg(long, value_name = "NAME", conflicts_with = "motion")]
    vehicle: Option<String>,
    #[command(flatten)]
    vehicles: Vehicles,
    /// Only the cases whose name holds this
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Cases of a driven vehicle whose wrench is inferred from poses and drive force, with a table of their own
    #[arg(long, conflicts_with_all = ["cases", "families", "size", "invariance"])]
    motion: bool,
    /// How often each effect stands among those of --motion; 5 make 210 cases
    #[arg(long, value_name = "N", default_value_t = 5, requires = "motion", value_parser = count())]
    copies: usize,
    /// Length and number of the trials of a case
    #[arg(long, value_enum, default_value_t = Size::Full)]
    size: Size,
    /// Command that answers beside the workflow: {trials} stands for the folder of trials, {out} for where it leaves report.json
    #[arg(long, value_name = "COMMAND")]
    tool: Option<String>,
    /// Leave the plain regressions out
    #[arg(long)]
    no_baselines: bool,
    /// Ask again with the trials shuffled and mirrored in every N-th case; 0 for never
    #[arg(long, value_name = "N", default_value_t = 10)]
    invariance: usize,
    /// Write the trials of each case to OUT/cases, and with --motion what is hidden in them to OUT/keys
    #[arg(long)]
    keep: bool,
    /// Folder for results.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the JSON instead of the table
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FamilyName {
    Null,
    Single,
    Set,
    Confounded,
    Gated,
    Outside,
    NotExcited,
    Timing,
}

impl FamilyName {
    fn family(self) -> Family {
        match self {
            Self::Null => Family::Null,
            Self::Single => Family::Single,
            Self::Set => Family::Set,
            Self::Confounded => Family::Confounded,
            Self::Gated => Family::Gated,
            Self::Outside => Family::Outside,
            Self::NotExcited => Family::NotExcited,
            Self::Timing => Family::Timing,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Size {
    /// The paper's 71 trials and 18 others at 111 Hz
    Full,
    /// A sixth of the paper's and the others, at 37 Hz
    Slice,
}

impl GapBench {
    /// Prints the table, or the JSON.
    pub fn run(self) -> Result<ExitCode> {
        match self.command {
            Some(Command::Import(import)) => import.run(),
            None => self.bench.run(),
        }
    }
}

impl Bench {
    fn run(self) -> Result<ExitCode> {
        let Some(out) = &self.out else { super::usage_error("--out DIR is needed") };
        if self.motion {
            return self.run_motion(out);
        }
        let model = self.vehicle.as_deref().map(|name| self.vehicles.model(name)).transpose()?;
        let Some(model) = &model else {
            let hull = Hull::generated_box();
            let prediction = Prediction::Analytic;
            let simulator = Simulator { hull: &hull, prediction, vehicle: "generated-box" };
            return self.run_on(out, &shipped::warthog()?.vehicle()?, simulator, &workflow);
        };
        let vehicle = model.vehicle();
        let body = Body::of_vehicle(vehicle);
        if !body.has_four_wheels() {
            bail!("{}: the benchmark hides effects of four wheels, and the vehicle has others", vehicle.name);
        }
        let hull = Hull::of_vehicle(vehicle);
        // each run begins without a memory
        let predict = RefCell::new(predictor(model, Physics::Full));
        let answers = |run: &[wade_gap_bench::Asked]| modeled(&mut *predict.borrow_mut(), run);
        let workflow = |trials: &Trials| answer(trials, &body, &mut predictor(model, Physics::Full));
        let prediction = Prediction::Model(&answers);
        self.run_on(out, vehicle, Simulator { hull: &hull, prediction, vehicle: &vehicle.name }, &workflow)
    }

    /// All cases, in runs of the paper's schedule as a vehicle drives them.
    fn run_on(
        &self,
        out: &Path,
        driven: &Vehicle,
        simulator: Simulator,
        workflow: &Tool,
    ) -> Result<ExitCode> {
        let schedule = match self.size {
            Size::Full => Schedule::full(driven, self.seed),
            Size::Slice => Schedule::slice(driven, self.seed),
        };
        let mut cases = cases(&self.families(), self.cases, self.seed);
        if let Some(text) = &self.only {
            cases.retain(|case| case.name.contains(text.as_str()));
        }
        if self.keep {
            for case in &cases {
                let place = out.join("cases").join(&case.name);
                folder::write(&place, &generate(case, &schedule, simulator).trials)
                    .with_context(|| place.display().to_string())?;
            }
        }
        let outcomes = self.outcomes(&cases, &schedule, simulator, workflow);
        std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
        let json = self.json(&outcomes)?;
        std::fs::write(out.join("results.json"), &json).with_context(|| out.display().to_string())?;
        emit(&if self.json { json } else { text(&outcomes) })?;
        Ok(ExitCode::SUCCESS)
    }

    /// The benchmark of a wrench that is inferred from motion; the plain regressions need a measured one.
    fn run_motion(&self, out: &Path) -> Result<ExitCode> {
        let mut cases = motion::cases(self.seed, self.copies);
        if let Some(text) = &self.only {
            cases.retain(|case| case.name.contains(text.as_str()));
        }
        if self.keep {
            for case in &cases {
                let (place, generated) = (out.join("cases").join(&case.name), motion::generate(case));
                let key = serde_json::to_string_pretty(&generated.key)? + "\n";
                let keys = out.join("keys");
                folder::write(&place, &generated.trials)
                    .and_then(|()| std::fs::create_dir_all(&keys))
                    .and_then(|()| std::fs::write(keys.join(format!("{}.json", case.name)), key))
                    .with_context(|| place.display().to_string())?;
            }
        }
        let command = self.tool.as_deref().map(command_tool);
        let mut tools: Vec<(&str, &Tool)> = vec![("wade gap", &workflow)];
        tools.extend(command.as_ref().map(|tool| ("tool", tool as &Tool)));
        let (bar, names) = (bar(), tools.iter().map(|(name, _)| (*name).to_owned()).collect::<Vec<_>>());
        let outcomes = motion::run(&cases, &tools, &mut |progress| show(&bar, progress));
        bar.finish_and_clear();
        let outcomes: BTreeMap<String, Vec<motion::Graded>> = names.into_iter().zip(outcomes).collect();
        let rows: BTreeMap<String, Vec<Row>> =
            outcomes.iter().map(|(name, graded)| (name.clone(), motion::rows(graded))).collect();
        let tools: BTreeMap<&String, serde_json::Value> = outcomes
            .iter()
            .map(|(name, graded)| {
                (name, serde_json::json!({"measures": rows[name.as_str()], "cases": graded}))
            })
            .collect();
        let results = serde_json::json!({
            "generated": GENERATED,
            "commit": env!("WADE_COMMIT"),
            "motion": true,
            "copies": self.copies,
            "seed": self.seed,
            "tool": self.tool,
            "tools": tools,
        });
        let json = serde_json::to_string_pretty(&results)? + "\n";
        std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
        std::fs::write(out.join("results.json"), &json).with_context(|| out.display().to_string())?;
        emit(&if self.json { json } else { format!("{GENERATED}\n{}", table(&rows)) })?;
        Ok(ExitCode::SUCCESS)
    }

    fn families(&self) -> Vec<Family> {
        if self.families.is_empty() {
            return Family::ALL.into_iter().filter(|family| *family != Family::Timing).collect();
        }
        self.families.iter().map(|name| name.family()).collect()
    }

    fn outcomes(
        &self,
        cases: &[Case],
        schedule: &Schedule,
        simulator: Simulator,
        workflow: &Tool,
    ) -> BTreeMap<String, Outcome> {
        type Boxed<'a> = Box<dyn Fn(&Trials) -> Result<Answer, ToolError> + 'a>;
        let mut tools: Vec<(String, Boxed)> = Vec::new();
        tools.push(("wade gap".to_owned(), Box::new(|trials: &Trials| workflow(trials))));
        if let Some(command) = &self.tool {
            tools.push(("tool".to_owned(), Box::new(command_tool(command))));
        }
        for method in Method::ALL.into_iter().filter(|_| !self.no_baselines) {
            let answer = move |trials: &Trials| method.answer(trials, &simulator);
            tools.push((method.name().to_owned(), Box::new(answer)));
        }
        let borrowed: Vec<(&str, &Tool)> =
            tools.iter().map(|(name, tool)| (name.as_str(), tool.as_ref())).collect();
        let bar = bar();
        let mut show = |progress: Progress| show(&bar, progress);
        let outcomes =
            run(cases, Setup { schedule, simulator, invariance: self.invariance }, &borrowed, &mut show);
        bar.finish_and_clear();
        tools.into_iter().map(|(name, _)| name).zip(outcomes).collect()
    }

    fn json(&self, outcomes: &BTreeMap<String, Outcome>) -> Result<String> {
        let tools: BTreeMap<&String, serde_json::Value> = outcomes
            .iter()
            .map(|(name, outcome)| {
                (name, serde_json::json!({"measures": rows(&outcome.judged), "cases": outcome}))
            })
            .collect();
        let results = serde_json::json!({
            "generated": GENERATED,
            "commit": env!("WADE_COMMIT"),
            "cases_of_each_family": self.cases,
            "seed": self.seed,
            "vehicle": self.vehicle,
            "size": format!("{:?}", self.size).to_lowercase(),
            "tool": self.tool,
            "tools": tools,
        });
        Ok(serde_json::to_string_pretty(&results)? + "\n")
    }
}

/// A bundle's answers to a run.
fn modeled(predict: &mut dyn FnMut(&Asked<'_>) -> Predicted, run: &[wade_gap_bench::Asked]) -> Vec<Modeled> {
    let mut before = None;
    let mut answer = |asked: &wade_gap_bench::Asked| {
        let t = asked.state.t;
        let condition = Condition { velocity: asked.through_water, ..asked.state.condition() };
        let Predicted { wrench, uncertainty, .. } = predict(&Asked {
            condition: &condition,
            wheel_speeds: Some(asked.state.wheels.into()),
            time_step: before.map_or(0.0, |before| t - before),
        });
        before = Some(t);
        let (f, m) = (wrench.force, wrench.moment);
        Modeled { wrench: Wrench6::new(f.x, f.y, f.z, m.x, m.y, m.z), deviation: Wrench6::from(uncertainty) }
    };
    run.iter().map(&mut answer).collect()
}

/// The workflow on trials that bring their prediction and their body.
fn workflow(trials: &Trials) -> Result<Answer, ToolError> {
    let body = wade_gap::body_of(trials).map_err(refused)?;
    answer(trials, &body, &mut |_| Predicted::default())
}

/// What the workflow answers to trials in memory.
fn answer(
    trials: &Trials,
    body: &Body,
    predict: &mut dyn FnMut(&Asked<'_>) -> Predicted,
) -> Result<Answer, ToolError> {
    let report = wade_gap::run(trials, body, predict, &Config::default()).map_err(refused)?;
    let answer = Answer::from_report(&serde_json::to_value(report)?)?;
    // a verdict that its own numbers contradict is no answer
    match answer.contradiction() {
        Some(why) => Err(ToolError::Refused(why.into())),
        None => Ok(answer),
    }
}

fn refused(error: GapError) -> ToolError {
    ToolError::Refused(Box::new(error))
}

fn text(outcomes: &BTreeMap<String, Outcome>) -> String {
    let tools: BTreeMap<String, Vec<Row>> =
        outcomes.iter().map(|(name, outcome)| (name.clone(), rows(&outcome.judged))).collect();
    let mut text = table(&tools);
    for (name, outcome) in outcomes {
        let [shuffled, mirrored] = [outcome.same_when_shuffled, outcome.same_when_mirrored];
        text += &format!(
            "{name}: the same in {} of {} with trials shuffled, in {} of {} mirrored\n",
            shuffled[0], shuffled[1], mirrored[0], mirrored[1]
        );
    }
    text
}

fn show(bar: &ProgressBar, progress: Progress) {
    bar.set_length(progress.done[1] as u64);
    bar.set_position(progress.done[0] as u64);
    bar.set_message(progress.case.to_owned());
    // in a log, a line a case
    if bar.is_hidden() && !progress.case.is_empty() {
        eprintln!("{}/{} {}", progress.done[0], progress.done[1], progress.case);
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(0);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos} of {len}, {eta} left, {msg}") {
        bar.set_style(style);
    }
    bar
}
