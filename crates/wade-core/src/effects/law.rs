//! What every effect's file defines, and how typed parameters become the three numbers of `shape` in a file and back.

use super::input::{Elsewhere, Input, Memory, Part};
use super::spec::EffectSpec;
use crate::wrench::Wrench;

/// `shape` in `effects.toml` and in reports: the nonlinear parameters, then the form of the law by number.
pub type Numbers = [f64; 3];

/// An effect: what it says of itself, the form of its law with its nonlinear parameters, and its load.
pub(super) trait Law: Copy + Default {
    /// What the effect says of itself.
    const SPEC: EffectSpec;

    /// Reads the numbers of a file. Without form and parameters all are 0.
    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 0)?;
        Ok(Self::default())
    }

    /// The numbers that [`Self::from_numbers`] reads.
    fn to_numbers(&self) -> Numbers {
        [0.0; 3]
    }

    /// Emits the load of each coefficient at 1, see [`super::Shape::basis`].
    fn basis(&self, _memory: &Memory, _input: &Input, _emit: &mut impl FnMut(usize, Part, Wrench)) {}

    /// Advances what it remembers, see [`super::Shape::advance`].
    fn advance(&self, _memory: &mut Memory, _input: &Input, _dt: f64) {}

    /// See [`super::Shape::elsewhere`].
    fn elsewhere(&self, _input: &Input) -> Option<Elsewhere> {
        None
    }

    /// See [`super::Shape::is_in_proportion`].
    fn is_in_proportion(&self) -> bool {
        false
    }

    /// See [`super::Shape::needs_channel_width`].
    fn needs_channel_width(&self) -> bool {
        Self::SPEC.inputs.contains(&super::Quantity::ChannelWidth)
    }
}

/// A number that means nothing in the law of an effect.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("shape[{index}] must be {expected}")]
pub struct ShapeFault {
    /// Place of the number.
    pub index: usize,
    /// What it must be.
    pub expected: String,
}

/// The form whose number is nearest, with the lower at half way: files hold 0, 1 and so on.
pub(super) fn form<T: Copy>(numbers: &Numbers, index: usize, forms: &[T]) -> Result<T, ShapeFault> {
    let nearest = (numbers[index] - 0.5).ceil();
    let found = (0..forms.len()).find(|&number| number as f64 == nearest);
    found.map(|number| forms[number]).ok_or_else(|| {
        let names: Vec<String> = (0..forms.len()).map(|number| number.to_string()).collect();
        ShapeFault { index, expected: names.join(" or ") }
    })
}

/// Any finite number.
pub(super) fn finite(numbers: &Numbers, index: usize) -> Result<f64, ShapeFault> {
    let fault = || ShapeFault { index, expected: "finite".to_owned() };
    Some(numbers[index]).filter(|number| number.is_finite()).ok_or_else(fault)
}

/// A finite number that is not negative.
pub(super) fn amount(numbers: &Numbers, index: usize) -> Result<f64, ShapeFault> {
    let fault = || ShapeFault { index, expected: "finite and 0 or greater".to_owned() };
    Some(numbers[index]).filter(|number| number.is_finite() && *number >= 0.0).ok_or_else(fault)
}

/// 0 from a place on: the law has no further numbers.
pub(super) fn unused(numbers: &Numbers, from: usize) -> Result<(), ShapeFault> {
    match (from..numbers.len()).find(|&index| numbers[index] != 0.0) {
        Some(index) => Err(ShapeFault { index, expected: "0: this law has no such parameter".to_owned() }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::condition::Condition;
    use crate::effects::{Body, Effect, Immersion, Kind, Quantity, Shape};
    use crate::frame::{Vec3, up_from_roll_pitch};
    use crate::vehicle::shipped;

    #[test]
    fn every_form_has_its_numbers() {
        let forms: &[(Effect, &[Numbers])] = &[
            (Effect::AddedMass, &[[1.0, 0.0, 0.0]]),
            (Effect::DragCoefficientError, &[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]),
            (Effect::Rotation, &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]),
            (Effect::Current, &[[-0.3, 0.2, 0.0], [-0.3, 0.2, 1.0]]),
            (Effect::WaterLevelOffset, &[[-0.02, 0.0, 0.0]]),
            (Effect::HullFlooding, &[[0.01, 0.0, 0.0]]),
            (Effect::WaterEntrySlamming, &[[0.2, 0.0, 0.0]]),
            (Effect::WaveMemory, &[[0.8, 0.0, 0.0], [0.8, 2.0, 1.0]]),
            (Effect::ChannelBlockage, &[[0.7, 0.0, 0.0]]),
            (Effect::Squat, &[[0.0, 1.0, 0.0], [0.7, 0.0, 0.0], [0.7, 2.0, 0.0]]),
            (Effect::WheelPaddleThrust, &[[1.0, 0.0, 0.0]]),
            (Effect::BedMotion, &[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]),
            (Effect::SensorDelay, &[[0.1, 0.0, 0.0]]),
            (Effect::DriveDelay, &[[0.1, 0.0, 0.0], [0.1, 1.0, 0.0]]),
            (Effect::SensorBiasStep, &[[0.0, 3.0, 0.0], [1.0, 2.5, 0.0]]),
            (Effect::SensorDrift, &[[1.0, 0.0, 0.0]]),
            (Effect::SensorGain, &[[1.0, 0.0, 0.0]]),
        ];
        for &(effect, numbers) in forms {
            for &numbers in numbers {
                let shape = Shape::from_numbers(effect, numbers).unwrap();
                assert_eq!((shape.effect(), shape.to_numbers()), (effect, numbers));
                assert_ne!(shape, effect.plain());
            }
        }
        for effect in Effect::ALL {
            assert_eq!(Shape::from_numbers(effect, [0.0; 3]), Ok(effect.plain()));
            assert_eq!(effect.plain().to_numbers(), [0.0; 3]);
        }
    }

    #[test]
    fn a_form_is_the_nearest_and_what_means_nothing_is_refused() {
        let drag = |number| Shape::from_numbers(Effect::DragCoefficientError, [number, 0.0, 0.0]);
        for (number, nearest) in [(-0.3, 0.0), (0.5, 0.0), (0.51, 1.0), (1.5, 1.0), (1.51, 2.0), (2.4, 2.0)] {
            assert_eq!(drag(number).unwrap().to_numbers()[0], nearest, "{number}");
        }
        for (effect, numbers, expected) in [
            (Effect::DragCoefficientError, [4.0, 0.0, 0.0], "shape[0] must be 0 or 1 or 2 or 3"),
            (Effect::DragCoefficientError, [f64::NAN, 0.0, 0.0], "shape[0] must be 0 or 1 or 2 or 3"),
            (Effect::LinearDamping, [0.0, 0.0, 0.1], "shape[2] must be 0"),
            (Effect::Squat, [0.7, 1.0, 0.0], "shape[1] must be 0 or 2"),
            (Effect::Squat, [0.0, 2.0, 0.0], "shape[0] must be greater than 0"),
            (Effect::HullFlooding, [-0.1, 0.0, 0.0], "shape[0] must be finite and 0 or greater"),
            (Effect::Current, [0.0, f64::INFINITY, 0.0], "shape[1] must be finite"),
        ] {
            let error = Shape::from_numbers(effect, numbers).unwrap_err().to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }

    /// Quantities that can be changed by themselves.
    const CHANGEABLE: [Quantity; 10] = [
        Quantity::Velocity,
        Quantity::GroundVelocity,
        Quantity::AngularVelocity,
        Quantity::Acceleration,
        Quantity::AngularAcceleration,
        Quantity::ModelWrench,
        Quantity::Heading,
        Quantity::WheelSpeeds,
        Quantity::DepthRate,
        Quantity::ChannelWidth,
    ];

    /// The loads of an effect at the second of two states, one of whose quantities is changed.
    fn loads(shape: &Shape, body: &Body, changed: Option<Quantity>) -> Vec<(usize, Wrench)> {
        let more = |quantity: Quantity| if changed == Some(quantity) { 0.1 } else { 0.0 };
        let vector = |x: f64, quantity: Quantity| Vec3::new(x, -0.2, 0.1).add_scalar(more(quantity));
        let condition = Condition {
            ground_velocity: vector(0.6, Quantity::GroundVelocity),
            angular_velocity: vector(0.3, Quantity::AngularVelocity),
            acceleration: vector(0.8, Quantity::Acceleration),
            angular_acceleration: vector(0.4, Quantity::AngularAcceleration),
            up: up_from_roll_pitch(0.03, -0.05),
            ..Condition::level(vector(0.7, Quantity::Velocity), 0.17)
        };
        let mut immersion = Immersion::default();
        body.immerse(&condition, &mut immersion);
        let force = vector(-60.0, Quantity::ModelWrench);
        let input = Input {
            body,
            condition: &condition,
            immersion: &immersion,
            predicted: Wrench { force, moment: force },
            elsewhere: None,
            base_drag: Vec3::new(1.1, 1.3, 0.9),
            yaw: 0.6 + more(Quantity::Heading),
            wetting_rate: 0.2 + more(Quantity::DepthRate),
            channel_width: Some(3.5 + more(Quantity::ChannelWidth)),
            wheel_speeds: [Some(3.0 + more(Quantity::WheelSpeeds)); 4].into(),
        };
        let mut memory = Memory::default();
        [0.0, 0.1].iter().for_each(|dt| shape.advance(&mut memory, &input, *dt));
        let mut found = Vec::new();
        shape.basis(&memory, &input, |coefficient, _, load| found.push((coefficient, load)));
        found
    }

    #[test]
    fn an_effect_reads_what_its_spec_says_and_loads_every_coefficient() {
        let body = Body::of_vehicle(&shipped::husky().unwrap().vehicle().unwrap());
        for effect in Effect::ALL.into_iter().filter(|effect| effect.kind() == Kind::Physics) {
            let shape = match effect {
                Effect::HullFlooding => Shape::from_numbers(effect, [0.01, 0.0, 0.0]).unwrap(),
                Effect::WaveMemory => Shape::from_numbers(effect, [0.8, 2.0, 0.0]).unwrap(),
                Effect::Squat => Shape::from_numbers(effect, [0.3, 2.0, 0.0]).unwrap(),
                _ => effect.plain(),
            };
            let whole = loads(&shape, &body, None);
            for (index, coefficient) in effect.coefficients().iter().enumerate() {
                let acts = |(number, load): &(usize, Wrench)| *number == index && *load != Wrench::default();
                assert!(whole.iter().any(acts), "{}: no load of {}", effect.name(), coefficient.name);
            }
            for quantity in CHANGEABLE {
                let changes = loads(&shape, &body, Some(quantity)) != whole;
                let says = effect.spec().inputs.contains(&quantity);
                assert_eq!(changes, says, "{}: {}", effect.name(), quantity.name());
            }
        }
    }

    #[test]
    fn a_held_squat_is_a_level_that_is_lower() {
        let body = Body::of_vehicle(&shipped::husky().unwrap().vehicle().unwrap());
        let sum = |effect, numbers| {
            let shape = Shape::from_numbers(effect, numbers).unwrap();
            let own = loads(&shape, &body, None).into_iter().filter(|(coefficient, _)| *coefficient == 0);
            own.fold(Wrench::default(), |mut sum, (_, load)| {
                sum += load;
                sum
            })
        };
        // 0.73 m/s over 0.17 m of water is Fr_h = 0.57
        let lower = sum(Effect::WaterLevelOffset, [0.0; 3]) * (-0.5 * 0.3 * 0.3 * 0.17);
        let held = sum(Effect::Squat, [0.3, 2.0, 0.0]);
        assert!((held.force - lower.force).norm() < 1e-9 * lower.force.norm(), "{held:?} {lower:?}");
        assert!(held.force.z < 0.0 && held.force.x > 0.0, "less lift and less drag: {held:?}");
        let below = sum(Effect::Squat, [0.9, 2.0, 0.0]);
        assert!(below.force.z < 3.0 * held.force.z, "{below:?}");
    }
}
