//! Faults in what is known of mass, drive and ground. They are no load of the water: their columns lie where trials are
//! fitted, and they are never part of a model.

use super::law::{Law, Numbers, ShapeFault, finite, form, unused};
use super::spec::{Coefficient, EffectSpec, Kind, Quantity, Rate};

/// What these faults have in common.
const DRIVE: EffectSpec = EffectSpec { kind: Kind::Drive, ..EffectSpec::COMMON };

/// Rolling resistance that was not subtracted, `F_x = -c N sgn(v_x)` with the load `N` on the wheels. It acts at the ground, below the
/// center of mass, and the load on a rolling wheel stands before its axle: `M_y = m N sgn(v_x)`, with `m / c` between the height of the
/// center of mass less the wheels' radius and that height.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RollingResistance;

impl Law for RollingResistance {
    const SPEC: EffectSpec = EffectSpec {
        name: "rolling_resistance",
        summary: "not subtracted from an inferred wrench",
        coefficients: &[
            Coefficient::published("coefficient", 0.0, 0.5, [0.01, 0.15]),
            Coefficient::new("pitch", "m", -0.5, 0.5),
        ],
        inputs: &[Quantity::InferredWrench, Quantity::GroundVelocity],
        needs_its_first: true,
        experiment: "tow the vehicle over the same dry ground at two speeds",
        ..DRIVE
    };
}

/// A wrong scale of the known drive force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DriveGain;

impl Law for DriveGain {
    const SPEC: EffectSpec = EffectSpec {
        name: "drive_gain",
        summary: "a wrong scale of the known drive force",
        coefficients: &[Coefficient::new("relative_error", "1", -0.9, 3.0)],
        inputs: &[Quantity::DriveForce],
        not_excited: "the known drive force is zero",
        experiment: "pull against a spring balance on dry ground at three drive forces",
        ..DRIVE
    };
}

/// A wrong mass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MassError;

impl Law for MassError {
    const SPEC: EffectSpec = EffectSpec {
        name: "mass_error",
        summary: "a wrong mass in an inferred wrench",
        coefficients: &[Coefficient::new("relative_error", "1", -0.5, 1.0)],
        inputs: &[Quantity::InferredWrench, Quantity::Acceleration],
        rates: &[Rate::Acceleration],
        experiment: "weigh the vehicle as it was tested, or speed up and brake on dry ground",
        ..DRIVE
    };
}

/// A wrong inertia.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InertiaError;

impl Law for InertiaError {
    const SPEC: EffectSpec = EffectSpec {
        name: "inertia_error",
        summary: "a wrong inertia in an inferred moment",
        coefficients: &[
            Coefficient::new("roll", "1", -0.5, 1.0),
            Coefficient::new("pitch", "1", -0.5, 1.0),
            Coefficient::new("yaw", "1", -0.5, 1.0),
        ],
        inputs: &[Quantity::InferredMoment, Quantity::AngularVelocity, Quantity::AngularAcceleration],
        rates: &[Rate::AngularAcceleration],
        experiment: "swing the vehicle as it was tested from a cable, or turn it on dry ground",
        ..DRIVE
    };
}

/// Wheels, gears and motors that spin with the motion ahead.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RotatingInertia;

impl Law for RotatingInertia {
    const SPEC: EffectSpec = EffectSpec {
        name: "rotating_inertia",
        summary: "wheels and drive train that spin take drive force to speed up",
        // mass factor 1.04 + 0.0025 N^2 of a drive train with the ratio N, in high gear to first (Gillespie, Fundamentals of
        // Vehicle Dynamics, SAE 1992, chapter 2)
        coefficients: &[Coefficient::published("share_of_mass", 0.0, 2.0, [0.04, 0.5])],
        inputs: &[Quantity::InferredWrench, Quantity::Acceleration],
        rates: &[Rate::Acceleration],
        experiment: "speed up and brake on dry ground, then lift the vehicle and speed up its wheels alone",
        ..DRIVE
    };
}

/// How a drive force comes late. The numbers are those of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Response {
    /// 0: all of it, by the same time.
    #[default]
    Delay,
    /// 1: as a lag of first order.
    Lag,
}

/// A drive force that acts later than it is recorded, with the estimate about which its load is linear.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveDelay {
    /// Estimate of the delay, below 0 where the record is late, or of the time constant of the lag [s].
    pub delay_s: f64,
    /// How it comes late.
    pub response: Response,
}

impl Law for DriveDelay {
    const SPEC: EffectSpec = EffectSpec {
        name: "drive_delay",
        summary: "the known drive force acts later than it is recorded, or lags behind it; below 0 earlier",
        coefficients: &[Coefficient::new("delay", "s", -1.0, 1.0).up_to(0.5)],
        inputs: &[Quantity::InferredWrench, Quantity::DriveForce],
        not_excited: "the known drive force hardly changes within a trial",
        experiment: "change the drive force in steps on dry ground",
        ..DRIVE
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 2)?;
        let response = form(numbers, 1, &[Response::Delay, Response::Lag])?;
        Ok(Self { delay_s: finite(numbers, 0)?, response })
    }

    fn to_numbers(&self) -> Numbers {
        [self.delay_s, f64::from(self.response as u8), 0.0]
    }
}
