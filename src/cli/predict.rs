//! `wade predict`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;
use wade::states::{Row, WheelColumns, unknown_columns};
use wade_core::domain::{Domain, Outside};
use wade_core::frame::Vec3;
use wade_core::model::Model;
use wade_core::served::Session;
use wade_learn::files::StagedFile;
use wade_learn::trials::{Recorded, Remark, acceleration, are_rates, derivative, long_step, turning};
use wade_wire::State;
use wade_wire::{Evaluated, Evaluator};

use super::state::Terms;
use super::{Vehicles, outside};

/// Forces for every row of a table of states
///
/// Columns: vx vy vz and depth, or water_level in its place; optionally bed_clearance, bed, cx cy cz (current), wx wy wz, roll pitch yaw, ax ay az, alx aly alz, rho,
/// wheel_fl wheel_fr wheel_rl wheel_rr (of a vehicle with other wheels the names of its wheel surfaces), in SI units and radians. Other columns are kept. Adds fx fy fz mx my mz about the
/// center of mass; their predicted standard deviations sfx sfy sfz smx smy smz; in_domain (1 or 0); and outside, the quantities outside the training domain with `;` between them. Where there
/// is a column t, the rows are one run in time, along which waves and flooding are remembered; accelerations that have no column
/// are then the derivatives of the velocities.
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
    /// Adds the forces of each surface, with what effects put on it; what they put on the hull as a whole is in the net alone
    #[arg(long)]
    per_surface: bool,
    /// Exit status 1 where a row is outside the training domain
    #[arg(long)]
    strict: bool,
    /// How much of the physical base answers
    #[arg(long, value_enum, default_value_t = Terms::Full)]
    physics: Terms,
    #[command(flatten)]
    vehicles: Vehicles,
}

/// Columns that are added for every row.
const ADDED: [&str; 14] =
    ["fx", "fy", "fz", "mx", "my", "mz", "sfx", "sfy", "sfz", "smx", "smy", "smz", "in_domain", "outside"];

impl Predict {
    /// Writes the table beside its place and renames it, so that a failure leaves no half of it.
    pub fn run(self) -> Result<ExitCode> {
        let vehicle = self.vehicles.served(&self.vehicle)?;
        let states = self.states.display();
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_path(&self.states)
            .with_context(|| states.to_string())?;
        let headers = reader.headers().with_context(|| states.to_string())?.clone();
        let wheels = WheelColumns::of_model(vehicle.model(), &headers);
        check_columns(&headers, &wheels).with_context(|| states.to_string())?;
        let out = || self.out.display().to_string();
        let mut staged = StagedFile::new(&self.out).with_context(out)?;
        let mut writer = csv::Writer::from_writer(&mut staged);
        writer.write_record(headers.iter().map(str::to_owned).chain(self.names(vehicle.model())))?;
        let mut evaluator = Evaluator::default();
        let mut session = headers.iter().any(|header| header == "t").then(Session::of_recording);
        let accelerations = match session {
            Some(_) => Accelerations::of(&self.states, &headers, &wheels)?,
            None => Accelerations::default(),
        };
        let mut before: Option<f64> = None;
        let mut far = Far::default();
        for (index, record) in reader.records().enumerate() {
            let at = || format!("{states}, row {}", index + 2);
            let record = record.with_context(at)?;
            let row = Row::read(&record, &headers, &wheels).with_context(at)?;
            let time_step = time_step(row.t, before, session.is_some()).with_context(at)?;
            before = row.t;
            let state = State { time_step, physics: Some(self.physics.into()), ..row.state() };
            let state = accelerations.of_row(index, state);
            let state = state.check_for(&vehicle).with_context(at)?;
            let evaluated = evaluator.evaluate(&vehicle, &state, session.as_mut());
            far.count(&evaluated.forces.outside);
            let added = self.values(&evaluated);
            writer.write_record(record.iter().map(str::to_owned).chain(added))?;
        }
        writer.flush()?;
        drop(writer);
        staged.finish().with_context(out)?;
        if let Some(warning) = far.warning(vehicle.model().domain()) {
            eprint!("{warning}");
        }
        Ok(ExitCode::from(u8::from(self.strict && far.outside > 0)))
    }

    fn names(&self, model: &Model) -> Vec<String> {
        let net = ADDED.into_iter().map(str::to_owned);
        let surfaces = model.vehicle().surfaces.iter().filter(|_| self.per_surface);
        net.chain(surfaces.flat_map(|s| ["fx", "fy", "fz"].map(|axis| format!("{}_{axis}", s.name))))
            .collect()
    }

    fn values(&self, Evaluated { forces, effects, .. }: &Evaluated<'_>) -> Vec<String> {
        let no_effects = vec![Vec3::zeros(); forces.surfaces.len()];
        let added = if effects.loads.is_empty() { &no_effects } else { &effects.surface_forces };
        let wrench = forces.wrench.force.iter().chain(forces.wrench.moment.iter()).map(number);
        let deviation = forces.uncertainty.iter().chain(forces.moment_uncertainty.iter()).map(number);
        let in_domain = u8::from(forces.outside.is_inside()).to_string();
        let outside: Vec<&str> = forces.outside.iter().map(|(quantity, _)| quantity.name()).collect();
        let surfaces = forces.surfaces.iter().zip(added).filter(|_| self.per_surface);
        let loads =
            surfaces.flat_map(|(load, added)| <[f64; 3]>::from(load.force + added).map(|f| number(&f)));
        wrench.chain(deviation).chain([in_domain, outside.join(";")]).chain(loads).collect()
    }
}

/// Finest force or moment that is written [N, N m]: what is below is left of rounding, and would be written as -0.
const FINEST: i32 = 9;

/// A load with nine significant digits, more than the weights have, and never finer than [`FINEST`] decimals.
fn number(value: &f64) -> String {
    let before = value.abs().max(1.0).log10().floor() as i32 + 1;
    let decimals = usize::try_from(FINEST - before).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Accelerations of the rows of a run, as in `wade gap`: those of a table without them are the derivatives of the velocities, and
/// those that are rates of the velocity's components get what turning adds.
#[derive(Default)]
struct Accelerations {
    linear: Option<Vec<Vec3>>,
    angular: Option<Vec<Vec3>>,
    /// Place of each row among the stamps; two rows may have one.
    place: Vec<usize>,
}

impl Accelerations {
    /// None where a row cannot be read or holds no number: it is reported where it is evaluated.
    fn of(path: &Path, headers: &csv::StringRecord, wheels: &WheelColumns) -> Result<Self> {
        let is_stated =
            |names: [&str; 3]| names.iter().any(|name| headers.iter().any(|header| header == *name));
        let stated = [["ax", "ay", "az"], ["alx", "aly", "alz"]].map(is_stated);
        if !path.metadata().with_context(|| path.display().to_string())?.is_file() {
            // what can be read once only is taken as it is
            if stated == [true; 2] {
                return Ok(Self::default());
            }
            bail!("{} is no file, and is read twice: give it ax ay az and alx aly alz", path.display());
        }
        let (mut times, mut velocity, mut angular, mut recorded, mut place) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for record in csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path)?.records() {
            let Some((t, [v, omega], a)) = record.ok().and_then(|record| {
                let row = Row::read(&record, headers, wheels).ok()?;
                Some((row.t?, row.motion(), row.acceleration()))
            }) else {
                return Ok(Self::default());
            };
            let later = times.last().is_none_or(|last| t > *last);
            if !later && times.last() != Some(&t) || !(t + v.sum() + omega.sum()).is_finite() {
                return Ok(Self::default());
            }
            if later {
                times.push(t);
                velocity.push(v);
                angular.push(omega);
                recorded.push(a);
            }
            place.push(times.len() - 1);
        }
        if let Some(step) = long_step(&times) {
            eprintln!("{}", Remark::Clock { trial: path.display().to_string(), step });
        }
        let [has_linear, has_angular] = stated;
        let motion =
            Recorded { t: &times, velocity: &velocity, angular_velocity: &angular, acceleration: &recorded };
        let linear = if !has_linear {
            Some(acceleration(&times, &velocity, &angular))
        } else if are_rates(std::iter::once(motion)) {
            eprintln!("{}: {}", path.display(), Remark::Rates);
            Some(recorded.iter().zip(turning(&velocity, &angular)).map(|(rate, turn)| rate + turn).collect())
        } else {
            None
        };
        Ok(Self { linear, angular: (!has_angular).then(|| derivative(&times, &angular)), place })
    }

    fn of_row(&self, row: usize, state: State) -> State {
        let of = |values: &Option<Vec<Vec3>>| -> Option<[f32; 3]> {
            let value = values.as_ref()?.get(*self.place.get(row)?)?;
            Some([value.x, value.y, value.z].map(|x| x as f32))
        };
        State {
            acceleration: of(&self.linear).unwrap_or(state.acceleration),
            angular_acceleration: of(&self.angular).unwrap_or(state.angular_acceleration),
            ..state
        }
    }
}

/// How many rows are outside the training domain, and the farthest of each quantity.
#[derive(Default)]
struct Far {
    rows: usize,
    outside: usize,
    farthest: Outside,
}

impl Far {
    fn count(&mut self, outside: &Outside) {
        self.rows += 1;
        self.outside += usize::from(!outside.is_inside());
        for (farthest, excess) in self.farthest.excess.iter_mut().zip(outside.excess) {
            if excess.abs() > farthest.abs() {
                *farthest = excess;
            }
        }
    }

    fn warning(&self, domain: &Domain) -> Option<String> {
        let lines = outside::lines(&self.farthest, Some(domain));
        (self.outside > 0).then(|| {
            format!(
                "warning: {} of {} rows are outside the training domain; their forces are not reliable. Farthest:\n{lines}",
                self.outside, self.rows
            )
        })
    }
}

/// Seconds since the row before; 0 in the first, and where the rows are no run in time.
fn time_step(t: Option<f64>, before: Option<f64>, is_run: bool) -> Result<f32> {
    match (t, before) {
        _ if !is_run => Ok(0.0),
        (None, _) => bail!("column t is blank: in a run in time every row has one"),
        (Some(t), Some(before)) if t < before => {
            bail!(
                "t = {t} comes after {before}: the rows of a run must be in the order of time; leave t out for single states"
            )
        }
        (Some(t), before) => Ok(before.map_or(0.0, |before| (t - before) as f32)),
    }
}

/// Refuses a table without a state or with forces already, and names the unused columns.
fn check_columns(headers: &csv::StringRecord, wheels: &WheelColumns) -> Result<()> {
    let has = |name: &str| headers.iter().any(|header| header.trim() == name);
    let there = || headers.iter().collect::<Vec<_>>().join(", ");
    if let Some(missing) = ["vx", "vy", "vz"].into_iter().find(|name| !has(name)) {
        bail!("column {missing} is missing; there are: {}", there());
    }
    if !has("depth") && !has("water_level") {
        bail!("column depth is missing, or water_level in its place; there are: {}", there());
    }
    if let Some(taken) = ADDED.into_iter().find(|name| has(name)) {
        bail!("column {taken} is there already: wade predict adds it; rename or remove yours");
    }
    unknown_columns(headers, wheels)
        .iter()
        .for_each(|column| eprintln!("column {column} is kept and not used"));
    Ok(())
}
