//! What an effect is told of one instant.

use super::body::Body;
use super::immersion::Immersion;
use crate::condition::Condition;
use crate::frame::{GRAVITY, Vec3, level_axes};
use crate::vehicle::PerWheel;
use crate::wrench::Wrench;

/// Drag of the model that an effect is added to, as coefficients on windward wet areas [-] along x, y, z: effects that
/// change the flow past the hull scale with it.
pub type BaseDrag = Vec3;

/// The speed that a quadratic drag has along each axis. The numbers are those of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DragSpeed {
    /// 0: that of the whole velocity, `|v| v_i`.
    #[default]
    Whole,
    /// 1: that along the axis, `|v_i| v_i` (the cross-flow principle).
    PerAxis,
}

impl DragSpeed {
    /// In the order of their numbers.
    pub(super) const ALL: [Self; 2] = [Self::Whole, Self::PerAxis];
}

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
    /// How much the model's wrench is another in the state that [`super::Shape::elsewhere`] says [N, N m]; none where it was not
    /// asked there, and the law takes what it knows of the model.
    pub elsewhere: Option<Wrench>,
    /// The model's own drag.
    pub base_drag: BaseDrag,
    /// Heading: angle from the world's x to the body's x [rad].
    pub yaw: f64,
    /// Rate at which the water rises at the body origin [m/s].
    pub wetting_rate: f64,
    /// Width of the channel [m].
    pub channel_width: Option<f64>,
    /// Speed of each wheel, in the order of the vehicle's wheels [rad/s]; none of one that is not known.
    pub wheel_speeds: PerWheel<Option<f64>>,
}

#[cfg(test)]
impl<'a> Input<'a> {
    /// A motion in open water of a vehicle of whose wheels, heading and model nothing is known.
    pub(super) fn of_motion(body: &'a Body, condition: &'a Condition, immersion: &'a Immersion) -> Self {
        Self {
            body,
            condition,
            immersion,
            predicted: Wrench::default(),
            elsewhere: None,
            base_drag: Vec3::zeros(),
            yaw: 0.0,
            wetting_rate: 0.0,
            channel_width: None,
            wheel_speeds: PerWheel::none(),
        }
    }
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

    /// The load of still water on the wet hull, `rho g V` up at the center of buoyancy (Archimedes).
    pub(super) fn buoyancy(&self) -> Wrench {
        let weight = self.condition.density * GRAVITY * self.immersion.volume;
        self.at(self.condition.up.into_inner() * weight, &self.immersion.center_of_buoyancy)
    }

    /// The model's own force across gravity [N], which is its drag.
    pub(super) fn predicted_drag_force(&self) -> Vec3 {
        let (force, up) = (self.predicted.force, self.condition.up.into_inner());
        force - up * force.dot(&up)
    }

    /// The model's own drag with its moment, which is what the model has beyond still water.
    pub(super) fn predicted_drag(&self) -> Wrench {
        let moment = self.predicted.moment - self.buoyancy().moment;
        Wrench { force: self.predicted_drag_force(), moment }
    }

    /// Coefficients on windward wet areas with which the hull carries the model's own drag in this state [-]: those stated,
    /// `K`, times `r = 1 + (D - P s) P s / ((P s)^2 + (P s0)^2)` along x and y, `D` the model's drag, `P s` what `K` makes of
    /// it, and `s = |v| v` or `|v_i| v_i`. A model has its own law of depth, tilt and
    /// speed; where there is hardly a flow it says nothing of one, and `K` stands.
    pub(super) fn own_drag(&self, speed: DragSpeed) -> BaseDrag {
        /// Square of the speed below which `K` counts more than the model's drag [m2/s2].
        const SLOW: f64 = 0.09;
        const MOST: f64 = 3.0;
        let velocity = self.condition.velocity;
        let mut area = Vec3::zeros();
        for (panel, wet) in self.body.panels.iter().zip(&self.immersion.panels) {
            area += panel.windward(&velocity) * wet.fraction;
        }
        let drag = self.predicted_drag_force();
        Vec3::from_fn(|axis, _| {
            let k = self.base_drag[axis];
            let per_square = self.half_density() * k * area[axis];
            if axis == 2 || per_square <= 0.0 {
                return k;
            }
            let speed = match speed {
                DragSpeed::PerAxis => velocity[axis].abs(),
                DragSpeed::Whole => velocity.norm(),
            };
            let square = speed * velocity[axis];
            let off = -drag[axis] / per_square - square;
            k * (1.0 + off * square / (square * square + SLOW * SLOW)).clamp(0.0, MOST)
        })
    }

    /// Half the density [kg/m3].
    pub(super) fn half_density(&self) -> f64 {
        0.5 * self.condition.density
    }

    /// World vector of a horizontal world direction, in the body frame.
    pub(super) fn body_from_world(&self, east: f64, north: f64) -> Vec3 {
        let [ahead, left, _] = level_axes(&self.condition.up);
        let (sine, cosine) = self.yaw.sin_cos();
        ahead * (cosine * east + sine * north) + left * (cosine * north - sine * east)
    }
}

/// A state in which the model is to be asked besides that of an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elsewhere {
    /// The state.
    pub condition: Condition,
    /// The wheels stand still there.
    pub wheels_at_rest: bool,
    /// What waves remember of the motion until now is part of the change.
    pub with_waves: bool,
}

impl Elsewhere {
    /// A state alone in which the wheels turn as they do.
    pub fn of(condition: Condition) -> Self {
        Self { condition, wheels_at_rest: false, with_waves: false }
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
    /// Rate of the velocity through the water at the state before [m/s2]; none before the first.
    pub motion: Option<Vec3>,
}
