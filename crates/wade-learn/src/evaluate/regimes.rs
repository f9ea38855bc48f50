//! Errors by what a vehicle does, in shares of the dynamic load: a number of newtons says little where one set has ten times the
//! force of another.

use serde::Serialize;

use super::contest::Entry;
use super::states::State;
use crate::dataset::{Image, flows};
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::vehicle::Vehicle;
use wade_core::wrench::Wrench;

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
    let sections = flows(states.iter().map(|state| (state.case.as_str(), state.image, &state.condition)));
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
            let [ahead, ..] = level_axes(state);
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
        let rest =
            vehicle.at_rest(&state.condition).into_iter().fold(Wrench::default(), |sum, load| sum + load);
        let rest = rest.moved(&Vec3::zeros(), about);
        let mean = |of: &dyn Fn(usize) -> Vec3| {
            places.iter().map(|&place| of(place)).sum::<Vec3>() / places.len() as f64
        };
        let [ahead, left, up] = level_axes(state);
        let level = |v: Vec3| Vec3::new(v.dot(&ahead), v.dot(&left), v.dot(&up));
        let found = mean(&|place| states[place].force());
        let said = mean(&|place| entry.predictions[place].force);
        let moment = |place: usize| Some((states[place].moment(about)?, entry.predictions[place].moment?));
        let has_moments = places.iter().all(|&place| moment(place).is_some());
        let moment = has_moments.then(|| {
            let found = mean(&|place| moment(place).map_or_else(Vec3::zeros, |m| m.0));
            let said = mean(&|place| moment(place).map_or_else(Vec3::zeros, |m| m.1));
            [level(found - rest.moment), level(said - found)]
        });
        Self { state, force: level(found - rest.force), force_error: level(said - found), moment }
    }
}

fn level_axes(state: &State) -> [Vec3; 3] {
    let up = state.condition.up.into_inner();
    let ahead = (Vec3::x() - up * up.x).normalize();
    [ahead, up.cross(&ahead), up]
}

fn report(vehicle: &Vehicle, name: &str, cases: &[&Case<'_>]) -> RegimeReport {
    let least = LEAST_FORCE * vehicle.mass * GRAVITY;
    let share = |case: &&Case<'_>| {
        let force = case.force.xy().norm();
        (force > least).then(|| case.force_error.xy().norm() / force)
    };
    let mut shares: Vec<f64> = cases.iter().filter_map(share).collect();
    shares.sort_by(f64::total_cmp);
    let horizontal = (!shares.is_empty()).then(|| {
        let half = shares.len() / 2;
        if shares.len() % 2 == 1 { shares[half] } else { 0.5 * (shares[half - 1] + shares[half]) }
    });
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
