//! What `trials.toml` states, compared with the trials: a figure that somebody gave says how the data must look.

use super::GapError;
use super::noise::{SLOWEST_SEEN, groups, high_frequency};
use super::series::Series;
use super::statistics::SEEN_OF_SLOW_NOISE;
use wade_core::effects::Body;
use wade_core::frame::Vec3;
use wade_learn::signal::interpolate;
use wade_learn::trials::{Manifest, WRENCH};

/// Share of the speed by which two trials that repeat each other differ at most, rms, and the difference that always may be
/// [m/s]: above the first they are two motions and not one.
const APART: f64 = 0.5;
const SLOW: f64 = 0.1;
/// Share by which a rolling radius may miss that of the wheels: they slip.
const SLIP: f64 = 0.3;
/// Units of a wheel's speed in which its number is as many times that in rad/s.
const TURNS: [(f64, &str); 3] = [
    (60.0 / std::f64::consts::TAU, "revolutions a minute"),
    (360.0 / std::f64::consts::TAU, "degrees a second"),
    (1.0 / std::f64::consts::TAU, "revolutions a second"),
];
/// Share by which the rolling radius of a rim speed in m/s, which is 1 m, may miss it.
const RIM: f64 = 0.05;
/// Times that a rolling radius is too large where the velocity is in km/h.
const KILOMETERS_AN_HOUR: f64 = 3.6;
/// Factor between a stated noise and that of the samples from which they contradict each other: an estimate from a few trials
/// is good to a third.
const CONTRADICTS: f64 = 3.0;

/// Refuses channels that the hull does not fit into, and wheels that do not roll with `rolling_radius` [m] in their unit.
pub(super) fn check(all: &[Series], body: &Body, rolling_radius: Option<f64>) -> Result<(), GapError> {
    let narrow = |series: &&Series| series.channel_width.is_some_and(|width| width <= body.width);
    if let Some(series) = all.iter().find(narrow) {
        let channel = series.channel_width.unwrap_or_default();
        return Err(GapError::NarrowChannel { trial: series.name.clone(), channel, hull: body.width });
    }
    if let Some(radius) = rolling_radius {
        let is_near = |factor: f64| (radius * factor / body.wheel_radius - 1.0).abs() < SLIP;
        let turns = TURNS.into_iter().find(|(factor, _)| is_near(*factor));
        let turns = turns.map(|(_, unit)| format!("their speeds are in {unit}: write rad/s"));
        let is_rim = (radius - 1.0).abs() < RIM && !is_near(1.0);
        let rim =
            is_rim.then(|| "their speeds are those of the rims in m/s: divide by the radius".to_owned());
        let fast = is_near(1.0 / KILOMETERS_AN_HOUR);
        let fast = fast.then(|| "the velocities are in km/h: divide by 3.6".to_owned());
        if let Some(suspected) = turns.or(rim).or(fast) {
            return Err(GapError::WheelUnit { radius, wheel: body.wheel_radius, suspected });
        }
    }
    Ok(())
}

/// A trial that is stated to repeat another one and is another motion.
#[derive(Debug, Clone, PartialEq)]
struct NoRepeat {
    trial: String,
    other: String,
    /// Difference of the velocities, and the speed of the faster one, rms [m/s].
    apart: f64,
    speed: f64,
}

impl std::fmt::Display for NoRepeat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { trial, other, apart, speed } = self;
        write!(
            f,
            "{other}.csv does not repeat {trial}.csv as measured.repeats says: at the same time since their start their velocities differ by {apart:.2} m/s, with a speed of {speed:.2} m/s; what they show of the noise is left out. Cut both so that they begin together, or leave the pair out of measured.repeats"
        )
    }
}

/// The trials that repeat others in name alone.
fn no_repeats(all: &[Series], manifest: &Manifest) -> Vec<NoRepeat> {
    let of_group = |group: Vec<&Series>| {
        let (first, others) = group.split_first()?;
        let of = |other: &&Series| {
            let [apart, speed] = difference(first, other)?;
            let (trial, other) = (first.name.clone(), other.name.clone());
            (apart > f64::max(APART * speed, SLOW)).then_some(NoRepeat { trial, other, apart, speed })
        };
        Some(others.iter().filter_map(of).collect::<Vec<_>>())
    };
    groups(all, manifest).filter_map(of_group).flatten().collect()
}

/// The manifest without trials in its repeats that repeat no other.
pub(super) fn with_true_repeats(all: &[Series], manifest: &Manifest) -> Manifest {
    let mut manifest = manifest.clone();
    let no_repeats = no_repeats(all, &manifest);
    let groups = &mut manifest.measured.repeats;
    for group in groups.iter_mut() {
        let of_group = no_repeats.iter().filter(|no| group.contains(&no.trial));
        let others: Vec<&String> = of_group.map(|no| &no.other).collect();
        group.retain(|name| !others.contains(&name));
    }
    groups.retain(|group| group.len() > 1);
    manifest
}

/// Trials that repeat no other, and stated noises that the samples contradict.
pub(super) fn remarks(all: &[Series], manifest: &Manifest, components: &[usize]) -> Vec<String> {
    let of = |&component: &usize| {
        let (name, unit) = (WRENCH[component], if component < 3 { "N" } else { "N m" });
        let stated = *manifest.sensor_noise.get(name).filter(|stated| **stated > 0.0)?;
        let seen = high_frequency(all.iter(), component) * all.first()?.averaged.sqrt();
        let said = if seen > CONTRADICTS * stated {
            "the larger one is used"
        } else if seen < SEEN_OF_SLOW_NOISE / CONTRADICTS * stated {
            "what is smaller than the stated one is taken for noise"
        } else {
            return None;
        };
        Some(format!(
            "{name}: trials.toml states a sensor_noise of {stated} {unit}, and samples scatter by {seen:.3} {unit} within {SLOWEST_SEEN} s: {said}; state the standard deviation of one sample"
        ))
    };
    let no_repeats = no_repeats(all, manifest);
    no_repeats.iter().map(ToString::to_string).chain(components.iter().filter_map(of)).collect()
}

/// Difference of the velocities of two trials at the same time since their start, and the speed of the faster one, rms [m/s];
/// `None` where they have no time in common.
fn difference(a: &Series, b: &Series) -> Option<[f64; 2]> {
    let since: Vec<f64> = a.t.iter().map(|t| t - a.t[0] + b.t[0]).collect();
    let last = *b.t.last()?;
    let common = since.iter().take_while(|t| **t <= last).count();
    let velocities = |series: &Series| -> [Vec<f64>; 3] {
        [0, 1, 2].map(|axis| series.conditions.iter().map(|state| state.velocity[axis]).collect())
    };
    let other = velocities(b).map(|values| interpolate(&b.t, &values, &since[..common]));
    let ours = velocities(a);
    let at = |values: &[Vec<f64>; 3], i: usize| Vec3::new(values[0][i], values[1][i], values[2][i]);
    let rms = |of: &dyn Fn(usize) -> f64| ((0..common).map(of).sum::<f64>() / common as f64).sqrt();
    let speed = |values: &[Vec<f64>; 3]| rms(&|i| at(values, i).norm_squared());
    let apart = rms(&|i| (at(&ours, i) - at(&other, i)).norm_squared());
    (common > 1).then(|| [apart, speed(&ours).max(speed(&other))])
}
