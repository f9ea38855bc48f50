//! Errors by what a vehicle does, in shares of the dynamic load: a number of newtons says little where one set has ten times the
//! force of another.

use serde::Serialize;

use super::baseline::rest;
use super::contest::Entry;
use super::states::{State, sections};
use crate::dataset::Image;
use crate::signal::median;
use wade_core::frame::{GRAVITY, Vec3, level_axes};
use wade_core::vehicle::Vehicle;

/// Share of the weight below which a horizontal force is too small for its error to be a share of it.
const LEAST_FORCE: f64 = 0.02;
/// Course from dead astern within which a vehicle reverses: a component astern of more than half of the speed.
const ASTERN: f64 = -0.5;
/// Component of up along body z below which a vehicle is tilted: 5.7 degrees.
const TILTED: f64 = 0.995;
/// Clearance over the bed from which a vehicle counts as off it [m].
const OFF_THE_BED: f64 = 0.015;

/// Errors of a model in a set of cases or a kind of motion; each case counts once, mirror images are left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegimeReport {
    /// Name of the set, or `reverse`, `tilted` or `off the bed`.
    pub name: String,
    /// Cases in motion.
    pub cases: usize,
    /// Those whose horizontal force is above 2 % of the weight.
    pub judged: usize,
    /// Median over them of the horizontal error over the horizontal force; `None` without any.
    pub horizontal: Option<f64>,
    /// Mean error of the vertical dynamic force over its mean size.
    pub vertical: f64,
    /// The same of each component of the dynamic moment about the center of mass, level axes.
    pub moment: Option<[f64; 3]>,
}

/// The dynamic load of a case, along the course axes of the vehicle on the water: ahead, left, up.
struct Case<'a> {
    state: &'a State,
    force: Vec3,
    force_error: Vec3,
    moment: Option<[Vec3; 2]>,
}

type IsKind = fn(&State) -> bool;

/// The regimes of an entry's states.
pub fn regimes(vehicle: &Vehicle, entry: &Entry, states: &[State]) -> Vec<RegimeReport> {
    let sections = sections(states);
    let moves = |places: &&Vec<usize>| {
        let state = &states[places[0]];
        state.image == Image::Original && state.condition.velocity.norm() > 0.0
    };
    let cases: Vec<Case<'_>> =
        sections.iter().filter(moves).map(|places| Case::new(vehicle, entry, states, places)).collect();
    let mut names: Vec<&str> = cases.iter().map(|case| case.state.set.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let of_set = names.into_iter().map(|name| {
        let cases: Vec<&Case<'_>> = cases.iter().filter(|case| case.state.set == name).collect();
        report(vehicle, name, &cases)
    });
    let kinds: [(&str, IsKind); 3] = [
        ("reverse", |state| {
            let [ahead, ..] = level_axes(&state.condition.up);
            ahead.dot(&state.condition.velocity) < ASTERN * state.condition.velocity.norm()
        }),
        ("tilted", |state| state.condition.up.z < TILTED),
        ("off the bed", |state| state.condition.bed_clearance.is_some_and(|c| c > OFF_THE_BED)),
    ];
    let of_kind = kinds.map(|(name, is)| {
        let cases: Vec<&Case<'_>> = cases.iter().filter(|case| is(case.state)).collect();
        report(vehicle, name, &cases)
    });
    of_set.chain(of_kind).filter(|regime| regime.cases > 0).collect()
}

impl<'a> Case<'a> {
    fn new(vehicle: &Vehicle, entry: &Entry, states: &'a [State], places: &[usize]) -> Self {
        let state = &states[places[0]];
        let about = &vehicle.center_of_mass;
        let rest = rest(vehicle, &state.condition);
        let sections = places.len() as f64;
        let mean =
            |of: &dyn Fn(usize) -> Vec3| places.iter().map(|&place| of(place)).sum::<Vec3>() / sections;
        let axes = level_axes(&state.condition.up);
        let level = |v: Vec3| Vec3::from(axes.map(|axis| axis.dot(&v)));
        let found = mean(&|place| states[place].force());
        let said = mean(&|place| entry.predictions[place].force);
        let moment = |place: usize| Some((states[place].moment(about)?, entry.predictions[place].moment?));
        let moments: Option<Vec<(Vec3, Vec3)>> = places.iter().map(|&place| moment(place)).collect();
        let moment = moments.map(|moments| {
            let found = moments.iter().map(|(found, _)| *found).sum::<Vec3>() / sections;
            let said = moments.iter().map(|(_, said)| *said).sum::<Vec3>() / sections;
            [level(found - rest.moment), level(said - found)]
        });
        Self { state, force: level(found - rest.force), force_error: level(said - found), moment }
    }
}

fn report(vehicle: &Vehicle, name: &str, cases: &[&Case<'_>]) -> RegimeReport {
    let least = LEAST_FORCE * vehicle.mass * GRAVITY;
    let share = |case: &&Case<'_>| {
        let force = case.force.xy().norm();
        (force > least).then(|| case.force_error.xy().norm() / force)
    };
    let mut shares: Vec<f64> = cases.iter().filter_map(share).collect();
    let horizontal = median(&mut shares);
    let ratio = |error: f64, size: f64| if size > 0.0 { error / size } else { 0.0 };
    let sum = |of: &dyn Fn(&Case<'_>) -> f64| cases.iter().map(|case| of(case)).sum::<f64>();
    let moments: Option<Vec<[Vec3; 2]>> = cases.iter().map(|case| case.moment).collect();
    RegimeReport {
        name: name.to_owned(),
        cases: cases.len(),
        judged: shares.len(),
        horizontal,
        vertical: ratio(sum(&|case| case.force_error.z.abs()), sum(&|case| case.force.z.abs())),
        moment: moments.map(|moments| {
            let size = |which: usize, axis: usize| moments.iter().map(|m| m[which][axis].abs()).sum::<f64>();
            std::array::from_fn(|axis| ratio(size(1, axis), size(0, axis)))
        }),
    }
}
