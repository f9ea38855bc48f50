//! The measured wrench of a trial: as its columns say, or inferred from the motion.
//!
//! Inverse dynamics (`method = "inverse_dynamics"`): `F = m (a + g up) - sum of other forces`, and with a stated inertia
//! `M = I alpha + omega x I omega - sum of other moments` about the center of mass. A column of a known other force is named
//! after the component it acts on (`drive_fx`, `drive_mz`). Components without such a column are not inferred, since
//! what the ground carries is unknown there. A dry twin, the same command without water, is taken off at the same time
//! since the start, and so is its part in all that the wrench was inferred from: an error of the mass or of the drive
//! stands in both.

use std::collections::BTreeMap;

use nalgebra::Matrix3;

use super::GapError;
use super::rates::mean_step;
use wade_core::frame::{GRAVITY, Vec3};
use wade_learn::signal::interpolate;
use wade_learn::trials::{Manifest, Method, Trial, Trials, component_of};

/// Speed below which rolling resistance fades out [m/s].
const ROLLING_SPEED: f64 = 0.05;

/// What was measured of a trial, a value a sample; where the wrench was inferred, all of it less that of the dry twin.
pub(super) struct Measurement {
    /// `None` for a component that was not measured [N, N m].
    pub wrench: [Option<Vec<f64>>; 6],
    /// What the wrench was inferred from; `None` where it was measured, or comes inferred.
    pub motion: Option<Motion>,
    /// Known other force on each component, where there is one [N, N m].
    pub other: Vec<[f64; 6]>,
}

/// What times the mass is force, and what the inertia makes of the turning.
pub(super) struct Motion {
    /// [m/s2]
    pub acceleration: Vec<Vec3>,
    pub up: Vec<Vec3>,
    /// `I alpha + omega x I omega` [N m]; 0 where no inertia is stated.
    pub moment: Vec<Vec3>,
    /// The same of each moment of inertia alone, about x, y and z [N m].
    pub moments: Vec<[Vec3; 3]>,
    /// The dry twin's weight times the direction in which it rolls, over its mass; 0 without one [m/s2].
    pub dry_rolling: Vec<f64>,
    /// The dry twin's acceleration, where there is one [m/s2].
    pub dry_acceleration: Option<Vec<Vec3>>,
}

/// The dry twin of a trial, where it has one.
pub(super) fn twin<'a>(trials: &'a Trials, trial: &Trial) -> Result<Option<&'a Trial>, GapError> {
    let Some(name) = trials.manifest.measured.dry_twins.get(&trial.name) else { return Ok(None) };
    if !is_inferred_here(&trials.manifest, trial) {
        return Err(GapError::TwinOfMeasured { trial: trial.name.clone() });
    }
    let missing = || GapError::NoTwin { trial: trial.name.clone(), twin: name.clone() };
    trials.trials.iter().find(|other| other.name == *name).ok_or_else(missing).map(Some)
}

/// What was measured of a trial beside its dry twin, or inferred with a mass where the manifest states none [kg].
pub(super) fn measurement(
    manifest: &Manifest,
    trial: &Trial,
    twin: Option<&Trial>,
    mass: f64,
) -> Result<Measurement, GapError> {
    let own = of_columns(&trial.other_forces, trial.len());
    if !is_inferred_here(manifest, trial) {
        return Ok(Measurement { wrench: trial.measured.clone(), motion: None, other: own });
    }
    let mut other = own;
    let mut motion = Motion {
        acceleration: trial.acceleration.clone(),
        up: (0..trial.len()).map(|sample| trial.up(sample).into_inner()).collect(),
        moment: turning(manifest, trial, |inertia, rate, change| moment(&inertia, rate, change)),
        moments: turning(manifest, trial, of_each_axis),
        dry_rolling: vec![0.0; trial.len()],
        dry_acceleration: None,
    };
    if let Some(twin) = twin {
        take_off(&mut motion, &mut other, manifest, trial, twin)?;
    }
    let mass = manifest.mass.unwrap_or(mass);
    let force = |axis: usize| {
        sum_on(axis, &trial.other_forces)?;
        let inertia = motion.acceleration.iter().zip(&motion.up).map(|(a, up)| a[axis] + GRAVITY * up[axis]);
        Some(inertia.zip(&other).map(|(inertia, other)| mass * inertia - other[axis]).collect())
    };
    let about = |axis: usize| {
        manifest.inertia?;
        sum_on(axis + 3, &trial.other_forces)?;
        Some(motion.moment.iter().zip(&other).map(|(moment, other)| moment[axis] - other[axis + 3]).collect())
    };
    let wrench = [force(0), force(1), force(2), about(0), about(1), about(2)];
    Ok(Measurement { wrench, motion: Some(motion), other })
}

/// What a wrench that is inferred from the motion rests on, where the trials leave it open; `mass` is the one that is used [kg].
pub(super) fn remarks(trials: &Trials, mass: f64) -> Vec<String> {
    let mut said = Vec::new();
    if !trials.trials.iter().any(|trial| is_inferred_here(&trials.manifest, trial)) {
        return said;
    }
    if trials.manifest.mass.is_none() {
        said.push(format!(
            "trials.toml states no mass: the wrench is inferred with the vehicle's, {mass} kg"
        ));
    }
    for name in &trials.manifest.measured.other_forces {
        let mut rows = trials.trials.iter().filter_map(|trial| trial.other_forces.get(name)).flatten();
        let is_moment = component_of(name).is_some_and(|component| component >= 3);
        if is_moment && trials.manifest.inertia.is_none() {
            said.push(format!(
                "column {name} is not used: a moment is inferred from the motion where trials.toml states the inertia (inertia = [[Ixx, Ixy, Ixz], ...], kg m2)"
            ));
        } else if rows.all(|force| *force == 0.0) {
            said.push(format!("column {name} is 0 in every row: no such force acts on the vehicle"));
        }
    }
    said
}

/// What the stated inertia makes of a trial's turning, a value a sample; 0 where none is stated.
fn turning<T: Default + Clone>(
    manifest: &Manifest,
    trial: &Trial,
    of: impl Fn(Matrix3<f64>, &Vec3, &Vec3) -> T,
) -> Vec<T> {
    let Some(inertia) = manifest.inertia_matrix() else { return vec![T::default(); trial.len()] };
    let rates = trial.angular_velocity.iter().zip(&trial.angular_acceleration);
    rates.map(|(rate, change)| of(inertia, rate, change)).collect()
}

/// `I alpha + omega x I omega`, Euler's equation of a body about its center of mass [N m].
pub(super) fn moment(inertia: &Matrix3<f64>, rate: &Vec3, change: &Vec3) -> Vec3 {
    inertia * change + rate.cross(&(inertia * rate))
}

/// The same of each moment of inertia alone.
pub(super) fn of_each_axis(inertia: Matrix3<f64>, rate: &Vec3, change: &Vec3) -> [Vec3; 3] {
    std::array::from_fn(|axis| {
        let mut alone = Matrix3::zeros();
        alone[(axis, axis)] = inertia[(axis, axis)];
        moment(&alone, rate, change)
    })
}

/// Which way wheels roll: the sign of the speed ahead [m/s], 0 at rest.
pub(super) fn rolling_direction(speed: f64) -> f64 {
    speed / speed.hypot(ROLLING_SPEED)
}

/// True where the wrench of the trials was computed by a resolved flow.
pub(super) fn is_computed(manifest: &Manifest) -> bool {
    manifest.measured.method == Some(Method::Cfd)
}

/// True where the wrench of the trials rests on inertia and drive.
pub(super) fn is_inferred(manifest: &Manifest) -> bool {
    manifest.measured.method == Some(Method::InverseDynamics)
}

/// True where the wrench is inferred from the trial's own motion; false where it was measured, or comes inferred.
fn is_inferred_here(manifest: &Manifest, trial: &Trial) -> bool {
    manifest.measured.method == Some(Method::InverseDynamics) && trial.measured.iter().all(Option::is_none)
}

/// Known forces on each component; 0 where no column acts on it.
pub(super) fn of_columns(columns: &BTreeMap<String, Vec<f64>>, count: usize) -> Vec<[f64; 6]> {
    let sums: [Option<Vec<f64>>; 6] = std::array::from_fn(|c| sum_on(c, columns));
    (0..count).map(|i| std::array::from_fn(|c| sums[c].as_ref().map_or(0.0, |sum| sum[i]))).collect()
}

/// Sum of the columns of known forces that act on a component; `None` where there is none.
fn sum_on(component: usize, columns: &BTreeMap<String, Vec<f64>>) -> Option<Vec<f64>> {
    let mut columns = columns.iter().filter(|(name, _)| component_of(name) == Some(component));
    let mut sum = columns.next()?.1.clone();
    for (_, column) in columns {
        sum.iter_mut().zip(column).for_each(|(sum, value)| *sum += value);
    }
    Some(sum)
}

fn take_off(
    motion: &mut Motion,
    other: &mut [[f64; 6]],
    manifest: &Manifest,
    trial: &Trial,
    twin: &Trial,
) -> Result<(), GapError> {
    let length = |trial: &Trial| trial.t[trial.len() - 1] - trial.t[0];
    // the last sample may stand for one more, and for no longer
    if length(twin) + mean_step(&twin.t) < length(trial) {
        return Err(GapError::ShortTwin {
            trial: trial.name.clone(),
            twin: twin.name.clone(),
            seconds: length(trial) - length(twin),
        });
    }
    let since_start: Vec<f64> = trial.t.iter().map(|t| t - trial.t[0] + twin.t[0]).collect();
    let at = |value: &dyn Fn(usize) -> f64| {
        let values: Vec<f64> = (0..twin.len()).map(value).collect();
        interpolate(&twin.t, &values, &since_start)
    };
    let dry_moment = turning(manifest, twin, |inertia, rate, change| moment(&inertia, rate, change));
    let dry_moments = turning(manifest, twin, of_each_axis);
    let mut dry_acceleration = vec![Vec3::zeros(); trial.len()];
    for axis in 0..3 {
        let acceleration = at(&|i| twin.acceleration[i][axis]);
        for ((wet, own), dry) in motion.acceleration.iter_mut().zip(&mut dry_acceleration).zip(acceleration) {
            (wet[axis], own[axis]) = (wet[axis] - dry, dry);
        }
        let up = at(&|i| twin.up(i)[axis]);
        motion.up.iter_mut().zip(up).for_each(|(wet, dry)| wet[axis] -= dry);
        let whole = at(&|i| dry_moment[i][axis]);
        motion.moment.iter_mut().zip(whole).for_each(|(wet, dry)| wet[axis] -= dry);
        for alone in 0..3 {
            let one = at(&|i| dry_moments[i][alone][axis]);
            motion.moments.iter_mut().zip(one).for_each(|(wet, dry)| wet[alone][axis] -= dry);
        }
    }
    motion.dry_acceleration = Some(dry_acceleration);
    motion.dry_rolling = at(&|i| GRAVITY * twin.up(i).z * rolling_direction(twin.velocity[i].x));
    let dry = of_columns(&twin.other_forces, twin.len());
    for component in 0..6 {
        let dry = at(&|i| dry[i][component]);
        other.iter_mut().zip(dry).for_each(|(wet, dry)| wet[component] -= dry);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_top_without_a_moment_turns_by_eulers_equation() {
        // a symmetric top: its rate goes round the axis of symmetry at (C - A) / A times the spin about that
        let (a, c, spin, cone) = (2.0, 3.0, 4.0, 0.7);
        let inertia = Matrix3::from_diagonal(&Vec3::new(a, a, c));
        let pace: f64 = (c - a) / a * spin;
        for t in [0.0, 0.3, 1.1] {
            let (sin, cos) = (pace * t).sin_cos();
            let rate = Vec3::new(cone * cos, cone * sin, spin);
            let change = Vec3::new(-cone * pace * sin, cone * pace * cos, 0.0);
            assert!(moment(&inertia, &rate, &change).norm() < 1e-12);
            let alone = of_each_axis(inertia, &rate, &change);
            assert!(alone.iter().sum::<Vec3>().norm() < 1e-12 && alone[2].norm() > 1.0, "{alone:?}");
        }
    }
}
