//! Every effect of the library as columns: the wrench of each coefficient at 1, sample by sample.

use nalgebra::Matrix3;

use super::base_drag::BaseDrag;
use super::elsewhere::Asking;
use super::measurement::{of_each_axis, rolling_direction};
use super::rates::{mean_square, mean_step};
use super::series::Series;
use super::statistics::white_variance;
use wade_core::effects::added_mass::{AddedMass, HeaveMass};
use wade_core::effects::bed_motion::{BedArea, BedMotion};
use wade_core::effects::channel_blockage::ChannelBlockage;
use wade_core::effects::current::Current;
use wade_core::effects::drag_coefficient_error::{DragCoefficientError, DragLaw};
use wade_core::effects::drive::{DriveDelay, Response};
use wade_core::effects::hull_flooding::HullFlooding;
use wade_core::effects::rotation::{Extent, Rotation};
use wade_core::effects::sensor::{SensorBiasStep, SensorDelay, SensorDrift, SensorGain};
use wade_core::effects::squat::Squat;
use wade_core::effects::water_entry_slamming::WaterEntrySlamming;
use wade_core::effects::wave_memory::{Kernel, WaveMemory};
use wade_core::effects::wheel_paddle_thrust::{Rim, WheelPaddleThrust};
use wade_core::effects::{
    Body, DragSpeed, Effect, EffectRegion, Kind, MAX_COEFFICIENTS, Memory, Quantity, Shape,
};
use wade_core::frame::{GRAVITY, Vec3};
use wade_learn::trials::Manifest;

/// Half the distance over which the prediction is differentiated for a delay [s]: further than noise that stands in both
/// the gap and the prediction reaches, which would pass for a delay.
const DELAY_ARM: f64 = 0.15;

/// Delays about which one is first looked for [s].
const DELAYS: [f64; 4] = [0.0, 0.1, 0.25, 0.5];

/// Froude numbers at which one-dimensional flow in a channel ends.
const FADED_AT: [f64; 2] = [0.7, 1.0];
/// Froude numbers at which the depression in open water ends to grow.
const HELD_AT: [f64; 4] = [0.4, 0.55, 0.7, 1.0];

/// Coefficient of a gain that all channels share.
const ALL_CHANNELS: usize = 6;

/// What columns depend on besides the trial.
#[derive(Clone)]
pub(super) struct Setting<'a> {
    pub body: &'a Body,
    pub base_drag: BaseDrag,
    /// True where the width of some trial's channel is stated.
    pub in_channel: bool,
    pub mass: f64,
    /// Stated inertia about the center of mass [kg m2].
    pub inertia: Option<Matrix3<f64>>,
    /// Compared components.
    pub components: Vec<usize>,
    /// The wrench comes from inertia, drive and weight.
    pub inferred: bool,
    /// The wrench was computed by a resolved flow.
    pub computed: bool,
    /// True where each stamp of the folder is of one clock.
    pub one_clock: bool,
    pub first_stamp: f64,
    /// What the model makes of other states ([`super::elsewhere::Questions::changes`]); none where another simulator predicts.
    pub elsewhere: Option<&'a Asking<'a>>,
}

impl Setting<'_> {
    fn infers_moments(&self) -> bool {
        self.inferred && self.inertia.is_some() && self.components.iter().any(|&component| component >= 3)
    }
}

/// One coefficient's wrench, a value a sample [per unit of the coefficient].
pub(super) type Column = Vec<[f64; 6]>;

/// Why an effect cannot be looked for in these trials at all.
pub(super) fn unavailable(
    effect: Effect,
    setting: &Setting,
    manifest: &Manifest,
    all: &[Series],
) -> Option<String> {
    let has_wheels = || all.iter().any(|s| s.wheels.iter().any(|w| w.iter().any(Option::is_some)));
    let missing = |quantity: &Quantity| match quantity {
        Quantity::MeasuredWrench if setting.computed => {
            Some("the wrench was computed: no sensor can have a fault")
        }
        Quantity::ChannelWidth if !setting.in_channel => Some("trials.toml states no channel_width"),
        Quantity::WheelSpeeds if !has_wheels() => {
            Some("no speeds of four wheels were recorded (wheel_fl, wheel_fr, wheel_rl, wheel_rr)")
        }
        Quantity::InferredWrench if !setting.inferred => {
            Some("the wrench was measured, not inferred from mass and drive")
        }
        Quantity::InferredMoment if !setting.infers_moments() => Some(
            "no moment was inferred: trials.toml states no inertia, or no column of a moment in measured.other_forces",
        ),
        Quantity::DriveForce if !setting.inferred && manifest.measured.other_forces.is_empty() => {
            Some("no drive force stands among the columns")
        }
        _ => None,
    };
    effect.spec().inputs.iter().find_map(missing).map(str::to_owned)
}

/// Shapes among which an effect's is first looked for.
pub(super) fn shapes(effect: Effect, all: &[Series], setting: &Setting) -> Vec<Shape> {
    match effect {
        Effect::HullFlooding => [3e-4, 1e-3, 3e-3, 1e-2, 3e-2]
            .map(|opening_ratio| Shape::HullFlooding(HullFlooding { opening_ratio }))
            .into(),
        Effect::WaveMemory => memories(setting),
        Effect::SensorGain => {
            [SensorGain::EachComponent, SensorGain::AllComponents].map(Shape::SensorGain).into()
        }
        Effect::Rotation => [
            (Extent::Strips, DragSpeed::Whole),
            (Extent::Whole, DragSpeed::Whole),
            (Extent::Strips, DragSpeed::PerAxis),
        ]
        .map(|(extent, speed)| Shape::Rotation(Rotation { extent, speed }))
        .into(),
        Effect::Current => [DragSpeed::Whole, DragSpeed::PerAxis]
            .map(|speed| Shape::Current(Current { speed, ..Current::default() }))
            .into(),
        Effect::DragCoefficientError => {
            DragLaw::ALL.map(|law| Shape::DragCoefficientError(DragCoefficientError { law })).into()
        }
        Effect::AddedMass => {
            [HeaveMass::Displaced, HeaveMass::Plate].map(|heave| Shape::AddedMass(AddedMass { heave })).into()
        }
        Effect::WheelPaddleThrust => {
            [Rim::Disc, Rim::Lugs].map(|rim| Shape::WheelPaddleThrust(WheelPaddleThrust { rim })).into()
        }
        Effect::BedMotion => [BedArea::Front, BedArea::Underside, BedArea::OfDrag]
            .map(|area| Shape::BedMotion(BedMotion { area }))
            .into(),
        Effect::Squat => {
            let walls = FADED_AT.into_iter().filter(|_| setting.in_channel);
            let open = [Squat::Bernoulli, Squat::Tuck].into_iter();
            let held = HELD_AT.map(|faded_at| Squat::Held { faded_at });
            let walls = walls.map(|faded_at| Squat::Channel { faded_at });
            open.chain(held).chain(walls).map(Shape::Squat).collect()
        }
        Effect::ChannelBlockage => {
            let falling = FADED_AT.map(|faded_at| ChannelBlockage::FallingSurface { faded_at });
            std::iter::once(ChannelBlockage::WindwardAreas)
                .chain(falling)
                .map(Shape::ChannelBlockage)
                .collect()
        }
        Effect::WaterEntrySlamming => {
            // a bottom without deadrise, and of 10, 20 and 30 degrees
            let wedge = |slope: f64| WaterEntrySlamming::Wedge { wet_at_m: 0.5 * slope * setting.body.width };
            std::iter::once(WaterEntrySlamming::Displaced)
                .chain([0.18, 0.36, 0.58].map(wedge))
                .map(Shape::WaterEntrySlamming)
                .collect()
        }
        Effect::SensorDelay => DELAYS.map(|delay_s| Shape::SensorDelay(SensorDelay { delay_s })).into(),
        Effect::DriveDelay => {
            let of = |response, delay_s| Shape::DriveDelay(DriveDelay { delay_s, response });
            let delays = [-0.25, -0.1].into_iter().chain(DELAYS).map(|delay| of(Response::Delay, delay));
            delays.chain(DELAYS.map(|lag| of(Response::Lag, lag))).collect()
        }
        Effect::SensorDrift if setting.one_clock => {
            [SensorDrift::OfTrial, SensorDrift::OfSession].map(Shape::SensorDrift).into()
        }
        Effect::SensorBiasStep => steps(all),
        _ => vec![effect.plain()],
    }
}

/// Memories from the time that waves of the hull take to leave it on: a shorter one is added mass.
fn memories(setting: &Setting) -> Vec<Shape> {
    let period = (setting.body.length / GRAVITY).sqrt();
    let mut shapes = Vec::new();
    for tau in [1.0, 2.5, 6.0, 15.0] {
        let of = |frequency: f64, kernel: Kernel| {
            let (time_constant_s, frequency_radps) = (tau * period, frequency / period);
            Shape::WaveMemory(WaveMemory { time_constant_s, frequency_radps, kernel })
        };
        shapes.extend([0.0, 0.5, 1.0, 2.0].map(|frequency| of(frequency, Kernel::Cosine)));
        shapes.extend([0.5, 1.0, 2.0].map(|frequency| of(frequency, Kernel::Sine)));
    }
    shapes
}

/// From a trial on in the order of recording, or from a time in every trial on.
fn steps(all: &[Series]) -> Vec<Shape> {
    let count = all.len();
    let stride = (count as f64 / 16.0).max(1.0);
    let mut steps = Vec::new();
    let mut at = 1.0;
    while at < count as f64 - 0.5 && count > 3 {
        steps.push(SensorBiasStep::FromTrial { rank: at.round() });
        at += stride;
    }
    let mut lengths: Vec<f64> = all.iter().map(|series| series.t[series.t.len() - 1] - series.t[0]).collect();
    let length = super::statistics::median(&mut lengths);
    steps.extend((1..12).map(|i| SensorBiasStep::WithinTrials { time_s: length * f64::from(i) / 12.0 }));
    steps.into_iter().map(Shape::SensorBiasStep).collect()
}

/// The columns of an effect in one trial: one a coefficient. `rank` is the trial's place in the order of recording: by
/// stamps of one clock, or else by names.
pub(super) fn columns(shape: &Shape, series: &Series, rank: usize, setting: &Setting) -> Vec<Column> {
    let (effect, count) = (shape.effect(), series.t.len());
    let mut columns = vec![vec![[0.0; 6]; count]; effect.coefficients().len()];
    match effect.kind() {
        Kind::Physics => physics(shape, series, setting, &mut columns),
        _ => chain(shape, series, rank, setting, &mut columns),
    }
    columns
}

/// [`columns`] of an effect that acts in a region.
pub(super) fn columns_within(
    (shape, region): (&Shape, &EffectRegion),
    series: &Series,
    rank: usize,
    setting: &Setting,
) -> Vec<Column> {
    let mut columns = columns(shape, series, rank, setting);
    if region.is_everywhere() {
        return columns;
    }
    for (sample, condition) in series.conditions.iter().enumerate() {
        let share = region.share(condition);
        columns.iter_mut().for_each(|column| column[sample].iter_mut().for_each(|load| *load *= share));
    }
    columns
}

#[allow(clippy::needless_range_loop, reason = "a sample is an index into the series as well")]
fn physics(shape: &Shape, series: &Series, setting: &Setting, columns: &mut [Column]) {
    let mut memory = Memory::default();
    debug_assert!(columns.len() <= MAX_COEFFICIENTS);
    let base_drag = setting.base_drag.of(shape);
    let has_memory = shape.effect().spec().has_memory;
    let elsewhere = setting.elsewhere.and_then(|changes| changes(shape, series));
    for (sample, &t) in series.t.iter().enumerate() {
        let mut input = series.input(sample, setting.body, base_drag);
        input.elsewhere = elsewhere.as_ref().map(|changes| changes[sample]);
        if matches!(shape, Shape::AddedMass(_)) {
            input.condition = &series.calibrated[sample];
        }
        if has_memory {
            let since = if sample > 0 { t - series.t[sample - 1] } else { 0.0 };
            shape.advance(&mut memory, &input, since);
        }
        shape.basis(&memory, &input, |coefficient, _, load| {
            let sum = &mut columns[coefficient][sample];
            (0..3).for_each(|axis| {
                sum[axis] += load.force[axis];
                sum[axis + 3] += load.moment[axis];
            });
        });
    }
}

fn chain(shape: &Shape, series: &Series, rank: usize, setting: &Setting, columns: &mut [Column]) {
    let since_start = |sample: usize| series.t[sample] - series.t[0];
    for (sample, p) in series.seen.iter().enumerate() {
        let state = &series.conditions[sample];
        let up = state.up.into_inner();
        let mut own = |value: &dyn Fn(usize) -> f64| {
            setting.components.iter().for_each(|&c| columns[c][sample][c] = value(c));
        };
        match *shape {
            Shape::SensorBias(_) => own(&|_| 1.0),
            Shape::SensorBiasStep(step) => {
                let after = match step {
                    SensorBiasStep::WithinTrials { time_s } => since_start(sample) >= time_s,
                    SensorBiasStep::FromTrial { rank: first } => rank as f64 >= first,
                };
                own(&|_| f64::from(u8::from(after)));
            }
            Shape::SensorDrift(SensorDrift::OfSession) => own(&|_| series.t[sample] - setting.first_stamp),
            Shape::SensorDrift(SensorDrift::OfTrial) => own(&|_| since_start(sample)),
            Shape::SensorGain(SensorGain::AllComponents) => {
                setting.components.iter().for_each(|&c| columns[ALL_CHANNELS][sample][c] = p[c]);
            }
            Shape::SensorGain(SensorGain::EachComponent) => own(&|c| p[c]),
            Shape::AxisMisalignment(_) => {
                for (axis, column) in columns.iter_mut().enumerate() {
                    // axes that are turned by an angle see the wrench turned back by it
                    let e = Vec3::ith(axis, -1.0);
                    let force = e.cross(&Vec3::new(p[0], p[1], p[2]));
                    let moment = e.cross(&Vec3::new(p[3], p[4], p[5]));
                    column[sample] = [force.x, force.y, force.z, moment.x, moment.y, moment.z];
                }
            }
            Shape::RollingResistance(_) => {
                let load = (setting.mass * GRAVITY * up.z - p[2]).max(0.0);
                let dry = setting.mass * series.dry_rolling[sample];
                let force = dry - load * rolling_direction(state.ground_velocity.x);
                columns[0][sample][0] = force;
                columns[1][sample][4] = -force;
            }
            Shape::MassError(_) => {
                // a wrench that comes inferred was so with an acceleration that nobody knows: with what is expected of it
                let inertia = match &series.inertia {
                    Some(inertia) => inertia[sample],
                    None => series.calibrated[sample].acceleration + up * GRAVITY,
                };
                (0..3).for_each(|axis| columns[0][sample][axis] = -setting.mass * inertia[axis]);
            }
            Shape::RotatingInertia(_) => {
                let surge = match &series.inertia {
                    Some(inertia) if series.dry_acceleration.is_some() => inertia[sample].x,
                    Some(inertia) => inertia[sample].x - GRAVITY * up.x,
                    None => series.calibrated[sample].acceleration.x,
                };
                columns[0][sample][0] = -setting.mass * surge;
            }
            Shape::InertiaError(_) => {
                let calibrated = &series.calibrated[sample];
                let (rate, change) = (&calibrated.angular_velocity, &calibrated.angular_acceleration);
                let moments = match &series.turning {
                    Some(turning) => turning[sample],
                    None => {
                        setting.inertia.map_or_else(Default::default, |of| of_each_axis(of, rate, change))
                    }
                };
                for (column, moment) in columns.iter_mut().zip(moments) {
                    (0..3).for_each(|axis| column[sample][axis + 3] = -moment[axis]);
                }
            }
            _ => {}
        }
    }
    match *shape {
        Shape::SensorDelay(SensorDelay { delay_s }) => delayed(series, delay_s, &mut columns[0]),
        Shape::DriveGain(_) => driven(series, &mut columns[0]),
        Shape::DriveDelay(law) => late(series, law, &mut columns[0]),
        _ => {}
    }
}

/// The known forces in the components in which they are more than their own noise, which stands in the gap as well: that of the same
/// command with and without water, one less the other, is not.
fn driven(series: &Series, column: &mut Column) {
    for component in 0..6 {
        let values: Vec<f64> = series.other.iter().map(|other| other[component]).collect();
        if white_variance(&values) < 0.5 * mean_square(&values) {
            column.iter_mut().zip(values).for_each(|(column, value)| column[component] = value);
        }
    }
}

/// Change of the known force `D` per second of delay or time constant `tau`: `(D(t - tau) - D(t)) / tau`, or what a lag of first
/// order leaves in the place of the former. Recorded forces have no noise of the motion in them.
fn late(series: &Series, law: DriveDelay, column: &mut Column) {
    let shortest = mean_step(&series.t);
    let tau = match law.response {
        Response::Delay => shortest.max(law.delay_s.abs()).copysign(law.delay_s),
        Response::Lag => shortest.max(law.delay_s),
    };
    let times: Vec<f64> = series.t.iter().map(|t| t - tau).collect();
    for component in 0..6 {
        let values: Vec<f64> = series.other.iter().map(|other| other[component]).collect();
        let late = match law.response {
            Response::Delay => wade_learn::signal::interpolate(&series.t, &values, &times),
            Response::Lag => lagged(&series.t, &values, tau),
        };
        for ((change, late), now) in column.iter_mut().zip(late).zip(&values) {
            change[component] = (late - now) / tau;
        }
    }
}

/// Lag of first order, from the value of the first sample on, of values that change linearly from sample to sample.
fn lagged(t: &[f64], values: &[f64], tau: f64) -> Vec<f64> {
    let mut state = values[0];
    let mut out = vec![state];
    for (t, v) in t.windows(2).zip(values.windows(2)) {
        let step = t[1] - t[0];
        let slope = (v[1] - v[0]) / step.max(f64::MIN_POSITIVE);
        let steady = |value: f64| value - slope * tau;
        state = steady(v[1]) + (state - steady(v[0])) * (-step / tau).exp();
        out.push(state);
    }
    out
}

/// Change per second of delay, `-dp/dt` at `t - tau/2`: `-(15 D_h - 6 D_2h + D_3h) / 10` with the central
/// differences `D_h = (p(+h) - p(-h)) / 2h`, which follow a change within half a second where `D_h` alone takes a quarter off.
fn delayed(series: &Series, delay: f64, column: &mut Column) {
    const WEIGHTS: [f64; 3] = [1.5, -0.6, 0.1];
    let (first, last) = (series.t[0], series.t[series.t.len() - 1]);
    // beyond the ends nothing is known of the prediction
    let at = |shift: f64| -> Vec<f64> {
        series.t.iter().map(|t| (t - 0.5 * delay + shift).clamp(first, last)).collect()
    };
    let arms = [1.0, 2.0, 3.0].map(|arms| [at(-arms * DELAY_ARM), at(arms * DELAY_ARM)]);
    for component in 0..6 {
        let values: Vec<f64> = series.seen.iter().map(|seen| seen[component]).collect();
        for (weight, [early, late]) in WEIGHTS.into_iter().zip(&arms) {
            let [before, after] =
                [early, late].map(|t| wade_learn::signal::interpolate(&series.t, &values, t));
            for (i, value) in column.iter_mut().enumerate() {
                let span = late[i] - early[i];
                if span > DELAY_ARM {
                    value[component] -= weight * (after[i] - before[i]) / span;
                }
            }
        }
    }
}
