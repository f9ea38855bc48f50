//! What is hidden in trials: the effects of the library by formulas of our own, and some that no library has.
//!
//! `strips` (added mass, damping, drag, cross-flow), `water` (level, density, current, flooding, entry), `channel`
//! (blockage, squat), `memory` (radiated waves), `wheels` (paddles, moving bed), `sensors` (a chain of faults), `drive`
//! (an inverse-dynamics wrench), `outside` (what is in no library), `truth` (their parameters as a tool may state them).

mod channel;
mod drive;
mod memory;
mod outside;
mod sensors;
mod strips;
mod truth;
mod water;
mod wheels;

use serde::Serialize;

pub(super) use drive::rolling_resistance;
pub(super) use memory::{DRAFT as MEMORY_DRAFT, RATIO as MEMORY_RATIO};
pub use truth::{Parameter, parameters};

use super::{Hull, Simulator, State, Track, Wrench6};
use wade_core::frame::Vec3;
use wade_learn::random::Random;

/// Something that can be hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // the names are those of the library
pub enum Effect {
    AddedMass,
    LinearDamping,
    DragCoefficientError,
    Rotation,
    Current,
    WaterLevelOffset,
    DensityError,
    HullFlooding,
    WaterEntrySlamming,
    WaveMemory,
    ChannelBlockage,
    Squat,
    WheelPaddleThrust,
    BedMotion,
    SensorDelay,
    SensorBias,
    SensorBiasStep,
    SensorDrift,
    SensorGain,
    AxisMisalignment,
    RollingResistance,
    DriveGain,
    MassError,
    /// A side force that changes sign as vortices are shed.
    VortexShedding,
    /// A spring to a fixed place.
    Tether,
    /// A gain that grows with the square of the warming of the session.
    ThermalGain,
    /// A pull down that grows with the root of the time at rest.
    MudSuction,
    /// Water that swings to and fro in the tank.
    Seiche,
}

/// Sort of a library effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Of the water.
    Physics,
    /// Of what measures the wrench.
    Sensor,
    /// Of the vehicle's drive, which shows where the wrench is inferred from its motion.
    Drive,
    /// In no library.
    Outside,
}

/// The effects of the library.
pub const LIBRARY: [Effect; 23] = {
    use Effect::*;
    [
        AddedMass,
        LinearDamping,
        DragCoefficientError,
        Rotation,
        Current,
        WaterLevelOffset,
        DensityError,
        HullFlooding,
        WaterEntrySlamming,
        WaveMemory,
        ChannelBlockage,
        Squat,
        WheelPaddleThrust,
        BedMotion,
        SensorDelay,
        SensorBias,
        SensorBiasStep,
        SensorDrift,
        SensorGain,
        AxisMisalignment,
        RollingResistance,
        DriveGain,
        MassError,
    ]
};

/// The effects that no library has.
pub const OUTSIDE: [Effect; 5] = {
    use Effect::*;
    [VortexShedding, Tether, ThermalGain, MudSuction, Seiche]
};

impl Effect {
    /// Name in reports.
    pub fn name(self) -> String {
        match serde_json::to_value(self) {
            Ok(serde_json::Value::String(name)) => name,
            _ => String::new(),
        }
    }

    /// Its sort.
    pub fn kind(self) -> Kind {
        use Effect::*;
        match self {
            SensorDelay | SensorBias | SensorBiasStep | SensorDrift | SensorGain | AxisMisalignment => {
                Kind::Sensor
            }
            RollingResistance | DriveGain | MassError => Kind::Drive,
            VortexShedding | Tether | ThermalGain | MudSuction | Seiche => Kind::Outside,
            _ => Kind::Physics,
        }
    }
}

/// Where an effect acts.
#[derive(Clone, Copy)]
pub struct Setting<'a> {
    /// The body and what is predicted for it.
    pub simulator: Simulator<'a>,
    /// Length of the session [s].
    pub session: f64,
}

/// An effect with its parameters: a size, which its strength is set by, and up to three others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hidden {
    /// Which.
    pub effect: Effect,
    /// The main parameter; see `draw` for its meaning and unit.
    pub size: f64,
    /// The others.
    pub shape: [f64; 3],
}

impl Hidden {
    /// Plausible parameters at random.
    ///
    /// Sizes: multiple of strip theory (added mass, slamming, rotation), N s/m3 (linear damping),
    /// share (drag, density, gain, drive gain), m/s (current), m (water level), share of the volume (flooding), N/m
    /// (wave memory), multiple of one-dimensional flow (blockage, squat), lug coefficient (paddle), coefficient (bed),
    /// s (delay), N or N m (bias and its step), N/s (drift), rad (misalignment), coefficient (rolling resistance, vortex),
    /// kg (mass), N/m (tether), share at the end (thermal), N/s^0.5 (mud), N (seiche).
    pub fn draw(effect: Effect, random: &mut Random) -> Self {
        use Effect::*;
        let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
        let sign = if between(-1.0, 1.0) < 0.0 { -1.0 } else { 1.0 };
        let size = match effect {
            AddedMass => between(0.4, 1.2),
            LinearDamping => between(100.0, 500.0),
            DragCoefficientError => sign * between(0.15, 0.5),
            Rotation => between(0.7, 1.3),
            Current => between(0.08, 0.4),
            WaterLevelOffset => sign * between(0.004, 0.02),
            DensityError => sign * between(0.01, 0.04),
            HullFlooding => between(0.03, 0.15),
            WaterEntrySlamming => between(0.5, 1.5),
            WaveMemory => between(60.0, 250.0),
            ChannelBlockage | Squat => between(0.6, 1.4),
            WheelPaddleThrust => between(0.6, 2.5),
            BedMotion => between(0.1, 0.5),
            SensorDelay => between(0.015, 0.08),
            SensorBias | SensorBiasStep => sign * between(3.0, 15.0),
            SensorDrift => sign * between(0.5, 3.0),
            SensorGain => sign * between(0.01, 0.08),
            AxisMisalignment => sign * between(0.01, 0.05),
            RollingResistance => between(0.01, 0.04),
            DriveGain => sign * between(0.04, 0.15),
            MassError => sign * between(5.0, 25.0),
            VortexShedding => between(0.2, 0.6),
            Tether => between(3.0, 15.0),
            ThermalGain => sign * between(0.02, 0.08),
            MudSuction => between(5.0, 20.0),
            Seiche => between(5.0, 15.0),
        };
        let shape = match effect {
            Current => [between(-3.1, 3.1), 0.0, 0.0],
            HullFlooding => [between(2.0, 6.0), between(0.2, 0.8), 0.0],
            WaveMemory => [between(0.6, 1.4), between(2.0, 4.0), 0.0],
            // components: x, y, z
            SensorBias | SensorDrift | SensorGain => [between(0.0, 3.0).floor(), 0.0, 0.0],
            SensorBiasStep => [between(0.0, 3.0).floor(), between(0.3, 0.7), 0.0],
            Tether => [between(-1.0, 1.0), 0.0, 0.0],
            Seiche => [between(1.5, 4.0), between(0.0, 6.0), between(-3.1, 3.1)],
            _ => [0.0; 3],
        };
        Self { effect, size, shape }
    }

    /// The same, larger.
    pub fn scaled(self, factor: f64) -> Self {
        Self { size: self.size * factor, ..self }
    }

    /// The change of the measured wrench of a trial; `wrench` is what would be measured without it. Faults of the chain
    /// see the wrench that the physics left.
    pub fn change(&self, setting: &Setting, track: &Track, wrench: &[Wrench6]) -> Vec<Wrench6> {
        use Effect::*;
        match self.effect {
            AddedMass => strips::added_mass(self, setting, track),
            LinearDamping | DragCoefficientError | Current | ChannelBlockage => {
                track.states.iter().map(|state| self.load(setting, track.channel_width, state)).collect()
            }
            Rotation => strips::rotation(self, setting, track),
            WaterLevelOffset => water::level(self, setting, track),
            DensityError => water::density(self, setting, track),
            HullFlooding => water::flooding(self, setting, track),
            WaterEntrySlamming => water::slamming(self, setting, track),
            WaveMemory => memory::convolution(self, setting, track),
            Squat => channel::squat(self, setting, track),
            WheelPaddleThrust => wheels::paddles(self, setting, track),
            BedMotion => wheels::moving_bed(self, setting, track),
            SensorDelay | SensorBias | SensorBiasStep | SensorDrift | SensorGain | AxisMisalignment => {
                sensors::change(self, setting, track, wrench)
            }
            RollingResistance | DriveGain | MassError => drive::change(self, setting, track, wrench),
            VortexShedding | Tether | ThermalGain | MudSuction | Seiche => {
                outside::change(self, setting, track, wrench)
            }
        }
    }

    /// The load of an effect that depends on the velocity and the depth of the instant alone; 0 of any other.
    pub(super) fn load(&self, setting: &Setting, channel_width: f64, state: &State) -> Wrench6 {
        match self.effect {
            Effect::LinearDamping => strips::linear_damping(self, setting, state),
            Effect::DragCoefficientError => strips::drag(self, setting, state),
            Effect::Current => water::current(self, setting, state),
            Effect::ChannelBlockage => channel::blockage(self, setting, channel_width, state),
            _ => Wrench6::zeros(),
        }
    }
}

/// Linear and angular momentum of the water that moves with the body by strip theory, about its center of mass.
pub(super) fn momenta(hull: &Hull, state: &State) -> (Vec3, Vec3) {
    strips::momenta(&hull.strips(state, 0.0), state)
}

/// Share of the largest standardized magnitude from which on an effect is said to act.
const ACTS: f64 = 0.05;
/// Share of the strongest component's strength from which on a component is one that the effect acts on.
const ACTS_ON: f64 = 0.3;

/// Strength of a change against the floor of each component, over all trials; `measured` says which are measured.
///
/// An effect acts in the samples where `sum_c (w_c / floor_c)^2` is above a twentieth of its largest root, and on the
/// components whose root mean square over these, in floors, is at least 0.3 of the largest one. The strength is the root
/// of the mean of the squares of these; 0 where nothing is changed.
pub fn strength(changes: &[Vec<Wrench6>], floor: &Wrench6, measured: &[bool; 6]) -> f64 {
    let standardized = || {
        changes.iter().flatten().map(|change| {
            Wrench6::from_fn(|c, _| if measured[c] && floor[c] > 0.0 { change[c] / floor[c] } else { 0.0 })
        })
    };
    let largest = standardized().map(|w| w.norm()).fold(0.0, f64::max);
    if largest == 0.0 {
        return 0.0;
    }
    let (sum, count) = standardized()
        .filter(|w| w.norm() > ACTS * largest)
        .fold((Wrench6::zeros(), 0.0), |(sum, count), w| (sum + w.component_mul(&w), count + 1.0));
    let squares = sum / count;
    let least = ACTS_ON * ACTS_ON * squares.max();
    let on: Vec<f64> = squares.iter().copied().filter(|&square| square > 0.0 && square >= least).collect();
    (on.iter().sum::<f64>() / on.len() as f64).sqrt()
}

#[cfg(test)]
mod tests_support {
    use super::*;
    use crate::Prediction;

    pub fn hidden(effect: Effect, size: f64) -> Hidden {
        Hidden { effect, size, shape: [0.0; 3] }
    }

    /// The change of a wrench of 0 on the generated box, 0.01 s a sample.
    pub fn on_box(hidden: Hidden, states: impl Iterator<Item = State>) -> Vec<Wrench6> {
        let states: Vec<State> = states.collect();
        let wrench = vec![Wrench6::zeros(); states.len()];
        on_box_with(hidden, states, &wrench)
    }

    pub fn on_box_with(hidden: Hidden, states: Vec<State>, wrench: &[Wrench6]) -> Vec<Wrench6> {
        let hull = Hull::generated_box();
        let simulator = Simulator { hull: &hull, prediction: Prediction::Analytic, vehicle: "generated-box" };
        let setting = Setting { simulator, session: 100.0 };
        let track = Track {
            name: "generated".into(),
            session_time: 0.0,
            channel_width: crate::track::CHANNEL,
            step: 0.01,
            states,
        };
        hidden.change(&setting, &track, wrench)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn strength_counts_where_the_effect_acts_and_is_linear() {
        // 10 of 100 samples with 6 N in x and 0.1 N in z, floors of 3 and 4
        let act = Wrench6::new(6.0, 0.0, 0.1, 0.0, 0.0, 0.0);
        let change = |factor: f64| -> Vec<Vec<Wrench6>> {
            vec![(0..100).map(|i| if i < 10 { act * factor } else { Wrench6::zeros() }).collect()]
        };
        let floor = Wrench6::new(3.0, 3.0, 4.0, 1.0, 1.0, 1.0);
        assert!((strength(&change(1.0), &floor, &[true; 6]) - 2.0).abs() < 1e-12);
        assert!((strength(&change(0.5), &floor, &[true; 6]) - 1.0).abs() < 1e-12);
        assert_eq!(strength(&change(1.0), &floor, &[false; 6]), 0.0);
    }

    #[test]
    fn names_are_those_of_the_library() {
        assert_eq!(Effect::WaterEntrySlamming.name(), "water_entry_slamming");
        assert_eq!(Effect::AxisMisalignment.name(), "axis_misalignment");
        assert!(LIBRARY.iter().all(|effect| effect.kind() != Kind::Outside));
        assert!(OUTSIDE.iter().all(|effect| effect.kind() == Kind::Outside));
    }
}
