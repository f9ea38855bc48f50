//! Added mass: the inertia of the water that moves with the hull.
//!
//! `W = -(M_A nu_dot + C_A(nu) nu)` about the center of buoyancy, with a diagonal `M_A` that scales with the water
//! displaced: `k rho V` along the axes and `k rho V (a^2 + b^2) / 12` about them, the inertia of the displaced box. A flat
//! bottom near the surface moves as much water however deep it is, half of a plate's `rho pi a^2` a meter (Newman):
//! [`HeaveMass::Plate`] has `rho pi b A_wp / 8` in the place of `rho V` for heave, roll and pitch.
//! `nu` is the velocity through the water and `nu_dot` its rate in body axes, `a - omega x nu` in a steady current; the cross
//! terms are Kirchhoff's (Newman, Marine Hydrodynamics, section 4.14).
//!
//! Deep-water values of `k` for bodies as long as high lie between 0.05 along a slender body and 1.5 across a flat one;
//! shallow water raises sway more than heave (Zhou, Lo, Tan, J. Eng. Mech. 2005), by a factor of a few. Valid while the
//! waves made by the acceleration may be neglected; those are `wave_memory`.

use nalgebra::{Matrix3, Matrix6};

use super::body::Body;
use super::immersion::Immersion;
use super::input::{Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, form, unused};
use super::spec::{Coefficient, EffectSpec, Quantity, Rate};
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// What scales the added mass of heave, roll and pitch. The numbers are those of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HeaveMass {
    /// 0: the water displaced.
    #[default]
    Displaced,
    /// 1: half of what moves with a plate as wide and long as the waterplane.
    Plate,
}

/// Added mass with a form for heave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AddedMass {
    /// What scales heave, roll and pitch.
    pub heave: HeaveMass,
}

impl AddedMass {
    /// Added mass and inertia of the six coefficients at 1 [kg, kg m2].
    fn unit(&self, body: &Body, immersion: &Immersion, density: f64) -> [f64; 6] {
        let mass = density * immersion.volume;
        // of the bottom, as half a plate
        let plate = density * std::f64::consts::PI / 8.0 * body.width * immersion.waterplane_area;
        let heaved = match self.heave {
            HeaveMass::Displaced => mass,
            HeaveMass::Plate => plate,
        };
        let [l, w, h] = [body.length, body.width, immersion.depth].map(|side| side * side / 12.0);
        [mass, mass, heaved, heaved * (w + h), heaved * (l + h), mass * (l + w)]
    }

    /// The 6x6 matrix about the center of mass [kg, kg m, kg m2], forces first: `W = -M nu_dot` for a body at rest, which an
    /// implicit integration takes instead of the explicit force.
    pub(super) fn matrix(
        &self,
        body: &Body,
        immersion: &Immersion,
        density: f64,
        k: &[f64; 6],
    ) -> Matrix6<f64> {
        let unit = self.unit(body, immersion, density);
        let linear = Matrix3::from_diagonal(&Vec3::from_fn(|i, _| k[i] * unit[i]));
        let angular = Matrix3::from_diagonal(&Vec3::from_fn(|i, _| k[i + 3] * unit[i + 3]));
        let arm = (immersion.center_of_buoyancy - body.center_of_mass).cross_matrix();
        let mut matrix = Matrix6::zeros();
        // velocity at the center of buoyancy is v - arm x omega
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&linear);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-linear * arm));
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&(arm * linear));
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&(angular - arm * linear * arm));
        matrix
    }
}

impl Law for AddedMass {
    const SPEC: EffectSpec = EffectSpec {
        name: "added_mass",
        summary: "inertia of the water that moves with the hull",
        equation: "W = -(M_A nu_dot + C_A(nu) nu), M_A = rho V diag(surge, sway, heave, roll (b2+d2)/12, pitch (l2+d2)/12, yaw (l2+b2)/12), or heave, roll, pitch with rho pi b A_wp / 8 for rho V",
        corrects: "added mass",
        total: "positive, in every direction",
        // sway and heave in shallow water reach a few times the deep-water value (Zhou, Lo, Tan 2005)
        coefficients: &[
            Coefficient::published("surge", 0.0, 6.0, [0.05, 1.5]),
            Coefficient::published("sway", 0.0, 8.0, [0.2, 2.5]),
            Coefficient::published("heave", 0.0, 10.0, [0.3, 3.0]),
            Coefficient::published("roll", 0.0, 10.0, [0.02, 2.0]),
            Coefficient::published("pitch", 0.0, 10.0, [0.05, 2.0]),
            Coefficient::published("yaw", 0.0, 10.0, [0.05, 2.0]),
        ],
        reference: "over the displaced water's",
        inputs: &[
            Quantity::Velocity,
            Quantity::AngularVelocity,
            Quantity::Acceleration,
            Quantity::AngularAcceleration,
        ],
        rates: &[Rate::Acceleration, Rate::AngularAcceleration],
        not_excited: "no trial accelerates beyond the noise of its accelerations",
        experiment: "speed up and brake hard several times through one speed at the deepest level, and hold that speed for 10 s",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        Ok(Self { heave: form(numbers, 0, &[HeaveMass::Displaced, HeaveMass::Plate])? })
    }

    fn to_numbers(&self) -> Numbers {
        [f64::from(self.heave as u8), 0.0, 0.0]
    }

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let state = input.condition;
        let (v, omega) = (state.velocity, state.angular_velocity);
        let center = input.immersion.center_of_buoyancy;
        let u = v + omega.cross(&center);
        let rate = state.acceleration - omega.cross(&v) + state.angular_acceleration.cross(&center);
        let unit = self.unit(input.body, input.immersion, state.density);
        for axis in 0..3 {
            let e = Vec3::ith(axis, 1.0);
            let momentum = e * (unit[axis] * u[axis]);
            let force = -(e * (unit[axis] * rate[axis]) + omega.cross(&momentum));
            let mut load = input.at(force, &center);
            load.moment -= u.cross(&momentum);
            emit(axis, Part::Hull, load);
            let spin = e * (unit[axis + 3] * omega[axis]);
            let moment = -(e * (unit[axis + 3] * state.angular_acceleration[axis]) + omega.cross(&spin));
            emit(axis + 3, Part::Hull, Wrench { force: Vec3::zeros(), moment });
        }
    }
}
