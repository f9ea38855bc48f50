//! Promise: the fast path answers as the plain-loop reference does, on every instruction set of this CPU.

use crate::common::{Numbers, VEHICLES, model_on, paper_on, without_base_on};
use wade_core::anchor;
use wade_core::condition::Condition;
use wade_core::features;
use wade_core::forces::Forces;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::model::kernel::{
    Buffers, DIRECTIONS, FeatureSlopes, Isa, Kernel, MAX_DYNAMIC, SlopeBuffers, WetSurface,
};
use wade_core::model::network::{Network, WIDTHS};
use wade_core::model::{Form, Model, Weights, Workspace};

/// Size of the terms that a surface's force is a sum of, by which its rounding is measured [N].
fn size_of_terms(model: &Model, condition: &Condition, surface: usize) -> f64 {
    match &model.weights().expect("weights").form {
        Form::Paper(form) => condition.density * f64::from(form.scaling.target_std[2]),
        Form::Anchored(_) => {
            let (speed, depth) = (condition.velocity.norm(), condition.depth);
            condition.density * (speed.powi(2) + GRAVITY * depth) * model.vehicle().surfaces[surface].area
        }
    }
}

#[test]
fn every_instruction_set_agrees_with_the_reference() {
    for isa in Isa::available() {
        for model in
            VEHICLES.into_iter().flat_map(|vehicle| [without_base_on(vehicle, isa), paper_on(vehicle, isa)])
        {
            let name = format!(
                "{} {} {}",
                isa.name(),
                model.vehicle().name,
                model.weights().expect("weights").form.name()
            );
            let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
            let mut numbers = Numbers::new(7);
            let mut wet = 0;
            for _ in 0..200 {
                let mut condition = numbers.condition();
                condition.ground_contact =
                    model.weights().and_then(Weights::ground_contact).unwrap_or_default();
                model.evaluate(&condition, &mut workspace, &mut forces);
                let both = forces.surfaces.iter().zip(model.reference(&condition));
                for (surface, (load, expected)) in both.enumerate() {
                    let scale = size_of_terms(&model, &condition, surface);
                    let error = (load.force - expected).norm() / (expected.norm() + scale);
                    assert!(error < 1e-5, "{name}: {} against {expected}", load.force);
                    wet += usize::from(load.wetted_fraction > 0.0);
                }
            }
            assert!(wet > 500, "the states wet enough surfaces to compare: {wet}");
        }
    }
}

#[test]
fn a_row_has_the_same_bits_alone_and_in_any_company() {
    let model = paper_on("husky", Isa::available()[0]);
    let (vehicle, weights) = (model.vehicle(), model.weights().expect("weights"));
    for isa in Isa::available() {
        let kernel = Kernel::new(&weights.network, (features::STATIC, features::DYNAMIC), isa);
        let fixed = vehicle
            .surfaces
            .iter()
            .map(|surface| features::surface_static(surface, &vehicle.dimensions).map(|x| x as f32));
        let statics = kernel.static_rows(&fixed.collect::<Vec<_>>());
        let mut buffers = Buffers::new(vehicle.surfaces.len());
        let mut numbers = Numbers::new(13);
        for _ in 0..20 {
            let global = [(); features::GLOBAL].map(|()| numbers.between(-2.0, 2.0));
            let wet: Vec<WetSurface> = (0..vehicle.surfaces.len())
                .map(|surface| WetSurface {
                    surface,
                    dynamic: [(); MAX_DYNAMIC].map(|()| numbers.between(0.0, 1.0)),
                })
                .collect();
            let together = kernel.forward(&global, &statics, &wet, &mut buffers).to_vec();
            for (alone, expected) in wet.iter().zip(&together) {
                let output = kernel.forward(&global, &statics, &[*alone], &mut buffers)[0];
                assert_eq!(output, *expected, "{}", isa.name());
            }
            for company in wet.chunks(4).chain(wet.chunks(7)) {
                let outputs = kernel.forward(&global, &statics, company, &mut buffers).to_vec();
                let expected: Vec<_> = company.iter().map(|wet| together[wet.surface]).collect();
                assert_eq!(outputs, expected, "{}", isa.name());
            }
        }
    }
}

#[test]
fn a_query_leaves_nothing_behind_in_its_workspace() {
    for isa in Isa::available() {
        let model = model_on("husky", isa);
        let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
        let deep = Condition::level(Vec3::new(0.5, 0.1, 0.0), 0.19);
        model.evaluate(&deep, &mut workspace, &mut forces);
        let first = forces.clone();
        model.evaluate(&Condition::level(Vec3::new(0.5, 0.1, 0.0), 0.05), &mut workspace, &mut forces);
        assert_ne!(forces, first);
        model.evaluate(&deep, &mut workspace, &mut forces);
        assert_eq!(forces, first, "{}", isa.name());
    }
}

/// The outputs of a network and their derivatives along a direction, by plain loops in double precision.
fn plain_slopes(network: &Network, row: &[f64], along: &[f64]) -> Vec<f64> {
    let mut layer = (row.to_vec(), along.to_vec());
    for (weights, biases) in
        [(&network.w1, &network.b1), (&network.w2, &network.b2), (&network.w3, &network.b3)]
    {
        let inputs = layer.0.len();
        let sum = |values: &[f64], unit: usize| -> f64 {
            (0..inputs).map(|i| f64::from(weights[unit * inputs + i]) * values[i]).sum()
        };
        let units = 0..biases.len();
        let values: Vec<f64> = units.clone().map(|u| sum(&layer.0, u) + f64::from(biases[u])).collect();
        let slopes: Vec<f64> = units.map(|unit| sum(&layer.1, unit)).collect();
        if biases.len() == network.outputs {
            return slopes;
        }
        let passes = |(value, slope): (&f64, &f64)| if *value > 0.0 { *slope } else { 0.0 };
        layer.1 = values.iter().zip(&slopes).map(passes).collect();
        layer.0 = values.iter().map(|value| value.max(0.0)).collect();
    }
    unreachable!("the last layer has the outputs")
}

/// A network of another width, with units of this one in turn.
fn of_width(network: &Network, width: usize) -> Network {
    let units: Vec<usize> = (0..width).map(|unit| unit % network.width).collect();
    let rows = |weights: &[f32], inputs: usize| -> Vec<f32> {
        units.iter().flat_map(|unit| weights[unit * inputs..][..inputs].to_vec()).collect()
    };
    let columns = |weights: &[f32]| -> Vec<f32> {
        weights
            .chunks_exact(network.width)
            .flat_map(|row| units.iter().map(|unit| row[*unit]).collect::<Vec<_>>())
            .collect()
    };
    Network {
        inputs: network.inputs,
        width,
        outputs: network.outputs,
        w1: rows(&network.w1, network.inputs),
        b1: rows(&network.b1, 1),
        w2: rows(&columns(&network.w2), width),
        b2: rows(&network.b2, 1),
        w3: columns(&network.w3),
        b3: network.b3.clone(),
    }
}

#[test]
fn answers_and_slopes_are_those_of_the_network_at_every_width_on_every_instruction_set() {
    let model = model_on("husky", Isa::available()[0]);
    let trained = &model.weights().expect("weights").network;
    let global = trained.inputs - anchor::STATIC - anchor::DYNAMIC;
    let kinds =
        WIDTHS.into_iter().flat_map(|width| Isa::available().into_iter().map(move |isa| (width, isa)));
    for (width, isa) in kinds {
        let network = &of_width(trained, width);
        let kernel = Kernel::new(network, (anchor::STATIC, anchor::DYNAMIC), isa);
        let count = model.vehicle().surfaces.len();
        let mut numbers = Numbers::new(29);
        let fixed: Vec<[f32; anchor::STATIC]> =
            (0..count).map(|_| [(); anchor::STATIC].map(|()| numbers.between(-1.0, 1.0))).collect();
        let statics = kernel.static_rows(&fixed);
        let (mut buffers, mut slopes) = (Buffers::new(count), SlopeBuffers::new(count));
        for _ in 0..20 {
            let inputs = 0..global;
            let of_state: Vec<f32> = inputs.clone().map(|_| numbers.between(-2.0, 2.0)).collect();
            let of_state_slopes: Vec<[f32; DIRECTIONS]> =
                inputs.map(|_| [(); DIRECTIONS].map(|()| numbers.between(-2.0, 2.0))).collect();
            let wet: Vec<WetSurface> = (0..count)
                .map(|surface| WetSurface {
                    surface,
                    dynamic: [(); MAX_DYNAMIC].map(|()| numbers.between(-1.0, 1.0)),
                })
                .collect();
            let mut of_surface =
                || [(); MAX_DYNAMIC].map(|()| [(); DIRECTIONS].map(|()| numbers.between(-1.0, 1.0)));
            let of_wet: Vec<FeatureSlopes> = wet.iter().map(|_| of_surface()).collect();
            let answers = kernel.forward(&of_state, &statics, &wet, &mut buffers).to_vec();
            let found = kernel.slopes((&of_state_slopes, &of_wet), &buffers, &mut slopes);
            for (((surface, of_surface), found), answer) in wet.iter().zip(&of_wet).zip(found).zip(answers) {
                let fixed = fixed[surface.surface];
                let joined =
                    |fixed: [f32; anchor::STATIC], dynamic: [f32; MAX_DYNAMIC], global: &[f32]| -> Vec<f32> {
                        fixed.into_iter().chain(dynamic).chain(global.iter().copied()).collect()
                    };
                let row = joined(fixed, surface.dynamic, &of_state);
                let expected = network.forward(&row);
                let size = expected.iter().map(|x| x.abs()).fold(1.0, f32::max);
                for (found, expected) in answer.iter().zip(&expected) {
                    let error = (found - expected).abs();
                    assert!(error <= 1e-4 * size, "{width} {}: {found} against {expected}", isa.name());
                }
                let in_double = |row: Vec<f32>| -> Vec<f64> { row.into_iter().map(f64::from).collect() };
                let row = in_double(row);
                for k in 0..DIRECTIONS {
                    let of_state: Vec<f32> = of_state_slopes.iter().map(|slope| slope[k]).collect();
                    let of_surface = of_surface.map(|slope| slope[k]);
                    let along = in_double(joined([0.0; anchor::STATIC], of_surface, &of_state));
                    let expected = plain_slopes(network, &row, &along);
                    let size = expected.iter().map(|x| x.abs()).fold(0.0, f64::max);
                    for (found, expected) in found.iter().map(|slope| slope[k]).zip(&expected) {
                        let error = (f64::from(found) - expected).abs();
                        assert!(error <= 1e-4 * size, "{width} {}: {found} against {expected}", isa.name());
                    }
                }
            }
        }
    }
}
