//! E10, the walls of a channel: the flow past the hull is faster than the hull.
//!
//! `W = k D ((1 - m)^-2 - 1)` with the drag `D` of the model and the blockage `m = A_wet,front / (w d)`: by continuity the
//! flow beside the hull is `1 / (1 - m)` times as fast. Qi, Eames, Johnson (JFM 2014) have `(1 + Cd0 b / 2w)^2` instead,
//! which agrees to a few per cent for b/w of 0.1 to 0.4, where both are meant to hold; `k` is about 1.

use super::input::{Input, Part};
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let (state, immersion) = (input.condition, input.immersion);
    let Some(width) = input.channel_width.filter(|_| immersion.depth > 1e-3) else { return };
    let velocity = state.velocity;
    let wet = input.body.panels.iter().zip(&immersion.panels);
    let front: f64 = wet.map(|(panel, wet)| panel.windward(&velocity).x * wet.fraction).sum();
    let blockage = (front / (width * immersion.depth)).min(0.8);
    let factor = (1.0 - blockage).powi(-2) - 1.0;
    let pressure = input.half_density() * velocity.norm() * factor;
    for (index, panel) in input.body.panels.iter().enumerate() {
        let part = &immersion.panels[index];
        let area = panel.windward(&velocity).component_mul(&input.base_drag) * part.fraction;
        let force: Vec3 = area.component_mul(&velocity) * -pressure;
        emit(0, Part::Panel(index), input.at(force, &part.point));
    }
}

/// Share of the channel's section that the hull's mean section takes [-], at most `b / w` since no hull stands deeper in the
/// water than the water is; none without walls or water.
pub(super) fn blockage(input: &Input) -> Option<f64> {
    const MOST: f64 = 0.8;
    let immersion = input.immersion;
    let width = input.channel_width.filter(|_| immersion.depth > 1e-3)?;
    let section = immersion.volume / input.body.length;
    Some((section / (width * immersion.depth)).min(input.body.width / width).min(MOST))
}
