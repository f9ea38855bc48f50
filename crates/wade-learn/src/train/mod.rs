//! Learning a network: a data set and its split in, weights and what they are worth out.
//!
//! Reading order: `config`, `samples` (features and targets), `variant` (rows and loss of
//! each kind of network), `task`, `loss`, `layers` (forward and backward), `adam`, `fit` (epochs), `checkpoint`, `score`
//! (errors on held-out samples), `report`, `page`; `analytic` makes the loads by formula. The same seed gives
//! the same bits on the same kind of processor, with one thread or two (the matrix product is chosen by what the
//! processor can do).

pub mod adam;
pub mod analytic;
pub mod anchored;
pub mod checkpoint;
mod config;
pub mod domain;
mod error;
pub mod fit;
pub mod layers;
pub mod loss;
pub(crate) mod page;
pub mod report;
pub mod samples;
pub mod score;
pub mod task;
pub mod variant;

pub use error::TrainError;
use std::collections::BTreeMap;
use std::time::Instant;

pub use config::{Analytic, Config, Keep};
pub use variant::Variant;

use crate::dataset::Dataset;
use crate::dataset::label::{self};
use crate::dataset::mirror::{self};
use crate::dataset::split::Split;
use crate::dataset::{self, Image, split};
use checkpoint::Checkpoint;
use fit::{Epoch, Fit};
use layers::Layers;
use samples::Sample;
use score::{Judged, Score};
use task::Task;
use wade_core::condition::GroundContact;
use wade_core::domain::Domain;
use wade_core::model::network::{OUTPUTS, Scaling};
use wade_core::model::{Form, Paper, Weights};
use wade_core::vehicle::Vehicle;

/// A checkpoint is written after this many epochs.
const CHECKPOINT_EPOCHS: u32 = 10;

/// A data set that is ready to be learnt from, and the vehicles that it is about.
#[derive(Debug, Clone)]
pub struct Source {
    /// The samples with their mirror images.
    pub data: Dataset,
    /// Every vehicle of it, by its name.
    pub vehicles: BTreeMap<String, Vehicle>,
}

impl Source {
    /// Adds the mirror images where the data set has none yet.
    pub fn new(
        data: Dataset,
        vehicles: &BTreeMap<String, Vehicle>,
        front_rear: bool,
    ) -> Result<Self, TrainError> {
        let of = |name: &String| {
            let unknown = || TrainError::UnknownVehicle { vehicle: name.clone() };
            Ok((name.clone(), vehicles.get(name).cloned().ok_or_else(unknown)?))
        };
        let vehicles = data.meta.vehicles.keys().map(of).collect::<Result<BTreeMap<_, _>, TrainError>>()?;
        // before any image is made: names of surfaces that do not fit are the likeliest mistake
        for (name, vehicle) in &vehicles {
            label::order(vehicle, &data.meta.vehicles[name])?;
        }
        check_steady(&data)?;
        let has_images = data.samples.iter().any(|sample| sample.image != Image::Original);
        let data = if has_images { data } else { mirror::augment(&data, &vehicles, front_rear)? };
        Ok(Self { data, vehicles })
    }
}

/// Accelerations above this are no rounding of a steady state [m/s2].
const STEADY: f64 = 1e-6;

/// Refuses states that differ by their acceleration, of which no network is told.
fn check_steady(data: &Dataset) -> Result<(), TrainError> {
    let unsteady = |sample: &&dataset::Sample| sample.condition.acceleration.norm() > STEADY;
    match data.samples.iter().find(unsteady) {
        Some(sample) => Err(TrainError::Unsteady {
            case: sample.case.clone(),
            acceleration: sample.condition.acceleration.norm(),
        }),
        None => Ok(()),
    }
}

/// Refuses two kinds of bed for one vehicle, and a bed that is not below the wheels, which are no inputs of the paper's network.
fn check_beds(data: &Dataset) -> Result<(), TrainError> {
    for sample in &data.samples {
        if let Some(clearance) = sample.condition.bed_clearance.filter(|clearance| *clearance > 0.0) {
            return Err(TrainError::OffTheBed { case: sample.case.clone(), clearance });
        }
    }
    for vehicle in data.meta.vehicles.keys() {
        let (mut moving, mut resting) = (None, None);
        for sample in data.samples.iter().filter(|sample| sample.vehicle == *vehicle) {
            let (over_ground, through_water) =
                (sample.condition.ground_velocity.norm(), sample.condition.velocity.norm());
            // at rest in the water a bed is either
            if over_ground < 0.5 * through_water {
                resting = Some(&sample.case);
            } else if through_water > 0.0 {
                moving = Some(&sample.case);
            }
        }
        if let (Some(moving), Some(resting)) = (moving, resting) {
            let [vehicle, moving, resting] = [vehicle, moving, resting].map(String::clone);
            return Err(TrainError::Beds { vehicle, moving, resting });
        }
    }
    Ok(())
}

/// Which samples are held out, and whether states may be on both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sides<'a> {
    /// The split.
    pub split: &'a Split,
    /// How it was made.
    pub by: split::By,
}

impl Sides<'_> {
    /// Refuses a state on both sides, but of a split by sample, which the source paper seems to have used.
    pub fn check(&self, data: &Dataset) -> Result<(), TrainError> {
        let leaks = self.split.leaks(data);
        match leaks.first() {
            Some(first) if !matches!(self.by, split::By::Sample { .. }) => {
                Err(TrainError::Leak { count: leaks.len(), first: first.clone() })
            }
            _ => Ok(()),
        }
    }

    /// The training side in two: what is learnt from, and a share of its states that sets the pace of the learning rate. The
    /// held-out side is then judged by a network that knows nothing of it.
    fn validation(&self, data: &Dataset, config: &Config) -> Result<(Vec<usize>, Vec<usize>), TrainError> {
        let share = config.validation_share;
        let by = match self.by {
            split::By::Sample { .. } => split::By::Sample { share },
            _ => split::By::Case { share },
        };
        let whole = &self.split.training;
        let mut parts = split::split(&data.subset(whole), by, config.seed)?;
        let Split { training, held_out, .. } = parts.swap_remove(0);
        let numbers = |side: Vec<usize>| side.into_iter().map(|index| whole[index]).collect();
        Ok((numbers(training), numbers(held_out)))
    }
}

/// What came out.
#[derive(Debug, Clone, PartialEq)]
pub struct Trained<L> {
    /// Name of what was learnt.
    pub name: &'static str,
    /// One network for all vehicles.
    pub layers: Layers<f32>,
    /// What goes with it: [`Published`], or [`wade_core::model::Anchored`].
    pub learnt: L,
    /// What holds for each vehicle of the data set, in the order of their names.
    pub vehicles: Vec<TrainedVehicle>,
    /// Every epoch.
    pub history: Vec<Epoch>,
    /// The epoch after which the weights were as they are kept.
    pub kept_epoch: u32,
    /// Seconds an epoch took in this run [s]; `None` where there was none left to do.
    pub epoch_s: Option<f64>,
}

/// What goes with a network of the paper.
#[derive(Debug, Clone, PartialEq)]
pub struct Published {
    /// What was learnt.
    pub variant: Variant,
    /// Its standardisation.
    pub scaling: Scaling,
    /// Root mean square of the error of the net force over density on the validation samples, by vehicle; of all
    /// vehicles where none of them is of this one [m4/s2].
    pub rms: BTreeMap<String, [f64; OUTPUTS]>,
}

/// The part of a training that belongs to one vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct TrainedVehicle {
    /// Its name.
    pub name: String,
    /// The states learnt from; those of all vehicles where none was of this one.
    pub domain: Domain,
    /// Errors on held-out samples in newtons.
    pub score: Score,
}

/// What a training takes.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// The samples.
    pub source: &'a Source,
    /// Which of them are held out.
    pub sides: Sides<'a>,
    /// The settings.
    pub config: &'a Config,
    /// Where the state of the training is kept.
    pub checkpoint: Option<&'a Checkpoint>,
}

/// Trains one network of the paper for all vehicles of a data set; `progress` hears of every epoch.
pub fn train(
    run: Run<'_>,
    variant: Variant,
    progress: &dyn Fn(&Epoch),
) -> Result<Trained<Published>, TrainError> {
    let Run { source, sides, config, checkpoint } = run;
    config.validate()?;
    sides.check(&source.data)?;
    check_beds(&source.data)?;
    let side = |numbers: &[usize]| samples::samples(&source.data, numbers, &source.vehicles);
    let (learnt, validation) = sides.validation(&source.data, config)?;
    let (training, validation) = (side(&learnt)?, side(&validation)?);
    let held_out = side(&sides.split.held_out)?;
    let (task, scaling) = Task::new(variant, &training, &validation, config)?;
    let begun = Instant::now();
    let (fit, epochs) = epochs(&task, config, checkpoint, progress)?;
    let (layers, kept_epoch) = fit.kept();
    let mut trained = Trained {
        name: variant.name(),
        layers,
        learnt: Published { variant, scaling, rms: BTreeMap::new() },
        vehicles: Vec::new(),
        history: fit.state.history,
        kept_epoch,
        epoch_s: (epochs > 0).then(|| begun.elapsed().as_secs_f64() / f64::from(epochs)),
    };
    for (index, name) in source.vehicles.keys().enumerate() {
        let own = trained.score(&validation, |sample| sample.vehicle == index);
        let judged = if own.samples > 0 { own } else { trained.score(&validation, |_| true) };
        trained.learnt.rms.insert(name.clone(), judged.rms_over_density);
        let score = trained.score(&held_out, |sample| sample.vehicle == index);
        let domain = domain::learnt(name, source, sides)?;
        trained.vehicles.push(TrainedVehicle { name: name.clone(), domain, score });
    }
    Ok(trained)
}

/// All epochs, or those that a checkpoint leaves to do, and how many these were.
fn epochs<'a>(
    task: &'a Task,
    config: &'a Config,
    checkpoint: Option<&Checkpoint>,
    progress: &dyn Fn(&Epoch),
) -> Result<(Fit<'a>, u32), TrainError> {
    let digest = task.digest(config);
    let state = checkpoint.map(|checkpoint| checkpoint.start(task.sizes, &digest)).transpose()?.flatten();
    let mut fit = match state {
        Some(state) => Fit::resume(task, config, state),
        None => Fit::new(task, config),
    };
    let mut epochs = 0;
    while !fit.is_over() {
        let epoch = fit.epoch()?;
        epochs += 1;
        if let Some(checkpoint) = checkpoint.filter(|_| epoch.number % CHECKPOINT_EPOCHS == 0) {
            checkpoint.write(&fit.state, &digest)?;
        }
        progress(&epoch);
    }
    Ok((fit, epochs))
}

impl Trained<Published> {
    /// The weights as they are served, of a vehicle and a data set's convention for the contact patches.
    pub fn weights(
        &self,
        of_vehicle: &TrainedVehicle,
        ground_contact: GroundContact,
        provenance: String,
    ) -> Weights {
        let (scaling, held_out_rms) = (self.learnt.scaling.clone(), self.learnt.rms[&of_vehicle.name]);
        let form = Form::Paper(Paper { scaling, ground_contact, held_out_rms });
        Weights { network: self.layers.network(), form, provenance }
    }

    /// Force over density on each surface as this variant sees them [m4/s2]: nothing from one without a wet sample.
    pub fn force_over_density(&self, sample: &Sample) -> Vec<[f64; OUTPUTS]> {
        let Published { variant, scaling, .. } = &self.learnt;
        let view = variant.view(sample);
        let rows = variant.rows(&view, scaling, 0.0);
        let inputs = nalgebra::DMatrix::from_vec(self.layers.sizes.inputs, view.surfaces.len(), rows.inputs);
        let output = self.layers.forward(&inputs).output;
        let surface = |(column, fraction): (usize, &f32)| match *fraction > 0.0 {
            true => scaling.target(std::array::from_fn(|c| output[(c, column)])),
            false => [0.0; OUTPUTS],
        };
        view.fractions.iter().enumerate().map(surface).collect()
    }

    /// Errors on those of some samples.
    fn score(&self, samples: &[Sample], of: impl Fn(&Sample) -> bool) -> Score {
        let judged = |sample: &Sample| Judged {
            density: sample.density,
            truth: sample.net_force_over_density(),
            guess: samples::sum(&self.force_over_density(sample)),
        };
        Score::of(samples.iter().filter(|sample| of(sample)).map(judged))
    }
}
