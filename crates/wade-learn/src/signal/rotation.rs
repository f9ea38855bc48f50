//! Rotations as functions of time.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// The same rotations with the sign of each quaternion chosen to be nearest to the one before, so that the components
/// can be filtered.
pub fn without_sign_flips(rotations: &[UnitQuaternion<f64>]) -> Vec<Quaternion<f64>> {
    let mut last: Option<Quaternion<f64>> = None;
    let mut continuous = |rotation: &UnitQuaternion<f64>| {
        let quaternion = rotation.into_inner();
        let flipped = last.is_some_and(|last| last.dot(&quaternion) < 0.0);
        *last.insert(if flipped { -quaternion } else { quaternion })
    };
    rotations.iter().map(&mut continuous).collect()
}

/// Angular velocity in the body frame [rad/s] of a rotation `world_from_body` that changes at `rate` [1/s]:
/// `omega = 2 vec(q* dq/dt) / |q|^2`. Only the rate along the unit sphere counts, so the length of a smoothed
/// quaternion does not matter.
pub fn angular_velocity(world_from_body: &Quaternion<f64>, rate: &Quaternion<f64>) -> Vector3<f64> {
    (world_from_body.conjugate() * rate).vector() * (2.0 / world_from_body.norm_squared())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_about_a_tilted_body_axis_is_found_in_the_body_frame() {
        let start = UnitQuaternion::from_euler_angles(0.3, -0.7, 1.9);
        let omega = Vector3::new(0.4, -1.1, 2.0);
        let at = |t: f64| start * UnitQuaternion::from_scaled_axis(omega * t);
        let rate = (at(1e-6).into_inner() - at(-1e-6).into_inner()) * 5e5;
        assert!((angular_velocity(&start.into_inner(), &rate) - omega).norm() < 1e-9);
        let longer = start.into_inner() * 1.5;
        assert!((angular_velocity(&longer, &(rate * 1.5)) - omega).norm() < 1e-9);
    }

    #[test]
    fn flips_are_undone() {
        let q = UnitQuaternion::from_euler_angles(0.1, 0.2, 3.0);
        let flipped = UnitQuaternion::new_unchecked(-q.into_inner());
        let found = without_sign_flips(&[q, flipped, flipped, q]);
        assert!(found.iter().all(|found| *found == q.into_inner()));
    }
}
