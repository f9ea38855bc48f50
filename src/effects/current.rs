//! E14, water that moves over ground with `u`, fixed in the world.
//!
//! `f = D(v - w) - D(v)` on each wet panel, `w = R^T u`, with the drag of the model itself, `D(v) = -K |v| v`. Exact for a
//! uniform flow and a quadratic law. Written as `K |v - w0| w + K v ((2 v - w0) . w) / (|v - w0| + |v|)`, which is linear in
//! `w` and exact at `w = w0`; the shape is the estimate `u0`, to which fitting sets it again and again.

use super::input::{Input, Part};
use super::library::Shape;
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let velocity = input.condition.velocity;
    let estimate = input.body_from_world(shape[0], shape[1]);
    let through = velocity - estimate;
    let (fast, slow) = (through.norm(), velocity.norm());
    for (number, (east, north)) in [(1.0, 0.0), (0.0, 1.0)].into_iter().enumerate() {
        let w = input.body_from_world(east, north);
        let along = (velocity * 2.0 - estimate).dot(&w) / (fast + slow).max(1e-9);
        let change = w * fast + velocity * along;
        for (index, panel) in input.body.panels.iter().enumerate() {
            let part = &input.immersion.panels[index];
            let wet = part.fraction;
            if wet == 0.0 {
                continue;
            }
            let facing = panel.windward(&through);
            let area = facing.component_mul(&input.base_drag) * (input.half_density() * wet);
            let force: Vec3 = area.component_mul(&change);
            emit(number, Part::Panel(index), input.at(force, &part.point));
        }
    }
}
