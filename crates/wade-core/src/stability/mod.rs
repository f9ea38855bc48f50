//! Whether a vehicle that stands in moving water floats, slides, topples or can no longer be steered.
//!
//! The vehicle is rigid and in balance on a plane bed that is the xy plane of its body frame. With `H` the part of water's force and
//! weight along the bed, `N` what is left of the weight across it and `mu` the friction of its wheels on the bed:
//! - it floats where `N < 0`;
//! - it slides where `|H| > mu N`, and where it floats;
//! - it topples where it stands and the line of the sum of all forces leaves the area between its feet, whether or not the wheels
//!   have the grip to trip it: a kerb gives it;
//! - it can be steered where it stands, each axle bears weight, and neither needs more than its own grip, `|F_i| <= mu N_i`, with the
//!   side forces those that hold force and yaw moment, and the force along the body's x shared as still weight is. What can be steered
//!   does not slide.
//!
//! Criteria and friction: Smith, Modra and Felder (2019), full-scale tests of a Yaris and a Patrol, J. Flood Risk Management 12, and
//! the 0.32 to 0.90 of tires on wet roads that flume studies of flooded cars state.

mod chance;
mod footing;

pub use footing::{Foot, Footing};

use nalgebra::{UnitVector3, Vector2};

use crate::forces::Forces;
use crate::frame::{GRAVITY, Vec3};
use crate::vehicle::Vehicle;
use chance::{DRAWS, Draw, below};
use footing::Axles;

/// Friction of tires on a wet road, each value from the one to the other as likely [-].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// Least.
    pub min: f64,
    /// Greatest.
    pub max: f64,
}

impl Friction {
    /// What is published for tires on wet roads.
    pub const PUBLISHED: Self = Self { min: 0.32, max: 0.90 };

    /// Known for certain.
    pub fn of(friction: f64) -> Self {
        Self { min: friction, max: friction }
    }

    fn at(&self, share: f64) -> f64 {
        self.min + (self.max - self.min) * share
    }
}

/// One value a way in which a vehicle loses its hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modes<T> {
    /// It floats.
    pub floats: T,
    /// The water pushes it along.
    pub slides: T,
    /// It tips over an edge of the area between its feet.
    pub topples: T,
    /// It can be steered; none of what has no axles.
    pub steers: Option<T>,
}

/// What is known of how a vehicle stands in one state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stability {
    /// Probabilities, from the stated deviation of each component of the wrench, taken as normal and independent, and the spread of
    /// the friction.
    pub chances: Modes<f64>,
    /// How far it is from the limit with the mean wrench and the least friction: 1 dry on level ground, 0 at the limit, negative
    /// beyond [-]. Of floating `N / W`; of sliding `(mu N - |H|) / (mu W)`; of toppling the least moment that holds it down about an
    /// edge, over that of its weight; of steering the least of both axles, as of sliding.
    pub margins: Modes<f64>,
    /// Friction below which it slides, `|H| / N` [-]; infinite where it floats.
    pub friction_needed: f64,
}

/// A vehicle on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Stance {
    footing: Footing,
    /// Weight [N].
    weight: f64,
    /// Center of mass over the point of the ground-contact plane below the body origin [m].
    center: Vec3,
}

/// What holds of forces along the bed and moments, whatever the normal force.
#[derive(Debug, Clone, Copy)]
struct Push {
    /// Force along the bed [N].
    along: Vector2<f64>,
    /// Moments about the point of the ground-contact plane below the body origin, without that of the normal force, as the offset
    /// of the center of pressure times the normal force [N m].
    shift: Vector2<f64>,
    /// Moment about the body's z, at that point [N m].
    yaw: f64,
}

impl Stance {
    /// Of a vehicle.
    pub fn of(vehicle: &Vehicle) -> Self {
        let center = vehicle.center_of_mass - Vec3::z() * vehicle.z0;
        Self { footing: Footing::of(vehicle), weight: vehicle.mass * GRAVITY, center }
    }

    /// What it stands on.
    pub fn footing(&self) -> &Footing {
        &self.footing
    }

    /// Whether it has axles, and so can be steered.
    pub fn has_axles(&self) -> bool {
        self.footing.axles.is_some()
    }

    /// How it stands with these forces of the water, on a bed that is tilted as the body is: `up` is the world's, in the body frame.
    pub fn stability(&self, forces: &Forces, up: &UnitVector3<f64>, friction: &Friction) -> Stability {
        let (mean, normal) = self.mean(forces, up);
        Stability {
            chances: self.chances(forces, up, friction),
            margins: self.margins(&mean, normal, friction.min),
            friction_needed: if normal > 0.0 { mean.along.norm() / normal } else { f64::INFINITY },
        }
    }

    /// Normal force on each foot with the mean wrench [N], as of equal springs on a rigid bed that can push and not pull; past an edge,
    /// where nothing is in balance, those of the feet on it.
    pub fn normal_forces(&self, forces: &Forces, up: &UnitVector3<f64>) -> Vec<f64> {
        let (mean, normal) = self.mean(forces, up);
        let pressure = mean.shift / normal.max(f64::MIN_POSITIVE) + self.center.xy();
        self.footing.normal_forces(normal, &pressure)
    }

    fn weight(&self, up: &UnitVector3<f64>) -> Vec3 {
        -up.into_inner() * self.weight
    }

    /// The mean push, and the normal force beside it [N].
    fn mean(&self, forces: &Forces, up: &UnitVector3<f64>) -> (Push, f64) {
        let force = forces.wrench.force + self.weight(up);
        (self.push(&force, &forces.wrench.moment), -force.z)
    }

    fn push(&self, force: &Vec3, moment: &Vec3) -> Push {
        let (force_along, arm) = (force.xy(), self.center);
        Push {
            along: force_along,
            shift: Vector2::new(moment.y, -moment.x) + force_along * arm.z,
            yaw: moment.z + arm.xy().perp(&force_along),
        }
    }

    /// Moment that holds the vehicle down about an edge, as `a + b N` [N m].
    fn hold(&self, push: &Push) -> impl Iterator<Item = (f64, f64)> {
        let center = self.center.xy();
        self.footing.edges.iter().map(move |edge| (edge.along.perp(&push.shift), edge.inside(&center)))
    }

    /// Load of each axle as `a + b N` [N], and the force along the bed that it must hold [N].
    fn axle_loads(&self, push: &Push) -> Option<[(f64, f64, f64); 2]> {
        let axles @ Axles { x: [front, rear], y } = self.footing.axles?;
        let (base, center) = (axles.wheelbase(), self.center.x);
        let share = [(center - rear) / base, (front - center) / base];
        let held = -(push.yaw + y * push.along.x);
        let side_front = (held + rear * push.along.y) / base;
        let side = [side_front, -push.along.y - side_front];
        let need = |axle: usize| Vector2::new(share[axle] * push.along.x, side[axle]).norm();
        Some([(push.shift.x / base, share[0], need(0)), (-push.shift.x / base, share[1], need(1))])
    }

    /// Normal forces between which the vehicle does not topple, among those with which it stands.
    fn upright(&self, push: &Push) -> [f64; 2] {
        if self.footing.edges.len() < 3 {
            return [f64::INFINITY; 2];
        }
        enough(self.hold(push).map(|(hold, per_normal)| (hold, per_normal, 0.0)))
    }

    /// Normal forces between which neither axle needs more than its grip.
    fn steered(&self, push: &Push, friction: f64) -> Option<[f64; 2]> {
        let axles = self.axle_loads(push)?.into_iter();
        Some(enough(axles.map(|(load, per_normal, need)| (load, per_normal, need / friction))))
    }

    fn chances(&self, forces: &Forces, up: &UnitVector3<f64>, friction: &Friction) -> Modes<f64> {
        let weight = self.weight(up);
        let (mean, spread) = (forces.wrench, (forces.uncertainty, forces.moment_uncertainty));
        let normal = -(mean.force.z + weight.z);
        // given the others each of these is a limit of the normal force, whose share of the probability is in closed form
        let under = |limit: f64| below(limit, normal, spread.0.z);
        let floats = under(0.0);
        let (mut slides, mut topples, mut steers) = (0.0, 0.0, 0.0);
        for Draw { normals: [x, y, mx, my, mz], share } in &*DRAWS {
            let force = mean.force + weight + spread.0.component_mul(&Vec3::new(*x, *y, 0.0));
            let moment = mean.moment + spread.1.component_mul(&Vec3::new(*mx, *my, *mz));
            let (push, friction) = (self.push(&force, &moment), friction.at(*share));
            slides += under(push.along.norm() / friction);
            let [low, high] = self.upright(&push);
            topples += (under(low) - floats) + (1.0 - under(high));
            steers += self.steered(&push, friction).map_or(0.0, |[low, high]| under(high) - under(low));
        }
        let mean = |sum: f64| (sum / DRAWS.len() as f64).clamp(0.0, 1.0);
        let steers = self.has_axles().then(|| mean(steers));
        Modes { floats, slides: mean(slides), topples: mean(topples), steers }
    }

    fn margins(&self, push: &Push, normal: f64, friction: f64) -> Modes<f64> {
        let over_weight = |load: f64, need: f64, share: f64| {
            (friction * load - need) / (friction * self.weight * share.abs().max(f64::MIN_POSITIVE))
        };
        let hold = |(hold, per_normal): (f64, f64)| {
            (hold + per_normal * normal) / (self.weight * per_normal.abs()).max(f64::MIN_POSITIVE)
        };
        let axle = |(load, per_normal, need): (f64, f64, f64)| {
            over_weight(load + per_normal * normal, need, per_normal)
        };
        let least = |least: f64, margin: f64| least.min(margin);
        let topples = match self.footing.edges.len() {
            0..3 => f64::NEG_INFINITY,
            _ => self.hold(push).map(hold).fold(f64::INFINITY, least),
        };
        Modes {
            floats: normal / self.weight,
            slides: over_weight(normal, push.along.norm(), 1.0),
            topples,
            steers: self.axle_loads(push).map(|axles| axles.map(axle).into_iter().fold(f64::INFINITY, least)),
        }
    }
}

/// Normal forces `N` from zero, from the first to the second, with which every `a + b N` is what is needed or more; empty at infinity.
fn enough(needs: impl Iterator<Item = (f64, f64, f64)>) -> [f64; 2] {
    let mut range = [0.0, f64::INFINITY];
    for (a, b, need) in needs {
        let limit = (need - a) / b;
        match b {
            b if b > 0.0 => range[0] = f64::max(range[0], limit),
            b if b < 0.0 => range[1] = f64::min(range[1], limit),
            _ if a < need => range[0] = f64::INFINITY,
            _ => (),
        }
    }
    [range[0], f64::max(range[1], range[0])]
}
