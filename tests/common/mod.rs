//! What several test files need. Each file uses a part of it.
#![allow(dead_code, reason = "every test file is a crate of its own and uses a part")]

pub mod paper;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use wade::bundle;
use wade::client::{Client, GrpcClient, Method, Reply, ShmClient};
use wade::config::Config;
use wade::effects::{
    ActiveEffect, Between, Effect, EffectsFile, Evidence, Kind, ParameterValue, Shape, Validity,
};
use wade::model::Model;
use wade::model::kernel::Isa;
use wade::served::ServedVehicle;
use wade::server::{self, Running};
use wade::service::health::{Part, State as Up};
use wade::service::shm::Wait;
use wade::service::shm_layout::PROVENANCE_LEN;
use wade::service::wire::State;

/// Long enough for a busy machine: no test is about this time.
pub const PATIENCE: Duration = Duration::from_secs(20);

pub const VEHICLES: [&str; 2] = ["husky", "warthog"];

pub fn vehicles() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("vehicles")
}

pub fn model(vehicle: &str) -> Model {
    model_on(vehicle, Isa::available()[0])
}

pub fn served_vehicle(vehicle: &str) -> ServedVehicle {
    bundle::load_served(&vehicles().join(vehicle), Isa::available()[0])
        .expect("the shipped bundles are sound")
}

/// An effect with made-up numbers, one for every coefficient.
pub fn effect(name: Effect, value: f64) -> ActiveEffect {
    let coefficients = name.coefficients();
    let parameter =
        |value: f64, unit: &str| ParameterValue { value, std: 0.1 * value.abs(), unit: unit.into() };
    let numbers = match name {
        Effect::HullFlooding => [0.01, 0.0, 0.0],
        Effect::WaveMemory => [0.8, 2.0, 0.0],
        // exact where the estimate is the value
        Effect::Current => [value, value, 0.0],
        Effect::Rotation => [1.0, 0.0, 0.0],
        _ => [0.0; 3],
    };
    let fitted = coefficients.iter().map(|c| (c.name.to_owned(), parameter(value, c.unit)));
    let nonlinear = name.spec().parameters.iter().zip(numbers);
    let nonlinear = nonlinear.map(|(spec, value)| (spec.name.to_owned(), parameter(value, spec.unit)));
    let count = coefficients.len();
    ActiveEffect {
        equation: name.equation().to_owned(),
        provisional: false,
        share_of_gap: 0.5,
        shape: Shape::from_numbers(name, numbers).expect("numbers that mean something"),
        base_drag: [1.1, 1.3, 0.9],
        channel_width: (name == Effect::ChannelBlockage).then_some(4.0),
        coefficients: coefficients.iter().map(|c| c.name.to_owned()).collect(),
        covariance: (0..count)
            .map(|i| (0..count).map(|j| if i == j { 1e-4 } else { 0.0 }).collect())
            .collect(),
        parameters: fitted.chain(nonlinear).collect(),
    }
}

/// A file with these effects and a box that holds every state of [`Numbers::state`].
pub fn effects_file(vehicle: &str, effects: Vec<ActiveEffect>) -> EffectsFile {
    let evidence = Evidence { trials: vec!["run00".into()], tool: "a test".into(), ..Evidence::default() };
    let validity = Validity {
        depth_m: [0.0, 1.0],
        speed_mps: [0.0, 10.0],
        acceleration_mps2: [0.0, 10.0],
        angular_speed_radps: [0.0, 10.0],
        density_kgpm3: [900.0, 2000.0],
    };
    EffectsFile::new(vehicle.into(), evidence, validity, effects)
}

/// Every physical effect of the library, the first two as if they had been fitted together.
pub fn every_effect(vehicle: &str) -> EffectsFile {
    let physics = Effect::ALL.into_iter().filter(|effect| effect.kind() == Kind::Physics);
    let effects: Vec<ActiveEffect> = physics.map(|name| effect(name, 0.15)).collect();
    let [rows, columns] = [0, 1].map(|index: usize| effects[index].coefficients.len());
    let together = Between {
        effects: [0, 1].map(|index: usize| effects[index].effect()),
        covariance: vec![vec![5e-5; columns]; rows],
    };
    effects_file(vehicle, effects).with_between(vec![together])
}

/// The shipped bundle with effects, in memory.
pub fn served_with(vehicle: &str, effects: EffectsFile) -> ServedVehicle {
    ServedVehicle::new(model(vehicle), Some(effects))
}

/// Copies of the shipped bundles, each with every effect.
pub fn copy_with_every_effect() -> TempDir {
    let copy = copy_of_vehicles();
    for vehicle in VEHICLES {
        bundle::apply(&copy.path().join(vehicle), every_effect(vehicle)).expect("applied");
    }
    copy
}

pub fn model_on(vehicle: &str, isa: Isa) -> Model {
    bundle::load(&vehicles().join(vehicle), isa).expect("the shipped bundles are sound")
}

/// The shipped vehicle with the paper's network.
pub fn paper_on(vehicle: &str, isa: Isa) -> Model {
    let copy = copy_of_vehicles();
    paper::put_into(&copy.path().join(vehicle));
    bundle::load(&copy.path().join(vehicle), isa).expect("the fixture is sound")
}

/// Copies the shipped bundles to where a test may change them.
pub fn copy_of_vehicles() -> TempDir {
    let copy = TempDir::new().expect("a temporary folder");
    for vehicle in VEHICLES {
        copy_folder(&vehicles().join(vehicle), &copy.path().join(vehicle));
    }
    copy
}

/// Makes a vehicle of another name than those that the program carries.
pub fn rover(folder: &Path) {
    std::fs::create_dir_all(folder).expect("a folder");
    let mut bundle = bundle::read(&vehicles().join("husky")).expect("sound");
    bundle.vehicle.name = "rover".to_owned();
    bundle.effects = None;
    bundle::write(&folder.join("rover"), &bundle).expect("written");
}

pub fn copy_folder(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("readable") {
        let entry = entry.expect("readable");
        std::fs::copy(entry.path(), to.join(entry.file_name())).expect("copied");
    }
}

/// A name that no other server of this test run has.
pub fn namespace() -> String {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    format!("test-{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed))
}

/// Settings on ports that the system chooses and a socket in `folder`.
pub fn config(folder: &Path) -> Config {
    let mut config = Config { vehicles: vehicles(), ..Config::default() };
    config.grpc.listen = "127.0.0.1:0".into();
    config.grpc.unix_socket = folder.join("wade.sock");
    config.http.listen = "127.0.0.1:0".into();
    config.shm.namespace = namespace();
    config.shm.program = env!("CARGO_BIN_EXE_wade").into();
    config
}

/// A server of its own for one test.
pub struct Served {
    pub running: Running,
    pub config: Config,
    _folder: TempDir,
}

impl Served {
    pub fn start() -> Self {
        Self::with(|_| {})
    }

    pub fn with(change: impl FnOnce(&mut Config)) -> Self {
        let folder = TempDir::new().expect("a temporary folder");
        let mut config = config(folder.path());
        change(&mut config);
        config.validate().expect("a valid configuration");
        let running = server::start(&config).expect("the server starts");
        let start = Instant::now();
        while running.health().state(Part::Shm) == Up::Starting && start.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(5));
        }
        Self { running, config, _folder: folder }
    }

    pub fn url(&self) -> String {
        format!("http://{}", self.running.grpc_address().expect("TCP is on"))
    }

    pub fn tcp(&self, vehicle: &str, method: Method) -> GrpcClient {
        GrpcClient::tcp(&self.url(), vehicle, method, PATIENCE).expect("the server is there")
    }

    pub fn unix(&self, vehicle: &str, method: Method) -> GrpcClient {
        GrpcClient::unix(self.config.grpc.unix_socket.clone(), vehicle, method, PATIENCE)
            .expect("the server is there")
    }

    pub fn shm(&self, vehicle: &str, wait: Wait) -> ShmClient {
        ShmClient::new(vehicle, wait, PATIENCE).in_namespace(&self.config.shm.namespace)
    }

    /// Every way to ask this server.
    pub fn clients(&self, vehicle: &str) -> Vec<(&'static str, Client)> {
        vec![
            ("tcp unary", Client::Grpc(Box::new(self.tcp(vehicle, Method::Unary)))),
            ("tcp stream", Client::Grpc(Box::new(self.tcp(vehicle, Method::Stream)))),
            ("unix unary", Client::Grpc(Box::new(self.unix(vehicle, Method::Unary)))),
            ("unix stream", Client::Grpc(Box::new(self.unix(vehicle, Method::Stream)))),
            ("shm blocking", Client::Shm(Box::new(self.shm(vehicle, Wait::Block)))),
            ("shm polling", Client::Shm(Box::new(self.shm(vehicle, Wait::Spin)))),
        ]
    }
}

/// What every transport must answer alike: not how long it took, and of a long provenance what shared memory has room for.
pub fn comparable(mut reply: Reply) -> Reply {
    reply.provenance.truncate(PROVENANCE_LEN);
    Reply { compute_ns: 0, ..reply }
}

/// Numbers that are the same in every run: a linear congruential generator with Knuth's constants.
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform between two values.
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 40) as f32 / (1_u64 << 24) as f32)
    }

    pub fn vector(&mut self, size: f32) -> [f32; 3] {
        [(); 3].map(|()| self.between(-size, size))
    }

    /// A state in and around the training domains: any heading, some tilt, some dry, some deep.
    pub fn state(&mut self) -> State {
        let tilted = self.between(0.0, 1.0) < 0.5;
        let (roll, pitch) = (self.between(-0.3, 0.3), self.between(-0.3, 0.3));
        let up = wade::frame::up_from_roll_pitch(roll.into(), pitch.into());
        let gravity = if tilted { wade::service::grpc::single(&-up.into_inner()) } else { [0.0, 0.0, -1.0] };
        State {
            velocity: self.vector(4.0),
            current: self.vector(0.5),
            angular_velocity: self.vector(0.2),
            acceleration: self.vector(1.0),
            angular_acceleration: self.vector(1.0),
            gravity,
            depth: self.between(0.0, 0.5),
            density: self.between(950.0, 1950.0),
            dry_contact: self.between(0.0, 1.0) < 0.25,
            heading: Some(self.between(-3.0, 3.0)),
            depth_rate: Some(self.between(-0.5, 0.5)),
            wheel_speeds: Some([(); 4].map(|()| self.between(-10.0, 10.0))),
            time_step: self.between(0.0, 0.02),
            implicit_added_mass: false,
        }
    }
}
