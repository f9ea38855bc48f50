//! Force and moment about a stated point.

use std::ops::{Add, AddAssign, Mul};

use crate::frame::Vec3;

/// A force and its moment about a reference point that the owner of the value states, body frame [N, N m].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// Force [N].
    pub force: Vec3,
    /// Moment about the reference point [N m].
    pub moment: Vec3,
}

impl Wrench {
    /// The wrench about `about` of a force acting at `point`.
    pub fn from_force_at(force: Vec3, point: &Vec3, about: &Vec3) -> Self {
        Self { force, moment: (point - about).cross(&force) }
    }

    /// The same load taken about a point that lies at `new` where this wrench was taken about `old`.
    pub fn moved(self, old: &Vec3, new: &Vec3) -> Self {
        Self { force: self.force, moment: self.moment + (old - new).cross(&self.force) }
    }
}

impl Add for Wrench {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { force: self.force + other.force, moment: self.moment + other.moment }
    }
}

impl Mul<f64> for Wrench {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self { force: self.force * factor, moment: self.moment * factor }
    }
}

impl AddAssign for Wrench {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_the_reference_agrees_with_taking_it_there() {
        let (force, point) = (Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.3, 0.1, -0.2));
        let (a, b) = (Vec3::new(0.5, 0.0, 0.1), Vec3::new(-1.0, 2.0, 0.0));
        let moved = Wrench::from_force_at(force, &point, &a).moved(&a, &b);
        assert!((moved.moment - Wrench::from_force_at(force, &point, &b).moment).norm() < 1e-12);
    }
}
