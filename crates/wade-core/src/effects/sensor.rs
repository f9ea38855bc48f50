//! Faults of the measuring chain. They are no load of the water: their columns lie where trials are fitted, and they are
//! never part of a model.

use super::law::{Law, Numbers, ShapeFault, amount, form, unused};
use super::spec::{Coefficient, EffectSpec, Kind, Quantity, UNBOUNDED};

/// What the faults of sensors have in common.
const SENSOR: EffectSpec =
    EffectSpec { kind: Kind::Sensor, inputs: &[Quantity::MeasuredWrench], ..EffectSpec::COMMON };

/// One coefficient a wrench component, of any size.
const fn components(force: &'static str, moment: &'static str) -> [Coefficient; 6] {
    [
        Coefficient::new("fx", force, -UNBOUNDED, UNBOUNDED),
        Coefficient::new("fy", force, -UNBOUNDED, UNBOUNDED),
        Coefficient::new("fz", force, -UNBOUNDED, UNBOUNDED),
        Coefficient::new("mx", moment, -UNBOUNDED, UNBOUNDED),
        Coefficient::new("my", moment, -UNBOUNDED, UNBOUNDED),
        Coefficient::new("mz", moment, -UNBOUNDED, UNBOUNDED),
    ]
}

/// A delay with the estimate about which its load is linear.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorDelay {
    /// Estimate of the delay [s].
    pub delay_s: f64,
}

impl Law for SensorDelay {
    const SPEC: EffectSpec = EffectSpec {
        name: "sensor_delay",
        summary: "the wrench has late time stamps",
        coefficients: &[Coefficient::new("delay", "s", 0.0, 1.0).up_to(0.5)],
        not_excited: "the predicted wrench hardly changes within a trial",
        experiment: "tap the load cell with a hammer while the motion is recorded, or change the speed in steps at depth zero",
        ..SENSOR
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        Ok(Self { delay_s: amount(numbers, 0)? })
    }

    fn to_numbers(&self) -> Numbers {
        [self.delay_s, 0.0, 0.0]
    }
}

/// A constant zero error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SensorBias;

impl Law for SensorBias {
    const SPEC: EffectSpec = EffectSpec {
        name: "sensor_bias",
        summary: "a constant zero error",
        coefficients: &components("N", "N m"),
        experiment: "read the sensor on dry ground before and after each trial",
        ..SENSOR
    };
}

/// A zero that jumps, with the place of the jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SensorBiasStep {
    /// From a trial on.
    FromTrial {
        /// Place of that trial in the order of recording.
        rank: f64,
    },
    /// Within every trial.
    WithinTrials {
        /// Time after the start of a trial [s].
        time_s: f64,
    },
}

impl Default for SensorBiasStep {
    fn default() -> Self {
        Self::FromTrial { rank: 0.0 }
    }
}

impl Law for SensorBiasStep {
    const SPEC: EffectSpec = EffectSpec {
        name: "sensor_bias_step",
        summary: "a zero that jumps",
        coefficients: &components("N", "N m"),
        experiment: "read the sensor on dry ground between all trials, in their order",
        ..SENSOR
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 2)?;
        let at = amount(numbers, 1)?;
        form(numbers, 0, &[Self::FromTrial { rank: at }, Self::WithinTrials { time_s: at }])
    }

    fn to_numbers(&self) -> Numbers {
        match *self {
            Self::FromTrial { rank } => [0.0, rank, 0.0],
            Self::WithinTrials { time_s } => [1.0, time_s, 0.0],
        }
    }
}

/// A zero that drifts with time. The numbers are those of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SensorDrift {
    /// 0: from the start of each trial.
    #[default]
    OfTrial,
    /// 1: from the start of the first trial.
    OfSession,
}

impl Law for SensorDrift {
    const SPEC: EffectSpec = EffectSpec {
        name: "sensor_drift",
        summary: "a zero that drifts with time",
        coefficients: &components("N/s", "N m/s"),
        experiment: "read the sensor at rest on dry ground for as long as a trial lasts",
        ..SENSOR
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        form(numbers, 0, &[Self::OfTrial, Self::OfSession])
    }

    fn to_numbers(&self) -> Numbers {
        [f64::from(*self as u8), 0.0, 0.0]
    }
}

/// A wrong scale. The numbers are those of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SensorGain {
    /// 0: of each component.
    #[default]
    EachComponent,
    /// 1: the same of all components.
    AllComponents,
}

impl Law for SensorGain {
    const SPEC: EffectSpec = EffectSpec {
        name: "sensor_gain",
        summary: "a wrong scale of a component, or of all",
        // farther off it is no error of a scale: such a channel was zeroed in the water, or holds something else
        coefficients: &[
            Coefficient::new("fx", "1", -0.5, 1.0).up_to(0.5),
            Coefficient::new("fy", "1", -0.5, 1.0).up_to(0.5),
            Coefficient::new("fz", "1", -0.5, 1.0).up_to(0.5),
            Coefficient::new("mx", "1", -0.5, 1.0).up_to(0.5),
            Coefficient::new("my", "1", -0.5, 1.0).up_to(0.5),
            Coefficient::new("mz", "1", -0.5, 1.0).up_to(0.5),
            // one calibration factor of the whole sensor
            Coefficient::new("all", "1", -0.5, 1.0).up_to(0.5),
        ],
        experiment: "hang three known weights on the sensor, in each direction that was measured (measured.known_loads in trials.toml)",
        ..SENSOR
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        form(numbers, 0, &[Self::EachComponent, Self::AllComponents])
    }

    fn to_numbers(&self) -> Numbers {
        [f64::from(*self as u8), 0.0, 0.0]
    }
}

/// Sensor axes turned against the body's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AxisMisalignment;

impl Law for AxisMisalignment {
    const SPEC: EffectSpec = EffectSpec {
        name: "axis_misalignment",
        summary: "sensor axes turned against the body's",
        coefficients: &[
            Coefficient::new("about_x", "rad", -0.5, 0.5),
            Coefficient::new("about_y", "rad", -0.5, 0.5),
            Coefficient::new("about_z", "rad", -0.5, 0.5),
        ],
        experiment: "hang a known weight on the sensor on level ground and read all components",
        ..SENSOR
    };
}
