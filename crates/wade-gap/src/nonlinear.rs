//! Parameters in which an effect is not linear: a current, a delay, a time to fill, a memory.

use super::Named;
use super::candidates::Setting;
use super::design::{Candidate, Design};
use super::holdout::explained;
use super::judge::Member;
use super::series::Series;
use wade_core::effects::current::Current;
use wade_core::effects::drive::DriveDelay;
use wade_core::effects::sensor::SensorDelay;
use wade_core::effects::water_level_offset::WaterLevelOffset;
use wade_core::effects::{Effect, Kind, Shape};
use wade_core::frame::GRAVITY;

/// Last and smallest factor of the search.
const SHORTEST_STEP: f64 = 1.015;

/// Sets the shapes that are estimates of the effect's own coefficients, of the candidates from a number on: a current, an error
/// of the water level.
pub(super) fn settle(design: &mut Design, all: &[Series], setting: &Setting, from: usize) {
    for candidate in from..design.candidates.len() {
        if matches!(design.candidates[candidate].effect, Effect::Current | Effect::WaterLevelOffset) {
            let member = Member { candidate, columns: design.candidates[candidate].columns.clone() };
            iterate(design, all, setting, &member, &[]);
        }
    }
}

/// Fixed point of a shape that is the member's own estimate, beside other columns; a coefficient that is not in use has none.
///
/// Where the load grows with the square of the estimate, `F = k w0 w` says `w = F / (k w0)`, which jumps to and fro about the
/// root for ever; halfway there is Heron's rule, which closes in on it. The first step is a whole one: from nothing there
/// is no square.
fn iterate(design: &mut Design, all: &[Series], setting: &Setting, member: &Member, others: &[usize]) {
    const TIMES: usize = 5;
    let columns: Vec<usize> =
        member.columns.iter().map(|(column, _)| *column).chain(others.iter().copied()).collect();
    let effect = design.candidates[member.candidate].effect;
    for time in 0..TIMES {
        let Some((beta, _)) = design.solve(&columns) else { return };
        let shape = design.candidates[member.candidate].shape;
        let Some(before) = estimate(&shape) else { return };
        let mut estimate = [0.0; 2];
        for (index, &(column, coefficient)) in member.columns.iter().enumerate() {
            let [low, high] = effect.coefficients()[coefficient].bounds;
            let found = (beta[index] / design.scale[column]).clamp(low, high);
            let whole = time == 0 && before[coefficient] == 0.0;
            estimate[coefficient] = if whole { found } else { 0.5 * (before[coefficient] + found) };
        }
        design.reshape(all, setting, member.candidate, with_estimate(shape, estimate));
    }
}

/// The estimate of an effect's own coefficients about which its load is linear, by coefficient; none where it needs none.
fn estimate(shape: &Shape) -> Option<[f64; 2]> {
    match *shape {
        Shape::Current(Current { east_mps, north_mps, .. }) => Some([east_mps, north_mps]),
        Shape::WaterLevelOffset(WaterLevelOffset { estimate_m }) => Some([estimate_m, 0.0]),
        Shape::SensorDelay(SensorDelay { delay_s }) | Shape::DriveDelay(DriveDelay { delay_s, .. }) => {
            Some([delay_s, 0.0])
        }
        _ => None,
    }
}

/// The same law about another estimate.
fn with_estimate(shape: Shape, [first, second]: [f64; 2]) -> Shape {
    match shape {
        Shape::Current(law) => Shape::Current(Current { east_mps: first, north_mps: second, ..law }),
        Shape::WaterLevelOffset(_) => Shape::WaterLevelOffset(WaterLevelOffset { estimate_m: first }),
        Shape::SensorDelay(_) => Shape::SensorDelay(SensorDelay { delay_s: first }),
        Shape::DriveDelay(law) => Shape::DriveDelay(DriveDelay { delay_s: first, ..law }),
        other => other,
    }
}

/// Fits the nonlinear parameters of the named effects beside each other.
pub(super) fn refine(design: &mut Design, all: &[Series], setting: &Setting, members: &[Member]) {
    for _ in 0..2 {
        for index in 0..members.len() {
            let others: Vec<usize> = members
                .iter()
                .enumerate()
                .filter(|(other, _)| *other != index)
                .flat_map(|(_, member)| member.columns.iter().map(|(column, _)| *column))
                .collect();
            let member = &members[index];
            let shape = design.candidates[member.candidate].shape;
            if estimate(&shape).is_some() {
                iterate(design, all, setting, member, &others);
            } else if !shape.effect().spec().parameters.is_empty() {
                search(design, all, setting, member, &others);
            }
        }
    }
}

/// Lets the effects of sensors that scale, turn or delay a load do so with what the named effects of the water add to it as
/// well, and fits all anew.
///
/// A set is a sum, and the fault of a sensor is not one of its terms but a map of the sum of the others.
pub(super) fn through_sensors(
    design: &mut Design,
    all: &mut [Series],
    setting: &Setting,
    members: &[Member],
) {
    const TIMES: usize = 2;
    let effect = |design: &Design, member: &Member| design.candidates[member.candidate].effect;
    let water: Vec<&Member> = members.iter().filter(|m| effect(design, m).kind() == Kind::Physics).collect();
    let has_map = members.iter().any(|m| maps_loads(effect(design, m)));
    if water.is_empty() || !has_map {
        return;
    }
    for _ in 0..TIMES {
        let columns: Vec<usize> = members.iter().flat_map(|m| m.columns.iter().map(|(c, _)| *c)).collect();
        let Some((beta, _)) = design.solve(&columns) else { return };
        let value = |column: usize| {
            let place = columns.iter().position(|&c| c == column).unwrap_or_default();
            beta[place] / design.scale[column]
        };
        let found: Vec<Named> = water
            .iter()
            .map(|member| Named {
                effect: effect(design, member),
                shape: design.candidates[member.candidate].shape,
                region: design.candidates[member.candidate].region.clone(),
                coefficients: member.columns.iter().map(|&(column, k)| (k, value(column))).collect(),
            })
            .collect();
        see(design, all, setting, &found);
        refine(design, all, setting, members);
    }
}

/// Lets the effects of sensors see the prediction with what named effects add to it.
pub(super) fn see(design: &mut Design, all: &mut [Series], setting: &Setting, named: &[Named]) {
    for (rank, series) in all.iter_mut().enumerate() {
        let added = explained(named, series, rank, setting);
        let without = series.predicted.iter().zip(&series.known);
        for ((seen, (predicted, known)), added) in series.seen.iter_mut().zip(without).zip(added) {
            *seen = std::array::from_fn(|c| predicted[c] + known[c] + added[c]);
        }
    }
    for candidate in 0..design.candidates.len() {
        if maps_loads(design.candidates[candidate].effect) {
            design.reshape(all, setting, candidate, design.candidates[candidate].shape);
        }
    }
}

/// True for what a sensor or the ground makes of the load of the water.
fn maps_loads(effect: Effect) -> bool {
    use Effect::{AxisMisalignment, RollingResistance, SensorDelay, SensorGain};
    matches!(effect, AxisMisalignment | RollingResistance | SensorDelay | SensorGain)
}

/// Time constant below which no memory is looked for [s]: it is gone before waves leave the hull, which is inertia.
fn shortest_memory(setting: &Setting) -> f64 {
    0.8 * (setting.body.length / GRAVITY).sqrt()
}

/// True for a memory that the search would have made shorter still: what it stands for is no memory.
pub(super) fn is_too_short(shape: &Shape, setting: &Setting) -> bool {
    let shortest = SHORTEST_STEP * shortest_memory(setting);
    matches!(shape, Shape::WaveMemory(memory) if memory.time_constant_s < shortest)
}

/// Coordinate search over the nonlinear parameters of a member, from its own shape and the best of the others that its effect
/// is looked for in: two numbers of a memory go together, and a search along one and the other stops on the way.
fn search(design: &mut Design, all: &[Series], setting: &Setting, member: &Member, others: &[usize]) {
    /// Shapes from which two numbers are looked for.
    const STARTS: usize = 3;
    let coefficients: Vec<usize> = member.columns.iter().map(|(_, coefficient)| *coefficient).collect();
    let Candidate { effect, shape: own, ref region, .. } = design.candidates[member.candidate];
    let axes = effect.spec().parameters.len();
    let loss = |shape: &Shape| design.loss_with(all, setting, (shape, region), &coefficients, others);
    let mut starts = vec![own];
    if axes > 1 {
        let alike = |candidate: &&Candidate| candidate.effect == effect && candidate.shape != own;
        let forms = design.candidates.iter().filter(alike);
        let mut forms: Vec<(f64, Shape)> = forms.map(|form| (loss(&form.shape), form.shape)).collect();
        forms.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.extend(forms.into_iter().map(|(_, shape)| shape).take(STARTS));
    }
    let shortest = if effect == Effect::WaveMemory { shortest_memory(setting) } else { 0.0 };
    let found = starts.into_iter().map(|start| descend(start, axes, shortest, &loss));
    if let Some((_, shape)) = found.min_by(|a, b| a.0.total_cmp(&b.0)) {
        design.reshape(all, setting, member.candidate, shape);
    }
}

/// Goes down along one number after the other by factors that shrink; the first of them not below `shortest`.
fn descend(start: Shape, axes: usize, shortest: f64, loss: &dyn Fn(&Shape) -> f64) -> (f64, Shape) {
    const TRIES: usize = 8;
    let (mut best, mut shape) = (loss(&start), start);
    for step in [1.5, 1.15, 1.05, SHORTEST_STEP] {
        for axis in 0..axes {
            for factor in [step, 1.0 / step] {
                for _ in 0..TRIES {
                    let tried = shape.scaled(axis, factor);
                    // a frequency of zero has no factor
                    if tried == shape || (axis == 0 && tried.parameter(0) < shortest) {
                        break;
                    }
                    let found = loss(&tried);
                    if found >= best {
                        break;
                    }
                    (best, shape) = (found, tried);
                }
            }
        }
    }
    (best, shape)
}
