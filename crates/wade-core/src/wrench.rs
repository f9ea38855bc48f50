//! Force and moment about a stated point.

use std::ops::{Add, AddAssign, Mul};

use nalgebra::{Vector3, Vector6};

use crate::real::Real;

/// A force and its moment about a reference point that the owner of the value states, body frame [N, N m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrench<T = f64> {
    /// Force [N].
    pub force: Vector3<T>,
    /// Moment about the reference point [N m].
    pub moment: Vector3<T>,
}

impl<T: Real> Wrench<T> {
    /// The wrench about `about` of a force acting at `point`.
    pub fn from_force_at(force: Vector3<T>, point: &Vector3<T>, about: &Vector3<T>) -> Self {
        Self { force, moment: (point - about).cross(&force) }
    }

    /// The same load taken about a point that lies at `new` where this wrench was taken about `old`.
    pub fn moved(self, old: &Vector3<T>, new: &Vector3<T>) -> Self {
        Self { force: self.force, moment: self.moment + (old - new).cross(&self.force) }
    }

    /// Of a column, force first.
    pub fn from_column(column: &Vector6<T>) -> Self {
        Self { force: column.fixed_rows::<3>(0).into_owned(), moment: column.fixed_rows::<3>(3).into_owned() }
    }
}

impl Wrench {
    /// As a column, force first.
    pub fn column(&self) -> Vector6<f64> {
        let Self { force, moment } = self;
        Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
    }
}

impl<T: Real> Default for Wrench<T> {
    fn default() -> Self {
        Self { force: Vector3::zeros(), moment: Vector3::zeros() }
    }
}

impl<T: Real> Add for Wrench<T> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self { force: self.force + other.force, moment: self.moment + other.moment }
    }
}

impl<T: Real> Mul<T> for Wrench<T> {
    type Output = Self;
    fn mul(self, factor: T) -> Self {
        Self { force: self.force * factor, moment: self.moment * factor }
    }
}

impl<T: Real> AddAssign for Wrench<T> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Vec3;

    #[test]
    fn moving_the_reference_agrees_with_taking_it_there() {
        let (force, point) = (Vec3::new(1.0, -2.0, 3.0), Vec3::new(0.3, 0.1, -0.2));
        let (a, b) = (Vec3::new(0.5, 0.0, 0.1), Vec3::new(-1.0, 2.0, 0.0));
        let moved = Wrench::from_force_at(force, &point, &a).moved(&a, &b);
        assert!((moved.moment - Wrench::from_force_at(force, &point, &b).moment).norm() < 1e-12);
    }
}
