//! `wade dataset`.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::builder::RangedU64ValueParser;
use clap::{Args, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use wade_core::vehicle::Vehicle;
use wade_learn::dataset::import::{Format, Import, LEFT_OUT, PASSED_OVER};
use wade_learn::dataset::lift;
use wade_learn::dataset::sections::Sections;
use wade_learn::dataset::split::{self, By};
use wade_learn::dataset::summary::Summary;
use wade_learn::dataset::{self, CutOff, mirror, page};
use wade_learn::train::{self, Config};
use wade_learn::workflow::SplitRule;

use super::train::Rule;
use super::{Vehicles, begin_page, emit, keep_inputs, usage_error};

/// Most cases a vehicle: far more than a network of this size can use, and well within memory.
const MOST_CASES: u64 = 1_000_000;

/// Import CFD results, augment, split and describe data sets
///
/// A data set is one Parquet file, a row for each surface of each sample, which pandas and DuckDB open too.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade dataset import --format openfoam --vehicle warthog --cases runs \\
    --out data.parquet
  wade dataset augment data.parquet --out augmented.parquet
  wade dataset split augmented.parquet --by case --out split
  wade dataset describe data.parquet --html data.html")]
pub struct Dataset {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Average the force histories of a folder of CFD cases
    ///
    /// Each sub-folder is a case and holds case.toml, its description, beside the solver's files: for OpenFOAM
    /// postProcessing/SURFACE/TIME/force.dat and moment.dat, for Fluent report files *.out. A case that cannot be read
    /// is an error, and then nothing is written.
    #[command(override_usage = "wade dataset import [OPTIONS] --format <FORMAT> --vehicle <VEHICLE>
       --cases <DIR> --out <FILE>")]
    #[command(after_help = "Example:
  wade dataset import --format fluent --vehicle husky --cases runs \\
    --out data.parquet

case.toml, with z of the CFD forward, y up and so x to the left:
  vehicle = \"husky\"
  speed_mps = 0.8
  flow_angle_deg = 60.0        # 90 is head-on
  # heading_deg = 30.0         # or this, or water_velocity_mps in CFD axes
  density_kgpm3 = 1000.0
  depth_m = 0.15
  domain_m = [6.0, 5.0, 1.5]
  bed = \"parked\"               # or \"driving\"
  ground_contact = \"dry\"       # or \"wetted\"
  [frame]
  x = \"z\"                      # the axis of the CFD that points forward
  y = \"x\"                      # that points left
  z = \"y\"                      # that points up
  origin_m = [0.0, 0.0, 0.0]   # the body origin in the CFD
  # yaw_deg = 0.0              # and its attitude: yaw_deg, pitch_deg, roll_deg
  [surfaces]
  wheel_fl = \"wheel-front-left\" # where the solver's name is not ours
  [report]                     # Fluent alone
  force = \"{surface}-f{axis}\"
  moment = \"{surface}-m{axis}\"
  moment_center_m = [0.0, 0.0, 0.0]")]
    Import(ImportCases),
    /// Loads by formula over the paper's parameter table, in the same form
    #[command(after_help = "Example:
  wade dataset analytic --vehicle husky --vehicle warthog --out analytic.parquet")]
    Analytic(Analytic),
    /// Add mirror images: left to right and, where the hull is symmetric, front to rear
    #[command(after_help = "Example: wade dataset augment data.parquet --out augmented.parquet")]
    Augment {
        /// The data set
        file: PathBuf,
        /// The data set with images
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
        /// Front to rear on any hull whose surfaces have counterparts, as the source paper did
        #[arg(long)]
        front_rear: bool,
        #[command(flatten)]
        vehicles: Vehicles,
    },
    /// Write the training side and the held-out side as two data sets
    ///
    /// Every split but the one by sample keeps the sections and images of a case together.
    #[command(after_help = "Examples:
  wade dataset split data.parquet --by case --share 0.2 --seed 1 --out split
  split/1 to split/5, with one depth held out in each:
  wade dataset split data.parquet --by depth --parts 5 --out split")]
    Split(SplitFile),
    /// Join data sets, such as those of two vehicles, and take some sets of a campaign alone
    #[command(after_help = "Examples:
  wade dataset merge husky.parquet warthog.parquet --out both.parquet
  wade dataset merge mine/sections.parquet --set paper,wide --out steady.parquet")]
    Merge {
        /// The data sets
        #[arg(required = true)]
        files: Vec<PathBuf>,
        /// Sets of cases to keep, separated by commas [default: all]
        #[arg(long, value_delimiter = ',', value_name = "NAME")]
        set: Vec<String>,
        /// The data set that holds them all
        #[arg(long, value_name = "FILE")]
        out: PathBuf,
    },
    /// Counts, ranges, coverage, scatter between sections, and which surfaces carry the force
    #[command(after_help = "Example: wade dataset describe data.parquet --html data.html")]
    Describe {
        /// The data set
        file: PathBuf,
        /// Write a page with plots
        #[arg(long, value_name = "FILE")]
        html: Option<PathBuf>,
        /// Print JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        vehicles: Vehicles,
    },
}

#[derive(Debug, Args)]
struct ImportCases {
    /// Whose files
    #[arg(long, value_enum)]
    format: Solver,
    /// Vehicle that cases may be of; repeat it for several
    #[arg(long, required = true)]
    vehicle: Vec<String>,
    /// Folder with a sub-folder for each case
    #[arg(long, value_name = "DIR")]
    cases: PathBuf,
    /// The data set
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Solver and version, for the meta data [default: the format]
    #[arg(long, value_name = "TEXT")]
    provenance: Option<String>,
    /// Time before which the flow still develops [s]
    #[arg(long, value_name = "S", default_value_t = Sections::default().transient_s)]
    transient: f64,
    /// Sections after that
    #[arg(long, value_name = "N", default_value_t = Sections::default().count)]
    sections: u32,
    /// Length of a section [s]
    #[arg(long, value_name = "S", default_value_t = Sections::default().length_s)]
    section_length: f64,
    /// Runs are going on: leave out a last line that is not whole
    #[arg(long)]
    running: bool,
    #[command(flatten)]
    vehicles: Vehicles,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Solver {
    /// Function object forces: force.dat and moment.dat, or forces.dat of the Foundation's versions
    Openfoam,
    /// Report files
    Fluent,
}

#[derive(Debug, Args)]
struct Analytic {
    /// Vehicle; repeat it for several
    #[arg(long, required = true)]
    vehicle: Vec<String>,
    /// Seed of the plan
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Cases a vehicle
    #[arg(long, default_value_t = 175, value_parser = RangedU64ValueParser::<usize>::from(1..=MOST_CASES))]
    cases: usize,
    /// The data set
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    vehicles: Vehicles,
}

#[derive(Debug, Args)]
struct SplitFile {
    /// The data set
    file: PathBuf,
    /// What is held out
    #[arg(long, value_enum, default_value = "case")]
    by: Rule,
    /// Share that is held out, by case and by sample [default: 0.2]
    #[arg(long)]
    share: Option<f64>,
    /// Number of parts, by folds, depth and heading [default: 5]
    #[arg(long, value_parser = RangedU64ValueParser::<usize>::from(2..=split::MOST_PARTS as u64))]
    parts: Option<usize>,
    /// Seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// New folder for train.parquet and held-out.parquet, or for folders 1, 2 and so on with both
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Dataset {
    /// Runs the subcommand.
    pub fn run(self) -> Result<ExitCode> {
        match self.command {
            Command::Import(command) => command.run()?,
            Command::Analytic(command) => command.run()?,
            Command::Augment { file, out, front_rear, vehicles } => {
                keep_inputs(&out, [&file])?;
                let data = dataset::read(&file)?;
                let vehicles = read_vehicles(&vehicles, data.meta.vehicles.keys())?;
                write(&out, &mirror::augment(&data, &vehicles, front_rear)?)?;
            }
            Command::Split(command) => command.run()?,
            Command::Merge { files, set, out } => {
                keep_inputs(&out, &files)?;
                let mut data = dataset::read(&files[0])?;
                for file in &files[1..] {
                    let other = dataset::read(file)?;
                    data.merge(other).with_context(|| format!("{} and those before", file.display()))?;
                }
                if !set.is_empty() {
                    data.keep_sets(&set)?;
                }
                write(&out, &data)?;
            }
            Command::Describe { file, html, json, vehicles } => {
                describe(&file, html.as_deref(), json, &vehicles)?
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

impl ImportCases {
    fn run(self) -> Result<()> {
        let sections =
            Sections { transient_s: self.transient, count: self.sections, length_s: self.section_length };
        if !sections.is_valid() {
            usage_error("--sections and --section-length must be positive, --transient not negative");
        }
        let (format, name) = match self.format {
            Solver::Openfoam => (Format::OpenFoam, "openfoam"),
            Solver::Fluent => (Format::Fluent, "fluent"),
        };
        let vehicles = read_vehicles(&self.vehicles, self.vehicle.iter())?;
        let names = |vehicle: &Vehicle| vehicle.surfaces.iter().map(|surface| surface.name.clone()).collect();
        let import = Import {
            format,
            vehicles: vehicles.iter().map(|(name, vehicle)| (name.clone(), names(vehicle))).collect(),
            sections,
            cut_off: if self.running { CutOff::Drop } else { CutOff::Refuse },
            provenance: self.provenance.unwrap_or_else(|| name.to_owned()),
        };
        let bar = ProgressBar::new(0)
            .with_style(ProgressStyle::with_template("{wide_bar} {pos}/{len} cases, {eta} left")?);
        let data = import.run(&self.cases, &|done, total| {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
        })?;
        bar.finish_and_clear();
        if let Some(left_out) = data.meta.notes.get(LEFT_OUT) {
            eprintln!(
                "warning: forces were reported of {left_out} too, none of the vehicle's surfaces; they are left out"
            );
        }
        if let Some(files) = data.meta.notes.get(PASSED_OVER) {
            eprintln!("warning: these files hold no report that can be read, and were passed over: {files}");
        }
        let without = data.without_moments();
        if let Some(first) = without.first() {
            let count = without.len();
            eprintln!(
                "warning: {count} of the cases, `{first}` the first, have no moments: where their forces act can neither be \
                 trained on nor judged"
            );
        }
        for question in lift::questions(&data, &vehicles) {
            eprintln!("warning: {question}");
        }
        write(&self.out, &data)
    }
}

impl Analytic {
    fn run(self) -> Result<()> {
        let config = Config::default().analytic;
        let vehicles = read_vehicles(&self.vehicles, self.vehicle.iter())?;
        if let Some(name) = vehicles.keys().find(|name| !config.tables.contains_key(*name)) {
            bail!("there is no parameter table for {name}; there are: {}", keys(&config.tables));
        }
        let config = train::Analytic { cases: self.cases, ..config };
        let data = train::analytic::dataset(&vehicles, &config, self.seed)?;
        write(&self.out, &data)
    }
}

impl SplitFile {
    fn by(&self) -> By {
        let shared = matches!(self.by, Rule::Case | Rule::Sample);
        if self.share.is_some() && !shared {
            usage_error("--share goes with --by case or --by sample");
        }
        if self.parts.is_some() && (shared || self.by == Rule::Vehicle) {
            usage_error("--parts goes with --by folds, --by depth or --by heading");
        }
        let defaults = Config::default();
        let share = self.share.unwrap_or(defaults.held_out_share);
        SplitRule::from(self.by).by(share, self.parts.unwrap_or(defaults.parts))
    }

    /// All sides appear together: one side beside an older other one would be a leak.
    fn run(self) -> Result<()> {
        let by = self.by();
        keep_inputs(&self.out, [&self.file])?;
        if std::fs::read_dir(&self.out).is_ok_and(|mut entries| entries.next().is_some()) {
            bail!("{} is not empty: a split does not mix with what is there", self.out.display());
        }
        let data = dataset::read(&self.file)?;
        let splits = split::split(&data, by, self.seed).with_context(|| self.file.display().to_string())?;
        let parent = self.out.parent().filter(|parent| !parent.as_os_str().is_empty());
        let parent = parent.unwrap_or(Path::new("."));
        std::fs::create_dir_all(parent).with_context(|| parent.display().to_string())?;
        let staged =
            tempfile::Builder::new().permissions(Permissions::from_mode(0o777)).tempdir_in(parent)?;
        let (mut text, mut documents) = (String::new(), Vec::new());
        for (index, split) in splits.iter().enumerate() {
            let place = if splits.len() == 1 { String::new() } else { (index + 1).to_string() };
            let (training, held_out) = split.parts(&data);
            let folder = staged.path().join(&place);
            std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
            dataset::write(&folder.join("train.parquet"), &training)?;
            dataset::write(&folder.join("held-out.parquet"), &held_out)?;
            let folder = self.out.join(place).display().to_string();
            let (training, held_out) = (training.samples.len(), held_out.samples.len());
            let (name, leaks) = (&split.name, split.leaks(&data).len());
            writeln!(text, "{folder}: {training} training samples, {held_out} held out: {name}")?;
            if leaks > 0 {
                writeln!(text, "  {leaks} cases are on both sides")?;
            }
            documents.push(json!({"folder": folder, "name": name, "training": training,
                                  "held_out": held_out, "cases_on_both_sides": leaks}));
        }
        std::fs::rename(staged.path(), &self.out).with_context(|| self.out.display().to_string())?;
        if self.json { emit(&format!("{:#}\n", json!(documents))) } else { emit(&text) }
    }
}

fn read_vehicles<'a>(
    vehicles: &Vehicles,
    names: impl Iterator<Item = &'a String>,
) -> Result<BTreeMap<String, Vehicle>> {
    names.map(|name| Ok((name.clone(), vehicles.without_weights(name)?.vehicle))).collect()
}

fn keys<T>(map: &BTreeMap<String, T>) -> String {
    map.keys().cloned().collect::<Vec<_>>().join(", ")
}

/// Writes a data set and says what is in it.
fn write(path: &Path, data: &dataset::Dataset) -> Result<()> {
    dataset::write(path, data)?;
    let mut text = format!("{}\n", path.display());
    for vehicle in Summary::of(data, &|_, _| None).vehicles {
        let images: Vec<_> = vehicle.images.iter().map(|(image, count)| format!("{image} {count}")).collect();
        let (name, cases, samples) = (vehicle.name, vehicle.cases, vehicle.samples);
        writeln!(text, "{name}: {cases} cases, {samples} samples ({})", images.join(", "))?;
    }
    emit(&text)
}

fn describe(file: &Path, html: Option<&Path>, as_json: bool, vehicles: &Vehicles) -> Result<()> {
    let written = begin_page(html, [file])?;
    let data = dataset::read(file)?;
    // kinds are known where the bundle is; a data set of somebody else's vehicle is described by its surfaces
    let known: BTreeMap<_, _> = data
        .meta
        .vehicles
        .keys()
        .filter_map(|name| Some((name, vehicles.without_weights(name).ok()?.vehicle)))
        .collect();
    let kind = |vehicle: &str, surface: &str| {
        let vehicle = known.get(&vehicle.to_owned())?;
        let kind = vehicle.surfaces[vehicle.surface_index(surface)?].kind;
        Some(kind.name().to_owned())
    };
    let summary = Summary::of(&data, &kind);
    if let Some(written) = written {
        written.finish(&page::page(&format!("Data set {}", file.display()), &summary)?)?;
    }
    if as_json { emit(&format!("{:#}\n", json!(summary))) } else { emit(&text(&summary)?) }
}

fn text(summary: &Summary) -> Result<String> {
    let mut text = String::new();
    let contact = format!("{:?}", summary.ground_contact).to_lowercase();
    writeln!(text, "{} cases, {} samples", summary.cases, summary.samples)?;
    writeln!(text, "loads: {}, ground contact: {contact}", summary.provenance)?;
    for (key, note) in &summary.notes {
        writeln!(text, "{key}: {note}")?;
    }
    for vehicle in &summary.vehicles {
        writeln!(text, "\n{}: {} cases, {} samples", vehicle.name, vehicle.cases, vehicle.samples)?;
        for (set, count) in &vehicle.sets {
            writeln!(text, "  set {set:<17} {} cases, {} samples", count.cases, count.samples)?;
        }
        for (image, count) in &vehicle.images {
            writeln!(text, "  image {:<15} {count} samples", image.name())?;
        }
        let parts = vehicle.parts;
        writeln!(
            text,
            "  loads with a moment {:.0} %, viscous part {:.0} %, load at rest {:.0} %",
            100.0 * parts.moment,
            100.0 * parts.viscous,
            100.0 * parts.rest
        )?;
        for (name, range) in &vehicle.ranges {
            writeln!(text, "  {name:<21} {:.4} to {:.4}", range.min, range.max)?;
        }
        writeln!(text, "  cases by depth (down) and speed (across), least to most:")?;
        for row in &vehicle.coverage.cases {
            let counts: String = row.iter().map(|count| format!("{count:>6}")).collect();
            writeln!(text, "  {counts}")?;
        }
        for (axis, s) in ["Fx", "Fy", "Fz"].iter().zip(vehicle.scatter.iter().flatten()) {
            let (sections, cases) = (s.between_sections_n, s.between_cases_n);
            writeln!(
                text,
                "  {axis}: deviation between sections {sections:.3} N, between cases {cases:.3} N"
            )?;
        }
        for (group, share) in &vehicle.shares {
            let (force, drag) = (100.0 * share.of_force, 100.0 * share.of_drag);
            writeln!(text, "  {group:<21} {force:>5.1} % of the force, {drag:>5.1} % of the drag")?;
        }
    }
    Ok(text)
}
