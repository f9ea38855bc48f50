//! `wade vehicle`.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use wade_core::bundle::{self, Bundle, Kept};
use wade_core::condition::FRESH_WATER;
use wade_core::domain::Quantity;
use wade_core::effects::ActiveEffect;
use wade_core::frame::WaterPlane;
use wade_core::geometry::distance::SignedDistanceGrid;
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::geometry::mesh::Mesh;
use wade_core::physics::Radiation;
use wade_core::vehicle::build::{Built, build_reporting};
use wade_core::vehicle::plausible::{Floating, Rounded, questions};
use wade_core::vehicle::shipped;
use wade_core::vehicle::spec::VehicleSpec;
use wade_learn::files::StagedFile;
use wade_learn::panel_code::Capytaine;

use super::import::ImportVehicle;
use super::running::Running;
use super::{Vehicles, emit, interrupt};

/// Build, check and show vehicle bundles
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  wade vehicle import robot.urdf --out vehicles/robot
  wade vehicle build --stl rover.stl --spec rover.toml --out vehicles/rover
  wade vehicle check vehicles/husky
  wade vehicle show husky
  wade vehicle rollback husky
  wade vehicle reload husky")]
pub struct Vehicle {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make a bundle from an STL and a vehicle file
    #[command(after_help = "Example:
  wade vehicle build --stl rover.stl --spec rover.toml --out vehicles/rover")]
    Build {
        /// The hull, any axes and unit
        #[arg(long, value_name = "FILE")]
        stl: PathBuf,
        /// The vehicle file: axes, mass, patches (vehicles/husky/spec.toml is one)
        #[arg(long, value_name = "FILE")]
        spec: PathBuf,
        /// Folder of the bundle, named as the vehicle is; one that is there is replaced, with the next version
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
        /// Replace leaky and double-skinned parts by their convex hulls
        #[arg(long)]
        seal: bool,
        /// Also write the paper's signed distance grid into the bundle, which takes seconds and megabytes; no command needs it
        #[arg(long)]
        sdf: bool,
    },
    Import(ImportVehicle),
    /// Make the bundle of a vehicle that comes with wade, from its dimensions
    #[command(after_help = "Example: wade vehicle generate husky --out vehicles/husky")]
    Generate {
        /// Which
        vehicle: Shipped,
        /// Folder of the bundle, named as the vehicle is
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Read everything in a bundle; exit status 1 where something is wrong
    #[command(after_help = "Example: wade vehicle check vehicles/husky")]
    Check {
        /// Folder of the bundle
        bundle: PathBuf,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// The vehicles that a server would serve, and where each is from
    #[command(after_help = "Example: wade vehicle list --json")]
    List {
        #[command(flatten)]
        vehicles: Vehicles,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Versions of a vehicle: number, date, weights, effects, and where each is
    #[command(after_help = "Example: wade vehicle versions husky")]
    Versions {
        /// Name of the vehicle
        name: String,
        #[command(flatten)]
        vehicles: Vehicles,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Restore the version before the last wade train or wade gap --apply, or any version that is still stored
    ///
    /// Versions lie in <VEHICLES>/<NAME>.versions; wade vehicle versions lists them. What leaves its place is kept too, so that --to
    /// puts it back. Without --to, versions that were taken back before are passed over.
    #[command(after_help = "Examples:
  wade vehicle rollback husky
  wade vehicle rollback husky --to 4 --yes")]
    Rollback {
        /// Name of the vehicle
        name: String,
        /// Version to go to [default: the one before]
        #[arg(long, value_name = "VERSION")]
        to: Option<u32>,
        /// Also where that changes the network, and not the effects alone
        #[arg(long)]
        yes: bool,
        #[command(flatten)]
        vehicles: Vehicles,
        #[command(flatten)]
        running: Running,
    },
    /// Write the source paper's signed distance grid of a hull: longest edge over 64, 0.5 m around it
    ///
    /// A safetensors file: `distance` i16 [nx, ny, nz], x fastest, negative inside; origin, spacing and metres a step are
    /// in its metadata.
    #[command(after_help = "Example: wade vehicle sdf husky --out husky-sdf.safetensors")]
    Sdf {
        /// Name of the vehicle
        name: String,
        /// File to write [default: <NAME>-sdf.safetensors]
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        #[command(flatten)]
        vehicles: Vehicles,
    },
    /// Compute added mass and waves of a hull with capytaine, in the place of the estimate in its bundle
    ///
    /// Takes minutes of one core. The bundle becomes the next version; rollback restores the one before.
    #[command(after_help = "Example: wade vehicle radiation rover --python ~/capytaine/bin/python")]
    Radiation {
        /// Name of the vehicle
        name: String,
        /// Python that has capytaine [default: WADE_PYTHON, else python3]
        #[arg(long, value_name = "FILE")]
        python: Option<PathBuf>,
        /// Write the estimate that `wade vehicle build` makes
        #[arg(long, conflicts_with = "python")]
        estimate: bool,
        #[command(flatten)]
        vehicles: Vehicles,
        #[command(flatten)]
        running: Running,
    },
    /// Have a running server read a bundle again; exit status 1 where it refuses and keeps the version that it serves
    #[command(after_help = "Examples:
  wade vehicle reload husky
  wade vehicle reload --server unix:/run/wade/wade.sock")]
    Reload {
        /// Name of the vehicle [default: every vehicle that it serves]
        name: Option<String>,
        #[command(flatten)]
        running: Running,
    },
    /// Dimensions, surfaces, training domain and hydrostatics of a vehicle
    #[command(after_help = "Example: wade vehicle show warthog")]
    Show {
        /// Name of the vehicle
        name: String,
        #[command(flatten)]
        vehicles: Vehicles,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Shipped {
    /// Clearpath Husky A200, K = 13
    Husky,
    /// Clearpath Warthog, K = 10
    Warthog,
}

impl Vehicle {
    /// Runs the subcommand.
    pub fn run(self) -> Result<ExitCode> {
        match self.command {
            Command::Build { stl, spec, out, seal, sdf } => {
                let text = std::fs::read_to_string(&spec).with_context(|| spec.display().to_string())?;
                let bytes = std::fs::read(&stl).with_context(|| stl.display().to_string())?;
                build(&text, &bytes, &out, Made { seal, sdf })
                    .with_context(|| format!("{} with {}", stl.display(), spec.display()))?;
            }
            Command::Import(command) => command.run()?,
            Command::Generate { vehicle, out } => {
                let (shipped, text) = match vehicle {
                    Shipped::Husky => (shipped::husky()?, shipped::HUSKY_SPEC),
                    Shipped::Warthog => (shipped::warthog()?, shipped::WARTHOG_SPEC),
                };
                build(text, &shipped.stl(), &out, Made::default())?;
            }
            Command::Check { bundle, json } => return Ok(check(&bundle, json)),
            Command::List { vehicles, json } => {
                let library = vehicles.library()?;
                let mut rows = Vec::new();
                for name in library.names()? {
                    let origin = library.source(&name)?.origin();
                    rows.push((name, origin));
                }
                if json {
                    let rows = rows.iter().map(|(name, origin)| json!({"name": name, "origin": origin}));
                    emit(&format!("{}\n", json!(rows.collect::<Vec<_>>())))?;
                } else {
                    let line = |(name, origin): &(String, String)| format!("{name:<16} {origin}\n");
                    emit(&rows.iter().map(line).collect::<String>())?;
                }
            }
            Command::Versions { name, vehicles, json } => {
                let (current, others) = vehicles.library()?.versions(&name)?;
                versions(&name, &current, &others, json)?;
            }
            Command::Rollback { name, to, yes, vehicles, running } => {
                let library = vehicles.library()?;
                let (current, target) = library.roll_back_plan(&name, to)?;
                if current.network_sha256 != target.network_sha256 && !yes {
                    bail!(
                        "{name}: version {} has another network ({}) than version {} ({}): going back changes the model and not its effects alone; say --yes to do it",
                        target.version,
                        weights_text(&target),
                        current.version,
                        weights_text(&current)
                    );
                }
                library.roll_back(&name, to)?;
                println!(
                    "{name}: version {} is in its place again ({})",
                    target.version,
                    target.source.origin()
                );
                println!("  weights: {}", weights_text(&target));
                let gone = current.effects.iter().filter(|name| !target.effects.contains(name));
                let gone: Vec<&str> = gone.copied().collect();
                println!("  effects: {}; taken back: {}", list(&target.effects), list(&gone));
                running.reload(&name, &library.place(&name).unwrap_or_default());
            }
            Command::Sdf { name, out, vehicles } => {
                let out = out.unwrap_or_else(|| format!("{name}-sdf.safetensors").into());
                sdf(&vehicles.without_weights(&name)?.vehicle.hull.mesh, &out)?;
            }
            Command::Radiation { name, python, estimate, vehicles, running } => {
                let library = vehicles.library_to_write()?;
                let mut bundle = library.read(&name)?;
                let radiation = if estimate {
                    Radiation::estimate(&bundle.vehicle)
                } else {
                    panel_code(python, &bundle.vehicle)?
                };
                let source = radiation.source.clone();
                bundle.radiation = Some(radiation);
                for (place, version) in library.succeed_together(vec![bundle])? {
                    println!("{name}: version {version}, added mass and waves: {source}");
                    running.reload(&name, &place);
                }
            }
            Command::Reload { name, running } => {
                let served = running.ask(name.as_deref().unwrap_or_default())?;
                return Ok(if served { ExitCode::SUCCESS } else { ExitCode::FAILURE });
            }
            Command::Show { name, vehicles, json } => {
                let library = vehicles.library()?;
                show(&library.read(&name)?, &library.versions(&name)?.1, json)?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}

/// What a build does besides.
#[derive(Debug, Clone, Copy, Default)]
struct Made {
    seal: bool,
    sdf: bool,
}

fn list(names: &[&str]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn weights_text(version: &Kept) -> String {
    let weights = version.weights.as_ref();
    weights.map_or_else(|| "none yet".to_owned(), |(variant, provenance)| format!("{variant}, {provenance}"))
}

/// What stands in the column of a version's date.
fn date_of(version: &Kept) -> String {
    version.written_unix_s.map_or_else(|| "released".to_owned(), wade_learn::files::utc_date)
}

fn versions(name: &str, current: &Kept, others: &[Kept], as_json: bool) -> Result<()> {
    let mut all: Vec<&Kept> = others.iter().chain([current]).collect();
    all.sort_by_key(|version| version.version);
    let state = |version: &Kept| match version {
        version if version.version == current.version => "in place",
        version if version.taken_back => "taken back",
        _ => "kept",
    };
    if as_json {
        let versions = all.iter().map(|version| {
            json!({"version": version.version, "state": state(version), "date": date_of(version),
                "variant": version.weights.as_ref().map(|(variant, _)| variant),
                "provenance": version.weights.as_ref().map(|(_, provenance)| provenance),
                "network_sha256": version.network_sha256, "effects": version.effects,
                "origin": version.source.origin()})
        });
        let document = json!({"name": name, "versions": versions.collect::<Vec<_>>()});
        return emit(&format!("{document:#}\n"));
    }
    let mut text = String::new();
    for version in all {
        // writing to a String cannot fail
        let _ = writeln!(
            text,
            "{:>7}  {:<10} {:<16} effects: {}",
            version.version,
            state(version),
            date_of(version),
            list(&version.effects)
        );
        let _ = writeln!(text, "         weights: {}", weights_text(version));
        let _ = writeln!(text, "         {}", version.source.origin());
    }
    emit(&text)
}

fn build(spec_text: &str, stl: &[u8], out: &Path, made: Made) -> Result<()> {
    let spec: VehicleSpec = toml::from_str(spec_text)?;
    interrupt::end_between_writes()?;
    bundle::check_place(out, &spec.name)?;
    let before = match out.exists() {
        true => Some(bundle::read(out).context("the bundle in place cannot be read; move it away first")?),
        false => None,
    };
    let Built { vehicle, tidying, sealing, overlap_m3 } = build_reporting(&spec, stl, made.seal)?;
    if !tidying.is_nothing() {
        eprintln!(
            "mended: {} corners joined that differed by rounding; dropped: {} faces without area, {} faces that stand \
             there twice",
            tidying.joined_corners, tidying.dropped_faces, tidying.repeated_faces
        );
    }
    if let Some(sealing) = sealing {
        eprintln!("sealed: {sealing}");
    }
    if overlap_m3 > 0.0 {
        let percent = 100.0 * overlap_m3 / vehicle.hull.mesh.volume();
        eprintln!(
            "warning: parts overlap: {:.3} l, {percent:.1} % of the volume, are displaced twice",
            overlap_m3 * 1e3
        );
    }
    let floating = Floating::of(&vehicle);
    let summary = summary(&vehicle, &floating);
    for question in questions(&vehicle, &floating) {
        eprintln!("warning: {question}");
    }
    let distance = if made.sdf { Some(signed_distance(&vehicle.hull.mesh)?) } else { None };
    let vehicle_translation = vehicle.translation;
    let spec = Some(spec_text.to_owned());
    let radiation = Some(Radiation::estimate(&vehicle));
    let bundle = Bundle { vehicle, version: 0, trained: None, radiation, effects: None, distance, spec };
    let version = interrupt::whole(|| bundle::succeed(out, bundle))?;
    let t = vehicle_translation;
    println!("{}: version {version}, answers by physics alone until it is trained", out.display());
    if let Some(Bundle { vehicle, version, trained: Some(_), .. }) = before {
        println!("version {version} is kept: wade vehicle rollback {} puts it back", vehicle.name);
    }
    print!("{summary}");
    println!(
        "body frame = axes and scale of the STL, then moved by ({}, {}, {}) m",
        Rounded(t.x),
        Rounded(t.y),
        Rounded(t.z)
    );
    Ok(())
}

/// Added mass and waves by capytaine, with a progress bar on a terminal.
fn panel_code(python: Option<PathBuf>, vehicle: &wade_core::vehicle::Vehicle) -> Result<Radiation> {
    let code = Capytaine::find(python)?;
    let bar = ProgressBar::new(0)
        .with_message(format!("capytaine {}", code.version))
        .with_style(ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} water levels, {eta} left")?);
    let radiation = code.radiation(vehicle, &|done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    Ok(radiation)
}

/// Size, mass, displaced volume and floating position, a line each.
pub(super) fn summary(vehicle: &wade_core::vehicle::Vehicle, floating: &Floating) -> String {
    let d = &vehicle.dimensions;
    let mut text = format!("length {:.3} m, width {:.3} m, height {:.3} m\n", d.length, d.width, d.height);
    // writing to a String cannot fail
    let _ = writeln!(
        text,
        "mass {:.3} kg, displaced volume {:.3} l",
        vehicle.mass,
        floating.displaced_volume * 1e3
    );
    let _ = match floating.depth {
        Some(depth) => {
            writeln!(text, "floats in fresh water {depth:.3} m deep; trim {}", floating.trim_in_words())
        }
        None => writeln!(text, "does not float in fresh water: it weighs more than it displaces"),
    };
    text
}

/// The paper's grid, with a progress bar on a terminal.
fn signed_distance(mesh: &Mesh) -> Result<SignedDistanceGrid> {
    let bar = ProgressBar::new(0)
        .with_message("signed distance")
        .with_style(ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} slices, {eta} left")?);
    let grid = SignedDistanceGrid::build(mesh, &|done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    Ok(grid)
}

fn sdf(mesh: &Mesh, out: &Path) -> Result<()> {
    let mut file = StagedFile::new(out).with_context(|| format!("cannot write {}", out.display()))?;
    let grid = signed_distance(mesh)?;
    let written = file.write_all(&bundle::distance_bytes(&grid)).and_then(|()| file.finish());
    written.with_context(|| out.display().to_string())?;
    let ([nx, ny, nz], o) = (grid.shape, grid.origin);
    println!(
        "{}: {nx} x {ny} x {nz} points, {:.4} m apart, from ({}, {}, {}) m in the body frame",
        out.display(),
        grid.spacing,
        Rounded(o.x),
        Rounded(o.y),
        Rounded(o.z)
    );
    Ok(())
}

fn check(directory: &Path, as_json: bool) -> ExitCode {
    let outcome = bundle::read(directory);
    if as_json {
        let error = outcome.as_ref().err().map(ToString::to_string);
        println!("{}", json!({"bundle": directory, "ok": outcome.is_ok(), "error": error}));
    } else {
        match &outcome {
            Ok(bundle) => println!("{}: sound, version {}", directory.display(), bundle.version),
            Err(error) => eprintln!("error: {error}"),
        }
    }
    ExitCode::from(u8::from(outcome.is_err()))
}

/// Depths at which hydrostatics are shown, as shares of the height.
const SHOWN_DEPTHS: [f64; 4] = [0.15, 0.30, 0.45, 0.60];

fn show(bundle: &Bundle, kept: &[Kept], as_json: bool) -> Result<()> {
    let vehicle = &bundle.vehicle;
    let lift = SHOWN_DEPTHS.map(|share| {
        let depth = share * vehicle.dimensions.height;
        let plane = WaterPlane::level(vehicle.z0, depth);
        let force =
            hydrostatics(&vehicle.hull.mesh, &plane, FRESH_WATER, &vehicle.center_of_mass).wrench.force.z;
        (depth, force)
    });
    let domain = bundle.trained.as_ref().map(|&(_, domain)| domain);
    let weights =
        bundle.trained.as_ref().map(|(weights, _)| (weights.form.name(), weights.provenance.as_str()));
    let told =
        |weights: Option<(&str, &str)>| weights.map_or("none yet".into(), |(v, p)| format!("{v}, {p}"));
    let ranges = || Quantity::ALL.into_iter().filter_map(|q| Some((q.name(), domain?.range(q)?)));
    let d = &vehicle.dimensions;
    let effects: Vec<&ActiveEffect> = bundle.effects.iter().flat_map(|file| &file.effects).collect();
    if as_json {
        let surfaces = vehicle.surfaces.iter().map(|s| {
            json!({"name": s.name, "kind": s.kind, "centroid_m": s.centroid.as_slice(),
                   "normal": s.normal.as_slice(), "area_m2": s.area})
        });
        let document = json!({
            "name": vehicle.name, "version": bundle.version,
            "variant": weights.map(|(variant, _)| variant), "provenance": weights.map(|(_, provenance)| provenance),
            "length_m": d.length, "width_m": d.width, "height_m": d.height, "z0_m": vehicle.z0,
            "mass_kg": vehicle.mass, "center_of_mass_m": vehicle.center_of_mass.as_slice(),
            "faces": vehicle.hull.mesh.faces.len(), "surfaces": surfaces.collect::<Vec<_>>(),
            "domain": ranges().map(|(name, range)| (name.to_owned(), json!([range.min, range.max])))
                .collect::<serde_json::Map<_, _>>(),
            "effects": effects,
            "kept": kept.iter().map(|kept| json!({"version": kept.version,
                "variant": kept.weights.as_ref().map(|(variant, _)| variant),
                "provenance": kept.weights.as_ref().map(|(_, provenance)| provenance), "effects": kept.effects}))
                .collect::<Vec<_>>(),
            "hydrostatics": lift.map(|(depth, force)| json!({"depth_m": depth, "fz_n": force})),
        });
        return emit(&format!("{document:#}\n"));
    }
    let mut text = String::new();
    // writing to a String cannot fail
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    line(format!("{}, version {}, weights: {}", vehicle.name, bundle.version, told(weights)));
    line(format!(
        "L W H {:.3} x {:.3} x {:.3} m, ground at z {} m, {:.1} kg",
        d.length,
        d.width,
        d.height,
        Rounded(vehicle.z0),
        vehicle.mass
    ));
    line(format!("{:<18} {:<7} {:>8}  centroid [m]            normal", "surface", "kind", "area m2"));
    for s in &vehicle.surfaces {
        // a rounded zero has no sign
        let vector = |v: &wade_core::frame::Vec3| {
            let [x, y, z] = [v.x, v.y, v.z].map(|c| (c * 1e3).round() / 1e3 + 0.0);
            format!("{x:7.3} {y:7.3} {z:7.3}")
        };
        let kind = s.kind.name();
        line(format!(
            "{:<18} {kind:<7} {:>8.4}  {} {}",
            s.name,
            s.area,
            vector(&s.centroid),
            vector(&s.normal)
        ));
    }
    for (name, range) in ranges() {
        line(format!("trained for {name:<20} {} to {}", Rounded(range.min), Rounded(range.max)));
    }
    for effect in effects {
        line(format!("effect {}: {}", effect.effect().name(), effect.equation));
        for (name, p) in &effect.parameters {
            let unit = if p.unit == "1" { "" } else { &p.unit };
            line(format!("  {name:<16} {} +- {:.4} {unit}", Rounded(p.value), p.std));
        }
    }
    for kept in kept {
        let effects = if kept.effects.is_empty() { "no effects".into() } else { kept.effects.join(", ") };
        let weights =
            told(kept.weights.as_ref().map(|(variant, provenance)| (*variant, provenance.as_str())));
        line(format!("kept: version {}, weights: {weights}; {effects}", kept.version));
    }
    for (depth, force) in lift {
        line(format!("lift at rest in fresh water, {depth:.3} m deep: {force:.1} N"));
    }
    emit(&text)
}
