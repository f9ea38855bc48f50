//! Published measurements as folders of trials, one source a file. The measurements are not part of this repository.
//!
//! What does not fit is left out: ten single states of a ship near banks (Lataire, Vantorre, Eloot, 2009) have neither a
//! simulation beside them nor a column for the bank.

mod error;
pub mod falling_balls;
pub mod kvlcc2;
pub mod rm2_rotor;

pub use error::ImportError;
