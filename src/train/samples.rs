//! The training set in memory: features and loads of every case and its mirror images.

use super::TrainError;
use super::plan::{Table, mirrored, split};
use crate::analytic;
use crate::condition::Condition;
use crate::features::{self, DYNAMIC, GLOBAL, STATIC};
use crate::model::network::{OUTPUTS, Scaling};
use crate::random::Random;
use crate::vehicle::Vehicle;

/// Features of one surface.
pub type SurfaceRow = [f32; STATIC + DYNAMIC];

/// One state of one vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Index of the vehicle.
    pub vehicle: usize,
    /// Number of the case that it is, or that it mirrors, within the vehicle's plan.
    pub case: usize,
    /// Fluid density [kg/m3].
    pub density: f64,
    /// Global features, not standardised.
    pub global: [f64; GLOBAL],
    /// Features of each surface.
    pub surfaces: Vec<SurfaceRow>,
    /// Force over density on each surface [m4/s2].
    pub targets: Vec<[f64; OUTPUTS]>,
    /// Share of each surface under water.
    pub fractions: Vec<f32>,
}

impl Sample {
    /// The features of a state and its analytic loads.
    pub fn new(vehicle: &Vehicle, index: usize, case: usize, condition: &Condition) -> Self {
        let plane = condition.water_plane(vehicle.z0);
        let direction = features::direction(&condition.velocity);
        let (mut surfaces, mut fractions) = (Vec::new(), Vec::new());
        for (surface, samples) in vehicle.surfaces.iter().zip(&vehicle.samples.surfaces) {
            let wet = samples.submergence(&plane);
            let fixed = features::surface_static(surface, &vehicle.dimensions);
            let moving = features::surface_dynamic(surface, &wet, &direction, &vehicle.dimensions);
            let mut row = fixed.into_iter().chain(moving).map(|x| x as f32);
            surfaces.push(std::array::from_fn(|_| row.next().unwrap_or(0.0)));
            fractions.push(wet.fraction as f32);
        }
        let loads = analytic::loads(vehicle, condition);
        Self {
            vehicle: index,
            case,
            density: condition.density,
            global: features::global(condition, &vehicle.dimensions),
            surfaces,
            targets: loads.iter().map(|f| (f / condition.density).into()).collect(),
            fractions,
        }
    }

    /// True net force over density [m4/s2].
    pub fn net_force_over_density(&self) -> [f64; OUTPUTS] {
        std::array::from_fn(|c| self.targets.iter().map(|target| target[c]).sum())
    }
}

/// Training and held-out samples; all images of a case are on one side.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Dataset {
    /// What the weights learn from.
    pub training: Vec<Sample>,
    /// What they are judged by.
    pub held_out: Vec<Sample>,
}

impl Dataset {
    /// Adds `cases` of a vehicle, planned and split at random.
    pub fn add(
        &mut self,
        index: usize,
        vehicle: &Vehicle,
        table: &Table,
        cases: usize,
        share: f64,
        random: &mut Random,
    ) {
        let plan = table.latin_hypercube(cases, random);
        let (training, held_out) = split(cases, share, random);
        let samples =
            |case: usize| mirrored(&plan[case]).map(|state| Sample::new(vehicle, index, case, &state));
        self.training.extend(training.into_iter().flat_map(samples));
        self.held_out.extend(held_out.into_iter().flat_map(samples));
    }

    /// Means and standard deviations over the training side.
    pub fn scaling(&self) -> Result<Scaling, TrainError> {
        let globals = moments(self.training.iter().map(|s| s.global)).ok_or(TrainError::NoCases)?;
        let targets = moments(self.training.iter().flat_map(|s| s.targets.iter().copied()));
        let targets = targets.ok_or(TrainError::NoCases)?;
        Ok(Scaling {
            global_mean: globals.0.map(|x| x as f32),
            global_std: globals.1.map(|x| x as f32),
            target_mean: targets.0.map(|x| x as f32),
            target_std: targets.1.map(|x| x as f32),
        })
    }

    /// The global features that are the same in every training sample, of which nothing can be learnt.
    pub fn constant_globals(&self) -> [bool; GLOBAL] {
        std::array::from_fn(|i| self.training.windows(2).all(|pair| pair[0].global[i] == pair[1].global[i]))
    }
}

/// Mean and standard deviation of each component; 1 for the deviation of a constant, which then becomes zero.
fn moments<const N: usize>(rows: impl Iterator<Item = [f64; N]> + Clone) -> Option<([f64; N], [f64; N])> {
    let count = rows.clone().count() as f64;
    if count == 0.0 {
        return None;
    }
    let mean: [f64; N] = std::array::from_fn(|i| rows.clone().map(|row| row[i]).sum::<f64>() / count);
    let deviation = std::array::from_fn(|i| {
        let variance = rows.clone().map(|row| (row[i] - mean[i]).powi(2)).sum::<f64>() / count;
        // what rounding leaves of a constant is no deviation
        if variance.sqrt() > 1e-9 * mean[i].abs() { variance.sqrt() } else { 1.0 }
    });
    Some((mean, deviation))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn moments_are_those_of_the_population_and_guard_constants() {
        let rows = [[1.0, 0.1, 0.0], [3.0, 0.1, 0.0]];
        let (mean, deviation) = moments(rows.into_iter()).unwrap();
        assert_eq!((mean, deviation), ([2.0, 0.1, 0.0], [1.0, 1.0, 1.0]));
    }
}
