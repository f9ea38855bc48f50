//! Terms: the textbook form of each effect, and powers of the state.

use super::regression::Normal;
use crate::generate::{DRIVE, gap, predicted};
use crate::hidden::Effect::{self, *};
use crate::{Simulator, Wrench6};
use wade_core::frame::GRAVITY;
use wade_learn::trials::{Trial, Trials};

/// A column of the regression.
pub(super) struct Term {
    /// The effect that it stands for; none for a generic one.
    pub effect: Option<Effect>,
    /// Its parameter and unit.
    pub name: &'static str,
    pub unit: &'static str,
}

const fn term(effect: Effect, name: &'static str, unit: &'static str) -> Term {
    Term { effect: Some(effect), name, unit }
}

const fn generic(name: &'static str) -> Term {
    Term { effect: None, name, unit: "" }
}

/// In the order of `values`.
pub(super) const TERMS: [Term; 56] = [
    term(AddedMass, "mass_x", "kg"),
    term(AddedMass, "mass_y", "kg"),
    term(AddedMass, "mass_z", "kg"),
    term(AddedMass, "inertia_z", "kg m2"),
    term(LinearDamping, "b_x", "N s/m"),
    term(LinearDamping, "b_y", "N s/m"),
    term(LinearDamping, "b_psi", "N m s"),
    term(DragCoefficientError, "relative_error", "1"),
    term(Rotation, "side", "N s2"),
    term(Rotation, "coefficient", "1"),
    term(Current, "x", "m/s"),
    term(Current, "y", "m/s"),
    term(WaterLevelOffset, "offset", "m"),
    term(DensityError, "relative_error", "1"),
    term(HullFlooding, "fast", "m2"),
    term(HullFlooding, "slow", "m2"),
    term(WaterEntrySlamming, "momentum", "kg/m"),
    term(WaveMemory, "fast", "kg/s"),
    term(WaveMemory, "slow", "kg/s"),
    term(ChannelBlockage, "factor", "1"),
    term(Squat, "factor", "1"),
    term(WheelPaddleThrust, "area", "m2"),
    term(BedMotion, "drag", "m2"),
    term(BedMotion, "lift", "m2"),
    term(SensorDelay, "delay", "s"),
    term(SensorBias, "fx", "N"),
    term(SensorBias, "fy", "N"),
    term(SensorBias, "fz", "N"),
    term(SensorBiasStep, "fx", "N"),
    term(SensorBiasStep, "fy", "N"),
    term(SensorBiasStep, "fz", "N"),
    term(SensorDrift, "fx", "N/s"),
    term(SensorDrift, "fy", "N/s"),
    term(SensorDrift, "fz", "N/s"),
    term(SensorGain, "error", "1"),
    term(AxisMisalignment, "roll", "rad"),
    term(AxisMisalignment, "pitch", "rad"),
    term(RollingResistance, "coefficient", "1"),
    term(DriveGain, "error", "1"),
    term(MassError, "mass", "kg"),
    generic("vx in fx"),
    generic("vx2 in fx"),
    generic("vx3 in fx"),
    generic("depth in fx"),
    generic("vx depth in fx"),
    generic("vx wz in fx"),
    generic("vy in fy"),
    generic("wz in fy"),
    generic("vx vy in fy"),
    generic("vx wz in fy"),
    generic("depth in fz"),
    generic("depth2 in fz"),
    generic("vx in fz"),
    generic("vx2 in fz"),
    generic("vz in fz"),
    generic("vx vy in mz"),
];

/// Terms of each effect, and each generic one by itself.
pub(super) fn groups() -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, term) in TERMS.iter().enumerate() {
        let same = |group: &&mut Vec<usize>| term.effect.is_some() && TERMS[group[0]].effect == term.effect;
        match groups.iter_mut().find(same) {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    groups
}

/// Folds of trials; a session's neighbors are spread over them.
const FOLDS: usize = 5;
/// Every such sample counts: neighbors say the same.
const STRIDE: usize = 3;

/// Normal equations of each fold in standard deviations of the noise, as the differences of neighboring gaps show it.
pub(super) fn folds(trials: &Trials, simulator: &Simulator) -> Vec<Normal> {
    let predictions: Vec<Vec<Wrench6>> =
        trials.trials.iter().map(|trial| predicted(trial, simulator)).collect();
    let noise = noise(trials, &predictions);
    let mut folds = vec![Normal::new(TERMS.len()); FOLDS];
    let ordered = ordered(trials);
    for (rank, &index) in ordered.iter().enumerate() {
        let (trial, predictions) = (&trials.trials[index], &predictions[index]);
        let late = rank as f64 / ordered.len() as f64 > 0.5;
        let values = values(trial, predictions, simulator, late);
        for sample in (0..trial.len()).step_by(STRIDE) {
            let gap = gap(trial, sample, &predictions[sample]);
            for c in (0..6).filter(|&c| trial.measured[c].is_some() && noise[c] > 0.0) {
                let row: Vec<f64> = values.iter().map(|column| column[sample][c] / noise[c]).collect();
                folds[rank % FOLDS].add(&row, gap[c] / noise[c]);
            }
        }
    }
    folds
}

/// The trials by name, whatever order they come in.
fn ordered(trials: &Trials) -> Vec<usize> {
    let mut order: Vec<usize> = (0..trials.trials.len()).collect();
    order.sort_by(|&a, &b| trials.trials[a].name.cmp(&trials.trials[b].name));
    order
}

fn noise(trials: &Trials, predictions: &[Vec<Wrench6>]) -> Wrench6 {
    let (mut sum, mut count) = (Wrench6::zeros(), 0.0);
    for (trial, predictions) in trials.trials.iter().zip(predictions) {
        for i in 1..trial.len() {
            let change = gap(trial, i, &predictions[i]) - gap(trial, i - 1, &predictions[i - 1]);
            sum += change.component_mul(&change);
            count += 2.0;
        }
    }
    (sum / f64::max(count, 1.0)).map(f64::sqrt)
}

/// Every term of a trial, by sample.
fn values(trial: &Trial, predicted: &[Wrench6], simulator: &Simulator, late: bool) -> Vec<Vec<Wrench6>> {
    let hull = simulator.hull;
    let depth_at = |sample: usize| trial.depth(sample, hull.z0);
    let e = |c: usize, value: f64| {
        let mut wrench = Wrench6::zeros();
        wrench[c] = value;
        wrench
    };
    let [mut fast, mut slow] = [[wade_core::frame::Vec3::zeros(); 2]; 2].map(|v| v[0]);
    let mut wet_time = 0.0;
    let mut columns = vec![Vec::with_capacity(trial.len()); TERMS.len()];
    for i in 0..trial.len() {
        let (v, a) = (trial.velocity[i], trial.acceleration[i]);
        let (r, depth) = (trial.angular_velocity[i].z, depth_at(i).max(0.0));
        let turning = trial.angular_acceleration[i].z;
        let before = i.saturating_sub(1);
        let dt = (trial.t[i] - trial.t[before]).max(1e-6);
        let wet = if depth > 0.0 { 1.0 } else { 0.0 };
        wet_time = wet * (wet_time + if i > 0 { dt } else { 0.0 });
        let follow = |state: &mut wade_core::frame::Vec3, time: f64| {
            *state += (v - *state) * (1.0 - (-dt / time).exp());
            *state
        };
        let memory = [follow(&mut fast, 0.3), follow(&mut slow, 1.2)].map(|lagged| (v - lagged) * depth);
        let drag = |c: usize, across: f64, v: f64| e(c, -500.0 * across * depth * v * v.abs());
        let quadratic = drag(0, 1.2 * hull.width, v.x) + drag(1, 1.5 * hull.length, v.y);
        let rate = if i > 0 { (predicted[i] - predicted[before]) / dt } else { Wrench6::zeros() };
        let froude2 = v.x * v.x / (GRAVITY * depth.max(0.02));
        let blocked = (1.0 - froude2).abs().max(0.3);
        let (sine, cosine) = trial.yaw[i].sin_cos();
        let along = [1000.0 * 1.2 * hull.width, 1000.0 * 1.5 * hull.length].map(|k| k * depth);
        let speeds = [v.x.abs().max(0.1), v.y.abs().max(0.1)];
        let towards = |x: f64, y: f64| e(0, along[0] * speeds[0] * x) + e(1, along[1] * speeds[1] * y);
        let entry = ((depth_at(i) - depth_at(before)) / dt).max(0.0) * wet;
        let area = 1000.0 * GRAVITY * hull.waterplane(depth);
        let wheel = trial.wheel_speeds[0].as_ref().map_or(0.0, |speeds| speeds[i]) * hull.wheel[0] - v.x;
        let drive = trial.other_forces.get(DRIVE).map_or(0.0, |drive| drive[i]);
        let load = (hull.mass * GRAVITY - predicted[i][2]).max(0.0);
        let (sim, time) = (&predicted[i], trial.t[i]);
        let step = if late { 1.0 } else { 0.0 };
        let row = [
            e(0, -a.x * wet),
            e(1, -a.y * wet),
            e(2, -a.z * wet),
            e(5, -turning * wet),
            e(0, -v.x * wet),
            e(1, -v.y * wet),
            e(5, -r * wet),
            quadratic,
            e(1, -v.x * r * wet),
            e(5, -500.0 * 1.5 * depth * hull.length.powi(4) / 32.0 * r * r.abs()),
            towards(cosine, -sine),
            towards(sine, cosine),
            e(2, area),
            *sim,
            e(2, -1000.0 * GRAVITY * depth * (1.0 - (-wet_time / 1.0).exp())),
            e(2, -1000.0 * GRAVITY * depth * (1.0 - (-wet_time / 4.0).exp())),
            e(2, entry * entry),
            Wrench6::new(-memory[0].x, -memory[0].y, -memory[0].z, 0.0, 0.0, 0.0),
            Wrench6::new(-memory[1].x, -memory[1].y, -memory[1].z, 0.0, 0.0, 0.0),
            quadratic * (1.0 / blocked - 1.0),
            e(2, -area * depth * froude2.min(2.0) / blocked * 0.1),
            e(0, 500.0 * wheel * wheel.abs() * wet),
            e(0, 500.0 * v.x * v.x.abs() * wet),
            e(2, -500.0 * v.x * v.x * wet),
            -rate,
            e(0, 1.0),
            e(1, 1.0),
            e(2, 1.0),
            e(0, step),
            e(1, step),
            e(2, step),
            e(0, time),
            e(1, time),
            e(2, time),
            *sim,
            e(1, -sim[2]) + e(2, sim[1]),
            e(0, sim[2]) + e(2, -sim[0]),
            e(0, -load * (v.x / 0.05).tanh()),
            e(0, drive),
            e(0, a.x) + e(1, a.y),
            e(0, v.x),
            e(0, v.x * v.x),
            e(0, v.x.powi(3)),
            e(0, depth),
            e(0, v.x * depth),
            e(0, v.x * r),
            e(1, v.y),
            e(1, r),
            e(1, v.x * v.y),
            e(1, v.x * r),
            e(2, depth),
            e(2, depth * depth),
            e(2, v.x),
            e(2, v.x * v.x),
            e(2, v.z),
            e(5, v.x * v.y),
        ];
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
    }
    columns
}
