//! What an effect is told of one instant.

use super::body::Body;
use super::immersion::Immersion;
use crate::condition::Condition;
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// Drag of the model that an effect is added to, as coefficients on windward wet areas [-] along x, y, z: effects that
/// change the flow past the hull scale with it.
pub type BaseDrag = Vec3;

/// One instant; all vectors in the body frame.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// The hull.
    pub body: &'a Body,
    /// The state.
    pub condition: &'a Condition,
    /// Where the water reaches.
    pub immersion: &'a Immersion,
    /// The model's own wrench about the center of mass [N, N m].
    pub predicted: Wrench,
    /// The model's own drag.
    pub base_drag: BaseDrag,
    /// Heading: angle from the world's x to the body's x [rad].
    pub yaw: f64,
    /// Rate at which the water rises at the body origin [m/s].
    pub wetting_rate: f64,
    /// Width of the channel [m].
    pub channel_width: Option<f64>,
    /// Wheel speeds front left, front right, rear left, rear right [rad/s].
    pub wheel_speeds: [Option<f64>; 4],
}

impl Input<'_> {
    /// Velocity of the hull through the water at a point [m/s]: `v + omega x r`.
    pub fn local_velocity(&self, point: &Vec3) -> Vec3 {
        self.condition.velocity + self.condition.angular_velocity.cross(point)
    }

    /// The load of a force at a point, about the center of mass.
    pub(super) fn at(&self, force: Vec3, point: &Vec3) -> Wrench {
        Wrench::from_force_at(force, point, &self.body.center_of_mass)
    }

    /// The model's own force across gravity [N], which is its drag.
    pub(super) fn predicted_drag(&self) -> Vec3 {
        let (force, up) = (self.predicted.force, self.condition.up.into_inner());
        force - up * force.dot(&up)
    }

    /// Half the density [kg/m3].
    pub(super) fn half_density(&self) -> f64 {
        0.5 * self.condition.density
    }

    /// World vector of a horizontal world direction, in the body frame.
    pub(super) fn body_from_world(&self, east: f64, north: f64) -> Vec3 {
        let up = self.condition.up.into_inner();
        // the body's x in the horizontal plane points along the heading
        let ahead = Vec3::x() - up * up.x;
        let ahead = ahead.try_normalize(1e-9).unwrap_or_else(Vec3::x);
        let left = up.cross(&ahead);
        let (sine, cosine) = self.yaw.sin_cos();
        ahead * (cosine * east + sine * north) + left * (cosine * north - sine * east)
    }
}

/// The part of a hull that carries a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// One panel, by number.
    Panel(usize),
    /// The wet hull as a whole.
    Hull,
}

/// State of an effect with memory; starts dry and at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Memory {
    /// Level of the water inside the hull above the ground-contact plane [m].
    pub inner_level: f64,
    /// In-phase part of the memory.
    pub real: Vec3,
    /// Out-of-phase part of the memory.
    pub imaginary: Vec3,
}
