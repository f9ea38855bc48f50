//! The figures of an evaluation.

use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;

use super::contest::{Contest, Entry, Heat};
use super::measure::{Calibration, Errors, Flow, mean_magnitude, percentile};
use super::paper::{self, Paper};
use super::regimes::{RegimeReport, regimes};
use super::states::{State, sections};
use super::{EvaluateError, page};
use crate::page::PlotError;
use crate::train::Config;
use crate::train::fit::Epoch;
use crate::train::report::DataFile;
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;

/// Most points a parity plot shows; more only cover one another and make the page large.
const PARITY_POINTS: usize = 1500;

/// An evaluation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Version and commit of this program.
    pub program: String,
    /// What it is about.
    #[serde(flatten)]
    pub about: About,
    /// How the paper's figures are to be read.
    pub paper: &'static str,
    /// By vehicle.
    pub vehicles: Vec<VehicleReport>,
}

/// What an evaluation is about.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct About {
    /// What was held out of.
    pub data: DataFile,
    /// What was held out; several parts in turn are pooled.
    pub splits: Vec<String>,
    /// True where sections and images of one case may be on both sides: such figures test interpolation only.
    pub by_sample: bool,
    /// Settings of each network's training, by its name.
    pub settings: BTreeMap<String, Config>,
    /// Epochs of the training of the model under evaluation, where it was one.
    #[serde(skip)]
    pub history: Vec<Epoch>,
}

/// Figures of one vehicle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VehicleReport {
    /// Its name.
    pub name: String,
    /// Held-out cases.
    pub cases: usize,
    /// Held-out states, mirror images included.
    pub samples: usize,
    /// Mean magnitude of the net force, for scale [N].
    pub mean_force_n: [f64; 3],
    /// Mean magnitude of the net moment [N m]; `None` where the data set has none.
    pub mean_moment_nm: Option<[f64; 3]>,
    /// The model under evaluation first.
    pub models: Vec<ModelReport>,
    /// By surface, of the model under evaluation.
    pub surfaces: Vec<GroupReport>,
    /// By kind of surface.
    pub kinds: Vec<GroupReport>,
    /// The ends of the ranges.
    pub slices: Vec<SliceReport>,
    /// Of `Forces::uncertainty`; `None` where it is zero.
    pub calibration: Option<Calibration>,
    /// The paper's figures.
    pub paper: Option<&'static Paper>,
    /// Truth and prediction of each component of the net force [N], thinned out.
    #[serde(skip)]
    pub parity: Vec<(Vec3, Vec3)>,
    /// Mean flows, each mirror image its own.
    #[serde(skip)]
    pub flows: Vec<MeanFlow>,
}

/// What the model under evaluation makes of a mean flow.
#[derive(Debug, Clone, PartialEq)]
pub struct MeanFlow {
    /// Where it lies: the quantities of [`QUANTITIES`].
    pub place: [f64; 3],
    /// Error of the mean net force [N].
    pub error: Vec3,
    /// The deviation stated of it [N]; `None` where nothing is.
    pub stated: Option<Vec3>,
}

/// Errors of one model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ModelReport {
    /// Its name.
    pub name: String,
    /// Of the net force [N].
    pub force: Errors,
    /// Mean absolute error of the net moment about the center of mass [N m], where data and model have moments.
    pub moment_mae_nm: Option<[f64; 3]>,
    /// Mean absolute error of the force on a surface [N], where the model knows surfaces.
    pub surface_mae_n: Option<[f64; 3]>,
    /// By set and by kind of motion.
    pub regimes: Vec<RegimeReport>,
}

/// Errors on a surface, or on the surfaces of a kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupReport {
    /// Its name.
    pub name: String,
    /// Mean absolute error of the force on a surface [N].
    pub mae_n: [f64; 3],
    /// Share of the sum of the magnitudes of all true forces.
    pub share: f64,
}

/// Errors at one end of a range.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SliceReport {
    /// Quantity and end, such as "depth high".
    pub name: String,
    /// The 5th percentile, which these states do not exceed, or the 95th, which they do not fall below.
    pub bound: f64,
    /// How many states.
    pub samples: usize,
    /// Mean absolute error of the net force [N].
    pub mae_n: [f64; 3],
}

impl Report {
    /// The figures of a contest.
    pub fn new(
        contest: &Contest,
        vehicles: &BTreeMap<String, Vehicle>,
        about: About,
        program: &str,
    ) -> Result<Self, EvaluateError> {
        let of = |(name, heat): (&String, &Heat)| {
            let vehicle =
                vehicles.get(name).ok_or_else(|| EvaluateError::NoModel { vehicle: name.clone() })?;
            Ok(VehicleReport::new(vehicle, heat))
        };
        Ok(Self {
            program: program.to_owned(),
            about,
            paper: paper::LABEL,
            vehicles: contest.iter().map(of).collect::<Result<_, EvaluateError>>()?,
        })
    }

    /// As a page that needs no other file.
    pub fn page(&self) -> Result<String, PlotError> {
        page::page(self)
    }
}

impl VehicleReport {
    fn new(vehicle: &Vehicle, heat: &Heat) -> Self {
        let about = &vehicle.center_of_mass;
        let forces: Vec<Vec3> = heat.states.iter().map(State::force).collect();
        let moments: Vec<Option<Vec3>> = heat.states.iter().map(|state| state.moment(about)).collect();
        let known: Option<Vec<Vec3>> = moments.iter().copied().collect();
        let under_evaluation = &heat.entries[0];
        Self {
            name: vehicle.name.clone(),
            cases: cases(&heat.states),
            samples: heat.states.len(),
            mean_force_n: mean_magnitude(forces.iter()),
            mean_moment_nm: known.map(|moments| mean_magnitude(moments.iter())),
            models: heat
                .entries
                .iter()
                .map(|entry| ModelReport::new(vehicle, (entry, &heat.states), &forces, &moments))
                .collect(),
            surfaces: groups(vehicle, heat, |surface| vehicle.surfaces[surface].name.clone()),
            kinds: groups(vehicle, heat, |s| vehicle.surfaces[s].kind.name().to_owned()),
            slices: slices(heat, &forces),
            calibration: calibration(under_evaluation, &heat.states),
            paper: paper::of(&vehicle.name),
            parity: parity(under_evaluation, &forces),
            flows: mean_flows(under_evaluation, &heat.states),
        }
    }
}

impl ModelReport {
    fn new(
        vehicle: &Vehicle,
        (entry, states): (&Entry, &[State]),
        forces: &[Vec3],
        moments: &[Option<Vec3>],
    ) -> Self {
        let pairs: Vec<_> = entry.predictions.iter().map(|p| p.force).zip(forces.iter().copied()).collect();
        let moment = |(p, truth): (&super::predict::Prediction, &Option<Vec3>)| Some(p.moment? - (*truth)?);
        let moments: Option<Vec<Vec3>> = entry.predictions.iter().zip(moments).map(moment).collect();
        let surfaces = || entry.predictions.iter().flat_map(|p| &p.surface_errors);
        Self {
            name: entry.name.clone(),
            force: Errors::of(&pairs),
            moment_mae_nm: moments.map(|errors| mean_magnitude(errors.iter())),
            surface_mae_n: surfaces().next().map(|_| mean_magnitude(surfaces())),
            regimes: regimes(vehicle, entry, states),
        }
    }
}

/// Surfaces together under a name, in the order of the vehicle's.
fn groups(vehicle: &Vehicle, heat: &Heat, name: impl Fn(usize) -> String) -> Vec<GroupReport> {
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for surface in 0..vehicle.surfaces.len() {
        let name = name(surface);
        match groups.iter_mut().find(|(of, _)| *of == name) {
            Some((_, surfaces)) => surfaces.push(surface),
            None => groups.push((name, vec![surface])),
        }
    }
    let magnitude = |surfaces: &[usize]| -> f64 {
        let of = |state: &State| surfaces.iter().map(|&s| state.labels[s].force.norm()).sum::<f64>();
        heat.states.iter().map(of).sum()
    };
    let total = magnitude(&(0..vehicle.surfaces.len()).collect::<Vec<_>>());
    let predictions = &heat.entries[0].predictions;
    let report = |(name, surfaces): (String, Vec<usize>)| GroupReport {
        name,
        mae_n: mean_magnitude(
            predictions.iter().flat_map(|p| surfaces.iter().map(|&surface| &p.surface_errors[surface])),
        ),
        share: if total > 0.0 { magnitude(&surfaces) / total } else { 0.0 },
    };
    groups.into_iter().map(report).collect()
}

/// A number that states are ordered by.
pub type Quantity = fn(&State) -> f64;

/// What errors are told apart by: name, unit, value.
pub const QUANTITIES: [(&str, &str, Quantity); 3] = [
    ("depth", "m", |state| state.condition.depth),
    ("speed", "m/s", State::speed),
    ("obliqueness", "1", State::obliqueness),
];

fn slices(heat: &Heat, forces: &[Vec3]) -> Vec<SliceReport> {
    let mut slices = Vec::new();
    for (quantity, _, of) in QUANTITIES {
        let values: Vec<f64> = heat.states.iter().map(of).collect();
        for (end, share) in [("low", 0.05), ("high", 0.95)] {
            let Some(bound) = percentile(&values, share) else { continue };
            let inside = |value: f64| if end == "low" { value <= bound } else { value >= bound };
            let errors: Vec<Vec3> = values
                .iter()
                .zip(heat.entries[0].predictions.iter().zip(forces))
                .filter(|(value, _)| inside(**value))
                .map(|(_, (prediction, truth))| prediction.force - truth)
                .collect();
            let (samples, mae_n) = (errors.len(), mean_magnitude(errors.iter()));
            slices.push(SliceReport { name: format!("{quantity} {end}"), bound, samples, mae_n });
        }
    }
    slices
}

/// Number of cases.
fn cases(states: &[State]) -> usize {
    states.iter().map(|state| state.case.as_str()).collect::<BTreeSet<_>>().len()
}

fn error(entry: &Entry, states: &[State], place: usize) -> Vec3 {
    entry.predictions[place].force - states[place].force()
}

/// What is stated is how far the mean flow may be off: errors are averaged over the sections of a case first.
fn calibration(entry: &Entry, states: &[State]) -> Option<Calibration> {
    let flow = |places: &Vec<usize>| {
        let stated = entry.predictions[places[0]].uncertainty?;
        Some(Flow { errors: places.iter().map(|&place| error(entry, states, place)).collect(), stated })
    };
    let flows: Option<Vec<Flow>> = sections(states).iter().map(flow).collect();
    Calibration::of(&flows?, cases(states))
}

fn mean_flows(entry: &Entry, states: &[State]) -> Vec<MeanFlow> {
    let flow = |places: &Vec<usize>| MeanFlow {
        place: QUANTITIES.map(|(_, _, of)| of(&states[places[0]])),
        error: places.iter().map(|&place| error(entry, states, place)).sum::<Vec3>() / places.len() as f64,
        stated: entry.predictions[places[0]].uncertainty,
    };
    sections(states).iter().map(flow).collect()
}

fn parity(entry: &Entry, forces: &[Vec3]) -> Vec<(Vec3, Vec3)> {
    let every = forces.len().div_ceil(PARITY_POINTS).max(1);
    let pairs = forces.iter().copied().zip(entry.predictions.iter().map(|p| p.force));
    pairs.step_by(every).collect()
}
