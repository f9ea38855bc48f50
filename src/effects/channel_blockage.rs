//! E10, the walls of a channel: the flow past the hull is faster than the hull.
//!
//! `W = k D ((1 - m)^-2 - 1)` with the drag `D` of the model and the blockage `m = (V / L) / (w d)`, of its mean section: by continuity the
//! flow beside the hull is `1 / (1 - m)` times as fast. No hull stands deeper in the water than the water is, so `m` is at
//! most `b / w`, also where a bow reaches into deeper water than the origin does. Qi, Eames, Johnson (JFM 2014) have
//! `(1 + Cd0 b / 2w)^2` instead, which agrees to a few per cent for b/w of 0.1 to 0.4, where both are meant to hold; `k` is
//! about 1. A hull as wide at every depth has the same `m` in all trials ahead: there this is the twin of a wrong drag
//! coefficient.

use super::input::{Input, Part};
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let Some(blockage) = blockage(input) else { return };
    let (immersion, velocity) = (input.immersion, input.condition.velocity);
    let factor = (1.0 - blockage).powi(-2) - 1.0;
    let pressure = input.half_density() * velocity.norm() * factor;
    for (index, panel) in input.body.panels.iter().enumerate() {
        let part = &immersion.panels[index];
        let area = panel.windward(&velocity).component_mul(&input.base_drag) * part.fraction;
        let force: Vec3 = area.component_mul(&velocity) * -pressure;
        emit(0, Part::Panel(index), input.at(force, &part.point));
    }
}

/// Share of the channel's section that the hull takes [-]; none without walls or water.
pub(super) fn blockage(input: &Input) -> Option<f64> {
    const MOST: f64 = 0.8;
    let immersion = input.immersion;
    let width = input.channel_width.filter(|_| immersion.depth > 1e-3)?;
    let section = immersion.volume / input.body.length;
    Some((section / (width * immersion.depth)).min(input.body.width / width).min(MOST))
}
