//! Arithmetic on sampled signals: filters, resampling, rotations in time.
//!
//! Plain numbers in and out; stamps are seconds, increasing and finite, which whoever reads them from a file has checked.

mod median;
mod pieces;
mod resample;
mod rotation;
mod savitzky_golay;

pub use median::median;
pub use pieces::{GAP_STEPS, median_step, pieces};
pub use resample::{UniformGrid, interpolate, slerp};
pub use rotation::{angular_velocity, without_sign_flips};
pub use savitzky_golay::{FilterError, MAX_ORDER, SavitzkyGolay};
