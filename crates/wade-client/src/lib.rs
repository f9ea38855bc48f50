//! Clients of the library's own: in process, gRPC, shared memory; one call and one reply for all.

mod address;
mod credentials;
mod error;
mod grpc;
mod grpc_link;
mod shm;
mod shm_link;

pub use error::ClientError;
use std::sync::Arc;

pub use address::{Address, AddressError};
pub use credentials::{Credentials, VARIABLES};
pub use grpc::{GrpcClient, Method, reload, replies};
pub use grpc_link::GrpcLink;
pub use shm::ShmClient;
pub use shm_link::{Asked, Lost, ShmLink};

use wade_core::domain::Outside;
use wade_core::effects::{Effect, LeftOut, OutsideBox};
use wade_core::served::{ServedVehicle, Session};
use wade_wire::State;
use wade_wire::{DERIVATIVES, added_mass, by_rows, derivatives, single};
use wade_wire::{Evaluated, Evaluator};

/// Nobody answers at a URL, for what an error and its causes say: each reason once, since some repeat their source.
fn nobody_at(url: &str, error: &dyn std::error::Error) -> ClientError {
    let mut reasons: Vec<String> = Vec::new();
    for cause in std::iter::successors(Some(error), |error| error.source()).map(ToString::to_string) {
        if !reasons.iter().any(|reason| reason.contains(&cause)) {
            reasons.push(cause);
        }
    }
    let way_out = match url.starts_with("http://") {
        true => "is wade serve running, is this its grpc.listen, and does it speak TLS (https://)?",
        false => "is wade serve running, and is this its grpc.listen or grpc.unix_socket?",
    };
    ClientError::NoServer { at: url.to_owned(), reason: format!("{}; {way_out}", reasons.join(": ")) }
}

/// The load on one surface as it travels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceReply {
    /// Force, body frame [N].
    pub force: [f32; 3],
    /// Point of application, body frame [m].
    pub point: [f32; 3],
    /// Share under water.
    pub wetted_fraction: f32,
    /// Moment of the load about the point of application [N m].
    pub couple: [f32; 3],
}

/// What the physical base tells as it travels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseReply {
    /// Height of the still-water plane above the body origin along up [m].
    pub water_level: f32,
    /// Distance from the ground-contact plane to the bed, as used [m].
    pub bed_clearance: f32,
    /// Share of the motion through the water that is motion over the bed, as used.
    pub bed: f32,
    /// Power that the shafts of the wheels put in [W]; NaN of a server that does not state it.
    pub shaft_power: f32,
    /// Linear damping by rows, forces first [kg/s, kg m/s, kg m2/s].
    pub damping: [f32; 36],
}

/// The load of an effect as it travels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectReply {
    /// Which.
    pub effect: Effect,
    /// Force, body frame [N].
    pub force: [f32; 3],
    /// Moment [N m] about the reference point of the reply.
    pub moment: [f32; 3],
    /// Why it is zero, where it was left out.
    pub left_out: Option<LeftOut>,
}

/// An answer as it travels: the same bits whatever the transport.
#[derive(Debug, Clone, PartialEq)]
pub struct Reply {
    /// Version of the bundle that answered.
    pub version: u32,
    /// Source of its training data.
    pub provenance: String,
    /// The surfaces in the vehicle's order.
    pub surfaces: Vec<SurfaceReply>,
    /// Net force, body frame [N].
    pub force: [f32; 3],
    /// Net moment [N m] about `about`.
    pub moment: [f32; 3],
    /// Center of mass, body frame [m].
    pub about: [f32; 3],
    /// One standard deviation of the net force [N].
    pub uncertainty: [f32; 3],
    /// One standard deviation of the net moment [N m].
    pub moment_uncertainty: [f32; 3],
    /// What the physical base tells; none of a bundle without one.
    pub base: Option<BaseReply>,
    /// How far each quantity lies outside the training domain.
    pub outside: Outside,
    /// The effects that were added to the model; with the surfaces they sum to the net wrench.
    pub effects: Vec<EffectReply>,
    /// Share of the effects' forces that acts on each surface [N], a part of `effects`; empty where there are none.
    pub effect_surface_forces: Vec<[f32; 3]>,
    /// How far the state lies outside the box in which the effects were seen.
    pub effects_outside: OutsideBox,
    /// Added mass and inertia by rows, forces first [kg, kg m, kg m2], of base and effects together.
    pub added_mass: Option<[f32; 36]>,
    /// Derivatives of force and moment by rows, where they were asked for: see [`Jacobian`](wade_core::model::Jacobian).
    pub jacobian: Option<[f32; DERIVATIVES]>,
    /// The server's own time [ns].
    pub compute_ns: u64,
}

impl Reply {
    fn new(vehicle: &ServedVehicle, evaluated: &Evaluated<'_>) -> Self {
        let (model, Evaluated { forces, effects, jacobian, compute_ns }) = (vehicle.model(), evaluated);
        let surface = |load: &wade_core::forces::SurfaceForce| SurfaceReply {
            force: single(&load.force),
            point: single(&load.point),
            wetted_fraction: load.wetted_fraction as f32,
            couple: single(&load.couple),
        };
        let base = |base: &wade_core::forces::Base| BaseReply {
            water_level: base.water_level as f32,
            bed_clearance: base.bed_clearance as f32,
            bed: base.bed as f32,
            shaft_power: base.shaft_power as f32,
            damping: by_rows(&base.damping),
        };
        Self {
            version: model.version(),
            provenance: model.provenance().to_owned(),
            surfaces: forces.surfaces.iter().map(surface).collect(),
            force: single(&forces.wrench.force),
            moment: single(&forces.wrench.moment),
            about: single(&model.vehicle().center_of_mass),
            uncertainty: single(&forces.uncertainty),
            moment_uncertainty: single(&forces.moment_uncertainty),
            base: forces.base.as_ref().map(base),
            outside: Outside { excess: forces.outside.excess.map(|excess| f64::from(excess as f32)) },
            effects: effects.loads.iter().map(EffectReply::from).collect(),
            effect_surface_forces: effects.surface_forces.iter().map(single).collect(),
            effects_outside: effects.outside.map(|excess| f64::from(excess as f32)),
            added_mass: added_mass(effects),
            jacobian: jacobian.map(derivatives),
            compute_ns: *compute_ns,
        }
    }
}

impl From<&wade_core::effects::EffectLoad> for EffectReply {
    fn from(load: &wade_core::effects::EffectLoad) -> Self {
        Self {
            effect: load.effect,
            force: single(&load.wrench.force),
            moment: single(&load.wrench.moment),
            left_out: load.left_out,
        }
    }
}

/// A vehicle in this process.
#[derive(Debug)]
pub struct InProcess {
    vehicle: Arc<ServedVehicle>,
    evaluator: Evaluator,
    session: Option<Session>,
}

impl InProcess {
    /// Asks this vehicle; each state by itself.
    pub fn new(vehicle: Arc<ServedVehicle>) -> Self {
        Self { vehicle, evaluator: Evaluator::default(), session: None }
    }

    /// Takes the states for a run, one after the other, so that effects remember.
    pub fn in_session(self) -> Self {
        Self { session: Some(Session::default()), ..self }
    }

    /// What lasts from state to state; none where each is by itself.
    pub fn session(&self) -> Option<&Session> {
        self.session.as_ref()
    }

    /// Goes on from what lasted at another time.
    pub fn set_session(&mut self, session: Session) {
        self.session = Some(session);
    }

    /// The forces in one state.
    pub fn evaluate(&mut self, state: &State) -> Result<Reply, ClientError> {
        let state = state.check_for(&self.vehicle)?;
        let evaluated = self.evaluator.evaluate(&self.vehicle, &state, self.session.as_mut());
        Ok(Reply::new(&self.vehicle, &evaluated))
    }

    fn compute(&mut self, states: &[State]) -> Result<u64, ClientError> {
        let Self { vehicle, evaluator, session } = self;
        states.iter().try_fold(0, |ns, state| {
            Ok(ns + evaluator.evaluate(vehicle, &state.check_for(vehicle)?, session.as_mut()).compute_ns)
        })
    }
}

/// Any of them.
#[derive(Debug)]
pub enum Client {
    /// No transport at all.
    InProcess(Box<InProcess>),
    /// gRPC over TCP or a Unix socket, one call a query or one stream.
    Grpc(Box<GrpcClient>),
    /// Shared memory.
    Shm(Box<ShmClient>),
}

impl Client {
    /// The forces in one state.
    pub fn evaluate(&mut self, state: &State) -> Result<Reply, ClientError> {
        match self {
            Self::InProcess(client) => client.evaluate(state),
            Self::Grpc(client) => client.evaluate(state).map(Reply::from),
            Self::Shm(client) if state.jacobian => {
                client.evaluate_with_jacobian(state).map(|page| Reply::from(&page))
            }
            Self::Shm(client) => client.evaluate(state).map(|answer| Reply::from(&answer)),
        }
    }

    /// The forces in each state of a batch.
    pub fn evaluate_batch(&mut self, states: &[State]) -> Result<Vec<Reply>, ClientError> {
        match self {
            Self::InProcess(client) => states.iter().map(|state| client.evaluate(state)).collect(),
            Self::Grpc(client) => client.evaluate_batch(states).map(grpc::replies),
            Self::Shm(client) if states.iter().any(|state| state.jacobian) => {
                // a batch has no room for derivatives
                let replies = |state| client.evaluate_with_jacobian(state).map(|page| Reply::from(&page));
                states.iter().map(replies).collect()
            }
            Self::Shm(client) => {
                client.evaluate_batch(states).map(|answers| answers.iter().map(Reply::from).collect())
            }
        }
    }

    /// Asks for one state, or for a batch where there are more, and keeps of the answer only the server's own time
    /// [ns]: what a measurement of the transport calls.
    pub fn compute(&mut self, states: &[State]) -> Result<u64, ClientError> {
        match (self, states) {
            (Self::InProcess(client), _) => client.compute(states),
            (Self::Grpc(client), [state]) => client.evaluate(state).map(|response| response.compute_ns),
            (Self::Grpc(client), _) => client.evaluate_batch(states).map(|response| response.compute_ns),
            (Self::Shm(client), [state]) if state.jacobian => {
                client.evaluate_with_jacobian(state).map(|page| page.answer.compute_ns)
            }
            (Self::Shm(client), [state]) => client.evaluate(state).map(|answer| answer.compute_ns),
            (Self::Shm(client), _) => client.compute_batch(states),
        }
    }
}
