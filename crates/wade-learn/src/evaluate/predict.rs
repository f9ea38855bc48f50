//! What a model says of a state.

use super::states::State;
use crate::train::{Published, Trained, Variant};
use wade_core::forces::Forces;
use wade_core::frame::Vec3;
use wade_core::model::{Model, Workspace};

/// What a model says of a state, body frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Net force [N].
    pub force: Vec3,
    /// Net moment about the center of mass [N m], where the model has one.
    pub moment: Option<Vec3>,
    /// Error of the force on each surface, as the model divides the hull [N]; empty where it knows no surfaces.
    pub surface_errors: Vec<Vec3>,
    /// One standard deviation of the net force [N], where the model states it.
    pub uncertainty: Option<Vec3>,
}

/// As it is served: `Model::evaluate` with the ground contact of the state.
pub fn served(model: &Model, states: &[&State]) -> Vec<Prediction> {
    let (mut forces, mut workspace) = (Forces::default(), Workspace::new());
    let predict = |state: &&State| {
        model.evaluate(&state.condition, &mut workspace, &mut forces);
        let errors = forces.surfaces.iter().zip(&state.labels).map(|(load, label)| load.force - label.force);
        Prediction {
            force: forces.wrench.force,
            moment: Some(forces.wrench.moment),
            surface_errors: errors.collect(),
            uncertainty: Some(forces.uncertainty),
        }
    };
    states.iter().map(predict).collect()
}

/// By the trainer's own forward pass, of a network that cannot be served.
pub fn by_trainer(trained: &Trained<Published>, states: &[&State]) -> Vec<Prediction> {
    let predict = |state: &&State| {
        let density = state.condition.density;
        let forces = trained.force_over_density(&state.features);
        let targets = trained.learnt.variant.view(&state.features).targets;
        let error =
            |(force, target): (&[f64; 3], &[f64; 3])| (Vec3::from(*force) - Vec3::from(*target)) * density;
        let errors = || forces.iter().zip(&targets).map(error).collect();
        Prediction {
            force: forces.iter().map(|force| Vec3::from(*force)).sum::<Vec3>() * density,
            moment: None,
            surface_errors: if trained.learnt.variant == Variant::GlobalOnly { Vec::new() } else { errors() },
            uncertainty: None,
        }
    };
    states.iter().map(predict).collect()
}
