//! The physical base with what was learned beside it.
//!
//! The learned part of a surface is what the network says is left of the base, or its anchored load less the base's, both of the
//! level part of the motion, and counts as far as the state is near those that the weights were trained on. As far as it counts,
//! the load that the base gives the hull as a whole in steady motion gives way to it: steady CFD, and so the weights, have it in
//! them. Together it may spend power and never give any: where it would give
//! `P` to a hull whose base takes `P_0`, it is scaled by `k(r)` of `r = P / P_0`, 1 up to a half and `(1 - 1 / 4r) / r` from
//! there, which is smooth and leaves `k r < 1`.

use super::{Anchored, Learned, SPREAD, moment_deviation};
use crate::anchor::{OUTPUTS, Reading, Remainder, SurfaceReading};
use crate::condition::Condition;
use crate::domain::Quantity;
use crate::forces::{self, Forces, SurfaceForce};
use crate::frame::Vec3;
use crate::model::kernel::{MAX_OUTPUTS, WetSurface};
use crate::physics::drag::SurfaceDrag;
use crate::physics::{BaseLoads, origin_from};
use crate::real::Real;
use crate::vehicle::{MAX_SURFACES, Vehicle};
use crate::wrench::Wrench;

/// Deviation of a component of the base's drag, over the size of the drag [-]: `docs/src/concepts/physics.md`.
const BASE_DEVIATION: f64 = 0.3;

/// An answer that is being put together.
pub struct Blend<'a> {
    condition: &'a Condition,
    loads: &'a BaseLoads,
    /// Learned part of each surface about the body origin, before it is limited.
    learned: [Wrench; MAX_SURFACES],
    /// That of the hull as a whole: what the base has of it in steady motion, which the weights answer with the surfaces.
    learned_hull: Wrench,
    /// How much of the learned part counts, 0 to 1.
    weight: f64,
    learned_deviation: Vec3,
}

/// Share of a learned part that is let through, of one whose power is `ratio` of what the base takes.
fn let_through<T: Real>(ratio: T) -> T {
    if ratio.value() <= 0.5 { T::one() } else { (-(T::from(0.25) / ratio) + 1.0) / ratio }
}

/// The learned part of a surface about the body origin: what the network's answer is beside the base.
pub fn part<T: Real>(
    (known, answer): (&SurfaceReading<T>, &[T; OUTPUTS]),
    (base, remainder): (&Wrench<T>, Remainder),
) -> Wrench<T> {
    let Wrench { force, moment } = known.dynamic_load(answer);
    let load = Wrench { force, moment: moment + known.center.cross(&force) };
    match remainder {
        Remainder::OfDrag => load + *base * -T::one(),
        Remainder::OfPhysics => load,
    }
}

/// Share of a learned part that is let through beside the drag of the base.
pub fn through<T: Real>(condition: &Condition<T>, learned: &Wrench<T>, loads: &BaseLoads<T>) -> T {
    let power =
        |load: &Wrench<T>| load.force.dot(&condition.velocity) + load.moment.dot(&condition.angular_velocity);
    let drag = loads.surfaces.iter().fold(Wrench::default(), |sum, s| sum + s.drag);
    let taken = loads.shaft_power.max(T::zero()) - power(&drag);
    let given = power(learned);
    if given.value() <= 0.0 {
        T::one()
    } else if taken.value() <= 0.0 {
        T::zero()
    } else {
        let_through(given / taken)
    }
}

impl<'a> Blend<'a> {
    /// The base alone.
    pub fn new(condition: &'a Condition, loads: &'a BaseLoads, forces: &mut Forces) -> Self {
        forces.surfaces.clear();
        forces.surfaces.extend(loads.surfaces.iter().map(|surface| SurfaceForce {
            point: surface.center,
            wetted_fraction: surface.wet_fraction,
            ..SurfaceForce::default()
        }));
        Self {
            condition,
            loads,
            learned: [Wrench::default(); MAX_SURFACES],
            learned_hull: Wrench::default(),
            weight: 0.0,
            learned_deviation: Vec3::zeros(),
        }
    }

    /// Takes in what the network says of the surfaces that the level motion wets.
    pub fn add(
        &mut self,
        (learned, form, reading): (&Learned, &Anchored, &Reading),
        (wet, outputs): (&[WetSurface], &[[f32; MAX_OUTPUTS]]),
        (velocity, level_drag): (&Vec3, &[SurfaceDrag]),
        forces: &mut Forces,
    ) {
        let distance = form.distance(reading);
        forces.outside.excess[Quantity::Distance as usize - 1] = (distance - 1.0).max(0.0);
        let trust = Anchored::trust(distance);
        let (mut spread, mut doubtful) = (0.0, Vec3::zeros());
        for (WetSurface { surface, .. }, output) in wet.iter().zip(outputs) {
            let (known, base) = (&reading.surfaces[*surface], &level_drag[*surface]);
            spread += known.unit * Anchored::softplus(output[SPREAD]);
            let answer = std::array::from_fn(|i| f64::from(output[i]));
            let share = trust * learned.coverage[*surface];
            let part = part((known, &answer), (&base.load, form.remainder));
            self.learned[*surface] = part * share;
            doubtful += part.force.abs() * Anchored::doubt(distance).min(share);
        }
        self.learned_hull = self.loads.steady_hull(velocity, |x| x) * -trust;
        self.learned_deviation = Vec3::from(form.spread.map(f64::from)) * spread + doubtful;
        self.weight = trust;
    }

    /// Limits the learned part and sums.
    pub fn finish(self, vehicle: &Vehicle, forces: &mut Forces) {
        let Self { condition, loads, .. } = self;
        let learned = &self.learned[..loads.surfaces.len()];
        let learned = learned.iter().fold(self.learned_hull, |sum, learned| sum + *learned);
        let drag = loads.surfaces.iter().fold(Wrench::default(), |sum, s| sum + s.drag);
        let through = through(condition, &learned, loads);
        let about = &vehicle.center_of_mass;
        let hull = (loads.hull + self.learned_hull * through).moved(&Vec3::zeros(), about);
        let wet: f64 = wet_areas(vehicle, loads).sum();
        for (index, area) in wet_areas(vehicle, loads).enumerate() {
            let surface = &loads.surfaces[index];
            let own = surface.hydrostatic + surface.drag + self.learned[index] * through;
            // what acts on the hull as a whole is spread over what is wet of it
            let share = if wet > 0.0 { area / wet } else { 0.0 };
            let load = &mut forces.surfaces[index];
            let spread = hull * share;
            load.force = own.force + spread.force;
            let own = own.moved(&Vec3::zeros(), &surface.center);
            load.couple = own.moment + spread.moved(about, &surface.center).moment;
        }
        forces.sum_about(about);
        let size = drag.force.norm().max(learned.force.norm());
        let unlearned = Vec3::repeat(BASE_DEVIATION * size) * (1.0 - self.weight);
        forces.uncertainty = self.learned_deviation * self.weight + unlearned;
        forces.moment_uncertainty = moment_deviation(&forces.uncertainty, &vehicle.dimensions);
        let moved = origin_from(about);
        forces.base = Some(forces::Base {
            added_mass: moved.transpose() * loads.added_mass * moved,
            damping: moved.transpose() * loads.damping * moved,
            water_level: condition.water_plane(vehicle.z0).offset,
            bed_clearance: loads.bed_clearance,
            bed: loads.bed,
            shaft_power: loads.shaft_power,
        });
    }
}

fn wet_areas<'b>(vehicle: &'b Vehicle, loads: &'b BaseLoads) -> impl Iterator<Item = f64> + 'b {
    vehicle.surfaces.iter().zip(&loads.surfaces).map(|(surface, load)| surface.area * load.wet_fraction)
}

#[cfg(test)]
mod tests {
    use super::let_through;

    #[test]
    fn what_is_let_through_never_gives_more_than_the_base_takes() {
        let mut before = 1.0;
        for i in 0..10_000 {
            let ratio = 0.01 * f64::from(i);
            let through = let_through(ratio);
            assert!(through * ratio < 1.0 && through <= before && before - through < 0.02, "{ratio}");
            before = through;
        }
    }
}
