//! Water that moves over ground with `u`, fixed in the world.
//!
//! `f = D(v - w) - D(v)` on each wet panel, `w = R^T u`, with the drag of the model itself, `D(v) = -K |v| v`, `K` from
//! what the model answers in the state ([`Input::own_drag`]). Exact for a uniform flow and a quadratic law. Written as `K |v - w0| w + K v ((2 v - w0) . w) / (|v - w0| + |v|)`, which is linear in
//! `w` and exact at `w = w0`; the first two numbers of the shape are the estimate `u0`, to which fitting sets them again and
//! again. The third is 0 for a drag with the whole speed and 1 where each axis has its own, `D_i(v) = -K_i |v_i| v_i` (the
//! cross-flow principle; Fossen, Handbook of Marine Craft Hydrodynamics, section 6.4).

use super::input::{Input, Part};
use super::library::Shape;
use crate::frame::Vec3;
use crate::wrench::Wrench;

pub(super) fn basis(shape: &Shape, input: &Input, emit: &mut impl FnMut(usize, Part, Wrench)) {
    let velocity = input.condition.velocity;
    let estimate = input.body_from_world(shape[0], shape[1]);
    let through = velocity - estimate;
    let (fast, slow) = (through.norm(), velocity.norm());
    let axes_apart = shape[2] > 0.5;
    let drag = input.own_drag(axes_apart);
    for (number, (east, north)) in [(1.0, 0.0), (0.0, 1.0)].into_iter().enumerate() {
        let w = input.body_from_world(east, north);
        let change = if axes_apart {
            Vec3::from_fn(|i, _| w[i] * secant(velocity[i], through[i]))
        } else {
            let along = (velocity * 2.0 - estimate).dot(&w) / (fast + slow).max(1e-9);
            w * fast + velocity * along
        };
        for (index, panel) in input.body.panels.iter().enumerate() {
            let part = &input.immersion.panels[index];
            let wet = part.fraction;
            if wet == 0.0 {
                continue;
            }
            let facing = panel.windward(&through);
            let area = facing.component_mul(&drag) * (input.half_density() * wet);
            let force: Vec3 = area.component_mul(&change);
            emit(number, Part::Panel(index), input.at(force, &part.point));
        }
    }
}

/// Slope of `x |x|` between two values.
fn secant(a: f64, b: f64) -> f64 {
    b.abs() + a * (a + b) / (a.abs() + b.abs()).max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_secant_is_the_difference_over_the_step() {
        for (a, b) in [(1.5, 1.2), (0.3, -0.4), (-2.0, 0.0), (-1.0, -1.3)] {
            let exact: f64 = (a * f64::abs(a) - b * f64::abs(b)) / (a - b);
            assert!((secant(a, b) - exact).abs() < 1e-12, "{a} {b}");
        }
    }
}
