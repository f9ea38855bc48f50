//! Learning the remainder that the anchored model adds to hydrostatics and a simple drag ([`crate::anchor`]).
//!
//! Reading order: `known` (states and what CFD found), `gaussian` and `teacher` (what the cases say together), `between`
//! (the states in which it is taught), `loss`, this file (rows, the network, where the training cases lie), `spread` (how
//! far the answer may be off).

mod between;
mod gaussian;
pub mod known;
pub mod loss;
pub mod spread;
mod teacher;

use std::time::Instant;

use nalgebra::DMatrix;

use super::checkpoint::Checkpoint;
use super::fit::Epoch;
use super::layers::{Layers, Sizes};
use super::score::{Judged, Score};
use super::task::Task;
use super::variant::{Objective, Rows};
use super::{Config, Sides, Source, TrainError, Trained, TrainedVehicle, domain, run};
use crate::anchor::{COORDINATES, DYNAMIC, GLOBAL, OUTPUTS, STATIC};
use crate::dataset::Image;
use crate::frame::Vec3;
use crate::model::network::WIDTH;
use crate::model::{Anchored, Form, SPREAD, Weights};
use crate::random::Random;
use between::Between;
use known::{Known, Prepared};
use spread::{Missed, Spread};
use teacher::Teacher;

/// Name in files and reports.
pub const NAME: &str = "anchored";

/// Layers of the network: one more answer than the force and its place, for how far these may be off.
pub const SIZES: Sizes = Sizes { inputs: STATIC + DYNAMIC + GLOBAL, width: WIDTH, outputs: SPREAD + 1 };

/// Share of the training cases that keep at most the usual distance to their nearest neighbor.
const USUAL: f64 = 0.95;

/// Trains one network for all vehicles of a data set to answer as the regressions do that are fitted to the training cases,
/// and to say how far off these are in a case that they do not know.
pub fn train(
    source: &Source,
    sides: Sides<'_>,
    config: &Config,
    checkpoint: Option<&Checkpoint>,
    progress: &dyn Fn(&Epoch),
) -> Result<Trained<Box<Anchored>>, TrainError> {
    config.validate()?;
    sides.check(&source.data)?;
    let vehicles = Prepared::all(&source.data, &source.vehicles)?;
    let states = |numbers: &[usize]| Known::states(&source.data, numbers, &vehicles);
    let (training, held_out) = (states(&sides.split.training), states(&sides.split.held_out));
    let (mut form, unit) = form(&training);
    let teacher = Teacher::new(&training, &vehicles, unit)?;
    let mut random = Random::new(config.seed);
    let between = Between { training: &training, vehicles: &vehicles, teacher: &teacher, unit: &unit };
    let taught = between.taught(config.anchored.between, &mut random);
    let task = task(&taught, &held_out, &vehicles, &form, config)?;
    let begun = Instant::now();
    let (fit, epochs) = run(&task, config, checkpoint, progress)?;
    let epoch_s = (epochs > 0).then(|| begun.elapsed().as_secs_f64() / f64::from(epochs));
    let (mut layers, kept_epoch) = fit.kept();
    let history = fit.state.history;
    let mut errors = teacher.errors(training.len());
    // states that the network has not seen tell what it loses of what it was taught
    for (error, state) in errors.iter_mut().zip(between.fresh(&mut random)) {
        let lost = |s: &Known| predict(&layers, s, &vehicles[s.vehicle], &form) - s.dynamic();
        *error += state.as_ref().map_or_else(Vec3::zeros, lost);
    }
    let spread = Spread::fit(&missed(&layers, &training, &vehicles, &form, &errors));
    form.spread = spread.factors.map(|k| k as f32);
    layers.set_output(SPREAD, &spread.weights, spread.bias);
    let mut trained =
        Trained { name: NAME, layers, learnt: form, vehicles: Vec::new(), history, kept_epoch, epoch_s };
    trained.vehicles = (0..vehicles.len())
        .map(|index| trained.vehicle(index, &vehicles, source, sides, [&training, &held_out]))
        .collect::<Result<_, _>>()?;
    Ok(trained)
}

/// Least unit of each coordinate of a state ([`crate::anchor::Reading::coordinates`]): what matters physically also where
/// the training cases hardly differ. A tenth of a tilt; but whether the bed moves changes the load by a twentieth, so that
/// a state over the other bed is no stranger.
const LEAST_UNIT: [f64; COORDINATES] = [0.05, 0.05, 0.05, 0.2, 0.2, 0.1, 0.1, 10.0];

/// Standardisation, and where the training cases lie, with the unit of each coordinate.
fn form(training: &[Known]) -> (Box<Anchored>, [f64; COORDINATES]) {
    let (mean, std) = super::task::moments(training.iter().map(|state| state.reading.global));
    let scale = units(training.iter().map(|state| state.reading.coordinates));
    let mut form = Box::new(Anchored {
        global_mean: mean.map(|x| x as f32),
        global_std: std.map(|x| x as f32),
        spread: [0.0; 3],
        cases: Vec::new(),
        coordinate_scale: scale.map(|x| x as f32),
        near: 1.0,
    });
    let places: Vec<[f32; COORDINATES]> =
        training.iter().map(|state| form.place(&state.reading.coordinates)).collect();
    let squared = |a: &[f32; COORDINATES], b: &[f32; COORDINATES]| -> f32 {
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
    };
    let mut nearest: Vec<f32> = places
        .iter()
        .enumerate()
        .map(|(i, here)| {
            let others = places.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, there)| squared(here, there)).fold(f32::INFINITY, f32::min).sqrt()
        })
        .filter(|distance| distance.is_finite() && *distance > 0.0)
        .collect();
    nearest.sort_by(f32::total_cmp);
    let usual = (USUAL * nearest.len() as f64) as usize;
    form.near = nearest.get(usual).or(nearest.last()).copied().unwrap_or(1.0);
    form.cases = places;
    (form, scale)
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
    let (training, held_out) = (rows(training), rows(held_out));
    let same = |input: &usize| {
        let mut values =
            training.iter().flat_map(|rows| rows.inputs.iter().skip(*input).step_by(SIZES.inputs));
        let first = values.next();
        values.all(|value| Some(value) == first)
    };
    let constant = (0..SIZES.inputs).filter(same).collect();
    let objective = Objective::Anchored(config.anchored.loss);
    Ok(Task { sizes: SIZES, training, held_out, objective, constant })
}

/// A row a surface: its static features, those that change, the standardised global ones.
fn rows(state: &Known, prepared: &Prepared, form: &Anchored, config: &Config) -> Rows {
    let scale = config.anchored.loss.scale(state, prepared);
    let length = prepared.vehicle.dimensions.length;
    let surfaces = &state.reading.surfaces;
    let loads = state.carried();
    let targets = surfaces.iter().zip(&loads);
    Rows {
        vehicle: state.vehicle,
        inputs: inputs(state, prepared, form),
        targets: targets.flat_map(|(surface, load)| loss::targets(surface, load, (scale, length))).collect(),
        dry: surfaces.iter().map(|surface| surface.wet_fraction == 0.0).collect(),
    }
}

fn inputs(state: &Known, prepared: &Prepared, form: &Anchored) -> Vec<f32> {
    let global = form.standardize(&state.reading.global);
    let mut inputs = Vec::with_capacity(SIZES.inputs * prepared.fixed.len());
    for (surface, fixed) in state.reading.surfaces.iter().zip(&prepared.fixed) {
        inputs.extend(fixed.iter().chain(&surface.dynamic).chain(&global));
    }
    inputs
}

/// A column of inputs a surface.
fn columns(state: &Known, prepared: &Prepared, form: &Anchored) -> DMatrix<f32> {
    DMatrix::from_vec(SIZES.inputs, prepared.fixed.len(), inputs(state, prepared, form))
}

/// Net dynamic force [N].
fn predict(layers: &Layers<f32>, state: &Known, prepared: &Prepared, form: &Anchored) -> Vec3 {
    let output = layers.forward(&columns(state, prepared, form)).output;
    let force = |(column, surface): (usize, &crate::anchor::SurfaceReading)| {
        let answer: [f32; OUTPUTS] = std::array::from_fn(|i| output[(i, column)]);
        if surface.wet_fraction > 0.0 { surface.force(&answer) } else { Vec3::zeros() }
    };
    state.reading.surfaces.iter().enumerate().map(force).sum()
}

fn missed(
    layers: &Layers<f32>,
    training: &[Known],
    vehicles: &[Prepared],
    form: &Anchored,
    errors: &[Vec3],
) -> Vec<Missed> {
    let of = |(state, error): (&Known, &Vec3)| {
        let activations = layers.forward(&columns(state, &vehicles[state.vehicle], form));
        let hidden = &activations.hidden2;
        let wet = state.reading.surfaces.iter().enumerate().filter(|(_, surface)| surface.wet_fraction > 0.0);
        let surfaces =
            wet.map(|(column, surface)| (hidden.column(column).iter().copied().collect(), surface.unit));
        Missed { surfaces: surfaces.collect(), error: (*error).into() }
    };
    // an image is missed by as much as its original
    let originals = training.iter().zip(errors).filter(|(state, _)| state.image == Image::Original);
    originals.map(of).collect()
}

impl Trained<Box<Anchored>> {
    /// The net force in a state by the trainer's own forward pass, hydrostatics included [N].
    pub fn net_force(&self, state: &Known, vehicles: &[Prepared]) -> Vec3 {
        state.hydrostatic() + predict(&self.layers, state, &vehicles[state.vehicle], &self.learnt)
    }

    /// The weights as they are served.
    pub fn weights(&self, provenance: String) -> Weights {
        Weights { network: self.layers.network(), form: Form::Anchored(self.learnt.clone()), provenance }
    }

    fn vehicle(
        &self,
        index: usize,
        vehicles: &[Prepared],
        source: &Source,
        sides: Sides<'_>,
        [training, held_out]: [&[Known]; 2],
    ) -> Result<TrainedVehicle, TrainError> {
        let judged = |state: &Known| {
            let density = state.condition.density;
            let truth = (state.hydrostatic() + state.dynamic()) / density;
            let guess = self.net_force(state, vehicles) / density;
            Judged { density, truth: truth.into(), guess: guess.into() }
        };
        let score = |states: &[Known]| Score::of(states.iter().filter(|s| s.vehicle == index).map(judged));
        let (name, held_out) = (vehicles[index].name.clone(), score(held_out));
        let of_all = if held_out.samples > 0 { held_out } else { score(training) };
        Ok(TrainedVehicle {
            domain: domain::learnt(&name, source, sides)?,
            held_out_rms: of_all.rms_over_density,
            score: held_out,
            name,
        })
    }
}
