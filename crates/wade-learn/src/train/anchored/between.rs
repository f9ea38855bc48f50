//! States between the cases, in which the network is taught what the cases say together.

use nalgebra::UnitVector3;

use super::known::{Known, Prepared};
use super::teacher::Teacher;
use crate::random::Random;
use wade_core::anchor::COORDINATES;
use wade_core::condition::Condition;
use wade_core::frame::{Vec3, level_axes};

/// Neighbors among which the other end is drawn.
const NEIGHBORS: usize = 8;
/// How far states go beyond either case, in units of their distance: where another is near, and far out.
const BEYOND: f64 = 0.3;
const FAR_BEYOND: f64 = 1.0;

/// What states between the training cases are made of.
#[derive(Debug, Clone, Copy)]
pub struct Between<'a> {
    /// The cases.
    pub training: &'a [Known],
    /// Their vehicles.
    pub vehicles: &'a [Prepared],
    /// What says the loads.
    pub teacher: &'a Teacher,
    /// Unit of each coordinate.
    pub unit: &'a [f64; COORDINATES],
}

impl<'a> Between<'a> {
    /// The training states, `count` states for each between it and a neighbor, and `outside` states on the line through it and
    /// any other case, up to as far again beyond either; all with the loads that the teacher gives. Far from the cases the
    /// teacher goes back to their mean; a network that was taught nothing there carries on what it saw at their edge.
    pub fn taught(&self, count: usize, outside: usize, random: &mut Random) -> Vec<Known> {
        let mut taught = Vec::with_capacity(self.training.len() * (count + outside + 1));
        for state in self.training {
            let here = &state.prior.condition;
            let Some(itself) = self.learn(state, here) else {
                taught.push(state.clone());
                continue;
            };
            taught.push(itself);
            let others = self.others(state);
            let lines = [(near(&others), count, BEYOND), (&others[..], outside, FAR_BEYOND)];
            for (ends, count, beyond) in lines {
                let drawn = (0..count).filter_map(|_| self.learn(state, &drawn(here, ends, beyond, random)?));
                taught.extend(drawn);
            }
        }
        taught
    }

    /// For each training state `count` more among it and two neighbors, fewer of one that has none; nothing of a vehicle that
    /// the teacher does not know. On a line through two cases, where the network was taught, it is nearer to the teacher than
    /// it is elsewhere.
    pub fn fresh(&self, count: usize, random: &mut Random) -> Vec<Vec<Known>> {
        let mut of = |state: &Known| {
            let others = self.others(state);
            let mut one = || {
                let on_a_line = drawn(&state.prior.condition, near(&others), BEYOND, random)?;
                self.learn(state, &drawn(&on_a_line, near(&others), BEYOND, random)?)
            };
            (0..count).filter_map(|_| one()).collect()
        };
        self.training.iter().map(&mut of).collect()
    }

    fn learn(&self, state: &Known, condition: &Condition) -> Option<Known> {
        let prepared = &self.vehicles[state.vehicle];
        let prior = prepared.prior(condition);
        let loads = self.teacher.loads(state.vehicle, &prior, prepared)?;
        Some(Known { prior, loads, ..state.clone() })
    }

    /// The other cases of the vehicle, nearest first.
    fn others(&self, state: &Known) -> Vec<&'a Known> {
        let distance = |other: &Known| -> f64 {
            let (a, b) = (&state.prior.reading.coordinates, &other.prior.reading.coordinates);
            (0..COORDINATES).map(|i| ((a[i] - b[i]) / self.unit[i]).powi(2)).sum()
        };
        let others = self.training.iter().filter(|other| other.vehicle == state.vehicle);
        let mut others: Vec<(f64, &Known)> = others.map(|other| (distance(other), other)).collect();
        others.retain(|(distance, _)| *distance > 0.0);
        others.sort_by(|a, b| a.0.total_cmp(&b.0));
        others.into_iter().map(|(_, other)| other).collect()
    }
}

fn near<'b>(others: &'b [&'b Known]) -> &'b [&'b Known] {
    &others[..others.len().min(NEIGHBORS)]
}

/// A state on the line through one and any of `others`, and up to `beyond` of their distance beyond either.
fn drawn(from: &Condition, others: &[&Known], beyond: f64, random: &mut Random) -> Option<Condition> {
    let other = others.get((random.unit() * others.len() as f64) as usize)?;
    let share = (1.0 + 2.0 * beyond) * random.unit() - beyond;
    Some(between(from, &other.prior.condition, share))
}

/// A state on the line through two, `share` of the way from the first; seen from the side to which each moves.
fn between(first: &Condition, second: &Condition, share: f64) -> Condition {
    let mix = |a: f64, b: f64| a + share * (b - a);
    // a speed, clearance, density or depth is extrapolated by at most half of itself
    let bounded = |a: f64, b: f64| mix(a, b).max(a.min(b) - 0.5 * a.min(b).abs());
    let polar = |c: &Condition| {
        let [ahead, left, _] = level_axes(&c.up);
        let (along, across) = (c.velocity.dot(&ahead), c.velocity.dot(&left));
        (along.hypot(across), across.abs().atan2(along), across)
    };
    let ((speed, heading, across), (other_speed, other_heading, other_across)) =
        (polar(first), polar(second));
    let up = |c: &Condition, across: f64| {
        let side = if across < 0.0 { -1.0 } else { 1.0 };
        Vec3::new(c.up.x, c.up.y * side, c.up.z)
    };
    let up = UnitVector3::new_normalize(up(first, across).lerp(&up(second, other_across), share));
    let bed = |c: &Condition| {
        let square = c.velocity.norm_squared();
        if square > 0.0 { c.ground_velocity.dot(&c.velocity) / square } else { 0.0 }
    };
    let [ahead, left, _] = level_axes(&up);
    let (sin, cos) = mix(heading, other_heading).clamp(0.0, std::f64::consts::PI).sin_cos();
    let velocity = (ahead * cos + left * sin) * bounded(speed, other_speed);
    let clearance = first.bed_clearance.zip(second.bed_clearance).map(|(a, b)| bounded(a, b).max(0.0));
    Condition {
        velocity,
        ground_velocity: velocity * mix(bed(first), bed(second)),
        depth: bounded(first.depth, second.depth),
        density: bounded(first.density, second.density),
        bed_clearance: clearance,
        up,
        ..*first
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use wade_core::frame::up_from_roll_pitch;

    #[test]
    fn a_state_lies_on_the_line_and_motion_to_the_right_counts_as_its_image() {
        let first = Condition::level(Vec3::new(1.0, -1.0, 0.0), 0.10);
        let second = Condition { density: 1200.0, ..Condition::level(Vec3::new(0.0, 2.0, 0.0), 0.30) };
        let middle = between(&first, &second, 0.5);
        let speed = 0.5 * (2.0_f64.sqrt() + 2.0);
        let expected = Vec3::new((67.5_f64).to_radians().cos(), (67.5_f64).to_radians().sin(), 0.0) * speed;
        assert!((middle.velocity - expected).norm() < 1e-12 && (middle.depth - 0.2).abs() < 1e-12);
        assert!((middle.ground_velocity - middle.velocity).norm() < 1e-12 && middle.density == 1100.0);
        let start = between(&first, &second, 0.0).velocity;
        assert!((start - Vec3::new(1.0, 1.0, 0.0)).norm() < 1e-12, "{start}");
        assert_eq!(between(&first, &second, -10.0).depth, 0.05, "no state above the ground");
    }

    #[test]
    fn between_tilted_hulls_over_other_beds_the_motion_is_along_the_water() {
        let at = |roll: f64, pitch: f64, clearance: f64, velocity: Vec3| {
            let up = up_from_roll_pitch(roll, pitch);
            let [ahead, left, _] = level_axes(&up);
            let velocity = ahead * velocity.x + left * velocity.y;
            Condition { up, bed_clearance: Some(clearance), ..Condition::level(velocity, -0.02) }
        };
        let (first, second) =
            (at(0.2, -0.3, 0.0, Vec3::new(1.0, 0.5, 0.0)), at(-0.1, 0.2, 0.4, Vec3::new(-0.5, -0.5, 0.0)));
        for share in [-0.3, 0.0, 0.4, 1.0, 1.3] {
            let found = between(&first, &second, share);
            assert!(found.velocity.dot(&found.up).abs() < 1e-12, "{share}: {found:?}");
            assert!(
                found.bed_clearance.is_some_and(|clearance| (0.0..0.6).contains(&clearance)),
                "{found:?}"
            );
            assert!((-0.03..=-0.02).contains(&found.depth), "{}", found.depth);
        }
        let end = between(&first, &second, 1.0);
        // the second drifts to its right: seen from there it leans the other way
        assert!((end.up.y + second.up.y).abs() < 1e-12 && end.velocity.dot(&level_axes(&end.up)[1]) > 0.0);
    }
}
