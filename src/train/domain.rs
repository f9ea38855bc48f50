//! The training domain of weights that were learnt from samples.

use super::{Sides, Source, TrainError};
use crate::condition::Condition;
use crate::dataset::Sample;
use crate::domain::{Domain, Range};

/// Room for the tilt [rad], heave [m/s] and turning [rad/s] of a vehicle that is level, planar and straight but for noise.
pub(super) const TILT: f64 = 0.01;
pub(super) const HEAVE: f64 = 0.05;
pub(super) const TURN: f64 = 0.05;

/// The ranges of the states of a vehicle that were learnt from; those of all vehicles where none was of this one.
pub(super) fn learnt(name: &str, source: &Source, sides: Sides<'_>) -> Result<Domain, TrainError> {
    let samples = || sides.split.training.iter().map(|&number| &source.data.samples[number]);
    let of_vehicle = of(samples().filter(|sample| sample.vehicle == name));
    of_vehicle.or_else(|| of(samples())).ok_or(TrainError::EmptySide { side: "training" })
}

/// The ranges of some states; `None` where there is none, or none that moves.
pub fn of<'a>(samples: impl Iterator<Item = &'a Sample> + Clone) -> Option<Domain> {
    let range = |of: &dyn Fn(&Condition) -> Option<f64>| {
        let values = samples.clone().filter_map(|sample| of(&sample.condition));
        values.fold(None, |range: Option<Range>, x| match range {
            Some(range) => Some(Range { min: range.min.min(x), max: range.max.max(x) }),
            None => Some(Range { min: x, max: x }),
        })
    };
    let with_room =
        |range: Range, least: f64, most: f64| Range { min: range.min.min(least), max: range.max.max(most) };
    let speed = |c: &Condition| c.velocity.x.hypot(c.velocity.y);
    Some(Domain {
        speed_mps: range(&|c| Some(speed(c)))?,
        angle_rad: range(&|c| (speed(c) > 1e-6).then(|| c.velocity.x.abs().atan2(c.velocity.y.abs())))?,
        density_kgpm3: range(&|c| Some(c.density))?,
        depth_m: range(&|c| Some(c.depth))?,
        tilt_rad: with_room(range(&|c| Some(c.up.x.hypot(c.up.y).atan2(c.up.z)))?, 0.0, TILT),
        vertical_speed_mps: with_room(range(&|c| Some(c.velocity.z))?, -HEAVE, HEAVE),
        angular_speed_radps: with_room(range(&|c| Some(c.angular_velocity.norm()))?, 0.0, TURN),
    })
}
