//! Faults in what is known of mass, drive and ground. They are no load of the water: their columns lie where trials are
//! fitted, and they are never part of a model.

use super::law::Law;
use super::spec::{Coefficient, EffectSpec, Kind, Quantity, Rate};

/// What these faults have in common.
const DRIVE: EffectSpec = EffectSpec { kind: Kind::Drive, ..EffectSpec::COMMON };

/// Rolling resistance that was not subtracted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RollingResistance;

impl Law for RollingResistance {
    const SPEC: EffectSpec = EffectSpec {
        name: "rolling_resistance",
        summary: "not subtracted from an inferred wrench",
        coefficients: &[Coefficient::published("coefficient", 0.0, 0.5, [0.01, 0.15])],
        inputs: &[Quantity::InferredWrench, Quantity::GroundVelocity],
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
