//! Promise: the fast path answers as the plain-loop reference does, on every instruction set of this CPU.

mod common;

use common::{Numbers, VEHICLES, model_on};
use wade::condition::Condition;
use wade::features;
use wade::forces::Forces;
use wade::frame::Vec3;
use wade::model::kernel::Isa;
use wade::model::{Model, Workspace};

/// Forces on the surfaces by the reference network over whole rows of features.
fn reference(model: &Model, condition: &Condition) -> Vec<Vec3> {
    let (vehicle, weights) = (model.vehicle(), model.weights());
    let plane = condition.water_plane(vehicle.z0);
    let global = weights.scaling.standardize(&features::global(condition, &vehicle.dimensions));
    let direction = features::direction(&condition.velocity);
    let surfaces = vehicle.surfaces.iter().zip(&vehicle.samples.surfaces);
    let force = surfaces.map(|(surface, samples)| {
        let wet = samples.submergence(&plane);
        if wet.fraction == 0.0 {
            return Vec3::zeros();
        }
        let fixed = features::surface_static(surface, &vehicle.dimensions).map(|x| x as f32);
        let dynamic =
            features::surface_dynamic(surface, &wet, &direction, &vehicle.dimensions).map(|x| x as f32);
        let mut row = [0.0; features::INPUTS];
        row[..features::STATIC].copy_from_slice(&fixed);
        row[features::STATIC..features::STATIC + features::DYNAMIC].copy_from_slice(&dynamic);
        row[features::STATIC + features::DYNAMIC..].copy_from_slice(&global);
        Vec3::from(weights.scaling.target(weights.network.forward(&row))) * condition.density
    });
    force.collect()
}

#[test]
fn every_instruction_set_agrees_with_the_reference() {
    for isa in Isa::available() {
        for vehicle in VEHICLES {
            let model = model_on(vehicle, isa);
            let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
            let mut numbers = Numbers::new(7);
            let mut wet = 0;
            for _ in 0..200 {
                let mut condition = numbers.state().check().expect("a valid state");
                condition.ground_contact = model.weights().ground_contact;
                model.evaluate(&condition, &mut workspace, &mut forces);
                // the error of a sum is measured by the size of its terms: the spread of the targets
                let scale = condition.density * f64::from(model.weights().scaling.target_std[2]);
                for (load, expected) in forces.surfaces.iter().zip(reference(&model, &condition)) {
                    let error = (load.force - expected).norm() / (expected.norm() + scale);
                    assert!(error < 1e-5, "{} {vehicle}: {} against {expected}", isa.name(), load.force);
                    wet += usize::from(load.wetted_fraction > 0.0);
                }
            }
            assert!(wet > 500, "the states wet enough surfaces to compare: {wet}");
        }
    }
}

#[test]
fn a_surface_answers_the_same_bits_whichever_others_are_wet() {
    for isa in Isa::available() {
        let model = model_on("husky", isa);
        let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
        // a plane that wets more and more surfaces leaves the static and global parts of a wheel's row alone; the
        // batch kernel must not mix rows, so evaluating twice in different company gives the same wheel
        let deep = Condition::level(Vec3::new(0.5, 0.1, 0.0), 0.19);
        model.evaluate(&deep, &mut workspace, &mut forces);
        let in_company = forces.clone();
        let shallow = Condition::level(Vec3::new(0.5, 0.1, 0.0), 0.05);
        model.evaluate(&shallow, &mut workspace, &mut forces);
        let few = forces.surfaces.iter().filter(|load| load.wetted_fraction > 0.0).count();
        assert!(few < in_company.surfaces.iter().filter(|load| load.wetted_fraction > 0.0).count());
        model.evaluate(&deep, &mut workspace, &mut forces);
        assert_eq!(forces, in_company, "{}: a query leaves nothing behind in its workspace", isa.name());
    }
}
