//! One-dimensional flow past a hull in a channel of known width, which draws the hull down and speeds the flow past it up.
//!
//! Continuity and Bernoulli: `s / d = Fr_h^2 / 2 (((1 - m)(1 - s / d))^-2 - 1)` with the blockage `m`, the share of the section
//! that the hull takes, and the depression `s` of the water beside it. There is a solution up to Schijf's limiting speed
//! alone. Above it no steady flow passes the hull without a bore, and the depression at the limit goes to 0 in proportion
//! until a Froude number that is fitted.

use super::input::Input;
use crate::frame::GRAVITY;

/// Shallowest water that there is a flow in [m].
pub(super) const LEAST_DEPTH: f64 = 1e-3;
/// Most of the section that a hull may take [-].
pub(super) const MOST: f64 = 0.8;

/// `Fr_h^2`, squared speed through the water over that of long waves [-].
pub(super) fn froude_squared(input: &Input) -> f64 {
    input.condition.velocity.norm_squared() / (GRAVITY * input.immersion.depth.max(LEAST_DEPTH))
}

/// Depression over depth [-], gone at a Froude number; none without walls or water.
pub(super) fn depression(input: &Input, gone_at: f64) -> Option<f64> {
    Some(faded(froude_squared(input).sqrt(), blockage(input)?, gone_at))
}

/// How much more dynamic pressure the flow beside the hull has than the hull's speed means, as a share, by continuity:
/// `((1 - m)(1 - s / d))^-2 - 1`. None without walls or water.
pub(super) fn excess(input: &Input, gone_at: f64) -> Option<f64> {
    let blockage = blockage(input)?;
    let depression = faded(froude_squared(input).sqrt(), blockage, gone_at);
    Some(((1.0 - blockage) * (1.0 - depression)).powi(-2) - 1.0)
}

/// Width of the channel [m]; none without walls or water.
pub(super) fn width(input: &Input) -> Option<f64> {
    input.channel_width.filter(|_| input.immersion.depth > LEAST_DEPTH)
}

/// Share of the channel's section that the hull's mean section takes [-], at most `b / w` since no hull stands deeper in the
/// water than the water is; none without walls or water.
fn blockage(input: &Input) -> Option<f64> {
    let (width, immersion) = (width(input)?, input.immersion);
    let section = immersion.volume / input.body.length;
    Some((section / (width * immersion.depth)).min(input.body.width / width).min(MOST))
}

/// Depression over depth [-].
fn faded(froude: f64, blockage: f64, gone_at: f64) -> f64 {
    let limit = limiting_froude(blockage);
    if froude <= limit {
        return subcritical(froude, blockage);
    }
    let left = (gone_at - froude) / (gone_at - limit).max(1e-3);
    subcritical(limit, blockage) * left.clamp(0.0, 1.0)
}

/// True between Schijf's two limits: no steady flow passes a hull of this blockage without a bore.
pub fn is_choked(froude: f64, blockage: f64) -> bool {
    to_the_limit(froude, blockage) < 0.0
}

/// 0 at Schijf's limits, where the flow beside the hull is as fast as its own waves, below 0 between them:
/// `(1 - m) (2/3 (1 + F^2 / 2))^1.5 - F`. One limit is below `F = 1`, the other above.
fn to_the_limit(froude: f64, blockage: f64) -> f64 {
    let inner = 2.0 / 3.0 * (1.0 + 0.5 * froude * froude);
    (1.0 - blockage) * inner * inner.sqrt() - froude
}

/// Schijf's lower limit.
fn limiting_froude(blockage: f64) -> f64 {
    let free = 1.0 - blockage;
    let mut froude = free;
    for _ in 0..12 {
        // Newton; convex, and the root below 1
        let inner = 2.0 / 3.0 * (1.0 + 0.5 * froude * froude);
        let value = to_the_limit(froude, blockage);
        let slope = free * inner.sqrt() * froude - 1.0;
        froude -= value / slope.min(-1e-3);
    }
    froude.clamp(0.0, 1.0)
}

/// Smallest root of the energy equation, up to the critical depth `2/3 (1 + F^2 / 2)`.
fn subcritical(froude: f64, blockage: f64) -> f64 {
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
    fn the_depression_keeps_energy_up_to_the_limit_and_ends_with_the_fade() {
        // by hand for m = 0.267: F = 0.733 (2/3 (1 + 0.4668^2 / 2))^1.5 = 0.4668
        let limit = limiting_froude(0.267);
        assert!((limit - 0.4668).abs() < 2e-3, "{limit}");
        assert!(is_choked(limit + 0.01, 0.267) && !is_choked(limit - 0.01, 0.267));
        // by hand: 0.733 (2/3 (1 + 1.928^2 / 2))^1.5 = 1.928
        assert!(is_choked(1.918, 0.267) && !is_choked(1.938, 0.267));
        // the critical depth is two thirds of the energy
        let critical = 1.0 - 2.0 / 3.0 * (1.0 + 0.5 * limit * limit);
        assert!((subcritical(limit, 0.267) - critical).abs() < 1e-2, "{critical}");
        for froude in [0.1, 0.2, 0.3, 0.4] {
            let s = subcritical(froude, 0.267);
            let energy = 0.5 * froude * froude / (0.733 * (1.0 - s)).powi(2) + 1.0 - s;
            assert!((energy - 1.0 - 0.5 * froude * froude).abs() < 1e-9, "{froude} {s}");
        }
        assert!(subcritical(0.3, 0.0).abs() < 1e-12, "no walls, no channel");
        assert_eq!(faded(0.9, 0.267, 0.8), 0.0);
        let half = 0.5 * (limit + 0.8);
        assert!((faded(half, 0.267, 0.8) / faded(limit, 0.267, 0.8) - 0.5).abs() < 1e-6);
    }
}
