//! The training domain of weights that were learnt from samples.

use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;

use super::{Sides, Source, TrainError};
use crate::dataset::Sample;
use crate::parameter_table::{HEAVE, TILT, TURN};
use wade_core::condition::Condition;
use wade_core::domain::{Domain, Range};

/// The ranges of the states of a vehicle that were learnt from; those of all vehicles where none was of this one.
pub(super) fn learnt(name: &str, source: &Source, sides: Sides<'_>) -> Result<Domain, TrainError> {
    let samples = || sides.split.training.iter().map(|&number| &source.data.samples[number]);
    let of_vehicle = of(samples().filter(|sample| sample.vehicle == name));
    of_vehicle.or_else(|| of(samples())).ok_or(TrainError::EmptySide { side: "training" })
}

/// The ranges of some states; `None` where there is none, or none that moves.
pub fn of<'a>(samples: impl Iterator<Item = &'a Sample> + Clone) -> Option<Domain> {
    let cases = samples.clone().map(|sample| sample.case.as_str()).collect::<BTreeSet<_>>().len();
    let range = |of: &dyn Fn(&Condition) -> Option<f64>| {
        let values = samples.clone().filter_map(|sample| of(&sample.condition));
        values.fold(None, |range: Option<Range>, x| match range {
            Some(range) => Some(Range { min: range.min.min(x), max: range.max.max(x) }),
            None => Some(Range { min: x, max: x }),
        })
    };
    let drawn = |of: &dyn Fn(&Condition) -> Option<f64>, most: f64| {
        Some(widened(range(of)?, cases, Range { min: 0.0, max: most }))
    };
    let with_room =
        |range: Range, least: f64, most: f64| Range { min: range.min.min(least), max: range.max.max(most) };
    let speed = |c: &Condition| c.velocity.x.hypot(c.velocity.y);
    let angle = |c: &Condition| (speed(c) > 1e-6).then(|| c.velocity.x.abs().atan2(c.velocity.y.abs()));
    Some(Domain {
        speed_mps: drawn(&|c| Some(speed(c)), f64::INFINITY)?,
        angle_rad: drawn(&angle, FRAC_PI_2)?,
        density_kgpm3: drawn(&|c| Some(c.density), f64::INFINITY)?,
        depth_m: drawn(&|c| Some(c.depth), f64::INFINITY)?,
        tilt_rad: with_room(range(&|c| Some(c.up.x.hypot(c.up.y).atan2(c.up.z)))?, 0.0, TILT),
        vertical_speed_mps: with_room(range(&|c| Some(c.velocity.z))?, -HEAVE, HEAVE),
        angular_speed_radps: with_room(range(&|c| Some(c.angular_velocity.norm()))?, 0.0, TURN),
    })
}

/// A range that cases were drawn from by chance, of which the drawn ones miss the ends: wider by two of their mean distances
/// on either side.
fn widened(range: Range, cases: usize, possible: Range) -> Range {
    let room = 2.0 * (range.max - range.min) / cases.saturating_sub(1).max(1) as f64;
    Range { min: (range.min - room).max(possible.min), max: (range.max + room).min(possible.max) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_that_cases_miss_by_chance_are_inside_and_what_cannot_be_is_not() {
        let half = Range { min: 0.0, max: FRAC_PI_2 };
        let found = widened(Range { min: 0.01, max: 1.49 }, 75, half);
        assert!(found.min == 0.0 && (found.max - 1.53).abs() < 1e-12, "{found:?}");
        assert_eq!(widened(Range { min: 0.5, max: 1.56 }, 54, half).max, FRAC_PI_2);
        let one = Range { min: 1000.0, max: 1000.0 };
        assert_eq!(widened(one, 1, Range { min: 0.0, max: f64::INFINITY }), one);
    }
}
