//! Frames and the water plane.
//!
//! Body frame: right-handed FLU (x forward, y left, z up), origin at the center of the hull's bounding box,
//! SI units, radians. `z0` is the z of the ground-contact plane in that frame.

use nalgebra::{UnitQuaternion, UnitVector3, Vector3};

use crate::real::Real;

/// A vector in the body frame unless its name says otherwise.
pub type Vec3 = Vector3<f64>;

/// Standard gravity as the source paper rounds it [m/s2].
pub const GRAVITY: f64 = 9.81;

/// Dynamic viscosity of water at 20 degrees Celsius [Pa s].
pub const VISCOSITY: f64 = 1.002e-3;

/// World up in the body frame for an attitude given as roll and pitch (REP-103: yaw, then pitch, then roll;
/// positive pitch lowers the nose, positive roll lowers the right side).
pub fn up_from_roll_pitch(roll: f64, pitch: f64) -> UnitVector3<f64> {
    let (sr, cr) = roll.sin_cos();
    let (sp, cp) = pitch.sin_cos();
    UnitVector3::new_unchecked(Vec3::new(-sp, sr * cp, cr * cp))
}

/// World up in the body frame for the rotation that takes body vectors to the world.
pub fn up_from_quaternion(world_from_body: &UnitQuaternion<f64>) -> UnitVector3<f64> {
    world_from_body.inverse() * Vec3::z_axis()
}

/// Ahead, left and up of a level frame with the heading of the body, in the body frame; ahead is the body's x where that is
/// vertical.
pub fn level_axes(up: &UnitVector3<f64>) -> [Vec3; 3] {
    let up = up.into_inner();
    let ahead = Vec3::x() - up * up.x;
    let ahead = ahead.try_normalize(1e-9).unwrap_or_else(Vec3::x);
    [ahead, up.cross(&ahead), up]
}

/// The undisturbed water surface as a plane in the body frame: points with `normal . x <= offset` are under water.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaterPlane<T: Real = f64> {
    /// World up in the body frame.
    pub normal: UnitVector3<T>,
    /// Distance of the plane from the body origin along `normal` [m].
    pub offset: T,
}

impl WaterPlane {
    /// The plane of a level vehicle: `z = z0 + depth`.
    pub fn level(z0: f64, depth: f64) -> Self {
        Self::new(z0, depth, Vec3::z_axis())
    }

    /// True when up is exactly body z, so that submergence depends on heights alone.
    pub fn is_level(&self) -> bool {
        self.normal.x == 0.0 && self.normal.y == 0.0
    }
}

impl<T: Real> WaterPlane<T> {
    /// The plane through the body point `(0, 0, z0 + depth)`, horizontal in the world.
    pub fn new(z0: f64, depth: T, up: UnitVector3<T>) -> Self {
        Self { normal: up, offset: (depth + z0) * up.z }
    }

    /// Depth of a point below the surface [m]; negative in air.
    #[inline]
    pub fn depth_below(&self, point: &Vector3<T>) -> T {
        self.offset - self.normal.dot(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positive_pitch_lowers_the_nose() {
        let plane = WaterPlane::new(0.0, 0.0, up_from_roll_pitch(0.0, 0.1));
        assert!(plane.depth_below(&Vec3::x()) > 0.0);
    }

    #[test]
    fn positive_roll_lowers_the_right_side() {
        let plane = WaterPlane::new(0.0, 0.0, up_from_roll_pitch(0.1, 0.0));
        assert!(plane.depth_below(&-Vec3::y()) > 0.0);
    }

    #[test]
    fn roll_and_pitch_agree_with_the_quaternion() {
        let up = up_from_quaternion(&UnitQuaternion::from_euler_angles(0.2, -0.3, 1.1));
        assert!((up.into_inner() - up_from_roll_pitch(0.2, -0.3).into_inner()).norm() < 1e-12);
    }
}
