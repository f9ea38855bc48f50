//! Rotating wheels push water backward.
//!
//! Two laws. `F = 1/2 rho C A |omega r| (omega r - v_x)` forwards on each wheel with the wet part `A` of its disc: momentum of
//! the water that is carried along, in proportion to the slip. Or lugs, plates across the rim: one at the angle `phi` from
//! the foot of the wheel meets the water with `u = omega r - v_x cos(phi)`, so that
//! `F = 1/2 rho C r^2 int |u| u cos(phi) dphi` over the wet arc, which is not zero where the wheel rolls. C is of the order
//! of 1. The thrust acts at the hub; a second coefficient has the torque of the lugs, `-1/2 rho C r^3 int |u| u dphi`.

use super::input::{Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, form, unused};
use super::spec::{Coefficient, EffectSpec, Quantity};
use crate::frame::Vec3;
use crate::wrench::Wrench;

/// Points of the wet arc of a wheel, from its foot to the surface; both sides are alike.
const POINTS: usize = 6;

/// What of a wheel pushes the water. The numbers are those of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rim {
    /// 0: the disc, which carries water along.
    #[default]
    Disc,
    /// 1: lugs, plates across the rim.
    Lugs,
}

/// Thrust of wheels with the law that it follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct WheelPaddleThrust {
    /// What pushes the water.
    pub rim: Rim,
}

impl Law for WheelPaddleThrust {
    const SPEC: EffectSpec = EffectSpec {
        name: "wheel_paddle_thrust",
        summary: "rotating wheels push water",
        equation: "F = 1/2 rho C pi r^2 wet |omega r| (omega r - v_x) on each wheel, or F = 1/2 rho C r^2 int |u| u cos(phi) dphi over its wet lugs, u = omega r - v_x cos(phi); torque -1/2 rho C_t r^3 of the same without the cosine",
        corrects: "rim velocity and lugs of the wheels",
        total: "gives at most the power of the shafts",
        coefficients: &[
            Coefficient::published("thrust", 0.0, 6.0, [0.1, 2.0]),
            Coefficient::new("torque", "1", -12.0, 12.0),
        ],
        inputs: &[Quantity::Velocity, Quantity::AngularVelocity, Quantity::WheelSpeeds],
        needs_its_first: true,
        experiment: "let the wheels turn at two speeds while the vehicle is held, at one depth",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        Ok(Self { rim: form(numbers, 0, &[Rim::Disc, Rim::Lugs])? })
    }

    fn to_numbers(&self) -> Numbers {
        [f64::from(self.rim as u8), 0.0, 0.0]
    }

    fn basis(&self, _memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let radius = input.body.wheel_radius;
        let scale = input.half_density() * radius * radius;
        for (index, panel) in input.body.panels.iter().enumerate() {
            let Some(speed) = panel.wheel.and_then(|wheel| *input.wheel_speeds.get(wheel)?) else { continue };
            let wet = input.immersion.panels[index].fraction;
            if wet <= 0.0 {
                continue;
            }
            let rim = speed * radius;
            let through = input.local_velocity(&panel.centroid).x;
            let (push, turn) = match self.rim {
                Rim::Lugs => lugs(rim, through, wet),
                Rim::Disc => {
                    let push = std::f64::consts::PI * wet * rim.abs() * (rim - through);
                    (push, push)
                }
            };
            emit(0, Part::Panel(index), input.at(Vec3::x() * (scale * push), &panel.centroid));
            let torque = Vec3::y() * (-scale * radius * turn);
            emit(1, Part::Panel(index), Wrench { force: Vec3::zeros(), moment: torque });
        }
    }
}

/// `int |u| u cos(phi) dphi` and `int |u| u dphi` over the wet arc, by midpoints.
fn lugs(rim: f64, through: f64, wet: f64) -> (f64, f64) {
    let half = (1.0 - 2.0 * wet).clamp(-1.0, 1.0).acos();
    let step = half / POINTS as f64;
    let (mut push, mut turn) = (0.0, 0.0);
    for point in 0..POINTS {
        let cosine = ((point as f64 + 0.5) * step).cos();
        let u = rim - through * cosine;
        let pressure = 2.0 * step * u * u.abs();
        push += pressure * cosine;
        turn += pressure;
    }
    (push, turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lugs_push_where_a_wheel_spins_and_a_little_where_it_rolls() {
        // half a wheel wet, at rest: 2 (omega r)^2, and pi (omega r)^2 about the hub
        let (push, turn) = lugs(1.5, 0.0, 0.5);
        assert!(
            (push / 4.5 - 1.0).abs() < 0.01 && (turn / (2.25 * std::f64::consts::PI) - 1.0).abs() < 1e-12
        );
        // rolling: int (1 - cos)^2 cos dphi = 2 - pi + 4/3 over half a turn
        let (push, _) = lugs(1.0, 1.0, 0.5);
        assert!((push / 0.1917 - 1.0).abs() < 0.03, "{push}");
    }
}
