//! The shared-memory client: polls or sleeps for its answer, and finds a server again that was killed and restarted.

use std::time::{Duration, Instant};

use tonic::Code;

use super::shm_link::{Lost, ShmLink, not_served};
use super::{BaseReply, ClientError, EffectReply, Reply, SurfaceReply};
use wade_core::effects::{Effect, LeftOut};
use wade_wire::shm::layout::{
    Answer, BatchAnswer, EffectAnswer, HAS_ADDED_MASS, HAS_DAMPING, JacobianAnswer, MAX_BATCH, Names, Query,
    Status, SurfaceAnswer,
};
use wade_wire::shm::{self, Wait};
use wade_wire::{State, proto};

/// A client of one vehicle, owned by one thread.
#[derive(Debug)]
pub struct ShmClient {
    names: Names,
    vehicle: String,
    wait: Wait,
    timeout: Duration,
    session: u64,
    link: Option<ShmLink>,
}

impl ShmClient {
    /// A client that connects with its first call. `timeout` bounds each call [s].
    pub fn new(vehicle: &str, wait: Wait, timeout: Duration) -> Self {
        let names = Names::new(shm::NAMESPACE);
        Self { names, vehicle: vehicle.to_owned(), wait, timeout, session: 0, link: None }
    }

    /// Takes the states from now on for a run of this number, one after the other, so that effects remember; 0 for none.
    pub fn in_session(self, session: u64) -> Self {
        Self { session, ..self }
    }

    /// Asks the server of another namespace than the default.
    pub fn in_namespace(self, namespace: &str) -> Self {
        Self { names: Names::new(namespace), ..self }
    }

    /// The forces in one state, which asks for no derivatives.
    pub fn evaluate(&mut self, state: &State) -> Result<Answer, ClientError> {
        let query = Query { session: self.session, ..Query::from(state) };
        let answer = self.exchange(|link, deadline| {
            let asked = link.ask(query)?;
            link.answer(&asked, deadline, Answer::copied)
        })?;
        self.check(&answer, state)?;
        Ok(answer)
    }

    /// The forces in one state, and their derivatives.
    pub fn evaluate_with_jacobian(&mut self, state: &State) -> Result<JacobianAnswer, ClientError> {
        let query = Query { session: self.session, ..Query::from(&State { jacobian: true, ..*state }) };
        let (names, vehicle) = (self.names.clone(), self.vehicle.clone());
        self.link()?.open_jacobian(&names, &vehicle)?;
        let page = self.exchange(|link, deadline| {
            let asked = link.ask_jacobian(query)?;
            link.answer_jacobian(&asked, deadline, JacobianAnswer::copied)
        })?;
        self.check(&page.answer, state)?;
        Ok(page)
    }

    /// What the server says of the vehicle.
    pub fn vehicle(&mut self) -> Result<proto::GetVehicleResponse, ClientError> {
        let (names, vehicle, timeout) = (self.names.clone(), self.vehicle.clone(), self.timeout);
        let deadline = Instant::now() + timeout;
        let answered =
            self.link()?.describe(&names, &vehicle, deadline, |answer| (answer.status, answer.decoded()));
        let refused = |code, message: String| Err(ClientError::Refused { code, message });
        match answered.inspect_err(|_| self.link = None)? {
            None => Err(ClientError::Timeout(timeout)),
            Some((status, description)) if status == Status::Ok as u32 => description
                .or_else(|error| refused(Code::DataLoss, format!("the description cannot be read: {error}"))),
            Some((status, _)) if status == Status::TooLong as u32 => {
                let message = "the description has no room in shared memory; gRPC gives it";
                refused(Code::ResourceExhausted, message.into())
            }
            Some((status, _)) => Err(self.refused(status)),
        }
    }

    /// Passes an answer that has forces.
    fn check(&self, answer: &Answer, state: &State) -> Result<(), ClientError> {
        match answer.refusal_of(state) {
            Some(invalid) => Err(invalid.into()),
            None if answer.status == Status::Ok as u32 => Ok(()),
            None => Err(self.refused(answer.status)),
        }
    }

    /// The forces in each state of a batch.
    pub fn evaluate_batch(&mut self, states: &[State]) -> Result<Vec<Answer>, ClientError> {
        self.exchange_batch(states, |answer| {
            answer.answers[..states.len()].iter().map(Answer::copied).collect()
        })
    }

    /// The server's own time for a batch [ns].
    pub fn compute_batch(&mut self, states: &[State]) -> Result<u64, ClientError> {
        self.exchange_batch(states, |answer| answer.compute_ns)
    }

    fn exchange_batch<T>(
        &mut self,
        states: &[State],
        take: impl Fn(&BatchAnswer) -> T,
    ) -> Result<T, ClientError> {
        let len = states.len();
        if len > MAX_BATCH {
            return Err(ClientError::BatchTooLong { len, limit: MAX_BATCH });
        }
        let session = self.session;
        let queries = states.iter().map(|state| Query { session, ..Query::from(state) });
        let (status, refusal, taken) = self.exchange(|link, deadline| {
            let asked = link.ask_batch(queries)?;
            link.answer_batch(&asked, deadline, |answer| {
                (answer.status, answer.refusal_of(states), take(answer))
            })
        })?;
        match refusal {
            _ if status == Status::Ok as u32 => Ok(taken),
            Some((invalid, _)) => Err(invalid.into()),
            None if status == Status::InvalidBatch as u32 => Err(ClientError::Refused {
                code: Code::InvalidArgument,
                message: "the batch is empty or too long, or has a flag that the server does not know".into(),
            }),
            None => Err(self.refused(status)),
        }
    }

    /// The error of a status that names no field.
    fn refused(&self, status: u32) -> ClientError {
        if status == Status::NotServed as u32 {
            return not_served(&self.names, &self.vehicle);
        }
        // a code that a newer server of the same layout may send
        ClientError::Refused {
            code: Code::Unknown,
            message: format!("status {status}; is the client up to date?"),
        }
    }

    /// The link, opened where there is none.
    fn link(&mut self) -> Result<&mut ShmLink, ClientError> {
        match &mut self.link {
            Some(link) => Ok(link),
            none => Ok(none.insert(ShmLink::open(&self.names, &self.vehicle, self.wait)?)),
        }
    }

    /// One call on a link that is opened where there is none and given up where nobody answers.
    fn exchange<T>(
        &mut self,
        call: impl FnOnce(&mut ShmLink, Instant) -> Result<Option<T>, Lost>,
    ) -> Result<T, ClientError> {
        let deadline = Instant::now() + self.timeout;
        let result = match call(self.link()?, deadline) {
            Ok(Some(taken)) => return Ok(taken),
            Ok(None) => Err(ClientError::Timeout(self.timeout)),
            Err(lost) => Err(ClientError::NoServer { at: "shared memory".into(), reason: lost.to_string() }),
        };
        self.link = None;
        result
    }
}

impl From<&Answer> for Reply {
    fn from(answer: &Answer) -> Self {
        let surface = |load: &SurfaceAnswer| SurfaceReply {
            force: load.force_n,
            point: load.point_m,
            wetted_fraction: load.wetted_fraction,
            // of a bundle without the physical base it is not set
            couple: load.couple_nm.map(|x| if x.is_nan() { 0.0 } else { x }),
        };
        let base = (answer.flags & HAS_DAMPING != 0).then_some(BaseReply {
            water_level: answer.water_level_m,
            bed_clearance: answer.bed_clearance_m,
            bed: answer.bed,
            shaft_power: answer.shaft_power(),
            damping: answer.damping,
        });
        let effect = |load: &EffectAnswer| {
            Some(EffectReply {
                effect: Effect::from_code(load.effect)?,
                force: load.force_n,
                moment: load.moment_nm,
                left_out: LeftOut::from_code(load.left_out),
            })
        };
        Self {
            version: answer.bundle_version,
            provenance: answer.provenance().to_owned(),
            surfaces: answer.surfaces().iter().map(surface).collect(),
            force: answer.force_n,
            moment: answer.moment_nm,
            about: answer.about_m,
            uncertainty: answer.force_deviation_n,
            moment_uncertainty: answer.moment_deviation_nm,
            base,
            outside: answer.outside(),
            effects: answer.effects().iter().filter_map(effect).collect(),
            effect_surface_forces: match answer.effect_count {
                0 => Vec::new(),
                _ => answer.surfaces().iter().map(|load| load.effect_force_n).collect(),
            },
            effects_outside: answer.effects_outside(),
            added_mass: (answer.flags & HAS_ADDED_MASS != 0).then_some(answer.added_mass),
            // the page of an answer has no room for them
            jacobian: None,
            compute_ns: answer.compute_ns,
        }
    }
}

impl From<&JacobianAnswer> for Reply {
    fn from(page: &JacobianAnswer) -> Self {
        Self { jacobian: Some(page.jacobian), ..Self::from(&page.answer) }
    }
}
