//! The measured wrench of a trial: as its columns say, or inferred from the motion.
//!
//! Inverse dynamics (`method = "inverse_dynamics"`): `F = m (a + g up) - sum of other forces`. A column of a known other
//! force is named after the component it acts on (`drive_fx`). Components without such a column are not inferred, since
//! what the ground carries is unknown there. A dry twin, the same command without water, is taken off at the same time
//! since the start, with the difference of the inertia.

use std::collections::BTreeMap;

use super::GapError;
use crate::frame::GRAVITY;
use crate::signal::interpolate;
use crate::trials::{Method, Trial, Trials, component_of};

/// The measured wrench of each sample; `None` for a component that was not measured [N, N m].
pub(super) fn measured(trials: &Trials, trial: &Trial, mass: f64) -> Result<[Option<Vec<f64>>; 6], GapError> {
    if !is_inferred_here(trials, trial) {
        return Ok(trial.measured.clone());
    }
    let mass = trials.manifest.mass.unwrap_or(mass);
    let mut wrench = inferred(trial, mass);
    if let Some(name) = trials.manifest.measured.dry_twins.get(&trial.name) {
        let missing = || GapError::NoTwin { trial: trial.name.clone(), twin: name.clone() };
        let twin = trials.trials.iter().find(|other| other.name == *name).ok_or_else(missing)?;
        take_off(&mut wrench, trial, twin, &inferred(twin, mass));
    }
    Ok(wrench)
}

/// True where the wrench is inferred from the trial's own motion; false where it was measured, or comes inferred.
pub(super) fn is_inferred_here(trials: &Trials, trial: &Trial) -> bool {
    trials.manifest.measured.method == Some(Method::InverseDynamics)
        && trial.measured.iter().all(Option::is_none)
}

/// Sum of the columns of known forces that act on a component; `None` where there is none.
pub(super) fn sum_on(component: usize, columns: &BTreeMap<String, Vec<f64>>) -> Option<Vec<f64>> {
    let mut columns = columns.iter().filter(|(name, _)| component_of(name) == Some(component));
    let mut sum = columns.next()?.1.clone();
    for (_, column) in columns {
        sum.iter_mut().zip(column).for_each(|(sum, value)| *sum += value);
    }
    Some(sum)
}

fn inferred(trial: &Trial, mass: f64) -> [Option<Vec<f64>>; 6] {
    let force = |axis: usize| {
        let known = sum_on(axis, &trial.other_forces)?;
        let value = |(sample, other): (usize, f64)| {
            mass * (trial.acceleration[sample][axis] + GRAVITY * trial.up(sample)[axis]) - other
        };
        Some(known.into_iter().enumerate().map(value).collect())
    };
    [force(0), force(1), force(2), None, None, None]
}

fn take_off(wrench: &mut [Option<Vec<f64>>; 6], trial: &Trial, twin: &Trial, dry: &[Option<Vec<f64>>; 6]) {
    let since_start: Vec<f64> = trial.t.iter().map(|t| t - trial.t[0] + twin.t[0]).collect();
    for (wet, dry) in wrench.iter_mut().zip(dry) {
        if let (Some(wet), Some(dry)) = (wet, dry) {
            let dry = interpolate(&twin.t, dry, &since_start);
            wet.iter_mut().zip(dry).for_each(|(wet, dry)| *wet -= dry);
        }
    }
}
