//! What cameras make of a motion.

use nalgebra::{Matrix3, UnitQuaternion};

use super::super::recording::Recording;
use super::run::Run;
use super::{gaussian, gaussian_vector};
use crate::random::Random;
use wade_core::frame::Vec3;

/// Frames a second: the paper's.
pub const CAMERA_RATE: f64 = 120.0;

/// Four pucks on a frame, around the marker origin, body frame [m]: chosen.
const PUCKS: [Vec3; 4] = [
    Vec3::new(0.2, 0.15, 0.0),
    Vec3::new(0.2, -0.15, 0.0),
    Vec3::new(-0.2, 0.15, 0.0),
    Vec3::new(-0.2, -0.15, 0.0),
];

/// Most standard deviations of jitter: stamps stay in order.
const LATEST: f64 = 4.0;

/// Errors of the cameras and of the network behind them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cameras {
    /// Standard deviation of a puck's place along each axis [m]. 0.6 mm makes errors of 1.04 mm root mean square in space,
    /// of which one in a thousand exceeds 2.4 mm: the paper's calibration had 2.447 mm at most.
    pub marker_std: f64,
    /// Standard deviation of a stamp [s]: chosen. The frames are even; it is their stamps that come late or early.
    pub jitter_std: f64,
}

impl Default for Cameras {
    fn default() -> Self {
        Self { marker_std: 0.6e-3, jitter_std: 0.5e-3 }
    }
}

impl Cameras {
    /// Records what is seen of a run. The pose is solved from the pucks by least squares, for small errors: the origin is
    /// off by the mean error of the pucks, the attitude by `J^-1 sum r x e` with `J = sum (r.r I - r r')`.
    pub fn record(&self, run: &Run, random: &mut Random) -> Recording {
        let [first, last] = run.seen;
        let frames = ((last - first) * CAMERA_RATE).floor() as usize + 1;
        let inertia: Matrix3<f64> =
            PUCKS.iter().map(|r| Matrix3::identity() * r.norm_squared() - r * r.transpose()).sum();
        let per_moment = inertia.try_inverse().unwrap_or_else(Matrix3::zeros);
        let mut recording = Recording { t: Vec::new(), position: Vec::new(), rotation: Vec::new() };
        for frame in 0..frames {
            let t = first + frame as f64 / CAMERA_RATE;
            let (position, rotation) = run.marker_pose(t);
            let errors = PUCKS.map(|_| gaussian_vector(random) * self.marker_std);
            let moment: Vec3 = PUCKS.iter().zip(&errors).map(|(r, error)| r.cross(error)).sum();
            recording.position.push(position + rotation * (errors.iter().sum::<Vec3>() / 4.0));
            recording.rotation.push(rotation * UnitQuaternion::from_scaled_axis(per_moment * moment));
            recording.t.push(t + self.jitter_std * gaussian(random).clamp(-LATEST, LATEST));
        }
        recording
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_puck_in_a_thousand_is_off_by_more_than_the_paper_s_largest_error() {
        let (mut random, cameras) = (Random::new(5), Cameras::default());
        let errors: Vec<f64> =
            (0..50_000).map(|_| (gaussian_vector(&mut random) * cameras.marker_std).norm()).collect();
        let share = errors.iter().filter(|error| **error > 2.447e-3).count() as f64 / 5e4;
        assert!((0.3e-3..2e-3).contains(&share), "{share}");
    }
}
