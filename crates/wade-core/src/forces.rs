//! What a query answers.

use crate::domain::Outside;
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// The load on one surface, body frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfaceForce {
    /// Force [N]; exactly zero on a dry surface.
    pub force: Vec3,
    /// Point of application [m]: of the paper's network the centroid of the wet part, of the `anchored` one the point at which the
    /// force has the moment of its parts, where the water may reach; of a dry surface its centroid.
    pub point: Vec3,
    /// Share of the surface under water, 0 to 1.
    pub wetted_fraction: f64,
}

/// The loads on a vehicle. Reused from query to query: once it has held a vehicle's surfaces it allocates no more.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Forces {
    /// One load a surface, in the vehicle's order.
    pub surfaces: Vec<SurfaceForce>,
    /// Net force and moment about the center of mass.
    pub wrench: Wrench,
    /// One standard deviation of the net force [N].
    pub uncertainty: Vec3,
    /// Where the state lies outside the training domain.
    pub outside: Outside,
}

impl Forces {
    /// Sums the surfaces into the net wrench about a point, body frame [m].
    pub fn sum_about(&mut self, about: &Vec3) {
        self.wrench = self
            .surfaces
            .iter()
            .fold(Wrench::default(), |sum, load| sum + Wrench::from_force_at(load.force, &load.point, about));
    }
}
