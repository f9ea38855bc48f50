//! E9, the hull is drawn down by its own speed.
//!
//! `Fz = -c rho g A_wp s` with the depression `s` of the water beside and under the hull, where it flows faster. A second
//! coefficient trims. Three laws:
//!
//! - open water, `s = v^2 / 2g` (Bernoulli), or `s = v^2 / 2g / sqrt(|1 - Fr_h^2|)` (Tuck), cut at twice the former;
//! - a channel of known width: Bernoulli and continuity in one dimension, `s / d = Fr_h^2 / 2 (((1 - m)(1 - s / d))^-2 - 1)`
//!   with the blockage `m`, which has a solution up to Schijf's limiting speed alone. Above it no steady flow passes the
//!   hull without a bore, and the depression at the limit goes to 0 in proportion until a Froude number that is fitted.
//!
//! All are laws of ships at Fr_h below 0.7: low confidence for us. The shape is that Froude number, 0 for open water, and 1
//! for Tuck instead of Bernoulli.

use super::channel_blockage::blockage;
use super::input::{Input, Part};
use super::library::Shape;
use crate::frame::{GRAVITY, Vec3};
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let (state, immersion) = (input.condition, input.immersion);
    let froude2 = state.velocity.norm_squared() / (GRAVITY * immersion.depth.max(1e-3));
    let head = 0.5 * froude2;
    let relative = if shape[0] > 0.0 {
        blockage(input).map_or(0.0, |blockage| in_channel(froude2.sqrt(), blockage, shape[0]))
    } else if shape[1] > 0.5 {
        head * (1.0 / (1.0 - froude2).abs().max(1e-9).sqrt()).min(2.0)
    } else {
        head
    };
    let depression = relative * immersion.depth.max(1e-3);
    let load = state.density * GRAVITY * depression * immersion.waterplane_area;
    let down = state.up.into_inner() * -load;
    emit(0, Part::Hull, input.at(down, &immersion.waterplane_center));
    let trim = Vec3::y() * (load * input.body.length * state.velocity.x.signum());
    emit(1, Part::Hull, Wrench { force: Vec3::zeros(), moment: trim });
}

/// Depression over depth in a channel [-].
fn in_channel(froude: f64, blockage: f64, gone_at: f64) -> f64 {
    let limit = limiting_froude(blockage);
    if froude <= limit {
        return depression(froude, blockage);
    }
    let left = (gone_at - froude) / (gone_at - limit).max(1e-3);
    depression(limit, blockage) * left.clamp(0.0, 1.0)
}

/// Schijf's limit: the flow beside the hull is as fast as its own waves, `F = (1 - m) (2/3 (1 + F^2 / 2))^1.5`.
fn limiting_froude(blockage: f64) -> f64 {
    let free = 1.0 - blockage;
    let mut froude = free;
    for _ in 0..12 {
        // Newton; the right side is convex and the root below 1
        let inner = 2.0 / 3.0 * (1.0 + 0.5 * froude * froude);
        let value = free * inner * inner.sqrt() - froude;
        let slope = free * inner.sqrt() * froude - 1.0;
        froude -= value / slope.min(-1e-3);
    }
    froude.clamp(0.0, 1.0)
}

/// Smallest root of the energy equation, up to the critical depth `2/3 (1 + F^2 / 2)`.
fn depression(froude: f64, blockage: f64) -> f64 {
    let head = 0.5 * froude * froude;
    let most = (1.0 - 2.0 / 3.0 * (1.0 + head)).max(0.0);
    let free = 1.0 - blockage;
    let mut s = 0.0;
    for _ in 0..12 {
        // Newton from below: the left side is concave, so that no step goes beyond the root
        let depth: f64 = 1.0 - s;
        let faster = 1.0 / (free * depth).powi(2);
        let value = s - head * (faster - 1.0);
        let slope = 1.0 - 2.0 * head * faster / depth;
        s = (s - value / slope.max(1e-3)).clamp(0.0, most);
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_s_depression_keeps_energy_up_to_the_limit_and_ends_with_the_fade() {
        // by hand for m = 0.267: F = 0.733 (2/3 (1 + 0.4668^2 / 2))^1.5 = 0.4668
        let limit = limiting_froude(0.267);
        assert!((limit - 0.4668).abs() < 2e-3, "{limit}");
        // the critical depth is two thirds of the energy
        let critical = 1.0 - 2.0 / 3.0 * (1.0 + 0.5 * limit * limit);
        assert!((depression(limit, 0.267) - critical).abs() < 1e-2, "{critical}");
        for froude in [0.1, 0.2, 0.3, 0.4] {
            let s = depression(froude, 0.267);
            let energy = 0.5 * froude * froude / (0.733 * (1.0 - s)).powi(2) + 1.0 - s;
            assert!((energy - 1.0 - 0.5 * froude * froude).abs() < 1e-9, "{froude} {s}");
        }
        assert!(depression(0.3, 0.0).abs() < 1e-12, "no walls, no channel");
        assert_eq!(in_channel(0.9, 0.267, 0.8), 0.0);
        let half = 0.5 * (limit + 0.8);
        assert!((in_channel(half, 0.267, 0.8) / in_channel(limit, 0.267, 0.8) - 0.5).abs() < 1e-6);
    }
}
