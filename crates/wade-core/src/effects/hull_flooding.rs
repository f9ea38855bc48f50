//! Water runs into the hull, and the buoyancy of what it fills is lost.
//!
//! `W = -phi rho g V h_in / h_out` upwards: a share `phi` of the displaced volume fills to the level `h_in`, which follows
//! the level outside through an orifice, `dh_in/dt = r sign(h_out - h_in) sqrt(2 g |h_out - h_in|)` (Torricelli), with
//! `r = C_d A_opening / A_floor`. The hull starts dry. The second coefficient is the arm along x of what is lost, times
//! the share. With a constant level outside the root of the difference falls linearly, which the step uses.

use super::input::{Input, Memory, Part};
use super::law::{Law, Numbers, ShapeFault, amount, unused};
use super::spec::{Coefficient, EffectSpec, Parameter, Quantity};
use crate::frame::{GRAVITY, Vec3};
use crate::wrench::Wrench;

/// Level inside after `dt` [s] [m], for levels inside and outside [m] and the ratio of opening to floor [-].
pub fn level_after(inner: f64, outer: f64, ratio: f64, dt: f64) -> f64 {
    let root = (outer - inner).abs().sqrt();
    let left = (root - ratio * (0.5 * GRAVITY).sqrt() * dt).max(0.0);
    outer - (outer - inner).signum() * left * left
}

/// Flooding at a rate that its opening sets.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HullFlooding {
    /// `C_d A_opening / A_floor` [-].
    pub opening_ratio: f64,
}

impl Law for HullFlooding {
    const SPEC: EffectSpec = EffectSpec {
        name: "hull_flooding",
        summary: "water enters the hull",
        equation: "W = -phi rho g V h_in / h_out upwards, dh_in/dt = r sign(h_out - h_in) sqrt(2 g |h_out - h_in|)",
        corrects: "pressure of still water: the volume displaced",
        total: "down, by at most the buoyancy",
        coefficients: &[
            Coefficient::new("flooded_share", "1", 0.0, 1.0),
            Coefficient::new("arm_x", "m", -2.0, 2.0),
        ],
        parameters: &[Parameter { name: "opening_ratio", unit: "1" }],
        inputs: &[Quantity::Session],
        needs_its_first: true,
        has_memory: true,
        not_excited: "no trial is in the water for long enough to fill the hull",
        experiment: "stand still in the deepest water for two minutes from the moment of entry, then empty the hull",
        ..EffectSpec::COMMON
    };

    fn from_numbers(numbers: &Numbers) -> Result<Self, ShapeFault> {
        unused(numbers, 1)?;
        Ok(Self { opening_ratio: amount(numbers, 0)? })
    }

    fn to_numbers(&self) -> Numbers {
        [self.opening_ratio, 0.0, 0.0]
    }

    fn advance(&self, memory: &mut Memory, input: &Input, dt: f64) {
        if dt > 0.0 {
            memory.inner_level =
                level_after(memory.inner_level, input.immersion.depth, self.opening_ratio, dt);
        }
    }

    fn basis(&self, memory: &Memory, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
        let immersion = input.immersion;
        if immersion.depth <= 1e-6 {
            return;
        }
        let share = (memory.inner_level / immersion.depth).min(1.0);
        // the water inside takes its share of the lift
        let weight = input.buoyancy() * -share;
        emit(0, Part::Hull, weight);
        emit(1, Part::Hull, Wrench { force: Vec3::zeros(), moment: Vec3::x().cross(&weight.force) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tank_fills_in_torricelli_s_time_and_stays_full() {
        // from empty to full in sqrt(h) / (r sqrt(g / 2)) seconds
        let (outer, ratio) = (0.2_f64, 0.01);
        let time = outer.sqrt() / (ratio * (0.5 * GRAVITY).sqrt());
        let half = level_after(0.0, outer, ratio, 0.5 * time);
        assert!((half - 0.75 * outer).abs() < 1e-12, "three quarters at half the time: {half}");
        let mut level = 0.0;
        for _ in 0..1000 {
            level = level_after(level, outer, ratio, 0.001 * time);
        }
        assert!((level - outer).abs() < 1e-6);
        assert_eq!(level_after(level, outer, ratio, 1e6), outer);
        assert!(level_after(outer, 0.0, ratio, 0.1 * time) < outer, "it runs out again");
    }
}
