//! Trials of a case with their key.

use std::collections::BTreeMap;

use super::capture::{Instruments, Record};
use super::case::Case;
use super::cause::{Cause, Planted};
use super::command::{Command, commands};
use super::dynamics::{Instant, SUBSTEPS, Vehicle};
use super::key::Key;
use super::{MASS, VEHICLE, hull, simulator, yaw_inertia};
use crate::hidden::{Parameter, Setting, parameters, strength};
use crate::track::{CHANNEL, DENSITY};
use crate::{Simulator, State, Track, Wrench6};
use wade_core::frame::Vec3;
use wade_learn::random::Random;
use wade_learn::signal::pieces;
use wade_learn::trials::{Body, Gap, Manifest, Measured, Method, StillWater, Trial, Trials};

/// Columns of the drive.
const DRIVE: [&str; 2] = ["drive_fx", "drive_mz"];
/// Draft that the body's table states [m].
const DRAFT: f64 = 0.2032;
/// Friction of the bearings where there are wheel speeds only: the dry twin has it too [N].
const FRICTION: f64 = 8.0;

/// Trials with what is true of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Generated {
    /// What a tool may see.
    pub trials: Trials,
    /// What it may not.
    pub key: Key,
    /// The exact change of fx [N] and mz [N m], by trial in water and sample, less that of the dry twin.
    pub change: Vec<Vec<[f64; 2]>>,
}

/// A trial as it was driven and recorded.
struct Run {
    command: Command,
    instants: Vec<Instant>,
    record: Record,
}

/// Generates the trials of a case; the same case gives the same bits.
pub fn generate(case: &Case) -> Generated {
    let hull = hull();
    let simulator = simulator(&hull);
    let mut random = Random::new(case.seed);
    let commands = commands(case.plan, &mut random.fork());
    let noise = random.fork();
    let runs = drive(case, &commands, &case.planted, simulator, &mut noise.clone());
    let without = drive(case, &commands, &[], simulator, &mut noise.clone());
    let floor = root_mean_square(&less_twin(case, &without, |run| run.gap(case, &simulator)));
    let change = less_twin(case, &runs, |run| run.record.change.clone());
    let only_fx = |change: &[f64; 2]| Wrench6::x() * change[0];
    let changes: Vec<Vec<Wrench6>> =
        change.iter().map(|change| change.iter().map(only_fx).collect()).collect();
    // a null changes nothing but for the rounding of its numbers
    let strength = match case.planted.is_empty() {
        true => 0.0,
        false => strength(&changes, &(Wrench6::x() * floor[0]), &[true, false, false, false, false, false]),
    };
    let wet = runs.iter().filter(|run| run.command.depth > 0.0);
    let tracks: Vec<Track> = wet.map(track).collect();
    let parameters = case.planted.iter().map(|planted| parameters_of(planted, simulator, &tracks)).collect();
    let key = Key::new(case, strength, floor, parameters);
    Generated { trials: trials(case, &runs, simulator), key, change }
}

/// Drives and records all trials, those in water first, and then their dry twins.
fn drive(
    case: &Case,
    commands: &[Command],
    planted: &[Planted],
    simulator: Simulator,
    random: &mut Random,
) -> Vec<Run> {
    let instruments = Instruments {
        marker: case.marker.std(),
        flaw: case.flaw,
        planted,
        mass: stated_mass(planted),
        yaw_inertia: yaw_inertia(simulator.hull),
    };
    let friction = if case.plan.is_without_drive() { FRICTION } else { 0.0 };
    let vehicle = Vehicle { simulator, planted, friction };
    let dry = commands.iter().filter(|_| case.plan.has_twins()).map(Command::dry);
    let all = commands.iter().cloned().chain(dry);
    all.filter_map(|command| {
        let mut random = random.fork();
        let instants = vehicle.drive(&command, SUBSTEPS);
        let record = instruments.record(&command, &instants, &simulator, &mut random)?;
        Some(Run { command, instants, record })
    })
    .collect()
}

/// Mass in `trials.toml` [kg].
fn stated_mass(planted: &[Planted]) -> f64 {
    let error = planted.iter().find(|planted| planted.cause == Cause::MassError);
    MASS + error.map_or(0.0, |planted| planted.size)
}

impl Run {
    /// Recorded gap of fx [N] and mz [N m], with the mass as it is.
    fn gap(&self, case: &Case, simulator: &Simulator) -> Vec<[f64; 2]> {
        let mass = [simulator.hull.mass, yaw_inertia(simulator.hull)];
        let gap = |(i, state): (usize, &State)| {
            let predicted = simulator.predict(state);
            let rates = [state.acceleration.x, state.angular_acceleration.z];
            let drive = self.record.drive.each_ref().map(|drive| drive[i]);
            let drive = if case.plan.is_without_drive() { [0.0; 2] } else { drive };
            [0, 1].map(|axis| mass[axis] * rates[axis] - drive[axis] - predicted[[0, 5][axis]])
        };
        self.record.states.iter().enumerate().map(gap).collect()
    }
}

/// A quantity of each trial in water, less that of its dry twin where it has one.
fn less_twin(case: &Case, runs: &[Run], of: impl Fn(&Run) -> Vec<[f64; 2]>) -> Vec<Vec<[f64; 2]>> {
    let twin = |wet: &Run| {
        runs.iter().find(|run| case.plan.has_twins() && run.command.name == wet.command.dry().name)
    };
    let less = |wet: &Run| {
        let mut values = of(wet);
        if let Some(dry) = twin(wet) {
            for (value, dry) in values.iter_mut().zip(of(dry)) {
                *value = [value[0] - dry[0], value[1] - dry[1]];
            }
        }
        values
    };
    runs.iter().filter(|run| run.command.depth > 0.0).map(less).collect()
}

/// Root mean square over all trials and samples.
fn root_mean_square(values: &[Vec<[f64; 2]>]) -> [f64; 2] {
    let all = || values.iter().flatten();
    let square = |axis: usize| all().map(|value| value[axis] * value[axis]).sum::<f64>();
    [0, 1].map(|axis| (square(axis) / all().count().max(1) as f64).sqrt())
}

fn track(run: &Run) -> Track {
    Track {
        name: run.command.name.clone(),
        session_time: 0.0,
        channel_width: CHANNEL,
        step: 1.0 / super::dynamics::CAMERA_RATE,
        states: run.instants.iter().step_by(SUBSTEPS).map(|instant| instant.state).collect(),
    }
}

/// Parameters of what is hidden, as a tool may state them.
fn parameters_of(planted: &Planted, simulator: Simulator, tracks: &[Track]) -> Vec<Parameter> {
    if let Some(hidden) = planted.hidden().filter(|_| planted.cause != Cause::MassError) {
        return parameters(&hidden, &Setting { simulator, session: 0.0 }, tracks);
    }
    let size = planted.size;
    let one = |names, unit, value| Parameter { names, unit, value };
    match planted.cause {
        // what is stated is too much; a share is one of what is stated
        Cause::MassError => vec![
            one(&["mass", "error", "difference"], "kg", size),
            one(&["relative_error"], "1", -size / (simulator.hull.mass + size)),
        ],
        Cause::DrivetrainInertia => vec![
            one(&["mass", "inertia", "equivalent_mass"], "kg", size),
            one(&["relative_error"], "1", size / simulator.hull.mass),
        ],
        // a zero of the inferred force is off by as much the other way
        Cause::DriveOffset => {
            vec![one(&["offset", "drive_fx"], "N", size), one(&["fx", "bias_fx"], "N", -size)]
        }
        _ => vec![one(&["lag", "delay", "tau", "time", "time_constant"], "s", size)],
    }
}

fn trials(case: &Case, runs: &[Run], simulator: Simulator) -> Trials {
    let hull = simulator.hull;
    let has_drive = !case.plan.is_without_drive();
    let twins = runs.iter().filter(|_| case.plan.has_twins()).filter(|run| run.command.depth > 0.0);
    let twins = twins.map(|run| (run.command.name.clone(), run.command.dry().name));
    let manifest = Manifest {
        vehicle: VEHICLE.to_owned(),
        generated: Some(format!(
            "generated by the motion benchmark of the gap workflow, seed {}: motion, poses and drive force; nothing of it was measured",
            case.seed
        )),
        fluid_density: Some(DENSITY),
        channel_width: Some(CHANNEL),
        mass: Some(stated_mass(&case.planted)),
        measured: Measured {
            method: Some(Method::InverseDynamics),
            other_forces: DRIVE.iter().filter(|_| has_drive).map(|name| (*name).to_owned()).collect(),
            dry_twins: twins.collect(),
            ..Measured::default()
        },
        body: Some(Body {
            length: hull.length,
            width: hull.width,
            draft: DRAFT,
            mass: stated_mass(&case.planted),
            displaced_volume: hull.volume(DRAFT),
            center_of_mass: (hull.center_of_mass - Vec3::z() * (hull.z0 + 0.5 * DRAFT)).into(),
        }),
        ..Manifest::default()
    };
    let trials = runs.iter().map(|run| trial(run, has_drive, &simulator)).collect();
    Trials { manifest, trials, accelerations_were_rates: false }
}

fn trial(run: &Run, has_drive: bool, simulator: &Simulator) -> Trial {
    let states = &run.record.states;
    let of = |value: &dyn Fn(&State) -> f64| -> Vec<f64> { states.iter().map(value).collect() };
    let vectors = |value: &dyn Fn(&State) -> Vec3| -> Vec<Vec3> { states.iter().map(value).collect() };
    let t = of(&|state| state.t);
    let rows: Vec<u64> = (2..).take(t.len()).collect();
    let starts = pieces(&t).into_iter().skip(1).map(|piece| piece.start);
    let gaps = starts.map(|start| Gap { row: rows[start], seconds: t[start] - t[start - 1] }).collect();
    let predicted: Vec<Wrench6> = states.iter().map(|state| simulator.predict(state)).collect();
    let drive = DRIVE.iter().zip(&run.record.drive).filter(|_| has_drive);
    Trial {
        name: run.command.name.clone(),
        gaps,
        velocity: vectors(&|state| state.velocity),
        current: vec![Vec3::zeros(); t.len()],
        angular_velocity: vectors(&|state| state.angular_velocity),
        acceleration: vectors(&|state| state.acceleration),
        angular_acceleration: vectors(&|state| state.angular_acceleration),
        acceleration_is_measured: true,
        roll: of(&|state| state.attitude[0]),
        pitch: of(&|state| state.attitude[1]),
        yaw: of(&|state| state.attitude[2]),
        still_water: StillWater::Depth(of(&|state| state.depth)),
        bed_clearance: None,
        bed: None,
        density: vec![DENSITY; t.len()],
        wheel_speeds: std::array::from_fn(|wheel| (!has_drive).then(|| of(&|state| state.wheels[wheel]))),
        measured: Default::default(),
        simulated: std::array::from_fn(|c| Some(predicted.iter().map(|wrench| wrench[c]).collect())),
        other_forces: drive.map(|(name, values)| ((*name).to_owned(), values.clone())).collect(),
        known_loads: BTreeMap::new(),
        unknown_columns: Vec::new(),
        glitches: Vec::new(),
        rows,
        t,
    }
}
