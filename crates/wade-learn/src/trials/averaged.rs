//! Means over windows of samples in the place of the samples.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::acceleration::{acceleration, derivative};
use super::trial::{StillWater, Trial};
use wade_core::frame::Vec3;

impl Trial {
    /// The trial with one sample for each window: the mean of every column over it. Samples outside the windows are left
    /// out. Accelerations that were derivatives are the derivatives of the means: a filter of a few samples reaches a
    /// few windows then, and averages as much noise as at a lower rate.
    pub fn averaged(&self, windows: &[Range<usize>]) -> Self {
        let scalars = |values: &Vec<f64>| means(values, windows);
        let vectors = |values: &Vec<Vec3>| vector_means(values, windows);
        let angles = |values: &Vec<f64>| angle_means(values, windows);
        let columns = |columns: &[Option<Vec<f64>>; 6]| columns.each_ref().map(|c| c.as_ref().map(scalars));
        let averages = windows.iter().any(|window| window.len() > 1);
        let (t, velocity) = (scalars(&self.t), vectors(&self.velocity));
        let angular_velocity = vectors(&self.angular_velocity);
        let acceleration = match averages && !self.acceleration_is_measured {
            true => acceleration(&t, &velocity, &angular_velocity),
            false => vectors(&self.acceleration),
        };
        let turns = || derivative(&self.t, &self.angular_velocity);
        let angular_acceleration = match averages && self.angular_acceleration == turns() {
            true => derivative(&t, &angular_velocity),
            false => vectors(&self.angular_acceleration),
        };
        Self {
            name: self.name.clone(),
            rows: windows.iter().map(|window| self.rows[window.start]).collect(),
            t,
            velocity,
            current: vectors(&self.current),
            angular_velocity,
            roll: angles(&self.roll),
            pitch: scalars(&self.pitch),
            yaw: angles(&self.yaw),
            still_water: match &self.still_water {
                StillWater::Depth(values) => StillWater::Depth(scalars(values)),
                StillWater::Level(values) => StillWater::Level(scalars(values)),
            },
            bed_clearance: self.bed_clearance.as_ref().map(scalars),
            bed: self.bed.as_ref().map(scalars),
            acceleration,
            angular_acceleration,
            acceleration_is_measured: self.acceleration_is_measured,
            density: scalars(&self.density),
            wheel_speeds: self.wheel_speeds.each_ref().map(|speeds| speeds.as_ref().map(scalars)),
            measured: columns(&self.measured),
            simulated: columns(&self.simulated),
            other_forces: self.other_forces.iter().map(|(name, f)| (name.clone(), scalars(f))).collect(),
            known_loads: self.known_loads.iter().map(|(name, f)| (name.clone(), scalars(f))).collect(),
            unknown_columns: self.unknown_columns.clone(),
            gaps: self.gaps.clone(),
            glitches: self.glitches.clone(),
        }
    }
}

fn means(values: &[f64], windows: &[Range<usize>]) -> Vec<f64> {
    let mean = |window: &Range<usize>| values[window.clone()].iter().sum::<f64>() / window.len() as f64;
    windows.iter().map(mean).collect()
}

fn vector_means(values: &[Vec3], windows: &[Range<usize>]) -> Vec<Vec3> {
    let mean = |window: &Range<usize>| values[window.clone()].iter().sum::<Vec3>() / window.len() as f64;
    windows.iter().map(mean).collect()
}

/// Means of angles, each window's about its first sample: angles a whole turn apart are the same.
fn angle_means(values: &[f64], windows: &[Range<usize>]) -> Vec<f64> {
    let mean = |window: &Range<usize>| {
        let first = values[window.start];
        let off = |value: &f64| (value - first + PI).rem_euclid(TAU) - PI;
        match window.len() {
            1 => first,
            count => first + values[window.clone()].iter().map(off).sum::<f64>() / count as f64,
        }
    };
    windows.iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_keeps_its_mean_where_it_passes_half_a_turn() {
        let angles = [3.1, 3.13, 3.18 - TAU, 3.23 - TAU];
        let means = angle_means(&angles, &[0..4, 1..2]);
        assert!((means[0] - 3.16).abs() < 1e-12, "{means:?}");
        assert_eq!(means[1], 3.13);
    }
}
