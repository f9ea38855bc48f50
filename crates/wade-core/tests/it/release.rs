//! A body let go in still water, integrated with the matrix of added mass.

use nalgebra::{Matrix6, UnitQuaternion, UnitVector3, Vector6};
use wade_core::condition::Condition;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::physics::{Base, BaseLoads, Memory, Motion, Physics};
use wade_core::vehicle::{MAX_SURFACES, Vehicle};
use wade_core::wrench::Wrench;

use crate::random::Random;

/// Indices at which a series turns back.
pub fn turns(series: &[f64]) -> impl Iterator<Item = usize> {
    (1..series.len() - 1).filter(|&i| (series[i] - series[i - 1]) * (series[i + 1] - series[i]) < 0.0)
}

/// A body in water whose surface is the world's z = 0.
pub struct Release<'a> {
    pub vehicle: &'a Vehicle,
    /// Height of the body origin [m].
    pub height: f64,
    /// Body to world.
    pub attitude: UnitQuaternion<f64>,
    /// Velocities of body origin and body, body frame.
    pub nu: Vector6<f64>,
    /// Where waves are remembered.
    pub memory: Option<Memory>,
    /// Clearance over the bed; of a flat bed at a depth where it is given as one.
    pub bed: Option<f64>,
    pub density: f64,
    /// Velocity of the water over ground, world frame.
    pub current: Vec3,
    rigid: Matrix6<f64>,
}

impl<'a> Release<'a> {
    /// At rest, level, with the surface `depth` above the ground-contact plane.
    pub fn at(vehicle: &'a Vehicle, depth: f64) -> Self {
        let arm = vehicle.center_of_mass.cross_matrix();
        let mut rigid = Matrix6::identity() * vehicle.mass;
        rigid.fixed_view_mut::<3, 3>(0, 3).copy_from(&(arm * -vehicle.mass));
        rigid.fixed_view_mut::<3, 3>(3, 0).copy_from(&(arm * vehicle.mass));
        let inertia = vehicle.inertia - arm * arm * vehicle.mass;
        rigid.fixed_view_mut::<3, 3>(3, 3).copy_from(&inertia);
        Self {
            vehicle,
            height: -(vehicle.z0 + depth),
            attitude: UnitQuaternion::identity(),
            nu: Vector6::zeros(),
            memory: None,
            bed: None,
            density: 1000.0,
            current: Vec3::zeros(),
            rigid,
        }
    }

    /// Anywhere near the surface, with any motion.
    pub fn random(vehicle: &'a Vehicle, random: &mut Random) -> Self {
        let d = vehicle.dimensions;
        let size = Vec3::new(d.length, d.width, d.height).norm();
        let v = random.direction() * (3.0 * random.unit());
        let omega = random.direction() * (2.0 * random.unit());
        Self {
            height: size * (random.unit() - 0.5),
            attitude: UnitQuaternion::from_scaled_axis(random.direction() * (3.0 * random.unit())),
            nu: Vector6::new(v.x, v.y, v.z, omega.x, omega.y, omega.z),
            memory: (random.unit() < 0.5).then(Memory::default),
            ..Self::at(vehicle, 0.0)
        }
    }

    pub fn condition(&self) -> Condition {
        let [v, omega] = self.velocities();
        Condition {
            velocity: v - self.attitude.inverse() * self.current,
            ground_velocity: v,
            angular_velocity: omega,
            up: UnitVector3::new_normalize(self.attitude.inverse() * Vec3::z()),
            water_level: Some(-self.height),
            bed_clearance: self.bed.map(|bed| (self.height + self.vehicle.z0 - bed).max(0.0)),
            density: self.density,
            ..Condition::level(v, 0.0)
        }
    }

    fn velocities(&self) -> [Vec3; 2] {
        [self.nu.fixed_rows::<3>(0).into_owned(), self.nu.fixed_rows::<3>(3).into_owned()]
    }

    fn loads(&mut self, base: &Base, dt: f64, out: &mut BaseLoads) -> Wrench {
        let motion = Motion {
            wheel_speeds: &[f64::NAN; MAX_SURFACES],
            time_step: dt,
            implicit_added_mass: true,
            physics: Physics::Full,
            waters: None,
        };
        let state = self.condition();
        base.evaluate(&state, &motion, self.memory.as_mut(), out);
        out.surfaces.iter().fold(out.hull, |sum, s| sum + s.hydrostatic + s.drag)
    }

    /// Moves on by a step; external is a load about the body origin beside water and weight.
    pub fn step_with(&mut self, base: &Base, dt: f64, external: &Vector6<f64>, out: &mut BaseLoads) {
        let load = self.loads(base, dt, out);
        let up = self.attitude.inverse() * Vec3::z();
        let weight = up * (-self.vehicle.mass * GRAVITY);
        let torque = self.vehicle.center_of_mass.cross(&weight);
        let [v, omega] = self.velocities();
        let momentum = self.rigid * self.nu;
        let (p, h) = (momentum.fixed_rows::<3>(0).into_owned(), momentum.fixed_rows::<3>(3).into_owned());
        let force = load.force + weight - omega.cross(&p);
        let moment = load.moment + torque - omega.cross(&h) - v.cross(&p);
        let right = Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z) + external;
        let rate = (self.rigid + out.added_mass).lu().solve(&right).expect("positive");
        self.nu += rate * dt;
        let [v, omega] = self.velocities();
        self.height += (self.attitude * v).z * dt;
        self.attitude *= UnitQuaternion::from_scaled_axis(omega * dt);
    }

    pub fn step(&mut self, base: &Base, dt: f64, out: &mut BaseLoads) {
        self.step_with(base, dt, &Vector6::zeros(), out);
    }

    /// Kinetic energy of body and added mass, potential energy of body and displaced water, energy of the memory [J].
    pub fn energy(&mut self, base: &Base, out: &mut BaseLoads) -> f64 {
        let memory = self.memory;
        // a session in which no time has passed answers as a state alone
        self.loads(base, f64::MIN_POSITIVE, out);
        self.memory = memory;
        let kinetic = 0.5 * self.nu.dot(&((self.rigid + out.added_mass) * self.nu));
        let plane = self.condition().water_plane(self.vehicle.z0);
        let water = hydrostatics(&self.vehicle.hull.mesh, &plane, self.density, &Vec3::zeros());
        let lifted = water.center_of_buoyancy.map_or(0.0, |center| {
            self.density * GRAVITY * water.displaced_volume * plane.depth_below(&center)
        });
        let high = self.height + (self.attitude * self.vehicle.center_of_mass).z;
        let stored = memory.map_or(0.0, |m| m.energy(&base.radiation().poles) * self.density);
        kinetic + self.vehicle.mass * GRAVITY * high + lifted + stored
    }
}
