//! Every effect of the library as columns: the wrench of each coefficient at 1, sample by sample.

use super::base_drag::BaseDrag;
use super::measurement::rolling_direction;
use super::series::Series;
use wade_core::effects::{self, Body, Effect, MAX_COEFFICIENTS, Memory, Shape};
use wade_core::frame::{GRAVITY, Vec3};
use wade_learn::trials::Manifest;

/// Half the distance over which the prediction is differentiated for a delay [s]: further than noise that stands in both
/// the gap and the prediction reaches, which would pass for a delay.
const DELAY_ARM: f64 = 0.15;

/// Shapes of one-dimensional flow in a channel, by the Froude number where it ends.
const IN_CHANNEL: [Shape; 2] = [[0.7, 0.0, 0.0], [1.0, 0.0, 0.0]];

/// Coefficient of a gain that all channels share.
const ALL_CHANNELS: usize = 6;

/// What columns depend on besides the trial.
#[derive(Debug, Clone)]
pub(super) struct Setting<'a> {
    pub body: &'a Body,
    pub base_drag: BaseDrag,
    /// True where the width of some trial's channel is stated.
    pub in_channel: bool,
    pub mass: f64,
    /// Compared components.
    pub components: Vec<usize>,
    /// The wrench comes from inertia, drive and weight.
    pub inferred: bool,
    /// The wrench was computed by a resolved flow.
    pub computed: bool,
    /// True where each stamp of the folder is of one clock.
    pub one_clock: bool,
    pub first_stamp: f64,
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
    match effect {
        _ if effect.kind() == effects::Kind::Sensor && setting.computed => {
            Some("the wrench was computed: no sensor can have a fault".into())
        }
        Effect::ChannelBlockage if !setting.in_channel => Some("trials.toml states no channel_width".into()),
        Effect::WheelPaddleThrust if !has_wheels() => {
            Some("no wheel speeds were recorded (wheel_fl, wheel_fr, wheel_rl, wheel_rr)".into())
        }
        Effect::RollingResistance | Effect::MassError if !setting.inferred => {
            Some("the wrench was measured, not inferred from mass and drive".into())
        }
        Effect::DriveGain if !setting.inferred && manifest.measured.other_forces.is_empty() => {
            Some("no drive force stands among the columns".into())
        }
        _ => None,
    }
}

/// Shapes among which an effect's is first looked for.
pub(super) fn shapes(effect: Effect, all: &[Series], setting: &Setting) -> Vec<Shape> {
    match effect {
        Effect::HullFlooding => [3e-4, 1e-3, 3e-3, 1e-2, 3e-2].map(|ratio| [ratio, 0.0, 0.0]).into(),
        Effect::WaveMemory => {
            // a memory shorter than the waves of the hull take to leave it is added mass
            let period = (setting.body.length / GRAVITY).sqrt();
            let mut shapes = Vec::new();
            for tau in [1.0, 2.5, 6.0, 15.0] {
                let of = |frequency: f64, form: f64| [tau * period, frequency / period, form];
                shapes.extend([of(0.0, 0.0), of(0.5, 0.0), of(1.0, 0.0), of(2.0, 0.0)]);
                shapes.extend([of(0.5, 1.0), of(1.0, 1.0), of(2.0, 1.0)]);
            }
            shapes
        }
        // each channel by itself, or one factor of all
        Effect::SensorGain => vec![[0.0; 3], [1.0, 0.0, 0.0]],
        Effect::Rotation => vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        Effect::Current => vec![[0.0; 3], [0.0, 0.0, 1.0]],
        Effect::DragCoefficientError => [0.0, 1.0, 2.0].map(|law| [law, 0.0, 0.0]).into(),
        Effect::AddedMass | Effect::WheelPaddleThrust => vec![[0.0; 3], [1.0, 0.0, 0.0]],
        Effect::BedMotion => [0.0, 1.0, 2.0].map(|area| [area, 0.0, 0.0]).into(),
        Effect::Squat => {
            let walls = if setting.in_channel { &IN_CHANNEL[..] } else { &[] };
            [&[[0.0; 3], [0.0, 1.0, 0.0]][..], walls].concat()
        }
        Effect::ChannelBlockage => [&[[0.0; 3]][..], &IN_CHANNEL].concat(),
        Effect::WaterEntrySlamming => {
            // a bottom without deadrise, and of 10, 20 and 30 degrees
            [0.0, 0.18, 0.36, 0.58].map(|slope| [0.5 * slope * setting.body.width, 0.0, 0.0]).into()
        }
        Effect::SensorDelay => [0.0, 0.1, 0.25, 0.5].map(|delay| [delay, 0.0, 0.0]).into(),
        Effect::SensorDrift if setting.one_clock => vec![[0.0; 3], [1.0, 0.0, 0.0]],
        Effect::SensorBiasStep => steps(all),
        _ => vec![[0.0; 3]],
    }
}

/// From a trial on in the order of recording (first number 0), or from a time in every trial on (1).
fn steps(all: &[Series]) -> Vec<Shape> {
    let count = all.len();
    let stride = (count as f64 / 16.0).max(1.0);
    let mut steps = Vec::new();
    let mut at = 1.0;
    while at < count as f64 - 0.5 && count > 3 {
        steps.push([0.0, at.round(), 0.0]);
        at += stride;
    }
    let mut lengths: Vec<f64> = all.iter().map(|series| series.t[series.t.len() - 1] - series.t[0]).collect();
    let length = super::statistics::median(&mut lengths);
    steps.extend((1..12).map(|i| [1.0, length * f64::from(i) / 12.0, 0.0]));
    steps
}

/// The columns of an effect in one trial: one a coefficient. `rank` is the trial's place in the order of recording: by
/// stamps of one clock, or else by names.
pub(super) fn columns(
    effect: Effect,
    shape: &Shape,
    series: &Series,
    rank: usize,
    setting: &Setting,
) -> Vec<Column> {
    let count = series.t.len();
    let mut columns = vec![vec![[0.0; 6]; count]; effect.coefficients().len()];
    match effect.kind() {
        effects::Kind::Physics => physics(effect, shape, series, setting, &mut columns),
        _ => chain(effect, shape, series, rank, setting, &mut columns),
    }
    columns
}

#[allow(clippy::needless_range_loop, reason = "a sample is an index into the series as well")]
fn physics(effect: Effect, shape: &Shape, series: &Series, setting: &Setting, columns: &mut [Column]) {
    let mut memory = Memory::default();
    debug_assert!(columns.len() <= MAX_COEFFICIENTS);
    let base_drag = setting.base_drag.of(effect, shape);
    for (sample, &t) in series.t.iter().enumerate() {
        let mut input = series.input(sample, setting.body, base_drag);
        if effect == Effect::AddedMass {
            input.condition = &series.calibrated[sample];
        }
        if effect.has_memory() {
            let since = if sample > 0 { t - series.t[sample - 1] } else { 0.0 };
            effects::advance(effect, shape, &mut memory, &input, since);
        }
        effects::basis(effect, shape, &memory, &input, |coefficient, _, load| {
            let sum = &mut columns[coefficient][sample];
            (0..3).for_each(|axis| {
                sum[axis] += load.force[axis];
                sum[axis + 3] += load.moment[axis];
            });
        });
    }
}

fn chain(
    effect: Effect,
    shape: &Shape,
    series: &Series,
    rank: usize,
    setting: &Setting,
    columns: &mut [Column],
) {
    let since_start = |sample: usize| series.t[sample] - series.t[0];
    for (sample, p) in series.seen.iter().enumerate() {
        let state = &series.conditions[sample];
        let up = state.up.into_inner();
        let mut own = |value: &dyn Fn(usize) -> f64| {
            setting.components.iter().for_each(|&c| columns[c][sample][c] = value(c));
        };
        match effect {
            Effect::SensorBias => own(&|_| 1.0),
            Effect::SensorBiasStep => {
                let after =
                    if shape[0] > 0.5 { since_start(sample) >= shape[1] } else { rank as f64 >= shape[1] };
                own(&|_| f64::from(u8::from(after)));
            }
            Effect::SensorDrift => {
                let time =
                    if shape[0] > 0.5 { series.t[sample] - setting.first_stamp } else { since_start(sample) };
                own(&|_| time);
            }
            Effect::SensorGain if shape[0] > 0.5 => {
                setting.components.iter().for_each(|&c| columns[ALL_CHANNELS][sample][c] = p[c]);
            }
            Effect::SensorGain => own(&|c| p[c]),
            Effect::AxisMisalignment => {
                for (axis, column) in columns.iter_mut().enumerate() {
                    // axes that are turned by an angle see the wrench turned back by it
                    let e = Vec3::ith(axis, -1.0);
                    let force = e.cross(&Vec3::new(p[0], p[1], p[2]));
                    let moment = e.cross(&Vec3::new(p[3], p[4], p[5]));
                    column[sample] = [force.x, force.y, force.z, moment.x, moment.y, moment.z];
                }
            }
            Effect::RollingResistance => {
                let load = (setting.mass * GRAVITY * up.z - p[2]).max(0.0);
                let dry = setting.mass * series.dry_rolling[sample];
                columns[0][sample][0] = dry - load * rolling_direction(state.ground_velocity.x);
            }
            Effect::DriveGain => columns[0][sample] = series.other[sample],
            Effect::MassError => {
                // a wrench that comes inferred was so with an acceleration that nobody knows: with what is expected of it
                let inertia = match &series.inertia {
                    Some(inertia) => inertia[sample],
                    None => series.calibrated[sample].acceleration + up * GRAVITY,
                };
                (0..3).for_each(|axis| columns[0][sample][axis] = -setting.mass * inertia[axis]);
            }
            _ => {}
        }
    }
    if effect == Effect::SensorDelay {
        delayed(series, shape[0], &mut columns[0]);
    }
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
