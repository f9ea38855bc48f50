//! Learning the remainder that the anchored model adds to the physical base ([`wade_core::anchor::Remainder::OfPhysics`]).
//!
//! Reading order: `known` (states and what CFD found), `gaussian` and `teacher` (what the cases say together), `between`
//! (the states in which it is taught), `loss`, this file (rows, the network, where the training cases lie), `ensemble` and
//! `spread` (how far the answer may be off).

mod between;
mod ensemble;
mod gaussian;
pub mod known;
pub mod loss;
pub mod spread;
mod teacher;

use std::collections::BTreeMap;
use std::time::Instant;

use nalgebra::DMatrix;

use super::fit::Epoch;
use super::layers::{Layers, Sizes};
use super::score::{Judged, Score};
use super::task::Task;
use super::variant::{Objective, Rows};
use super::{Config, Run, TrainError, Trained, TrainedVehicle, domain, epochs};
use crate::dataset::{Image, split};
use crate::random::Random;
use between::Between;
use ensemble::Ensemble;
use known::{Known, Prepared};
use spread::{Missed, Spread};
use teacher::Teacher;
use wade_core::anchor::{COORDINATES, DYNAMIC, GLOBAL, OUTPUTS, Remainder, STATIC};
use wade_core::frame::Vec3;
use wade_core::model::{Anchored, Form, SPREAD, Weights};

/// Name in files and reports.
pub const NAME: &str = "anchored";

/// Numbers in a row of the network's inputs.
const INPUTS: usize = STATIC + DYNAMIC + GLOBAL;

/// Share of the training cases that keep at most the usual distance to their nearest neighbor.
const USUAL: f64 = 0.95;
/// States between the cases, for each case, in which the ensemble is asked how far it goes apart.
const FRESH: usize = 3;

/// What goes with the network, by vehicle: the same standardisation, and its own factors and cases.
pub type Learnt = BTreeMap<String, Box<Anchored>>;

/// Trains one network for all vehicles of a data set to answer as the regressions do that are fitted to the training cases,
/// and to say how far off these are in a case that they do not know.
pub fn train(run: Run<'_>, progress: &dyn Fn(&Epoch)) -> Result<Trained<Learnt>, TrainError> {
    let Run { source, sides, config, checkpoint } = run;
    config.validate()?;
    sides.check(&source.data)?;
    let vehicles = Prepared::all(&source.data, &source.vehicles)?;
    let states = |numbers: &[usize]| Known::states(&source.data, numbers, &vehicles);
    let (training, held_out) = (states(&sides.split.training), states(&sides.split.held_out));
    let (form, unit) = form(&training);
    let teacher = Teacher::new(training.iter(), &vehicles, unit, None)?;
    let mut random = Random::new(config.seed);
    let between = Between { training: &training, vehicles: &vehicles, teacher: &teacher, unit: &unit };
    let taught = between.taught(config.anchored.between, config.anchored.outside, &mut random);
    let task = task(&taught, &held_out, &vehicles, &form, config)?;
    let begun = Instant::now();
    let (fit, epochs) = epochs(&task, config, checkpoint, progress)?;
    let epoch_s = (epochs > 0).then(|| begun.elapsed().as_secs_f64() / f64::from(epochs));
    let (mut layers, kept_epoch) = fit.kept();
    let history = fit.state.history;
    let state_of = split::state_of(&source.data);
    let state_of = |state: &Known| state_of[state.case.as_str()];
    let ensemble = Ensemble::new(&training, &state_of, &vehicles, (&teacher, unit), &mut random)?;
    let fresh = between.fresh(FRESH, &mut random);
    let missed = missed(&layers, (&training, &fresh), &vehicles, &form, (&ensemble, &teacher));
    let spread = Spread::fit(&missed, vehicles.len());
    layers.set_output(SPREAD, &spread.weights, spread.bias);
    let of_vehicle = |(index, factors): (usize, &[f64; 3])| {
        (vehicles[index].name.clone(), of_vehicle(&form, &training, index, factors))
    };
    let learnt = spread.factors.iter().enumerate().map(of_vehicle).collect();
    let mut trained =
        Trained { name: NAME, layers, learnt, vehicles: Vec::new(), history, kept_epoch, epoch_s };
    trained.vehicles = (0..vehicles.len())
        .map(|index| trained.vehicle(index, &vehicles, &run, &held_out))
        .collect::<Result<_, _>>()?;
    Ok(trained)
}

/// Least unit of each coordinate of a state ([`wade_core::anchor::Reading::coordinates`]): what matters physically also where
/// the training cases hardly differ. A tenth of a tilt; but whether the bed moves changes the load by a twentieth, so that
/// a state over the other bed is no stranger.
const LEAST_UNIT: [f64; COORDINATES] = [0.05, 0.05, 0.05, 0.2, 0.2, 0.1, 0.1, 10.0, 0.2];

/// Standardisation, and the unit of each coordinate.
fn form(training: &[Known]) -> (Anchored, [f64; COORDINATES]) {
    let (mean, std) = super::task::moments(training.iter().map(|state| state.prior.reading.global));
    let scale = units(training.iter().map(|state| state.prior.reading.coordinates));
    let form = Anchored {
        remainder: Remainder::OfPhysics,
        global_mean: mean.map(|x| x as f32),
        global_std: std.map(|x| x as f32),
        spread: [0.0; 3],
        cases: Vec::new(),
        coordinate_scale: scale.map(|x| x as f32),
        near: 1.0,
    };
    (form, scale)
}

/// The same for a vehicle, with its factors and where its training cases lie; those of all vehicles where none is of this one:
/// a state in which another was asked is near to nothing that is known of it.
fn of_vehicle(form: &Anchored, training: &[Known], vehicle: usize, factors: &[f64; 3]) -> Box<Anchored> {
    let places = |of: &dyn Fn(&Known) -> bool| -> Vec<[f32; COORDINATES]> {
        training.iter().filter(|s| of(s)).map(|state| form.place(&state.prior.reading.coordinates)).collect()
    };
    let own = places(&|state| state.vehicle == vehicle);
    let cases = if own.is_empty() { places(&|_| true) } else { own };
    let squared = |a: &[f32; COORDINATES], b: &[f32; COORDINATES]| -> f32 {
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
    };
    let mut nearest: Vec<f32> = cases
        .iter()
        .enumerate()
        .map(|(i, here)| {
            let others = cases.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, there)| squared(here, there)).fold(f32::INFINITY, f32::min).sqrt()
        })
        .filter(|distance| distance.is_finite() && *distance > 0.0)
        .collect();
    nearest.sort_by(f32::total_cmp);
    let usual = (USUAL * nearest.len() as f64) as usize;
    let near = nearest.get(usual).or(nearest.last()).copied().unwrap_or(1.0);
    Box::new(Anchored { spread: factors.map(|k| k as f32), cases, near, ..form.clone() })
}

/// Standard deviation of each coordinate, or the least unit where that is larger.
fn units(places: impl Iterator<Item = [f64; COORDINATES]> + Clone) -> [f64; COORDINATES] {
    let (mean, _) = super::task::moments(places.clone());
    let count = places.clone().count().max(1) as f64;
    std::array::from_fn(|i| {
        let variance = places.clone().map(|place| (place[i] - mean[i]).powi(2)).sum::<f64>() / count;
        variance.sqrt().max(LEAST_UNIT[i])
    })
}

fn task(
    training: &[Known],
    held_out: &[Known],
    vehicles: &[Prepared],
    form: &Anchored,
    config: &Config,
) -> Result<Task, TrainError> {
    if training.is_empty() || held_out.is_empty() {
        let side = if training.is_empty() { "training" } else { "held-out" };
        return Err(TrainError::EmptySide { side });
    }
    let rows = |states: &[Known]| -> Vec<Rows> {
        states.iter().map(|state| rows(state, &vehicles[state.vehicle], form, config)).collect()
    };
    let (training, validation) = (rows(training), rows(held_out));
    let same = |input: &usize| {
        let mut values = training.iter().flat_map(|rows| rows.inputs.iter().skip(*input).step_by(INPUTS));
        let first = values.next();
        values.all(|value| Some(value) == first)
    };
    let constant = (0..INPUTS).filter(same).collect();
    let objective = Objective::Anchored(config.anchored.loss);
    // one more answer than the force and its place, for how far these may be off
    let sizes = Sizes { inputs: INPUTS, width: config.anchored.width, outputs: SPREAD + 1 };
    Ok(Task { sizes, training, validation, objective, constant })
}

/// A row a surface: its static features, those that change, the standardised global ones.
fn rows(state: &Known, prepared: &Prepared, form: &Anchored, config: &Config) -> Rows {
    let scale = config.anchored.loss.scale(state, prepared);
    let surfaces = &state.prior.reading.surfaces;
    let loads = state.carried();
    let targets = surfaces.iter().zip(&loads);
    Rows {
        vehicle: state.vehicle,
        inputs: inputs(state, prepared, form),
        targets: targets.flat_map(|(surface, load)| loss::targets(surface, load, prepared, scale)).collect(),
        dry: surfaces.iter().map(|surface| surface.wet_fraction == 0.0).collect(),
    }
}

fn inputs(state: &Known, prepared: &Prepared, form: &Anchored) -> Vec<f32> {
    let global = form.standardize(&state.prior.reading.global);
    let mut inputs = Vec::with_capacity(INPUTS * prepared.fixed.len());
    for (surface, fixed) in state.prior.reading.surfaces.iter().zip(&prepared.fixed) {
        inputs.extend(fixed.iter().chain(&surface.told()).chain(&global));
    }
    inputs
}

/// A column of inputs a surface.
fn columns(state: &Known, prepared: &Prepared, form: &Anchored) -> DMatrix<f32> {
    DMatrix::from_vec(INPUTS, prepared.fixed.len(), inputs(state, prepared, form))
}

/// Net force besides the base [N].
fn predict(layers: &Layers<f32>, state: &Known, prepared: &Prepared, form: &Anchored) -> Vec3 {
    let output = layers.forward(&columns(state, prepared, form)).output;
    let force = |(column, surface): (usize, &wade_core::anchor::SurfaceReading)| {
        let answer: [f32; OUTPUTS] = std::array::from_fn(|i| output[(i, column)]);
        if surface.wet_fraction > 0.0 { surface.force(&answer) } else { Vec3::zeros() }
    };
    state.prior.reading.surfaces.iter().enumerate().map(force).sum()
}

/// What is known of the errors: those of cases, and how large they are expected to be in states between them.
fn missed(
    layers: &Layers<f32>,
    (training, fresh): (&[Known], &[Vec<Known>]),
    vehicles: &[Prepared],
    form: &Anchored,
    (ensemble, teacher): (&Ensemble, &Teacher),
) -> Vec<Missed> {
    let of = |state: &Known, part: usize, is_case: bool, error: Vec3| {
        let activations = layers.forward(&columns(state, &vehicles[state.vehicle], form));
        let hidden = &activations.hidden2;
        let wet =
            state.prior.reading.surfaces.iter().enumerate().filter(|(_, surface)| surface.wet_fraction > 0.0);
        let surfaces =
            wet.map(|(column, surface)| (hidden.column(column).iter().copied().collect(), surface.unit));
        Missed { vehicle: state.vehicle, part, is_case, surfaces: surfaces.collect(), error: error.into() }
    };
    let mut missed = Vec::new();
    for (number, (state, fresh)) in training.iter().zip(fresh).enumerate() {
        let (prepared, part) = (&vehicles[state.vehicle], ensemble.parts[number]);
        // an image is missed by as much as its original
        let of_case = ensemble.missed(number, state, prepared).filter(|_| state.image == Image::Original);
        let Some(of_case) = of_case else { continue };
        // states that the network has not seen tell what it loses of what it was taught
        let lost = fresh.iter().map(|fresh| predict(layers, fresh, prepared, form) - fresh.remainder());
        let lost: Vec<(&Known, Vec3)> = fresh.iter().zip(lost).collect();
        // in proportion: one of them may be much faster than the case
        let here = |(fresh, lost): &(&Known, Vec3)| {
            let share = state.prior.reading.dynamic_load() / fresh.prior.reading.dynamic_load();
            if share.is_finite() { lost * share } else { Vec3::zeros() }
        };
        missed.push(of(state, part, true, of_case + lost.first().map_or_else(Vec3::zeros, here)));
        for (fresh, lost) in lost {
            let parts = [ensemble.deviation(fresh, prepared), teacher.noise(fresh), lost];
            let expected = parts.iter().map(|part| part.component_mul(part)).sum::<Vec3>().map(f64::sqrt);
            // the mean magnitude of a Laplace distribution of that deviation
            missed.push(of(fresh, part, false, expected * std::f64::consts::FRAC_1_SQRT_2));
        }
    }
    missed
}

impl Trained<Learnt> {
    /// The net force in a state by the trainer's own forward pass, the base included [N].
    pub fn net_force(&self, state: &Known, vehicles: &[Prepared]) -> Vec3 {
        let prepared = &vehicles[state.vehicle];
        state.prior.force() + predict(&self.layers, state, prepared, &self.learnt[&prepared.name])
    }

    /// The weights of a vehicle as they are served.
    pub fn weights(&self, of_vehicle: &TrainedVehicle, provenance: String) -> Weights {
        let form = Form::Anchored(self.learnt[&of_vehicle.name].clone());
        Weights { network: self.layers.network(), form, provenance }
    }

    fn vehicle(
        &self,
        index: usize,
        vehicles: &[Prepared],
        run: &Run<'_>,
        held_out: &[Known],
    ) -> Result<TrainedVehicle, TrainError> {
        let judged = |state: &Known| {
            let density = state.prior.condition.density;
            let truth = (state.prior.force() + state.remainder()) / density;
            let guess = self.net_force(state, vehicles) / density;
            Judged { density, truth: truth.into(), guess: guess.into() }
        };
        let name = vehicles[index].name.clone();
        let of_vehicle = held_out.iter().filter(|state| state.vehicle == index);
        let score = Score::of(of_vehicle.map(judged));
        Ok(TrainedVehicle { domain: domain::learnt(&name, run.source, run.sides)?, score, name })
    }
}
