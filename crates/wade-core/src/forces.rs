//! What a query answers.

use nalgebra::Matrix6;

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
    /// Moment of the load about the point of application [N m]; zero of a model without the physical base.
    pub couple: Vec3,
}

/// What the physical base adds to an answer.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Base {
    /// Added mass and inertia about the center of mass, forces first [kg, kg m, kg m2].
    pub added_mass: Matrix6<f64>,
    /// Linear damping by waves about the center of mass, the wrench being `-B nu` [kg/s, kg m/s, kg m2/s]; zero in a session,
    /// whose memory has it.
    pub damping: Matrix6<f64>,
    /// Height of the still-water plane above the body origin along up [m].
    pub water_level: f64,
    /// Clearance of the ground-contact plane over the bed that was used [m].
    pub bed_clearance: f64,
    /// Share of the motion through the water that is motion over the bed, as used.
    pub bed: f64,
    /// Power that the shafts of the wheels put in [W].
    pub shaft_power: f64,
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
    /// One standard deviation of the net moment about the center of mass [N m].
    pub moment_uncertainty: Vec3,
    /// Where the state lies outside the training domain.
    pub outside: Outside,
    /// What the physical base tells; none of a bundle without one.
    pub base: Option<Base>,
}

impl Forces {
    /// Sums the surfaces into the net wrench about a point, body frame [m].
    pub fn sum_about(&mut self, about: &Vec3) {
        self.wrench = self.surfaces.iter().fold(Wrench::default(), |sum, load| {
            let mut own = Wrench::from_force_at(load.force, &load.point, about);
            own.moment += load.couple;
            sum + own
        });
    }
}
