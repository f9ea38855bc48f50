//! One run of a simulator.

use std::hash::{BuildHasher, RandomState};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use wade_client::{
    Address, Client, ClientError, Credentials, GrpcClient, InProcess, Method, Reply, ShmClient,
};
use wade_core::bundle;
use wade_core::frame::Vec3;
use wade_core::model::COLUMNS;
use wade_core::model::kernel::Isa;
use wade_core::physics::Physics;
use wade_core::served::Session;
use wade_core::vehicle::PerWheel;
use wade_wire::shm::Wait;
use wade_wire::{DERIVATIVES, State};

use crate::settings::Settings;
use crate::variables::{Causality, Layout, Variable};

/// Share of a step by which a simulator's clock and ours may differ.
const SLACK: f64 = 1e-6;

/// What the standard says of a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd)]
#[repr(C)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// Done, with outputs of an earlier step.
    Warning = 1,
    /// Not done, and nothing has changed.
    Discard = 2,
    /// Not done.
    Error = 3,
}

/// Why a call was not done as asked.
#[derive(Debug)]
pub struct Fault {
    /// How bad it is.
    pub status: Status,
    /// What is wrong, and the way out.
    pub message: String,
}

impl Fault {
    fn discard(message: impl Into<String>) -> Self {
        Self { status: Status::Discard, message: message.into() }
    }

    /// Of a call that cannot be done.
    pub fn error(message: impl Into<String>) -> Self {
        Self { status: Status::Error, message: message.into() }
    }
}

/// Where a run is, in the words of the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Nothing was begun.
    Instantiated,
    /// Start values are set.
    Initialization,
    /// Steps are made.
    Step,
    /// Inputs change between steps.
    Event,
    /// Over.
    Terminated,
}

/// What a simulator keeps of a run to come back to.
#[derive(Debug, Clone)]
pub struct Kept {
    values: Vec<f64>,
    mode: Mode,
    is_stale: bool,
    session: Session,
}

/// One run.
#[derive(Debug)]
pub struct Instance {
    settings: Settings,
    resources: PathBuf,
    layout: Layout,
    values: Vec<f64>,
    mode: Mode,
    /// Whether inputs were set after the outputs were computed.
    is_stale: bool,
    client: Option<Client>,
}

impl Instance {
    /// Of the unit with these resources.
    pub fn new(resources: &Path, token: Option<&str>) -> Result<Self, Fault> {
        let settings = Settings::read(resources).map_err(Fault::error)?;
        if token.is_none_or(str::is_empty) {
            return Err(Fault::error("the instantiation token is empty; take that of modelDescription.xml"));
        }
        let (layout, values) = Layout::new(&settings);
        Ok(Self {
            settings,
            resources: resources.to_owned(),
            layout,
            values,
            mode: Mode::Instantiated,
            is_stale: true,
            client: None,
        })
    }

    /// Where the run is.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Simulated time [s].
    pub fn time(&self) -> f64 {
        self.number(Variable::Time)
    }

    /// Goes from one mode to another.
    pub fn enter(&mut self, from: &[Mode], to: Mode) -> Result<(), Fault> {
        if !from.contains(&self.mode) {
            return Err(Fault::error(format!("{to:?} cannot follow {:?}", self.mode)));
        }
        self.mode = to;
        Ok(())
    }

    /// Begins the initialization at a time, with a session of its own: at rest, and dry.
    pub fn initialize(&mut self, start: f64) -> Result<(), Fault> {
        if !start.is_finite() {
            return Err(Fault::error(format!("the start time must be finite, got {start}")));
        }
        self.enter(&[Mode::Instantiated], Mode::Initialization)?;
        self.put(Variable::Time, &[start]);
        Ok(())
    }

    /// Ends the initialization, with outputs that answer the start values.
    pub fn initialized(&mut self) -> Result<(), Fault> {
        self.refresh()?;
        self.enter(&[Mode::Initialization], Mode::Step)
    }

    /// Goes back to before the begin, with start values.
    pub fn reset(&mut self) {
        (self.layout, self.values) = Layout::new(&self.settings);
        (self.mode, self.is_stale, self.client) = (Mode::Instantiated, true, None);
    }

    /// Values of a variable.
    pub fn get(&mut self, variable: Variable) -> Result<&[f64], Fault> {
        let is_output = variable.row().causality == Causality::Output;
        if is_output && self.mode == Mode::Instantiated {
            return Err(Fault::error(format!("{} has no value before initialization", variable.row().name)));
        }
        if is_output && self.mode == Mode::Initialization {
            self.refresh()?;
        }
        let place = self.place(variable)?;
        Ok(&self.values[place])
    }

    /// Sets the values of a parameter or an input.
    pub fn set(&mut self, variable: Variable, values: &[f64]) -> Result<(), Fault> {
        let row = variable.row();
        let is_open = match row.causality {
            Causality::Parameter => matches!(self.mode, Mode::Instantiated | Mode::Initialization),
            Causality::Input => self.mode != Mode::Terminated,
            Causality::Output | Causality::Independent => false,
        };
        if !is_open {
            return Err(Fault::error(format!("{} cannot be set in {:?} mode", row.name, self.mode)));
        }
        let place = self.place(variable)?;
        self.values[place].copy_from_slice(values);
        self.is_stale = true;
        Ok(())
    }

    /// How many values a variable has.
    pub fn count(&self, variable: Variable) -> Result<usize, Fault> {
        Ok(self.place(variable)?.len())
    }

    fn place(&self, variable: Variable) -> Result<std::ops::Range<usize>, Fault> {
        self.layout
            .place(variable)
            .ok_or_else(|| Fault::error(format!("this unit has no {}", variable.row().name)))
    }

    /// Makes a step: answers the inputs that were set before it, and lets what is remembered move on by its length.
    pub fn step(&mut self, from: f64, length: f64) -> Result<(), Fault> {
        if self.mode != Mode::Step {
            return Err(Fault::error(format!("a step cannot be made in {:?} mode", self.mode)));
        }
        if !(from.is_finite() && length.is_finite() && length > 0.0) {
            return Err(Fault::discard(format!(
                "a step must have a finite begin and a length above 0, got {from} s and {length} s"
            )));
        }
        if (from - self.time()).abs() > SLACK * length + f64::EPSILON * 4.0 * from.abs() {
            return Err(Fault::discard(format!(
                "the run is at {} s, and the step begins at {from} s: a run goes back by the state that was kept of it",
                self.time()
            )));
        }
        match self.evaluate(length) {
            Ok(()) => self.put(Variable::Time, &[from + length]),
            Err(
                error
                @ (ClientError::NoServer { .. } | ClientError::Timeout(_) | ClientError::Refused { .. }),
            ) => {
                let age = self.number(Variable::Age) + length;
                if age > self.number(Variable::OldestAnswer) {
                    return Err(Fault::error(format!(
                        "{error}; oldest_answer_s bridges a server for some time"
                    )));
                }
                self.put(Variable::Age, &[age]);
                self.put(Variable::Time, &[from + length]);
                let message = format!("{error}; the outputs are {age} s old");
                return Err(Fault { status: Status::Warning, message });
            }
            Err(error) => return Err(Fault::discard(error.to_string())),
        }
        Ok(())
    }

    /// Makes the outputs answer the inputs, where these were set since.
    fn refresh(&mut self) -> Result<(), Fault> {
        if self.is_stale {
            self.evaluate(0.0).map_err(|error| Fault::error(error.to_string()))?;
        }
        Ok(())
    }

    /// Derivatives of force and moment by rows in the state of the inputs; what is remembered stays.
    fn jacobian(&mut self) -> Result<[f32; DERIVATIVES], Fault> {
        let state = State { jacobian: true, ..self.state(0.0) };
        let before = self.session();
        let reply = self.client().and_then(|client| client.evaluate(&state));
        self.remember(before);
        let reply = reply.map_err(|error| Fault::error(error.to_string()))?;
        reply.jacobian.ok_or_else(|| Fault::error("the answer holds no derivatives"))
    }

    /// How outputs change along a direction of inputs. Adds `df/dx seed` to each sensitivity.
    pub fn derivative(
        &mut self,
        (unknowns, knowns): (&[Variable], &[Variable]),
        seed: &[f64],
        sensitivity: &mut [f64],
    ) -> Result<(), Fault> {
        let mut along = [0.0; COLUMNS];
        let mut rest = seed;
        for known in knowns {
            let (own, left) = rest.split_at_checked(self.count(*known)?).ok_or_else(|| too_short("seed"))?;
            rest = left;
            match known {
                Variable::Velocity => add(&mut along[0..3], own),
                Variable::AngularVelocity => add(&mut along[3..6], own),
                Variable::WaterLevel => add(&mut along[6..7], own),
                // the direction of gravity changes by g x turn; what lies along it changes nothing
                Variable::Gravity => {
                    add(&mut along[7..10], vector(own).cross(&self.vector(Variable::Gravity)).as_slice())
                }
                Variable::Density => add(&mut along[10..11], own),
                other => {
                    return Err(Fault::error(format!(
                        "no derivative by {} is known; those are by velocity, angular velocity, level, gravity and density",
                        other.row().name
                    )));
                }
            }
        }
        let rows = self.jacobian()?;
        let slope = |row: usize| -> f64 {
            let row = &rows[row * COLUMNS..(row + 1) * COLUMNS];
            row.iter().zip(along).map(|(slope, along)| f64::from(*slope) * along).sum()
        };
        let mut rest = sensitivity;
        for unknown in unknowns {
            let first = match unknown {
                Variable::Force => 0,
                Variable::Moment => 3,
                other => {
                    let name = other.row().name;
                    return Err(Fault::error(format!(
                        "no derivative of {name} is known; those are of force and moment"
                    )));
                }
            };
            let (own, left) = rest.split_at_mut_checked(3).ok_or_else(|| too_short("sensitivity"))?;
            for (place, row) in own.iter_mut().zip(first..) {
                *place = slope(row);
            }
            rest = left;
        }
        Ok(())
    }

    /// What there is to come back to; none of a unit whose memory a server has.
    pub fn keep(&self) -> Result<Kept, Fault> {
        if self.settings.address.is_some() {
            return Err(Fault::error(
                "the memory of this run lies in a server; a unit that carries its bundle can keep it",
            ));
        }
        let (values, mode, is_stale) = (self.values.clone(), self.mode, self.is_stale);
        Ok(Kept { values, mode, is_stale, session: self.session().unwrap_or_default() })
    }

    /// Comes back to what was kept.
    pub fn come_back(&mut self, kept: &Kept) -> Result<(), Fault> {
        self.client().map_err(|error| Fault::error(error.to_string()))?;
        self.remember(Some(kept.session));
        self.values.clone_from(&kept.values);
        (self.mode, self.is_stale) = (kept.mode, kept.is_stale);
        Ok(())
    }

    fn session(&self) -> Option<Session> {
        match &self.client {
            Some(Client::InProcess(client)) => client.session().copied(),
            _ => None,
        }
    }

    fn remember(&mut self, session: Option<Session>) {
        if let (Some(Client::InProcess(client)), Some(session)) = (&mut self.client, session) {
            client.set_session(session);
        }
    }

    /// What answers, opened with the first question.
    fn client(&mut self) -> Result<&mut Client, ClientError> {
        let client = match self.client.take() {
            Some(client) => client,
            None => self.open()?,
        };
        Ok(self.client.insert(client))
    }

    fn open(&self) -> Result<Client, ClientError> {
        let Settings { vehicle, address, .. } = &self.settings;
        let no_server = |at: &str, reason: String| ClientError::NoServer { at: at.to_owned(), reason };
        let Some(address) = address else {
            let folder = self.settings.bundle(&self.resources);
            let served = bundle::load_served(&folder, Isa::available()[0])
                .map_err(|error| no_server("the resources of this unit", error.to_string()))?;
            return Ok(Client::InProcess(Box::new(InProcess::new(Arc::new(served)).in_session())));
        };
        let timeout = Duration::try_from_secs_f64(self.number(Variable::Timeout))
            .map_err(|error| no_server(address, format!("timeout_s: {error}")))?;
        let parsed: Address = address.parse().map_err(|error| no_server(address, format!("{error}")))?;
        Ok(match &parsed {
            Address::Shm(namespace) => {
                // the standard library's hasher is seeded at random for each instance
                let session = RandomState::new().hash_one(std::process::id()).max(1);
                let client = ShmClient::new(vehicle, Wait::Block, timeout);
                Client::Shm(Box::new(client.in_namespace(namespace).in_session(session)))
            }
            Address::Tcp(_) | Address::Tls(_) | Address::Unix(_) => {
                // a unit has no parameter for a secret, which would stand in the simulation's own files
                let (url, shown) = (parsed.url().unwrap_or_default(), Credentials::from_environment()?);
                Client::Grpc(Box::new(GrpcClient::connect(&url, vehicle, Method::Stream, timeout, &shown)?))
            }
        })
    }

    /// Answers the inputs.
    fn evaluate(&mut self, time_step: f64) -> Result<(), ClientError> {
        let state = self.state(time_step);
        let reply = self.client()?.evaluate(&state)?;
        self.publish(&reply);
        self.is_stale = false;
        Ok(())
    }

    fn state(&self, time_step: f64) -> State {
        let flag = |variable| self.layout.place(variable).is_some() && self.number(variable) != 0.0;
        let real = |variable| self.number(variable) as f32;
        let three = |variable| self.vector(variable).map(|x| x as f32).into();
        let speeds = || {
            let place = self.layout.place(Variable::WheelSpeed)?;
            let speeds: Vec<f32> = self.values[place].iter().map(|speed| *speed as f32).collect();
            PerWheel::new(&speeds)
        };
        State {
            velocity: three(Variable::Velocity),
            current: three(Variable::Current),
            angular_velocity: three(Variable::AngularVelocity),
            acceleration: three(Variable::Acceleration),
            angular_acceleration: three(Variable::AngularAcceleration),
            gravity: three(Variable::Gravity),
            depth: f32::NAN,
            water_level: Some(real(Variable::WaterLevel)),
            bed_clearance: flag(Variable::BedClearanceGiven).then(|| real(Variable::BedClearance)),
            bed: None,
            density: real(Variable::Density),
            dry_contact: flag(Variable::DryContact),
            heading: flag(Variable::HeadingGiven).then(|| real(Variable::Heading)),
            depth_rate: None,
            wheel_speeds: if flag(Variable::WheelSpeedsGiven) { speeds() } else { None },
            time_step: time_step as f32,
            implicit_added_mass: flag(Variable::ImplicitAddedMass),
            physics: match self.number(Variable::Physics) as u8 {
                2 => Some(Physics::Full),
                3 => Some(Physics::QuasiSteady),
                4 => Some(Physics::Hydrostatic),
                _ => None,
            },
            jacobian: false,
            ..State::default()
        }
    }

    /// Writes the outputs.
    fn publish(&mut self, reply: &Reply) {
        let base = reply.base.as_ref();
        let rows = |of: fn(&wade_client::SurfaceReply) -> [f32; 3]| -> Vec<f32> {
            reply.surfaces.iter().flat_map(of).collect()
        };
        let singles: [(Variable, &[f32]); 7] = [
            (Variable::Force, &reply.force),
            (Variable::Moment, &reply.moment),
            (Variable::CenterOfMass, &reply.about),
            (Variable::ForceDeviation, &reply.uncertainty),
            (Variable::MomentDeviation, &reply.moment_uncertainty),
            (Variable::AddedMass, reply.added_mass.as_ref().map_or(&[0.0; 36], |matrix| matrix)),
            (Variable::Damping, base.map_or(&[0.0; 36], |base| &base.damping)),
        ];
        for (variable, values) in singles {
            self.put_single(variable, values);
        }
        self.put_single(Variable::ShaftPower, &[base.map_or(0.0, |base| base.shaft_power)]);
        let wetted: Vec<f32> = reply.surfaces.iter().map(|surface| surface.wetted_fraction).collect();
        self.put_single(Variable::WettedFraction, &wetted);
        if self.settings.surface_loads {
            self.put_single(Variable::SurfaceForce, &rows(|surface| surface.force));
            self.put_single(Variable::SurfacePoint, &rows(|surface| surface.point));
            self.put_single(Variable::SurfaceCouple, &rows(|surface| surface.couple));
        }
        self.put(Variable::Outside, &reply.outside.excess);
        self.put(Variable::InDomain, &[f64::from(u8::from(reply.outside.is_inside()))]);
        self.put(Variable::BundleVersion, &[f64::from(reply.version)]);
        self.put(Variable::Age, &[0.0]);
    }

    fn put_single(&mut self, variable: Variable, values: &[f32]) {
        let Some(place) = self.layout.place(variable) else { return };
        for (slot, value) in self.values[place].iter_mut().zip(values) {
            *slot = f64::from(*value);
        }
    }

    fn put(&mut self, variable: Variable, values: &[f64]) {
        let Some(place) = self.layout.place(variable) else { return };
        for (slot, value) in self.values[place].iter_mut().zip(values) {
            *slot = *value;
        }
    }

    /// The value of a variable that is a number; 0 of one that the unit does not have.
    fn number(&self, variable: Variable) -> f64 {
        self.layout.place(variable).map_or(0.0, |place| self.values[place.start])
    }

    fn vector(&self, variable: Variable) -> Vec3 {
        self.layout.place(variable).map_or_else(Vec3::zeros, |place| vector(&self.values[place]))
    }
}

fn vector(values: &[f64]) -> Vec3 {
    Vec3::from_column_slice(&values[..3])
}

fn add(to: &mut [f64], values: &[f64]) {
    to.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
}

fn too_short(what: &str) -> Fault {
    Fault::error(format!("the {what} has fewer numbers than its variables"))
}
