//! The contract between servers and clients: the messages of `proto/`, the layout and the names of shared memory, the
//! checks on a state, the reasons for which a request is refused, and the casts between these and the values of the library.

mod convert;
mod evaluator;
pub mod proto;
mod refusal;
mod sessions;
pub mod shm;
mod stability;
mod state;
mod tensor_fault;

pub use convert::{
    DERIVATIVES, added_mass, batch, batch_response, by_rows, derivatives, push, response, single, state,
    summary, vehicle,
};
pub use evaluator::{Evaluated, Evaluator, nanoseconds_since};
pub use refusal::{Overloaded, Refusal, UnknownVehicle};
pub use sessions::Sessions;
pub use stability::{MAX_STATES, StabilityFault, StabilityStates, stability};
pub use state::{CheckedState, Field, InvalidState, Problem, State, UNIT_TOLERANCE, limit};
pub use tensor_fault::TensorFault;
