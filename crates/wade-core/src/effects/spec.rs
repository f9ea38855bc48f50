//! What an effect says of itself: an [`EffectSpec`] stands in its own file.

use serde::{Deserialize, Serialize};

/// What an effect is: a load of the water, a fault of the measuring chain, or of the drive's model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A load of the water.
    Physics,
    /// A fault of the measuring chain.
    Sensor,
    /// A fault in what is known of mass, drive and ground.
    Drive,
}

/// What an effect says of itself. Fitting, serving and the documentation read it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectSpec {
    /// Name in reports and files.
    pub name: &'static str,
    /// Load of the water, or whose fault.
    pub kind: Kind,
    /// What the model lacks or what is wrong, in a line.
    pub summary: &'static str,
    /// Equation of a physical effect in a line, without what is common to all: loads act on the wet hull.
    pub equation: &'static str,
    /// Term of the physical base that a physical effect corrects.
    pub corrects: &'static str,
    /// What base and effect together may be.
    pub total: &'static str,
    /// The coefficients in which the effect is linear; sensor effects have one a wrench component.
    pub coefficients: &'static [Coefficient],
    /// What the coefficients refer to, where their names do not say it.
    pub reference: &'static str,
    /// Nonlinear parameters that a fit searches for and a report states. They are the first numbers of a shape.
    pub parameters: &'static [Parameter],
    /// What every form of it reads beside depth, attitude and density.
    pub inputs: &'static [Quantity],
    /// Differentiated signals that it is proportional to: it is excited where one of them exceeds its noise.
    pub rates: &'static [Rate],
    /// True where the coefficients after the first say more of the same load: its arm, its trim, its torque, the blow
    /// backwards that comes with one upwards.
    pub needs_its_first: bool,
    /// True where the load depends on the past, so that a server keeps a state.
    pub has_memory: bool,
    /// True for an effect that changes the flow which the model's own drag speaks of.
    pub acts_on_own_drag: bool,
    /// What a report says of trials that do not excite it.
    pub not_excited: &'static str,
    /// A trial that separates it from other effects.
    pub experiment: &'static str,
}

impl EffectSpec {
    /// What most effects have in common. Texts are empty: a test requires them of each effect.
    pub(super) const COMMON: Self = Self {
        name: "",
        kind: Kind::Physics,
        summary: "",
        equation: "",
        corrects: "",
        total: "",
        coefficients: &[],
        reference: "",
        parameters: &[],
        inputs: &[],
        rates: &[],
        needs_its_first: false,
        has_memory: false,
        acts_on_own_drag: false,
        not_excited: "no trial excites it in the components that were measured",
        experiment: "",
    };
}

/// A coefficient: name, unit, what it can physically be, and what the literature says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficient {
    /// Name.
    pub name: &'static str,
    /// Unit; 1 where it has none.
    pub unit: &'static str,
    /// Least and largest value that is physically possible.
    pub bounds: [f64; 2],
    /// Band in which published values lie.
    pub literature: Option<[f64; 2]>,
    /// Largest error that somebody makes, where it is smaller than the bounds say.
    largest_error: Option<f64>,
}

/// Bound of a coefficient that has none [its unit].
pub(super) const UNBOUNDED: f64 = 1e9;

impl Coefficient {
    /// A coefficient between two bounds.
    pub(super) const fn new(name: &'static str, unit: &'static str, low: f64, high: f64) -> Self {
        Self { name, unit, bounds: [low, high], literature: None, largest_error: None }
    }

    /// A coefficient without dimension and with a published band.
    pub(super) const fn published(name: &'static str, low: f64, high: f64, band: [f64; 2]) -> Self {
        Self { literature: Some(band), ..Self::new(name, "1", low, high) }
    }

    /// The same with the largest error that somebody makes.
    pub(super) const fn up_to(self, largest_error: f64) -> Self {
        Self { largest_error: Some(largest_error), ..self }
    }

    /// Above this a coefficient is no longer an error that somebody makes.
    pub fn largest_plausible(&self) -> f64 {
        match self.literature {
            Some(band) => band[1].max(-band[0]),
            None => self.largest_error.unwrap_or(self.bounds[1]),
        }
    }
}

/// A parameter in which an effect is not linear. It is 0 in laws without it, and never negative.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parameter {
    /// Name.
    pub name: &'static str,
    /// Unit; 1 where it has none.
    pub unit: &'static str,
}

/// What an effect reads beside depth, attitude and density.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Velocity through the water.
    Velocity,
    /// Velocity over ground.
    GroundVelocity,
    /// Angular velocity.
    AngularVelocity,
    /// Acceleration.
    Acceleration,
    /// Angular acceleration.
    AngularAcceleration,
    /// The model's own wrench.
    ModelWrench,
    /// Angle from the world's x to the body's x.
    Heading,
    /// Speeds of the wheels.
    WheelSpeeds,
    /// Rate at which the water rises.
    DepthRate,
    /// Width of the channel.
    ChannelWidth,
    /// The states before, with the time between them.
    Session,
    /// That the caller has stated no current: the effect would add it a second time.
    NoStatedCurrent,
    /// A wrench that a sensor measured or that was inferred, not computed.
    MeasuredWrench,
    /// A wrench that was inferred from mass, drive and weight.
    InferredWrench,
    /// A moment that was inferred from inertia and drive.
    InferredMoment,
    /// A drive force, known by itself or in an inferred wrench.
    DriveForce,
}

impl Quantity {
    /// The quantity in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Velocity => "velocity through the water",
            Self::GroundVelocity => "velocity over ground",
            Self::AngularVelocity => "angular velocity",
            Self::Acceleration => "acceleration",
            Self::AngularAcceleration => "angular acceleration",
            Self::ModelWrench => "the model's wrench",
            Self::Heading => "heading",
            Self::WheelSpeeds => "wheel speeds",
            Self::DepthRate => "rate of the depth",
            Self::ChannelWidth => "width of the channel",
            Self::Session => "the earlier states of the session",
            Self::NoStatedCurrent => "no current that the caller states",
            Self::MeasuredWrench => "a measured wrench",
            Self::InferredWrench => "a wrench inferred from mass and drive",
            Self::InferredMoment => "a moment inferred from inertia and drive",
            Self::DriveForce => "the drive force",
        }
    }
}

/// A differentiated signal, which may be nothing but the noise of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rate {
    /// Acceleration.
    Acceleration,
    /// Angular acceleration.
    AngularAcceleration,
    /// Rate of the depth.
    Depth,
    /// Angular velocity.
    Attitude,
}
