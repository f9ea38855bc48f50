//! What the tests of several crates need: bundles, effects and states.
#![allow(dead_code, reason = "every test binary uses a part")]

pub mod paper;

use std::path::{Path, PathBuf};

use nalgebra::UnitVector3;
use tempfile::TempDir;
use wade_core::bundle;
use wade_core::condition::{Condition, GroundContact};
use wade_core::effects::{
    ActiveEffect, Between, Circumstances, Effect, EffectRegion, EffectsFile, Evidence, Kind, ParameterValue,
    Shape, Validity,
};
use wade_core::forces::Forces;
use wade_core::frame::{Vec3, up_from_roll_pitch};
use wade_core::model::kernel::Isa;
use wade_core::model::{Model, Workspace};
use wade_core::physics::{Memory, Motion, Physics};
use wade_core::sea::Sea;
use wade_core::served::ServedVehicle;
use wade_core::vehicle::PerWheel;
use wade_core::wrench::Wrench;

pub const VEHICLES: [&str; 2] = ["husky", "warthog"];

/// The root of the repository, whichever crate asks.
pub fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.ancestors().find(|folder| folder.join("vehicles/husky").is_dir()).expect("a checkout").to_owned()
}

pub fn vehicles() -> PathBuf {
    root().join("vehicles")
}

pub fn model(vehicle: &str) -> Model {
    model_on(vehicle, Isa::available()[0])
}

pub fn served_vehicle(vehicle: &str) -> ServedVehicle {
    bundle::load_served(&vehicles().join(vehicle), Isa::available()[0])
        .expect("the shipped bundles are sound")
}

/// What a model answers along a recording.
pub struct Recording<'a> {
    model: &'a Model,
    memory: Memory,
    workspace: Workspace,
    forces: Forces,
}

impl<'a> Recording<'a> {
    pub fn of(model: &'a Model) -> Self {
        let (workspace, forces) = (Workspace::new(), Forces::default());
        Self { model, memory: Memory::of_recording(), workspace, forces }
    }

    /// Net wrench in the next state; `wheel_speeds` as the model has them.
    pub fn wrench(
        &mut self,
        condition: &Condition,
        wheel_speeds: Option<&PerWheel<f64>>,
        time_step: f64,
    ) -> Wrench {
        let speeds = self.model.wheel_speeds(wheel_speeds);
        let motion = Motion {
            wheel_speeds: &speeds,
            time_step,
            implicit_added_mass: false,
            physics: Physics::Full,
            waters: None,
        };
        let Self { model, memory, workspace, forces } = self;
        model.evaluate_moving(condition, (&motion, Some(memory)), workspace, forces);
        forces.wrench
    }
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
        region: EffectRegion::default(),
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

/// The weights of a shipped vehicle without the base below them.
pub fn without_base_on(vehicle: &str, isa: Isa) -> Model {
    let model = model_on(vehicle, isa);
    let weights = model.weights().expect("the shipped bundles are trained").clone();
    Model::new(model.vehicle().clone(), model.version(), *model.domain(), weights, isa)
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
    pub fn drawn(&mut self) -> Drawn {
        let tilted = self.between(0.0, 1.0) < 0.5;
        let (roll, pitch) = (self.between(-0.3, 0.3), self.between(-0.3, 0.3));
        let up = up_from_roll_pitch(roll.into(), pitch.into());
        let gravity = if tilted { (-up.into_inner()).map(|x| x as f32).into() } else { [0.0, 0.0, -1.0] };
        Drawn {
            velocity: self.vector(4.0),
            current: self.vector(0.5),
            angular_velocity: self.vector(0.2),
            acceleration: self.vector(1.0),
            angular_acceleration: self.vector(1.0),
            gravity,
            depth: self.between(0.0, 0.5),
            density: self.between(950.0, 1950.0),
            dry_contact: self.between(0.0, 1.0) < 0.25,
            heading: self.between(-3.0, 3.0),
            depth_rate: self.between(-0.5, 0.5),
            wheel_speeds: [(); 4].map(|()| self.between(-10.0, 10.0)),
            time_step: self.between(0.0, 0.02),
        }
    }

    /// The same as the library takes it.
    pub fn condition(&mut self) -> Condition {
        self.drawn().condition()
    }
}

/// A state in single precision, as it travels.
pub struct Drawn {
    pub velocity: [f32; 3],
    pub current: [f32; 3],
    pub angular_velocity: [f32; 3],
    pub acceleration: [f32; 3],
    pub angular_acceleration: [f32; 3],
    pub gravity: [f32; 3],
    pub depth: f32,
    pub density: f32,
    pub dry_contact: bool,
    pub heading: f32,
    pub depth_rate: f32,
    pub wheel_speeds: [f32; 4],
    pub time_step: f32,
}

impl Drawn {
    pub fn condition(&self) -> Condition {
        let vector = |values: [f32; 3]| Vec3::from(values.map(f64::from));
        let velocity = vector(self.velocity);
        Condition {
            velocity: velocity - vector(self.current),
            ground_velocity: velocity,
            angular_velocity: vector(self.angular_velocity),
            acceleration: vector(self.acceleration),
            angular_acceleration: vector(self.angular_acceleration),
            density: self.density.into(),
            up: -UnitVector3::new_normalize(vector(self.gravity)),
            ground_contact: if self.dry_contact { GroundContact::Dry } else { GroundContact::Wetted },
            ..Condition::level(velocity, self.depth.into())
        }
    }

    pub fn circumstances(&self) -> Circumstances {
        Circumstances {
            heading: Some(self.heading.into()),
            depth_rate: Some(self.depth_rate.into()),
            wheel_speeds: Some(self.wheel_speeds.map(f64::from).into()),
            time_step: self.time_step.into(),
            implicit_added_mass: false,
            physics: None,
            jacobian: false,
            sea: Sea::default(),
        }
    }
}
