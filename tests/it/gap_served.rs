//! Promise: after `wade gap --apply` the answers of a running server over gRPC and shared memory, and those of
//! `wade predict`, are closer to trials that the workflow never read.
//!
//! Each test hides one load in generated trials of the Warthog, by a formula of its own, and replays other draws of the
//! same experiment before and after. All trials are generated.

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;
use wade_client::{Client, Method, Reply};
use wade_core::condition::Condition;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::model::Model;
use wade_learn::random::Random;
use wade_wire::State;
use wade_wire::shm::Wait;

use crate::common::{PATIENCE, Recording, Served, comparable, copy_of_vehicles, model};

/// Standard deviation of a measured force, of one sample and axis [N].
const NOISE: f64 = 8.0;
/// Time between samples [s].
const STEP: f64 = 0.02;
/// Samples of a trial.
const SAMPLES: usize = 400;
/// Trials that the workflow reads.
const NAMING: usize = 12;
/// Trials that it does not read.
const HELD_OUT: usize = 3;
/// Density of the water [kg/m3].
const RHO: f64 = 1000.0;
/// Width of the channel, where a trial is in one [m].
const CHANNEL: f64 = 2.5;
/// Current along the line that is driven in both directions [m/s].
const CURRENT: f64 = 0.21;

/// A load that the model lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hidden {
    AddedMass,
    Current,
    Squat,
    Blockage,
    WaveMemory,
}

impl Hidden {
    fn name(self) -> &'static str {
        match self {
            Self::AddedMass => "added_mass",
            Self::Current => "current",
            Self::Squat => "squat",
            Self::Blockage => "channel_blockage",
            Self::WaveMemory => "wave_memory",
        }
    }

    fn needs_channel(self) -> bool {
        self == Self::Blockage
    }

    /// The trials have a control beside them, the same without the load: a load of the size of a steady drag is otherwise within
    /// the error that the model states of itself.
    fn has_control(self) -> bool {
        matches!(self, Self::Current | Self::Squat | Self::Blockage)
    }

    /// Measured components. The law of a current has no lift.
    fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Current => &["fx", "fy"],
            _ => &["fx", "fy", "fz"],
        }
    }
}

/// An instant of a straight run; body axes.
struct Sample {
    t: f64,
    speed: f64,
    acceleration: f64,
    yaw: f64,
    depth: f64,
    /// What the model answers along the trial.
    still: Vec3,
    hidden: Vec3,
    measured: Vec3,
}

impl Sample {
    fn condition(&self) -> Condition {
        let acceleration = Vec3::x() * self.acceleration;
        Condition { acceleration, ..Condition::level(Vec3::x() * self.speed, self.depth) }
    }

    fn state(&self) -> State {
        State {
            velocity: [self.speed as f32, 0.0, 0.0],
            acceleration: [self.acceleration as f32, 0.0, 0.0],
            depth: self.depth as f32,
            heading: Some(self.yaw as f32),
            ..State::default()
        }
    }
}

/// A table of states, with the forces of some columns where the workflow is to read them.
fn table(trial: &[Sample], columns: &[&str], with_control: bool) -> String {
    let mut text = "t,vx,vy,vz,wx,wy,wz,ax,ay,az,yaw,depth".to_owned();
    columns.iter().for_each(|name| write!(text, ",{name}").unwrap());
    columns.iter().filter(|_| with_control).for_each(|name| write!(text, ",sim_{name}").unwrap());
    for s in trial {
        write!(text, "\n{},{},0,0,0,0,0,{},0,0,{},{}", s.t, s.speed, s.acceleration, s.yaw, s.depth).unwrap();
        let measured = s.measured.iter().take(columns.len());
        let control = s.still.iter().take(if with_control { columns.len() } else { 0 });
        measured.chain(control).for_each(|force| write!(text, ",{force}").unwrap());
    }
    text + "\n"
}

fn gaussian(random: &mut Random) -> f64 {
    (-2.0 * (1.0 - random.unit()).ln()).sqrt() * (std::f64::consts::TAU * random.unit()).cos()
}

/// An experiment that hides a load.
struct Experiment<'a> {
    model: &'a Model,
    hidden: Hidden,
}

impl Experiment<'_> {
    /// A trial in still water, from rest through five random speeds, in a channel of a width [m].
    fn trial(&self, seed: u64, depth: f64, width: f64) -> Vec<Sample> {
        let mut random = Random::new(seed);
        let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
        let back = if seed.is_multiple_of(2) { 0.0 } else { std::f64::consts::PI };
        let yaw = back + between(-0.08, 0.08);
        let changes: Vec<[f64; 3]> =
            (0..5).map(|k| [0.4 + 1.5 * f64::from(k), between(0.5, 0.8), between(0.3, 2.0)]).collect();
        let smooth = |u: f64| u * u * u * (10.0 - 15.0 * u + 6.0 * u * u);
        let speed = |t: f64| {
            let step = |(sum, last): (f64, f64), &[at, length, to]: &[f64; 3]| {
                (sum + (to - last) * smooth(((t - at) / length).clamp(0.0, 1.0)), to)
            };
            changes.iter().fold((0.0, 0.0), step).0
        };
        let at = |i: usize| {
            let t = STEP * i as f64;
            let acceleration = (speed(t + 1e-4) - speed(t - 1e-4)) / 2e-4;
            let [still, hidden, measured] = [Vec3::zeros(); 3];
            Sample { t, speed: speed(t), acceleration, yaw, depth, still, hidden, measured }
        };
        let mut trial: Vec<Sample> = (0..SAMPLES).map(at).collect();
        let mut recording = Recording::of(self.model);
        for (i, hidden) in self.loads(&trial, width).into_iter().enumerate() {
            let still = recording.wrench(&trial[i].condition(), None, if i == 0 { 0.0 } else { STEP }).force;
            let noise = Vec3::from_fn(|_, _| NOISE * gaussian(&mut random));
            (trial[i].still, trial[i].hidden) = (still, hidden);
            trial[i].measured = still + hidden + noise;
        }
        trial
    }

    fn loads(&self, trial: &[Sample], width: f64) -> Vec<Vec3> {
        let depth = trial[0].depth;
        let mass = RHO * self.displaced(depth);
        match self.hidden {
            Hidden::AddedMass => trial.iter().map(|s| Vec3::x() * (-0.6 * mass * s.acceleration)).collect(),
            Hidden::Current => self.in_a_current(trial),
            Hidden::Squat => {
                let lower = |s: &Sample| {
                    let drop = 0.4 * s.speed * s.speed / (2.0 * GRAVITY);
                    Vec3::z() * (RHO * GRAVITY * (self.displaced(depth - drop) - self.displaced(depth)))
                };
                trial.iter().map(lower).collect()
            }
            Hidden::Blockage => {
                // by continuity the flow past the hull is faster than the hull
                let section = self.displaced(depth) / self.model.vehicle().dimensions.length;
                let more = (1.0 - section / (width * depth)).powi(-2) - 1.0;
                let drag = |s: &Sample| {
                    let steady = Condition::level(Vec3::x() * s.speed, depth);
                    Recording::of(self.model).wrench(&steady, None, 0.0).force.x
                };
                trial.iter().map(|s| Vec3::x() * (drag(s) * more)).collect()
            }
            Hidden::WaveMemory => {
                let rate = GRAVITY / self.model.vehicle().dimensions.length;
                radiated(trial).into_iter().map(|meters| Vec3::x() * (-0.5 * mass * rate * meters)).collect()
            }
        }
    }

    /// Volume of the hull below the surface of water at rest [m3].
    fn displaced(&self, depth: f64) -> f64 {
        let vehicle = self.model.vehicle();
        let plane = Condition::level(Vec3::zeros(), depth).water_plane(vehicle.z0);
        hydrostatics(&vehicle.hull.mesh, &plane, RHO, &Vec3::zeros()).displaced_volume
    }

    /// What the model answers for the velocity through the water, less what it answers for that over ground.
    fn in_a_current(&self, trial: &[Sample]) -> Vec<Vec3> {
        let [mut moving, mut still] = [(); 2].map(|()| Recording::of(self.model));
        let load = |(i, s): (usize, &Sample)| {
            let (sine, cosine) = s.yaw.sin_cos();
            let water = Vec3::new(cosine, -sine, 0.0) * CURRENT;
            let over_ground = s.condition();
            let through_water = Condition { velocity: over_ground.velocity - water, ..over_ground };
            let step = if i == 0 { 0.0 } else { STEP };
            let [moving, still] = [(&mut moving, through_water), (&mut still, over_ground)]
                .map(|(recording, state)| recording.wrench(&state, None, step).force);
            moving - still
        };
        trial.iter().enumerate().map(load).collect()
    }
}

/// Cummins' integral of the velocity by trapezoids, `int k(s) v(t - s) ds` with
/// `k = exp(-a s) (cos b s - a / b sin b s)`, of a hull that was at rest before [m].
fn radiated(trial: &[Sample]) -> Vec<f64> {
    let (a, b) = (1.0_f64, 3.0_f64);
    let kernel: Vec<f64> = (0..trial.len())
        .map(|i| STEP * i as f64)
        .map(|s| (-a * s).exp() * ((b * s).cos() - a / b * (b * s).sin()))
        .collect();
    let at = |i: usize| {
        let sum: f64 = (0..=i).map(|j| kernel[j] * trial[i - j].speed).sum();
        STEP * (sum - 0.5 * kernel[0] * trial[i].speed)
    };
    (0..trial.len()).map(at).collect()
}

/// A folder of generated trials for the workflow. Of a load that walls make, a third is in open water.
fn write_trials(folder: &Path, experiment: &Experiment) {
    std::fs::create_dir_all(folder).unwrap();
    let mut manifest =
        "vehicle = \"warthog\"\ngenerated = \"for a test: motion, noise and wrench\"\n".to_owned();
    let has_walls = experiment.hidden.needs_channel();
    if has_walls {
        writeln!(manifest, "channel_width = {CHANNEL:?}").unwrap();
    }
    manifest += "[measured]\nmethod = \"load_cell\"\n";
    if experiment.hidden.has_control() {
        manifest += "sim_is = \"control\"\n";
    }
    if has_walls {
        manifest += "[channel_widths]\n";
    }
    for index in 0..NAMING {
        let depth = [0.17, 0.23, 0.3][index % 3];
        let is_open = has_walls && index >= NAMING - NAMING / 3;
        if is_open {
            writeln!(manifest, "run{index:02} = inf").unwrap();
        }
        let width = if has_walls && !is_open { CHANNEL } else { f64::INFINITY };
        let trial = experiment.trial(100 + index as u64, depth, width);
        let text = table(&trial, experiment.hidden.columns(), experiment.hidden.has_control());
        std::fs::write(folder.join(format!("run{index:02}.csv")), text).unwrap();
    }
    std::fs::write(folder.join("trials.toml"), manifest).unwrap();
}

/// Other draws, at depths between those of the folder.
fn held_out(experiment: &Experiment) -> Vec<Vec<Sample>> {
    let width = if experiment.hidden.needs_channel() { CHANNEL } else { f64::INFINITY };
    let draw = |index: usize| {
        let depth = 0.19 + 0.09 * Random::new(900 + index as u64).unit();
        experiment.trial(500 + index as u64, depth, width)
    };
    (0..HELD_OUT).map(draw).collect()
}

/// A running server of copies of the shipped bundles.
struct Place {
    folder: TempDir,
    vehicles: TempDir,
    served: Served,
}

impl Place {
    fn new() -> Self {
        let (folder, vehicles) = (TempDir::new().unwrap(), copy_of_vehicles());
        let served = Served::with(|config| config.vehicles = vehicles.path().to_owned());
        Self { folder, vehicles, served }
    }

    fn wade(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
        command.args(arguments).env("WADE_VEHICLES", self.vehicles.path()).output().unwrap()
    }

    fn apply(&self, trials: &Path) -> Value {
        let out = self.folder.path().join("gap");
        let nobody = format!("unix:{}", self.folder.path().join("nobody.sock").display());
        let fixed = ["gap", "--vehicle", "warthog", "--apply", "--json", "--server", &nobody];
        let paths = ["--trials", trials.to_str().unwrap(), "--out", out.to_str().unwrap()];
        let output = self.wade(&[&fixed[..], &paths].concat());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stdout));
        // what --server asks for, on a thread that does not yield to whatever else the machine does
        let reloaded = self.served.running.reloader().reload("warthog").unwrap();
        assert!(reloaded[0].refusal.is_none(), "{reloaded:?}");
        // the process that serves shared memory reads the bundle by itself
        let (mut client, start) = (self.served.shm("warthog", Wait::Block), Instant::now());
        while client.evaluate(&State::still(0.2)).unwrap().bundle_version != reloaded[0].served_version {
            assert!(start.elapsed() < PATIENCE, "shared memory goes on with the version before");
            std::thread::sleep(Duration::from_millis(20));
        }
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// Answers along a trial, by `wade predict`.
    fn predict(&self, trial: &[Sample]) -> Vec<Vec3> {
        let [states, out] = ["states.csv", "out.csv"].map(|name| self.folder.path().join(name));
        std::fs::write(&states, table(trial, &[], false)).unwrap();
        let paths = ["--states", states.to_str().unwrap(), "--out", out.to_str().unwrap()];
        let output = self.wade(&[&["predict", "--vehicle", "warthog"][..], &paths].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut reader = csv::Reader::from_path(&out).unwrap();
        let headers = reader.headers().unwrap().clone();
        let place = |name: &str| headers.iter().position(|header| header == name).unwrap();
        let places = ["fx", "fy", "fz"].map(place);
        reader
            .records()
            .map(|row| row.unwrap())
            .map(|row| places.map(|i| row[i].parse().unwrap()).into())
            .collect()
    }

    /// The same in a session of a client.
    fn session(&self, mut client: Client, trial: &[Sample]) -> Vec<Reply> {
        let at = |(i, sample): (usize, &Sample)| {
            let time_step = if i == 0 { 0.0 } else { (sample.t - trial[i - 1].t) as f32 };
            comparable(client.evaluate(&State { time_step, ..sample.state() }).unwrap())
        };
        trial.iter().enumerate().map(at).collect()
    }

    fn replay(&self, trials: &[Vec<Sample>]) -> Replay {
        let mut replay = Replay::default();
        for (session, trial) in (1..).zip(trials) {
            let stream = Client::Grpc(Box::new(self.served.tcp("warthog", Method::Stream)));
            let shm = self.served.shm("warthog", Wait::Block).in_session(session);
            let over_grpc = self.session(stream, trial);
            let over_shm = self.session(Client::Shm(Box::new(shm)), trial);
            let differs = over_grpc.iter().zip(&over_shm).position(|(grpc, shm)| grpc != shm);
            assert_eq!(differs, None, "the first sample with other bits over gRPC than over shared memory");
            let force = |reply: &Reply| Vec3::from(reply.force.map(f64::from));
            replay.forces[0].extend(over_grpc.iter().map(force));
            replay.forces[1].extend(over_shm.iter().map(force));
            replay.forces[2].extend(self.predict(trial));
            replay.last = over_shm.last().cloned();
        }
        replay
    }
}

const TRANSPORTS: [&str; 3] = ["gRPC", "shared memory", "predict"];

/// Forces along all trials, one after the other, by transport.
#[derive(Default)]
struct Replay {
    forces: [Vec<Vec3>; 3],
    last: Option<Reply>,
}

/// Root mean square of the length of force vectors [N].
fn rms(forces: impl ExactSizeIterator<Item = Vec3>) -> f64 {
    let count = forces.len() as f64;
    (forces.map(|force| force.norm_squared()).sum::<f64>() / count).sqrt()
}

fn is_closer_after_apply(hidden: Hidden) {
    let model = model("warthog");
    let experiment = Experiment { model: &model, hidden };
    let place = Place::new();
    let folder = place.folder.path().join("trials");
    write_trials(&folder, &experiment);
    let trials = held_out(&experiment);
    let before = place.replay(&trials);
    let report = place.apply(&folder);
    assert_eq!(report["verdict"], "named", "{}", report["summary"]);
    let names: Vec<&str> =
        report["effects"].as_array().unwrap().iter().map(|effect| effect["name"].as_str().unwrap()).collect();
    assert_eq!(names, [hidden.name()], "{}", report["summary"]);
    let after = place.replay(&trials);
    let load = &after.last.as_ref().unwrap().effects;
    assert!(load.len() == 1 && load[0].left_out.is_none(), "{load:?}");

    let measured = Vec3::from_fn(|axis, _| if axis < hidden.columns().len() { 1.0 } else { 0.0 });
    let samples: Vec<&Sample> = trials.iter().flatten().collect();
    for (transport, name) in TRANSPORTS.into_iter().enumerate() {
        let residual = |replay: &Replay, of: &dyn Fn(&Sample) -> Vec3| {
            let apart =
                samples.iter().zip(&replay.forces[transport]).map(|(sample, served)| of(sample) - served);
            rms(apart.map(|apart| measured.component_mul(&apart)))
        };
        let [was, is] = [&before, &after].map(|replay| residual(replay, &|sample| sample.measured));
        // the same replay with nothing hidden: noise, and how a session differs from a recording
        let floor = residual(&before, &|sample| sample.measured - sample.hidden);
        eprintln!("{} over {name}: {was:.1} N before, {is:.1} N after, {floor:.1} N floor", hidden.name());
        let above_floor = |rms: f64| (rms * rms - floor * floor).max(0.0).sqrt();
        let (was, is) = (above_floor(was), above_floor(is));
        // otherwise there is no gap to close
        assert!(was > floor, "{name}: {was} N hidden, {floor} N floor");
        // a load of the wrong sign, of half or twice the size, or left out, leaves half of it or more
        assert!(is < 0.5 * was, "{name}: {is} N left of {was} N, {floor} N floor");
    }
    let apart = rms(after.forces[0].iter().zip(&after.forces[2]).map(|(grpc, predict)| grpc - predict));
    // predict takes the rows for a recording, a session takes them for a loop, in which the added mass follows a few steps late
    assert!(apart < 0.1 * NOISE, "{apart} N between gRPC and predict");
}

#[test]
fn with_an_added_mass_that_was_named() {
    is_closer_after_apply(Hidden::AddedMass);
}

#[test]
fn with_a_current_that_was_named() {
    is_closer_after_apply(Hidden::Current);
}

#[test]
fn with_a_squat_that_was_named() {
    is_closer_after_apply(Hidden::Squat);
}

#[test]
fn with_a_blockage_that_was_named() {
    is_closer_after_apply(Hidden::Blockage);
}

#[test]
fn with_a_wave_memory_that_was_named() {
    is_closer_after_apply(Hidden::WaveMemory);
}
