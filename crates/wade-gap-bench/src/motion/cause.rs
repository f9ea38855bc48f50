//! What is hidden in a motion: effects of the water and of the drive, and faults of what is recorded.

use serde::Serialize;

use crate::hidden::{Effect, Hidden};
use wade_learn::random::Random;

wade_core::named_enum! {
    /// Something that can be hidden in a motion.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Cause {
        /// Water that moves with the hull, by strip theory.
        AddedMass => "added_mass",
        /// Wheels and motors that spin with the speed.
        DrivetrainInertia => "drivetrain_inertia",
        /// A share of the predicted drag.
        DragCoefficientError => "drag_coefficient_error",
        /// Drag that grows with the speed.
        LinearDamping => "linear_damping",
        /// Water that moves over ground.
        Current => "current",
        /// Waves that the hull radiates and meets again.
        WaveMemory => "wave_memory",
        /// Water that flows faster past the hull between walls.
        ChannelBlockage => "channel_blockage",
        /// A share of the wheels' load.
        RollingResistance => "rolling_resistance",
        /// A drive force that follows the recorded command late.
        DriveLag => "drive_lag",
        /// A recorded drive force that is too large or too small.
        DriveGain => "drive_gain",
        /// A stated mass that is too large or too small.
        MassError => "mass_error",
        /// A constant in the recorded drive force.
        DriveOffset => "drive_offset",
        /// A recorded drive force that comes late.
        DriveDelay => "drive_delay",
        /// A recorded pose that comes late.
        PoseDelay => "pose_delay",
    }
}

impl Cause {
    /// True of faults of what is stated or recorded, which leave the motion as it is.
    pub fn is_fault(self) -> bool {
        use Cause::*;
        matches!(self, DriveGain | MassError | DriveOffset | DriveDelay | PoseDelay)
    }

    /// The effect of the other benchmark whose formula this one shares.
    pub(super) fn effect(self) -> Option<Effect> {
        match self {
            Self::AddedMass => Some(Effect::AddedMass),
            Self::DragCoefficientError => Some(Effect::DragCoefficientError),
            Self::LinearDamping => Some(Effect::LinearDamping),
            Self::Current => Some(Effect::Current),
            Self::WaveMemory => Some(Effect::WaveMemory),
            Self::ChannelBlockage => Some(Effect::ChannelBlockage),
            Self::RollingResistance => Some(Effect::RollingResistance),
            Self::DriveGain => Some(Effect::DriveGain),
            Self::MassError => Some(Effect::MassError),
            Self::DrivetrainInertia
            | Self::DriveLag
            | Self::DriveOffset
            | Self::DriveDelay
            | Self::PoseDelay => None,
        }
    }
}

/// A cause with its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Planted {
    /// Which.
    pub cause: Cause,
    /// The main parameter: as in `hidden::Hidden::draw` where the formula is shared, else kg (rotating inertia), s (lag and
    /// delays), N (offset).
    pub size: f64,
    /// The others.
    pub shape: [f64; 3],
}

impl Planted {
    /// Plausible parameters at random.
    pub fn draw(cause: Cause, random: &mut Random) -> Self {
        if let Some(effect) = cause.effect() {
            let Hidden { size, shape, .. } = Hidden::draw(effect, random);
            return Self { cause, size, shape };
        }
        let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
        let sign = if between(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
        let size = match cause {
            Cause::DrivetrainInertia => between(10.0, 45.0),
            Cause::DriveLag => between(0.06, 0.3),
            Cause::DriveOffset => sign * between(6.0, 25.0),
            _ => between(0.03, 0.15),
        };
        Self { cause, size, shape: [0.0; 3] }
    }

    /// As the other benchmark has it.
    pub(super) fn hidden(&self) -> Option<Hidden> {
        self.cause.effect().map(|effect| Hidden { effect, size: self.size, shape: self.shape })
    }
}
