//! The list of effects.

use serde::{Deserialize, Serialize, Serializer};

use super::input::{Elsewhere, Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault};
use super::spec::{Coefficient, EffectSpec, Kind};
use super::{
    added_mass, bed_motion, channel_blockage, current, density_error, drag_coefficient_error, drive,
    hull_flooding, hull_lift, linear_damping, rotation, sensor, squat, water_entry_slamming,
    water_level_offset, wave_memory, wheel_paddle_thrust,
};
use crate::wrench::Wrench;

/// Makes the closed set of effects from one list. The place of an effect in the list is its number on the wire.
macro_rules! effects {
    ($($module:ident::$effect:ident,)*) => {
        /// A named reason why a model and a measurement disagree; its file says the rest.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Effect {
            $(#[doc = concat!("See `effects::", stringify!($module), "`.")] $effect,)*
        }

        /// An effect with the form of its law and its nonlinear parameters.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Shape {
            $(#[doc = concat!("See `effects::", stringify!($module), "`.")] $effect($module::$effect),)*
        }

        /// In the order of the list.
        const SPECS: &[EffectSpec] = &[$($module::$effect::SPEC,)*];

        impl Effect {
            /// The library.
            pub const ALL: [Self; SPECS.len()] = [$(Self::$effect,)*];

            /// The form that a law has where nothing is said of it: every number of its shape is 0.
            pub fn plain(self) -> Shape {
                match self { $(Self::$effect => Shape::$effect($module::$effect::default()),)* }
            }
        }

        impl Shape {
            /// The effect that it is of.
            pub fn effect(&self) -> Effect {
                match self { $(Self::$effect(_) => Effect::$effect,)* }
            }

            /// Reads the numbers of a file.
            pub fn from_numbers(effect: Effect, numbers: Numbers) -> Result<Self, ShapeFault> {
                match effect {
                    $(Effect::$effect => $module::$effect::from_numbers(&numbers).map(Self::$effect),)*
                }
            }

            /// The numbers of a file: first the parameters of the spec, then the form.
            pub fn to_numbers(&self) -> Numbers {
                match self { $(Self::$effect(law) => law.to_numbers(),)* }
            }

            /// Emits the load of each coefficient of a physical effect at 1: number of the coefficient, the part of the
            /// hull that carries it, and the load about the center of mass, body frame [N, N m]. Effects of the measuring
            /// chain or the drive, which are no load of the water, emit nothing.
            pub fn basis(&self, memory: &Memory, input: &Input, mut emit: impl FnMut(usize, Part, Wrench)) {
                match self { $(Self::$effect(law) => law.basis(memory, input, &mut emit),)* }
            }

            /// Advances the state of an effect with memory by `dt` [s], of the first state of a run by 0; the others have
            /// none.
            pub fn advance(&self, memory: &mut Memory, input: &Input, dt: f64) {
                match self { $(Self::$effect(law) => law.advance(memory, input, dt),)* }
            }

            /// The state in which the model is to be asked as well, for a law of what it answers there
            /// ([`Input::elsewhere`]).
            pub fn elsewhere(&self, input: &Input) -> Option<Elsewhere> {
                match self { $(Self::$effect(law) => law.elsewhere(input),)* }
            }

            /// True for the form that takes the drag of the prediction itself, in proportion.
            pub fn is_in_proportion(&self) -> bool {
                match self { $(Self::$effect(law) => law.is_in_proportion(),)* }
            }

            /// True for a law of a channel, which has no meaning without a width.
            pub fn needs_channel_width(&self) -> bool {
                match self { $(Self::$effect(law) => law.needs_channel_width(),)* }
            }
        }
    };
}

// a new effect comes last: those before it keep their numbers
effects! {
    added_mass::AddedMass,
    linear_damping::LinearDamping,
    drag_coefficient_error::DragCoefficientError,
    rotation::Rotation,
    current::Current,
    water_level_offset::WaterLevelOffset,
    density_error::DensityError,
    hull_flooding::HullFlooding,
    water_entry_slamming::WaterEntrySlamming,
    wave_memory::WaveMemory,
    channel_blockage::ChannelBlockage,
    squat::Squat,
    wheel_paddle_thrust::WheelPaddleThrust,
    bed_motion::BedMotion,
    sensor::SensorDelay,
    sensor::SensorBias,
    sensor::SensorBiasStep,
    sensor::SensorDrift,
    sensor::SensorGain,
    sensor::AxisMisalignment,
    drive::RollingResistance,
    drive::DriveGain,
    drive::MassError,
    drive::InertiaError,
    drive::RotatingInertia,
    drive::DriveDelay,
    hull_lift::HullLift,
}

/// Most coefficients of one effect.
pub const MAX_COEFFICIENTS: usize = {
    let (mut most, mut effect) = (0, 0);
    while effect < SPECS.len() {
        if SPECS[effect].coefficients.len() > most {
            most = SPECS[effect].coefficients.len();
        }
        effect += 1;
    }
    most
};

/// Physical effects in the library: the most that a model can have.
pub const PHYSICS: usize = {
    let (mut count, mut effect) = (0, 0);
    while effect < SPECS.len() {
        count += matches!(SPECS[effect].kind, Kind::Physics) as usize;
        effect += 1;
    }
    count
};

/// Effects with memory.
pub(super) const MEMORIES: usize = memories_before(SPECS.len());

/// Effects with memory among the first of the list.
const fn memories_before(end: usize) -> usize {
    let (mut count, mut effect) = (0, 0);
    while effect < end {
        count += SPECS[effect].has_memory as usize;
        effect += 1;
    }
    count
}

impl Effect {
    /// What it says of itself.
    pub fn spec(self) -> &'static EffectSpec {
        &SPECS[self as usize]
    }

    /// The name in reports and files.
    pub fn name(self) -> &'static str {
        self.spec().name
    }

    /// Number on the wire, from 1.
    pub fn code(self) -> u32 {
        self as u32 + 1
    }

    /// The effect of a number of the wire.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|effect| effect.code() == code)
    }

    /// The effect of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|effect| effect.name() == name)
    }

    /// Whose fault it is.
    pub fn kind(self) -> Kind {
        self.spec().kind
    }

    /// Its equation; empty for a fault of sensors or drive.
    pub fn equation(self) -> &'static str {
        self.spec().equation
    }

    /// Its coefficients.
    pub fn coefficients(self) -> &'static [Coefficient] {
        self.spec().coefficients
    }

    /// Place of its memory in a session; none where it has no memory.
    pub(super) fn memory_place(self) -> Option<usize> {
        self.spec().has_memory.then(|| memories_before(self as usize))
    }
}

impl Shape {
    /// Value of a parameter of the spec; 0 where this law has no place for it.
    pub fn parameter(&self, index: usize) -> f64 {
        self.to_numbers()[index]
    }

    /// The same with a parameter of the spec times a factor; unchanged where the law does not allow the product.
    pub fn scaled(&self, index: usize, factor: f64) -> Self {
        let mut numbers = self.to_numbers();
        numbers[index] *= factor;
        Self::from_numbers(self.effect(), numbers).unwrap_or(*self)
    }
}

/// As its numbers.
impl Serialize for Shape {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_numbers().serialize(serializer)
    }
}

#[cfg(test)]
mod tests {
    use super::super::spec::{Parameter, Quantity, Rate};
    use super::*;

    #[test]
    fn names_are_those_of_the_reports_and_coefficients_have_room() {
        for effect in Effect::ALL {
            assert_eq!(Effect::from_name(effect.name()), Some(effect), "names are unique");
            assert_eq!(serde_json::to_value(effect).ok(), Some(effect.name().into()));
            assert_eq!(Effect::from_code(effect.code()), Some(effect));
            assert_eq!(effect.plain().effect(), effect);
            assert!((1..=MAX_COEFFICIENTS).contains(&effect.coefficients().len()));
        }
        let physics = Effect::ALL.into_iter().filter(|effect| effect.kind() == Kind::Physics);
        assert_eq!(physics.count(), PHYSICS);
    }

    /// What is missing in a spec.
    fn incomplete(spec: &EffectSpec) -> Option<&'static str> {
        let is_physics = spec.kind == Kind::Physics;
        let names = || spec.coefficients.iter().map(|c| c.name).chain(spec.parameters.iter().map(|p| p.name));
        let is_twice = |name: &str| names().filter(|other| *other == name).count() > 1;
        let is_ordered = |c: &Coefficient| {
            let band = c.literature.is_none_or(|band| band[0] < band[1]);
            c.bounds[0] < c.bounds[1] && c.bounds[0] <= 0.0 && band && c.largest_plausible() > 0.0
        };
        let read = |rate: &Rate| match rate {
            Rate::Acceleration => Quantity::Acceleration,
            Rate::AngularAcceleration => Quantity::AngularAcceleration,
            Rate::Depth => Quantity::DepthRate,
            Rate::Attitude => Quantity::AngularVelocity,
        };
        let units = spec.coefficients.iter().map(|c| c.unit).chain(spec.parameters.iter().map(|p| p.unit));
        [
            (spec.name.is_empty() || spec.summary.is_empty(), "name or summary"),
            (spec.equation.is_empty() == is_physics, "an equation for physics, and none for a fault"),
            (spec.corrects.is_empty() == is_physics, "the term of the base that physics corrects"),
            (spec.total.is_empty() == is_physics, "what base and physics may be together"),
            (spec.coefficients.is_empty(), "coefficients"),
            (!spec.coefficients.iter().all(is_ordered), "bounds in order, about 0"),
            (names().any(|name| name.is_empty() || is_twice(name)), "different names"),
            (units.into_iter().any(str::is_empty), "units"),
            (spec.inputs.is_empty(), "inputs"),
            (!spec.rates.iter().all(|rate| spec.inputs.contains(&read(rate))), "inputs that have its rates"),
            (spec.has_memory != spec.inputs.contains(&Quantity::Session), "a session for its memory"),
            (spec.not_excited.is_empty(), "what does not excite it"),
            (spec.experiment.is_empty(), "an experiment"),
        ]
        .into_iter()
        .find_map(|(lacks, what)| lacks.then_some(what))
    }

    #[test]
    fn every_effect_describes_itself() {
        for effect in Effect::ALL {
            assert_eq!(incomplete(effect.spec()), None, "{}", effect.name());
        }
        const REVERSED: &[Coefficient] = &[Coefficient::new("surge", "1", 1.0, 0.0)];
        let whole = *Effect::AddedMass.spec();
        for broken in [
            EffectSpec { equation: "", ..whole },
            EffectSpec { corrects: "", ..whole },
            EffectSpec { total: "", ..whole },
            EffectSpec { kind: Kind::Sensor, ..whole },
            EffectSpec { inputs: &[], ..whole },
            EffectSpec { inputs: &[Quantity::Velocity], ..whole },
            EffectSpec { experiment: "", ..whole },
            EffectSpec { has_memory: true, ..whole },
            EffectSpec { parameters: &[Parameter { name: "surge", unit: "1" }], ..whole },
            EffectSpec { coefficients: REVERSED, ..whole },
        ] {
            assert!(incomplete(&broken).is_some(), "{broken:?}");
        }
    }
}
