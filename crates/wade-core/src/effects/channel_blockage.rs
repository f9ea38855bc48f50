//! The walls of a channel: the flow past the hull is faster than the hull.
//!
//! Two laws. By windward areas, `W = k D ((1 - m)^-2 - 1)` with the section that the wet front takes as the blockage `m`: by
//! continuity the flow beside the hull is `1 / (1 - m)` times as fast. Qi, Eames, Johnson (JFM 2014) have
//! `(1 + Cd0 b / 2w)^2` instead, which agrees to a few per cent for b/w of 0.1 to 0.4, where both are meant to hold. And with
//! the model's own drag `D`, whatever law it follows, and the surface that falls where the flow is fast,
//! [`super::channel_flow`]. `k` is about 1. The shape is 0 for the former and, for the latter, the Froude number above which
//! the surface stays where it is.

use super::channel_flow::{self, MOST};
use super::input::{Input, Part};
use super::library::{Effect, Shape};
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let (velocity, immersion) = (input.condition.velocity, input.immersion);
    if Effect::ChannelBlockage.is_in_proportion(shape) {
        let more = channel_flow::excess(input, shape[0]).unwrap_or(0.0);
        emit(0, Part::Hull, input.at(input.predicted_drag() * more, &immersion.center_of_buoyancy));
        return;
    }
    let Some(width) = channel_flow::width(input) else { return };
    let wet = input.body.panels.iter().zip(&immersion.panels);
    let front: f64 = wet.map(|(panel, wet)| panel.windward(&velocity).x * wet.fraction).sum();
    let blockage = (front / (width * immersion.depth)).min(MOST);
    let more = (1.0 - blockage).powi(-2) - 1.0;
    let pressure = input.half_density() * velocity.norm() * more;
    for (index, panel) in input.body.panels.iter().enumerate() {
        let part = &immersion.panels[index];
        let area = panel.windward(&velocity).component_mul(&input.base_drag) * part.fraction;
        let force: Vec3 = area.component_mul(&velocity) * -pressure;
        emit(0, Part::Panel(index), input.at(force, &part.point));
    }
}
